"""What a sweep reads of the equilibria of its members."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from .errors import InputError, require_label, require_option, shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from .points import Located
    from .results import State
    from .scene import Scene
    from .layout import WhichMember

#: What is read of material points by its name.
WHAT = ("displacement", "position")


class Reading(NamedTuple):
    """One value of an equilibrium.

    Attributes
    ----------
    name
        What the sweep calls it.
    what
        One of :data:`WHAT`, or a function of a :class:`~skfem_ancf.results.State`.
    at, beam
        The points: places (x, y), or the name of a boundary; and their beam, None if it is found.
    """

    name: str
    what: Any
    at: Any = None
    beam: WhichMember = None

    def located(self, scene: Scene) -> Located:
        """The points in a scene."""
        return scene.system.points.find(self.at, self.beam)

    def of(self, scene: Scene, state: State) -> Any:
        """The value.

        Parameters
        ----------
        scene, state
            The scene, and its equilibrium.
        """
        if self.at is None:
            return self.what(state)
        at = self.located(scene)
        return at.displacement(state.u) + (at.start if self.what == "position" else 0.0)


class Readings:
    """A measure of the scene: it is solved, then read.

    Parameters
    ----------
    measure
        A pair (what, at) or a triple (what, at, beam); a function of the State; a dict of such by
        name.

    Attributes
    ----------
    items : list of Reading
    """

    def __init__(self, measure: Any) -> None:
        named = measure if isinstance(measure, dict) else {"value": measure}
        if not named:
            raise InputError("measure is an empty dict: name what is to be read")
        self.items = [_reading(name, one) for name, one in named.items()]

    def __call__(self, scene: Scene) -> dict[str, Any]:
        """Values by name, of the scene's static equilibrium."""
        state = scene.solve_static()
        return {item.name: item.of(scene, state) for item in self.items}

    @property
    def at_points(self) -> bool:
        """True if all are of material points."""
        return all(item.at is not None for item in self.items)


def measured(measure: Any) -> Callable[[Scene], Any]:
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
    return Readings(measure)


def _reading(name, one):
    if require_label("name", name) is None:
        raise InputError("a name of measure must be a text, got None")
    if callable(one):
        return Reading(name, one)
    if not isinstance(one, tuple) or len(one) not in (2, 3):
        raise InputError(f"{name!r} of measure must be a pair, as (\"displacement\", (1, 0)), a "
                         "triple with the beam behind it, or a function of the State, got "
                         f"{shown(one)}")
    what, at = one[:2]
    require_option("quantity", what, WHAT)
    if at is None:
        raise InputError(f"{name!r} of measure needs a point, as ({what!r}, (1, 0)), or the name "
                         "of a boundary, got None")
    return Reading(name, *one)
