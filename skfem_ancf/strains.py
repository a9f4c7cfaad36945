"""The strain of the elements at points: what of it does not depend on the state is made once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .formulations import COMPONENTS

if TYPE_CHECKING:
    from .beam import Beam
    from .formulations.base import Term
    from .types import Array


class ElementStrain:
    """The strain of a term of a formulation at points: interpolated samples.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam` with sections.
    term
        A :class:`~skfem_ancf.formulations.Term`.
    X
        Reference points, (2, npoints) or (2, nelements, npoints).
    tind
        Elements, shape (nelements,), or None for all.
    """

    def __init__(self, beam: Beam, term: Term, X: Array, tind: Array | None = None) -> None:
        places: dict[Any, Array] = {}  # where gradients are needed: at the points, at samples
        self._parts: list[list[tuple[int, Any]]] = []  # of each component: places, weights
        for name in COMPONENTS:
            weights = term.interpolation(name, np.ravel(X[0]))
            if weights is None:
                places.setdefault(None, X)
                self._parts.append([(list(places).index(None), 1.0)])
                continue
            part = []
            for xi, w in zip(term.nodes(name), weights.reshape(X[0].shape + (-1,)).T):
                key = float(xi)
                places.setdefault(key, np.array([0.0 * X[0] + xi, X[1]]))
                part.append((list(places).index(key), w.T))
            self._parts.append(part)
        mapping = beam.mesh.mapping()
        tables = [beam.element.slopes(mapping, at, tind) for at in places.values()]
        self._slopes = np.array([table for table, _ in tables])  # (places, nb, 2, ne, np)
        self._frame = np.stack([frame for _, frame in tables], axis=2)  # (2, 2, places, ne, np)

    def __call__(self, u_e: Array) -> Array:
        """The strain (eps_xx, eps_yy, 2 eps_xy).

        Parameters
        ----------
        u_e
            Displacements of the coordinates of the elements, shape (nelements, nb, 2).

        Returns
        -------
        ndarray
            Shape (3, nelements, npoints).
        """
        H, e = np.einsum("ebi,qbJep->iJqep", u_e, self._slopes), self._frame
        (xx, yy), both = sum((e + 0.5 * H) * H), (e[:, 0] + H[:, 0]) * H[:, 1] + H[:, 0] * e[:, 1]
        return np.array([sum(weight * values[at] for at, weight in part)
                         for values, part in zip((xx, yy, both[0] + both[1]), self._parts)])
