"""Quantities that a sweep reads from static equilibria."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..core.errors import InputError, require_label, require_option, shown

#: Quantities of material points by name.
WHAT = ("displacement", "position")


class Probes(NamedTuple):
    """Solves a scene statically and evaluates quantities.

    ``named`` has by name pairs (what, at), triples (what, at, beam) or functions of the State.
    """

    named: dict[str, Any]

    def __call__(self, scene: Any) -> dict[str, Any]:
        state = scene.solve_static()
        return {name: probe(state) if callable(probe) else getattr(state, probe[0])(*probe[1:])
                for name, probe in self.named.items()}


def measured(measure: Any) -> Any:
    """The function of a scene for the ``measure`` of :func:`~skfem_ancf.sweep`."""
    if callable(measure):
        return measure
    if not isinstance(measure, (dict, tuple)) or not measure:
        raise InputError("measure must be a function of the scene, what to read of its "
                         'equilibrium, as ("displacement", (1, 0)), or a dict of such by name, got '
                         f"{shown(measure)}")
    named = measure if isinstance(measure, dict) else {"value": measure}
    for name, probe in named.items():
        if require_label("name", name) is None:
            raise InputError("a name of measure must be a text, got None")
        if callable(probe):
            continue
        if not isinstance(probe, tuple) or len(probe) not in (2, 3) or probe[1] is None:
            raise InputError(f"{name!r} of measure must be a pair of what and a point or the name "
                             "of an end, as (\"displacement\", (1, 0)), a triple with the beam "
                             f"behind it, or a function of the State, got {shown(probe)}")
        require_option("quantity", probe[0], WHAT)
    return Probes(named)
