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

    ``run`` takes a :class:`~skfem_ancf.solvers.newton.Search` and returns a result, or what is not
    true where it does not apply; it raises where it fails.
    """

    name: str
    run: Callable[[Any], Any]


def _loads_first(search: Any) -> Any:
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


def _few_steps(search: Any, method: str) -> Any:
    """Load steps, as long as they are few."""
    return search.load_steps(method, first_step=search.smaller_step, few=True)


# the whole load at once
MIXED = Strategy("the mixed iteration", lambda search: search.at_once and search.one_step("mixed"))
# The first correction of a slack rope stretches it far beyond its place. The stress of that brings
# it back, where an independent one does not.
SOFT = Strategy("Newton's method", lambda search: (
    search.at_once and search.soft and search.one_step("newton")))
NEWTON = Strategy("Newton's method", lambda search: (
    search.at_once and not search.soft and search.one_step("newton")))
LOADS_FIRST = Strategy("loads before supports", _loads_first)
# where points come and go at obstacles corrections of bounded size are fewer than load steps
TOUCHING = Strategy("descent", lambda search: (
    search.at_once and search.touches and search.stable and search.descent("mixed")))
# where springs push at rest, steps of the load do not lead there
FEW_MIXED = Strategy("smaller load steps", lambda search: (
    not search.pushed_at_rest and _few_steps(search, "mixed")))
FEW_NEWTON = Strategy("smaller load steps of Newton's method",
                      lambda search: _few_steps(search, "newton"))
# down to a minimum of the potential by corrections of bounded size
DESCENT = Strategy("descent", lambda search: (
    search.stable and not (search.at_once and search.touches) and search.descent("mixed")))
NEWTON_DESCENT = Strategy("descent by Newton's method",
                          lambda search: search.stable and search.descent("newton"))
WITHOUT_FRICTION = Strategy("descent without friction at first", lambda search: (
    search.stable and search.rubs and search.descent("mixed", eased=True)))
MIXED_STEPS = Strategy("load steps as small as may be", lambda search: search.load_steps("mixed"))
NEWTON_STEPS = Strategy("load steps of Newton's method as small as may be",
                        lambda search: search.load_steps("newton"))

#: Of scenes that supports hold.
STRATEGIES = (MIXED, SOFT, TOUCHING, FEW_MIXED, NEWTON, LOADS_FIRST, DESCENT, NEWTON_DESCENT,
              WITHOUT_FRICTION, FEW_NEWTON, MIXED_STEPS, NEWTON_STEPS)

#: Of scenes that only loads or obstacles hold, whose tangent at rest is singular.
HELD_BY_LOADS = (LOADS_FIRST, TOUCHING, DESCENT, NEWTON_DESCENT, WITHOUT_FRICTION, NEWTON,
                 FEW_MIXED, FEW_NEWTON)
