"""Checks of states and displacements for the equations of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..beam.beam import Beam
from ..core.errors import InputError, require_finite
from ..core.types import Array
from ..equations.system import System
from .state import State

#: What meshes must have in common to exchange states, with messages.
_GEOMETRY = {
    "nelements": "its mesh has {} elements, that of the scene {}",
    "height": "its height is {:.9g}, that of the scene {:.9g}",
    "sections": "its sections are {}, those of the scene {}",
    **dict.fromkeys(("p", "p_X", "lengths"), "its nodes lie elsewhere"),
    "t": "its nodes are joined in another way", "heights": "its heights are others",
    **dict.fromkeys(("p_Y", "p_XY"), "its sections turn in another way")}


def difference(a: Beam, b: Beam) -> str | None:
    """Why degrees of freedom of a beam do not fit that of the scene; None if they do."""
    if a is b or (a.mesh is b.mesh and a.element is b.element):
        return None
    if repr(a.element) != repr(b.element) or not _same(a.element.doflocs, b.element.doflocs):
        return f"its element is {a.element!r}, that of the scene {b.element!r}"
    for name, what in _GEOMETRY.items():
        x, y = getattr(a.mesh, name), getattr(b.mesh, name)
        if not _same(x, y):
            return what.format(x, y)
    return None


def _same(a: Any, b: Any) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


def displacement(system: System, state: State, name: str = "start") -> Array:
    """Displacement (N,) of a State for a scene; ``name`` is for messages."""
    if not isinstance(state, State):
        raise InputError(f"{name} is a State, as solve_static returns it, got "
                         f"{type(state).__name__}; scene.state(u) makes one of coordinates "
                         f"of shape ({system.N},)")
    other = state.system
    if other is not system:
        if len(other.beams) != len(system.beams):
            raise InputError(f"{name} is a state of {len(other.beams)} beams, the scene has "
                             f"{len(system.beams)}")
        for k, (a, b) in enumerate(zip(other.beams, system.beams)):
            why = difference(a, b)
            if why:
                who = "" if len(system.beams) == 1 else f" of beam {b.name or k}"
                raise InputError(
                    f"{name} is a state of another mesh{who}: {why}. Its coordinates mean "
                    "something else here; where they do not, scene.state(other.u) takes them over")
    places = [[(tuple(b.position), b.angle) for b in s.bodies] for s in (other, system)]
    if places[0] != places[1]:
        raise InputError(f"{name} is a state of other rigid bodies: at (position, angle) "
                         f"{places[0]} there, {places[1]} in the scene")
    return np.array(require_finite(f"{name}.u", state.u, (system.N,)))


def configuration(system: System, state: State) -> State:
    """A State with its multipliers, for a scene."""
    u = displacement(system, state, "state")
    if state.system is system:
        return state
    kinds = [[(type(j), j.equations) for j in s.constraints.joints] for s in (state.system, system)]
    if kinds[0] != kinds[1]:
        raise InputError("state has multipliers of other joints: "
                         f"{list(state.system.constraints.joints)} there, "
                         f"{list(system.constraints.joints)} in the scene; "
                         "scene.state(u, multipliers) takes them as they are")
    memory = system.histories.of_state(state)
    return state.replace(system=system, u=u).replace(memory=memory)
