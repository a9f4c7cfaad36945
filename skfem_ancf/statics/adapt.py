"""Graded meshes: elements where the error is."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import (ConvergenceError, InputError, NameUnknown, require_integer, require_positive,
                      taught)
from ..quadrature import gauss, tensor

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

    from ..beam import Beam
    from ..results import State
    from ..scene import Scene
    from ..types import Array

logger = logging.getLogger(__name__)

#: Part of the squared error whose elements are halved.
BULK = 0.7

#: What the error is measured in.
GOALS = ("displacement", "strain")

#: Largest number of elements that may be allowed.
MAX_ELEMENTS = 10**7


@taught
def solve_adaptive(scene: Scene, tol: float, max_elements: int = 20000, goal: str = "displacement",
                   **options: Any) -> State:
    """Solve on meshes that are refined until the estimated error is small enough.

    With the goal "displacement" each round solves on a mesh and on the same with every element
    halved. The difference is the estimate: in the displacement of the beams' ends relative to the
    size of the scene, and relative in the strain energy. Once the mesh resolves the solution, a
    method of order p leaves the finer solution an error of 1 / (2^p - 1) of it, a third or less.
    The elements that contribute most to the difference in the energy norm are halved for the next
    round.

    With the goal "strain" the estimate is the difference of the elements' strain and the recovered
    one (:mod:`skfem_ancf.recovery`), in the L2 norm over the body relative to that of the strain,
    and the elements that contribute most to it are halved. It estimates the error of the elements'
    strain; that of the recovered strain, which is what State.strain returns, is smaller.

    Parameters
    ----------
    scene
        A scene whose supports and loads were given by names, points and functions, so that they
        can be put on another mesh.
    tol
        Tolerance of both estimates.
    max_elements
        Largest number of elements of the finer mesh.
    goal
        "displacement" or "strain".
    **options
        Those of :func:`~skfem_ancf.statics.newton.solve_static`.

    Returns
    -------
    State
        On the finer mesh of the last round, with ``error_estimate``, a dictionary with
        "displacement" and "energy", or "strain", and ``scene``, the scene on that mesh.

    Raises
    ------
    NameUnknown
        If the goal is not known.
    InputError
        If the goal is "strain" and a beam's strain cannot be recovered.
    ConvergenceError
        If ``max_elements`` do not suffice; its ``state`` is the last State.
    """
    tol = require_positive("adapt", tol)
    max_elements = require_integer("max_elements", max_elements, 1, MAX_ELEMENTS)
    if goal not in GOALS:
        raise NameUnknown("goal", goal, GOALS)
    if goal == "strain":
        return _solve_for_strain(scene, tol, max_elements, **options)
    coarse = scene
    while True:
        # each from the stress-free state: what a coarse mesh does not see as strain a finer one
        # does, which makes its solution a poor start
        state = coarse._solve(None, **options)
        everywhere = [np.arange(b.mesh.nelements) for b in coarse.beams]
        fine, prolong = refine(coarse, everywhere)
        better = fine._solve(None, **options)
        estimate = _compare(coarse, state, fine, better)
        better = better.replace(error_estimate=estimate, scene=fine)
        n = sum(b.mesh.nelements for b in fine.beams)
        logger.info("%d elements, estimated error %.3g", n, max(estimate.values()))
        if max(estimate.values()) <= tol:
            return better
        if n >= max_elements:
            raise _too_few(n, estimate, tol, better)
        marked = _mark(coarse, fine, better.u - prolong(state.u), better.u)
        coarse, _ = refine(coarse, marked)


def _too_few(n, estimate, tol, state):
    return ConvergenceError(
        f"{n} elements leave an estimated error of {max(estimate.values()):.3g}, adapt = {tol:g} "
        "is not reached: raise max_elements or use an element of higher order", state)


def _solve_for_strain(scene, tol, max_elements, **options):
    before = 0, np.inf
    while True:
        state = scene._solve(None, **options)
        parts = [strain_error(state, b) for b in scene.beams]
        errors, sizes = (np.concatenate(x) for x in zip(*parts))
        size = sizes.sum()
        estimate = {"strain": float(np.sqrt(errors.sum() / size)) if size else 0.0}
        state = state.replace(error_estimate=estimate, scene=scene)
        logger.info("%d elements, estimated error of the strain %.3g", len(errors),
                    estimate["strain"])
        if estimate["strain"] <= tol:
            return state
        stuck = False
        if len(errors) >= 2 * before[0]:
            stuck = estimate["strain"] > 0.95 * before[1]
            before = len(errors), estimate["strain"]
        if stuck:
            raise ConvergenceError(
                f"the estimated error of the strain stays at {before[1]:.3g} as elements are "
                f"added; adapt = {tol:g} is not reached: the sections cannot show this field, use "
                "an element of higher order", state)
        if len(errors) >= max_elements:
            raise _too_few(len(errors), estimate, tol, state)
        scene, _ = refine(scene, _largest(errors, [len(e) for e, _ in parts]))


def strain_error(state: State, beam: Beam) -> tuple[Array, ...]:
    """Squared L2 norm of recovered minus elements' strain, and of the strain, by element.

    Parameters
    ----------
    state
        A State.
    beam
        One of its beams.

    Returns
    -------
    error, size
        Shapes (nelements,).

    Raises
    ------
    InputError
        If the strain of the beam cannot be recovered.
    """
    recovery = state.recovery(beam)
    if recovery is None:
        k = list(state.beams).index(beam)
        raise InputError('the goal "strain" needs recovered fields, which this scene has not: '
                         f"{list(state.recovered.values())[k]}")
    weights = np.array([1.0, 1.0, 0.5])  # eps_xy twice, from its double
    out = np.zeros((2, beam.mesh.nelements))
    for slab, rule in beam.across.rules(2 * max(beam.element.order, 1) + 1):
        X, W = tensor(gauss(5), rule)
        dV = beam.across.volume(slab, X, W)
        strain = recovery.fields(X)[0]
        gap = strain - beam.strain(state.u_of(beam), X)
        out += [np.einsum("k,kep,ep->e", weights, f * f, dV) for f in (gap, strain)]
    return tuple(out)


def refine(scene: Scene, marked: Sequence[ArrayLike]) -> tuple[Scene, Callable[[Array], Array]]:
    """The scene with elements halved, and the map of displacements onto it.

    Parameters
    ----------
    scene
        A scene.
    marked
        For each beam the numbers of the elements to halve, shapes (k,).

    Returns
    -------
    scene, prolong
        ``prolong(u)`` is the displacement u (N,) in the coordinates of the new scene.
    """
    beams = [b.with_mesh(b.mesh.refined(np.asarray(m, dtype=int)))
             for b, m in zip(scene.beams, marked)]

    def prolong(u):
        parts = np.split(u, np.cumsum([b.N for b in scene.beams]))  # the last of rigid bodies
        return np.concatenate([*(_prolong(a, b, m, v) for a, b, m, v in zip(
            scene.beams, beams, marked, parts)), parts[-1]])

    return scene.with_beams(beams), prolong


def _prolong(old, new, marked, u):
    """The same displacement on the mesh with the marked elements halved: the spaces are nested."""
    nb = old.element.nodal_dofs
    nodes = u.reshape(-1, nb, 2)
    slope = np.array([f[1] for f in old.element.functionals])
    marked = np.unique(marked)
    t = old.mesh.t[:, marked]
    L = old.mesh.lengths[marked][:, None, None]
    q = np.concatenate([nodes[t[0]], nodes[t[1]]], axis=1) * L ** np.tile(slope, 2)[:, None]
    middle = np.einsum("ij,ejc->eic", old.element.halving[nb:], q) / (0.5 * L) ** slope[:, None]
    return np.insert(nodes, t[1], middle, axis=0).ravel()


def _compare(coarse, state, fine, better):
    size, change = coarse.system.size, 0.0
    for a, b in zip(coarse.beams, fine.beams):
        for end in (0, -1):
            d = (better.u_of(b).reshape(-1, b.nd)[end, :2]
                 - state.u_of(a).reshape(-1, a.nd)[end, :2])
            change = max(change, float(np.hypot(*d)))
    old, new = state.strain_energy, better.strain_energy
    return {"displacement": change / size,
            "energy": abs(new - old) / abs(new) if new else 0.0}


def _mark(coarse, fine, difference, u):
    """The elements of the coarse mesh that make up most of the difference in the energy norm."""
    errors = []
    for a, b in zip(coarse.beams, fine.beams):
        s = fine.system.of(b)
        d = b.kernel.gather(difference[s]).reshape(b.mesh.nelements, -1)
        K = b.kernel.tangents(u[s])
        local = np.abs(np.einsum("ei,eij,ej->e", d, K, d))
        errors.append(local.reshape(-1, 2).sum(axis=1))
    return _largest(np.concatenate(errors), [len(e) for e in errors])


def _largest(errors, numbers):
    """For each beam its elements among those that make up most of the squared error."""
    order = np.argsort(-errors)
    keep = order[:1 + int(np.searchsorted(np.cumsum(errors[order]), BULK * errors.sum()))]
    chosen = np.zeros(len(errors), dtype=bool)
    chosen[keep] = True
    return [np.nonzero(c)[0] for c in np.split(chosen, np.cumsum(numbers)[:-1])]
