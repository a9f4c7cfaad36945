"""Parameters of a scene by object and name, and gradients of its states by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..actions.item import Item
from ..beam.beam import Beam
from ..core.errors import InputError, NameUnknown, require_option, shown
from ..core.immutable import Immutable, is_builtin, rebuilt
from ..core.types import Array
from ..mesh.mapping import PLACES
from ..sections.section import Rectangle

#: Kinds of fields, and the names of a beam that may be one.
FIELDS, FIELD_NAMES = ("nodes", "elements"), ("height", "E", "width")
#: Where a name of a beam is found.
PARTS = ("material", "mesh")
#: Arguments that items of the package store by another name.
STORED = {"force": ("total", "per_length"), "stiffness": ("penalty",)}


class Parameter(NamedTuple):
    """One parameter, which may be an array: ``name`` of ``owner``, or a field of a beam."""

    owner: Any
    name: str
    field: str
    start: Array
    at: slice


class Parameters:
    """Parameters of a scene by object and name, for a :class:`~skfem_ancf.Design`.

    ``Parameters(scene, wrt)(p)`` is the scene with other values; a Design knows what fields act on,
    so that its first gradient costs no more than others.

    Parameters
    ----------
    scene
        A :class:`~skfem_ancf.Scene`.
    wrt
        Pairs ``(object, name)`` of a beam, material, rigid body, item of the scene, or anything
        that these consist of, and an argument of it, a number or an array. A beam has the names of
        its material and mesh, too. Triples ``(beam, name, "nodes")`` or
        ``(beam, name, "elements")`` are fields: "height", "E" or "width", linear between nodes or
        constant in elements.

    Attributes
    ----------
    start
        The values in the scene, (n,).
    each
        The ``Parameter`` of each of ``wrt``.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, Design, ElementBeamCable, MeshBeam, Parameters, Scene
    >>> from skfem_ancf import StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
    ...             StVenantKirchhoff(2e8, 0.3), width=0.01)
    >>> scene = Scene(beam).clamp("left").point_force((0, -1e-4), at=(1, 0))
    >>> scene = scene.sensor("tip", "displacement", at=(1, 0))
    >>> heights = Parameters(scene, [(beam, "height", "nodes")])
    >>> Design(heights, ["tip"]).jacobian(heights.start).shape
    (2, 5)
    """

    def __init__(self, scene: Any, wrt: Sequence[Any]) -> None:
        self._scene, self.each, n = scene, [], 0
        for one in wrt:
            if not isinstance(one, tuple) or len(one) not in (2, 3):
                raise InputError("wrt must be a list of (object, name), or of (beam, name, "
                                 f'"nodes"), as [(beam, "height")], got {shown(one)}')
            owner, name, field = (*one, "")[:3]
            if field:
                start = self._field(owner, name, require_option("field", field, FIELDS))
            else:
                name, start = self._number(owner, name)
            self.each.append(Parameter(owner, name, field, start, slice(n, n + start.size)))
            n += start.size
        self.start = np.concatenate([np.zeros(0), *(one.start.ravel() for one in self.each)])
        for one in self.each:
            if not one.field and not _has([*scene.beams, *scene.bodies, *scene.items], one.owner):
                raise InputError(f"{one.owner!r} is no part of the scene: take beams, bodies and "
                                 "items of scene.beams, scene.bodies, scene.items, and their "
                                 "attributes")

    def _number(self, owner, name):
        """The name of an argument, for a beam as "material.E", and its value."""
        path = name
        if isinstance(owner, Beam) and not (name == "width" and isinstance(
                owner.section, Rectangle)):
            path = next((f"{part}.{name}" for part in PARTS
                         if getattr(getattr(owner, part), name, None) is not None), name)
        if isinstance(owner, Item) and is_builtin(owner):
            path = next((x for x in STORED.get(name, ()) if x in vars(owner)), name)
        value = owner
        for part in path.split("."):
            value = getattr(value, part, None)
        if path == "mesh.height" and owner.mesh.heights is not None:
            raise InputError(f"the height of {owner!r} varies: use the field (beam, 'height', "
                             "'nodes')")
        if not isinstance(owner, Immutable) or value is None:
            raise InputError(f"{shown(owner)} has no argument {name!r} that can be changed alone; "
                             "for anything else use a Design with a function that builds the scene")
        try:
            return path, np.array(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError(f"{name!r} of {owner!r} is {shown(value)} and no number or array: use "
                             "a Design with a function that builds the scene") from None

    def _field(self, beam, name, field):
        """The values of a field at nodes or in elements."""
        if not isinstance(beam, Beam) or not any(beam is one for one in self._scene.beams):
            raise InputError(f"fields are of beams of the scene, got {shown(beam)}")
        if name not in FIELD_NAMES:
            raise NameUnknown("field of a beam", name, FIELD_NAMES)
        mesh, n = beam.mesh, beam.mesh.p.shape[1]
        if name == "height" and mesh.heights is not None:
            if field == "elements":
                return mesh.heights.mean(axis=0)
            out = np.empty(n)
            out[mesh.t] = mesh.heights[[0, 3]]
            return out
        value = mesh.height if name == "height" else (
            beam.material.E if name == "E" else beam.width)
        if not isinstance(value, (int, float)):
            raise InputError(f"{name} of {beam!r} is no number before it becomes a field: use a "
                             "Design with a function that builds the scene")
        return np.full(n if field == "nodes" else mesh.nelements, float(value))

    def __call__(self, p: Array) -> Any:
        """The scene with other values of the parameters, (n,)."""
        new: dict[int, dict[str, Any]] = {}
        for one in self.each:
            value = np.asarray(p[one.at]).reshape(one.start.shape)
            if not np.array_equal(value, one.start):
                name, value = self._changed(one, value)
                new.setdefault(id(one.owner), {})[name] = value
        made: dict[int, Any] = {}
        return self._scene._rebuilt(*([_replaced(x, new, made) for x in some] for some in (
            self._scene.beams, self._scene.bodies, self._scene.items)))

    def _changed(self, one, value):
        """Argument and value of a changed parameter."""
        if not one.field:
            return one.name, value if value.ndim else float(value)
        mesh = one.owner.mesh
        if one.name == "height":
            change = value - one.start
            ends = change[mesh.t] if one.field == "nodes" else np.array([change, change])
            old = np.full((4, mesh.nelements), mesh.height) if mesh.heights is None else (
                mesh.heights)
            heights = old + np.outer(1.0 - PLACES, ends[0]) + np.outer(PLACES, ends[1])
            return "mesh", replace(mesh, heights=heights, height=float(heights.max()), taper=None)
        s = mesh.parameters

        def field(x, _):
            if one.field == "nodes":
                return np.interp(x, s, value)
            return value[np.clip(np.searchsorted(s, x) - 1, 0, len(value) - 1)]

        return "material.E" if one.name == "E" else one.name, field

    def groups(self, size: int) -> list[tuple[list[int], Array]]:
        """Parameters that change different rows, and the parameter of each of ``size`` rows.

        Rows are those of degrees of freedom and of joints, for which it is not known (-1). A
        component of a field acts on the nodes of its elements: each third one at once.
        """
        out = []
        for one in self.each:
            first, n = one.at.start, one.start.size
            if not one.field:
                out += [([k], np.full(size, k)) for k in range(first, first + n)]
                continue
            beam, offset = one.owner, self._scene.layout.offset(one.owner)
            nodes = np.arange(beam.mesh.p.shape[1])
            # components are numbered by their node, elements by their left node
            at = nodes if one.field == "nodes" else beam.mesh.t[0]
            number = np.full(len(nodes) + 2, -1)
            number[at + 1] = first + np.arange(n)
            for colour in range(3):
                near = nodes - 1 + (colour - nodes + 1) % 3  # the one of that colour
                found, of = number[near + 1], np.full(size, -1)
                if one.field == "elements":
                    found[near > nodes] = -1
                of[offset:offset + beam.N] = np.repeat(found, beam.nd)
                members = first + np.flatnonzero(at % 3 == colour)
                if len(members):
                    out.append((members.tolist(), of))
        return out


def _arguments(thing):
    """Arguments of the constructor of an object by name, if it stores them."""
    if isinstance(thing, Beam):
        return {name: getattr(thing, name) for name in ("mesh", "material", "section")}
    if not isinstance(thing, Immutable):
        return {}
    found = {name: getattr(thing, name, None) for name in type(thing).__signature__.parameters}
    return {name: value for name, value in found.items()
            if isinstance(value, (Immutable, tuple, list))}


def _has(thing, owner):
    """True if an object is, or consists of, another one."""
    inner = thing if isinstance(thing, (tuple, list)) else _arguments(thing).values()
    return thing is owner or any(_has(x, owner) for x in inner)


def _replaced(thing, new, made):
    """The object with changed arguments of the objects in ``new``, by id; ``made`` are copies."""
    if isinstance(thing, (tuple, list)):
        inner = [_replaced(x, new, made) for x in thing]
        return thing if all(a is b for a, b in zip(inner, thing)) else type(thing)(inner)
    if not isinstance(thing, Immutable):
        return thing
    if id(thing) not in made:
        changes = {name: other for name, value in _arguments(thing).items()
                   if (other := _replaced(value, new, made)) is not value}
        parts: dict[str, dict[str, Any]] = {}
        for name, value in new.get(id(thing), {}).items():
            first, _, inner = name.partition(".")
            if inner:
                parts.setdefault(first, {})[inner] = value
            else:
                changes[first] = value
        for name, given in parts.items():
            changes[name] = _copy(changes.get(name, getattr(thing, name)), given)
        made[id(thing)] = _copy(thing, changes) if changes else thing
    return made[id(thing)]


def _copy(thing, changes):
    """A copy with changed arguments."""
    if isinstance(thing, Item) and is_builtin(thing):
        # linear laws of springs are floats, too
        other = thing._with(**{name: type(old)(value) if isinstance(
            old := getattr(thing, name), float) else value for name, value in changes.items()})
        other._freeze()
        return other
    return thing.replace(**changes) if hasattr(thing, "replace") else rebuilt(thing, changes)
