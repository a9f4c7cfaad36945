"""What a sweep reads of the static equilibria of its members."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..core.errors import InputError, require_label, require_option, shown

if TYPE_CHECKING:
    from collections.abc import Callable


#: What is read of material points by its name.
WHAT = ("displacement", "position")


class Probes:
    """A measure of the scene: it is solved, then read.

    Parameters
    ----------
    measure
        A pair (what, at) or a triple (what, at, beam); a function of the State; a dict of such by
        name.
    """

    def __init__(self, measure: Any) -> None:
        named = measure if isinstance(measure, dict) else {"value": measure}
        if not named:
            raise InputError("measure is an empty dict: name what is to be read")
        for name, probe in named.items():
            _require_probe(name, probe)
        self._probes = named

    def __call__(self, scene: Any) -> dict[str, Any]:
        """Values by name, of the scene's static equilibrium."""
        state = scene.solve_static()
        return {name: probe(state) if callable(probe) else getattr(state, probe[0])(*probe[1:])
                for name, probe in self._probes.items()}


def measured(measure: Any) -> Callable[[Any], Any]:
    """The function of a scene that a measure is.

    Parameters
    ----------
    measure
        As for :func:`~skfem_ancf.sweep`.

    Raises
    ------
    InputError
        If it is none.
    """
    if callable(measure):
        return measure
    if not isinstance(measure, (dict, tuple)):
        raise InputError("measure must be a function of the scene, what to read of its "
                         'equilibrium, as ("displacement", (1, 0)), or a dict of such by name, got '
                         f"{shown(measure)}")
    return Probes(measure)


def _require_probe(name, probe):
    if require_label("name", name) is None:
        raise InputError("a name of measure must be a text, got None")
    if callable(probe):
        return
    if not isinstance(probe, tuple) or len(probe) not in (2, 3):
        raise InputError(f"{name!r} of measure must be a pair, as (\"displacement\", (1, 0)), a "
                         "triple with the beam behind it, or a function of the State, got "
                         f"{shown(probe)}")
    what, at = probe[:2]
    require_option("quantity", what, WHAT)
    if at is None:
        raise InputError(f"{name!r} of measure needs a point, as ({what!r}, (1, 0)), or the name "
                         "of a boundary, got None")
