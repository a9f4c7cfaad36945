"""What kernels ask of Python objects: loads, joints and user-defined laws, joints, descents.

An object is known by a handle, a positive number: compiled code can hold one, and calls back.
"""

import weakref
from itertools import count
from typing import Any

from .source import primitive

_numbers = count(1)
_objects: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()


def handle_of(thing: Any) -> int:
    """A number by which kernels call an object as long as it lives."""
    number = next(_numbers)
    _objects[number] = thing
    return number


def owner(handle: int) -> Any:
    """The object of a handle."""
    return _objects[handle]


@primitive("skfem_ancf.core.loops")
def own_force(handle, t, scale, u, out):
    """Add the user-defined loads at a time, which is not a number in statics."""
    owner(handle).add_own_force(t, scale, u, out)


@primitive("skfem_ancf.core.loops")
def own_mean_force(handle, t, u0, u1, out):
    """Add their mean from u0 to u1."""
    owner(handle).add_own_mean_force(t, u0, u1, out)


@primitive("skfem_ancf.core.loops")
def own_load_stiffness(handle, t, scale, u, flat):
    """Subtract their derivatives from the entries of a band matrix."""
    owner(handle).subtract_own_stiffness(t, scale, u, flat)


@primitive("skfem_ancf.core.loops")
def own_joints(handle, what, t, u, v, out):
    """Joints that are no tables, see :meth:`skfem_ancf.equations.system.System.add_own_joints`."""
    owner(handle).add_own_joints(what, t, u, v, out)


@primitive("skfem_ancf.core.loops")
def own_elements(handle, what, t, factor, a, b, out):
    """User-defined force elements, see :meth:`skfem_ancf.actions.forces.system.Forces.add_own`."""
    owner(handle).forces.add_own(what, t, factor, a, b, out)


@primitive("skfem_ancf.core.loops")
def own_poses(handle, t, span, poses):
    """Where obstacles are that move, see
    :meth:`skfem_ancf.actions.contact.contacts.Contacts.put`."""
    owner(handle).put(t, span, poses)


@primitive("skfem_ancf.core.loops")
def own_distance(handle, obstacle, t, x, out):
    """Distance, gradient and second derivatives of a user-defined shape."""
    owner(handle).ask(obstacle, t, x, out)


@primitive("skfem_ancf.core.loops")
def own_solve(handle, t, u, multipliers, R, phi, du, dm):
    """Solve with the multipliers by sparse factors; False if there is no solution."""
    return bool(owner(handle).solve_own(t, u, multipliers, R, phi, du, dm))


#: The same of one signature, by number, for compiled code: a handle, what is asked, a time, a
#: factor and three arrays.
QUESTIONS = (
    lambda handle, what, t, scale, u, _, out: own_force(handle, t, scale, u, out),
    lambda handle, what, t, _, u0, u1, out: own_mean_force(handle, t, u0, u1, out),
    lambda handle, what, t, scale, u, _, flat: own_load_stiffness(handle, t, scale, u, flat),
    lambda handle, what, t, _, u, v, out: own_joints(handle, what, t, u, v, out),
    own_elements,
    lambda handle, what, t, span, _, __, poses: own_poses(handle, t, span, poses),
)
