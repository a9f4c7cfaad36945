"""What the default of statics tries, in order: small functions, each with a name.

A strategy is given up after some iterations, so that the next one has its turn. The first is the
mixed iteration with the whole load at once, which is enough for most scenes. The last ones are the
load steps of ``method="mixed"`` and ``method="newton"`` to their end, so that the default finds
what either of these finds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Strategy(NamedTuple):
    """A way to look for an equilibrium: its name in messages, and a function.

    ``run`` takes a :class:`~skfem_ancf.solvers.newton.Search` and returns a result, or None where
    it does not apply; it raises where it fails.
    """

    name: str
    run: Callable[[Any], Any]


def mixed_at_once(search: Any) -> Any:
    """The whole load in one step of the mixed iteration."""
    return search.one_step("mixed") if search.at_once else None


def newton_where_soft(search: Any) -> Any:
    """The whole load in one step of Newton's method, of a scene that is soft at first.

    The first correction of a slack rope stretches it far beyond its place. The stress of that
    brings it back, where a stress carried by linearisation does not.
    """
    return search.one_step("newton") if search.at_once and search.soft else None


def newton_at_once(search: Any) -> Any:
    """The whole load in one step of Newton's method, of other scenes."""
    return search.one_step("newton") if search.at_once and not search.soft else None


def loads_first(search: Any) -> Any:
    """The loads while supports are at rest, then the displacements of the supports.

    A rope is tight under its weight, and then it is let go.
    """
    if not (search.at_once and search.supports_move):
        return None
    loaded = search.route._replace(times=(0.0, 0.0))
    if search.held_by_loads:
        start = search.descent("mixed", route=loaded)
    else:
        start = search.one_step("newton", loaded)
    moved = search.route._replace(u=start.u, loads=(1.0, 1.0))
    start.load = 0.0
    return search.load_steps("newton", moved, start, few=True)


def few_mixed_steps(search: Any) -> Any:
    """Load steps of the mixed iteration, as long as they are few.

    Where springs push at rest, steps of the load do not lead there.
    """
    if search.pushed_at_rest:
        return None
    return search.load_steps("mixed", first_step=search.smaller_step, few=True)


def few_newton_steps(search: Any) -> Any:
    """Load steps of Newton's method, as long as they are few."""
    return search.load_steps("newton", first_step=search.smaller_step, few=True)


def descent(search: Any) -> Any:
    """Down to a minimum of the potential by corrections of bounded size."""
    return search.descent("mixed") if search.stable else None


def newton_descent(search: Any) -> Any:
    """The same without carried stresses."""
    return search.descent("newton") if search.stable else None


def descent_without_friction(search: Any) -> Any:
    """Down to a minimum as if there were no friction, then with it from there."""
    return search.descent("mixed", eased=True) if search.stable and search.rubs else None


def mixed_steps(search: Any) -> Any:
    """Load steps of the mixed iteration down to the smallest."""
    return search.load_steps("mixed")


def newton_steps(search: Any) -> Any:
    """Load steps of Newton's method down to the smallest."""
    return search.load_steps("newton")


#: Of scenes that supports hold.
STRATEGIES = (
    Strategy("the mixed iteration", mixed_at_once),
    Strategy("Newton's method", newton_where_soft),
    Strategy("smaller load steps", few_mixed_steps),
    Strategy("Newton's method", newton_at_once),
    Strategy("loads before supports", loads_first),
    Strategy("descent", descent),
    Strategy("descent by Newton's method", newton_descent),
    Strategy("descent without friction at first", descent_without_friction),
    Strategy("smaller load steps of Newton's method", few_newton_steps),
    Strategy("load steps as small as may be", mixed_steps),
    Strategy("load steps of Newton's method as small as may be", newton_steps),
)

#: Of scenes that only loads or obstacles hold, whose tangent at rest is singular.
HELD_BY_LOADS = (
    Strategy("loads before supports", loads_first),
    Strategy("descent", descent),
    Strategy("descent by Newton's method", newton_descent),
    Strategy("descent without friction at first", descent_without_friction),
    Strategy("Newton's method", newton_at_once),
    Strategy("smaller load steps", few_mixed_steps),
    Strategy("smaller load steps of Newton's method", few_newton_steps),
)
