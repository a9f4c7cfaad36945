"""Graded meshes: elements where the error is."""

import logging

import numpy as np

from ..errors import ConvergenceError, require_integer, require_positive, taught

logger = logging.getLogger(__name__)

#: Part of the squared error whose elements are halved.
BULK = 0.7

#: Largest number of elements that may be allowed.
MAX_ELEMENTS = 10**7


@taught
def solve_adaptive(scene, tol, max_elements=20000, **options):
    """Solve on meshes that are refined until the estimated error is small enough.

    Each round solves on a mesh and on the same with every element halved. The difference is the
    estimate: in the displacement of the beams' ends relative to the size of the scene, and
    relative in the strain energy. Once the mesh resolves the solution, a method of order p leaves
    the finer solution an error of 1 / (2^p - 1) of it, a third or less. The elements that
    contribute most to the difference in the energy norm are halved for the next round.

    Parameters
    ----------
    scene
        A scene whose supports and loads were given by names, points and functions, so that they
        can be put on another mesh.
    tol
        Tolerance of both estimates.
    max_elements
        Largest number of elements of the finer mesh.
    **options
        Those of :func:`~skfem_ancf.statics.newton.solve_static`.

    Returns
    -------
    State
        On the finer mesh of the last round, with ``error_estimate``, a dictionary with
        "displacement" and "energy", and ``scene``, the scene on that mesh.

    Raises
    ------
    ConvergenceError
        If ``max_elements`` do not suffice; its ``state`` is the last State.
    """
    tol = require_positive("adapt", tol)
    max_elements = require_integer("max_elements", max_elements, 1, MAX_ELEMENTS)
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
            raise ConvergenceError(
                f"{n} elements leave an estimated error of {max(estimate.values()):.3g}, adapt = "
                f"{tol:g} is not reached: raise max_elements or use an element of higher order",
                better)
        marked = _mark(coarse, fine, better.u - prolong(state.u), better.u)
        coarse, _ = refine(coarse, marked)


def refine(scene, marked):
    """The scene with elements halved, and the map of displacements onto it.

    Parameters
    ----------
    scene
        A scene.
    marked
        For each beam the elements to halve.
    """
    beams = [b.with_mesh(b.mesh.refined(np.asarray(m, dtype=int)))
             for b, m in zip(scene.beams, marked)]

    def prolong(u):
        parts = np.split(u, np.cumsum([b.N for b in scene.beams])[:-1])
        return np.concatenate([_prolong(a, b, m, v)
                               for a, b, m, v in zip(scene.beams, beams, marked, parts)])

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
    every = np.concatenate(errors)
    order = np.argsort(-every)
    keep = order[:1 + int(np.searchsorted(np.cumsum(every[order]), BULK * every.sum()))]
    chosen = np.zeros(len(every), dtype=bool)
    chosen[keep] = True
    return [np.nonzero(c)[0] for c in np.split(chosen, np.cumsum([len(e) for e in errors])[:-1])]
