"""Strategies of the default static solution, in order.

Each stops after some iterations. The first, the mixed iteration with the whole load at once, solves
most scenes. The last are the full load steps of ``method="mixed"`` and ``method="newton"``, so that
the default finds what either of these finds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class Strategy(NamedTuple):
    """A strategy: its name in messages, and a function.

    ``run`` takes a :class:`~skfem_ancf.solvers.newton.Search` and returns a result, or a false
    value if it does not apply; it raises if it fails.
    """

    name: str
    run: Callable[[Any], Any]


def _loads_first(search: Any) -> Any:
    """Apply the loads with fixed supports, then the support displacements, as for a slack rope."""
    if not (search.at_once and search.supports_move):
        return None
    loaded = search.route._replace(times=(0.0, 0.0))
    if search.stabilised_by_loads:
        start = search.descent("mixed", route=loaded)
    else:
        start = search.one_step("newton", loaded)
    moved = search.route._replace(u=start.u, loads=(1.0, 1.0))
    start.load = 0.0
    return search.load_steps("newton", moved, start, few=True)


def _few_steps(search: Any, method: str) -> Any:
    """Load steps, while they are few."""
    return search.load_steps(method, first_step=search.smaller_step, few=True)


# the whole load at once
MIXED = Strategy("the mixed iteration", lambda search: search.at_once and search.one_step("mixed"))
# The first correction of a slack rope is far too large. The stress of the strain corrects that, the
# independent stress does not.
SOFT = Strategy("Newton's method", lambda search: (
    search.at_once and search.soft and search.one_step("newton")))
NEWTON = Strategy("Newton's method", lambda search: (
    search.at_once and not search.soft and search.one_step("newton")))
LOADS_FIRST = Strategy("loads before supports", _loads_first)
# if contacts open and close, a descent needs fewer corrections than load steps
TOUCHING = Strategy("descent", lambda search: (
    search.at_once and search.touches and search.stable and search.descent("mixed")))
# load steps do not help with prestressed springs
FEW_MIXED = Strategy("smaller load steps", lambda search: (
    not search.prestressed and _few_steps(search, "mixed")))
FEW_NEWTON = Strategy("smaller load steps of Newton's method",
                      lambda search: _few_steps(search, "newton"))
# to a minimum of the potential, by a trust-region method
DESCENT = Strategy("descent", lambda search: (
    search.stable and not (search.at_once and search.touches) and search.descent("mixed")))
NEWTON_DESCENT = Strategy("descent by Newton's method",
                          lambda search: search.stable and search.descent("newton"))
WITHOUT_FRICTION = Strategy("descent without friction at first", lambda search: (
    search.stable and search.rubs and search.descent("mixed", eased=True)))
MIXED_STEPS = Strategy("load steps as small as may be", lambda search: search.load_steps("mixed"))
NEWTON_STEPS = Strategy("load steps of Newton's method as small as may be",
                        lambda search: search.load_steps("newton"))

#: For scenes with sufficient supports.
STRATEGIES = (MIXED, SOFT, TOUCHING, FEW_MIXED, NEWTON, LOADS_FIRST, DESCENT, NEWTON_DESCENT,
              WITHOUT_FRICTION, FEW_NEWTON, MIXED_STEPS, NEWTON_STEPS)

#: For scenes stabilised by loads or obstacles, whose tangent at rest is singular.
STABILISED_BY_LOADS = (LOADS_FIRST, TOUCHING, DESCENT, NEWTON_DESCENT, WITHOUT_FRICTION, NEWTON,
                 FEW_MIXED, FEW_NEWTON)
