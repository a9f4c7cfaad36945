"""The strain of the elements at points: what of it does not depend on the state is made once."""

from __future__ import annotations

from functools import cached_property
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
        self._beam, self._places, self._tind = beam, list(places.values()), tind

    @cached_property
    def _tables(self):
        """Slopes, (places, nb, 2, ne, np), and frame, (2, 2, places, ne, np)."""
        beam = self._beam
        tables = [beam.element.slopes(beam.mesh.mapping(), at, self._tind) for at in self._places]
        return np.array([table for table, _ in tables]), np.stack([f for _, f in tables], axis=2)

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
        slopes, frame = self._tables
        return self._of(np.einsum("ebi,qbJep->iJqep", u_e, slopes), frame)

    def once(self, u_e: Array) -> Array:
        """As calling it, for a single state: no table is made.

        Parameters
        ----------
        u_e
            As for a call, shape (nelements, nb, 2).
        """
        beam = self._beam
        found = [beam.element.gradients(beam.mesh.mapping(), at, self._tind, u_e)
                 for at in self._places]
        return self._of(*(np.stack(parts, axis=2) for parts in zip(*found)))

    def _of(self, H, e):
        (xx, yy), both = sum((e + 0.5 * H) * H), (e[:, 0] + H[:, 0]) * H[:, 1] + H[:, 0] * e[:, 1]
        return np.array([sum(weight * values[at] for at, weight in part)
                         for values, part in zip((xx, yy, both[0] + both[1]), self._parts)])

    @cached_property
    def _single(self):
        """Of one point: slopes (nb, 2 places), frame (places, 2, 2), weights (3, 4 places)."""
        slopes, frame = (table[..., 0, 0] for table in self._tables)
        weights = np.zeros((3, len(slopes), 2, 2))
        for (row, J, K), part in zip(((0, 0, 0), (1, 1, 1), (2, 0, 1)), self._parts):
            for at, weight in part:
                weights[row, at, J, K] += np.ravel(weight)[0]
        weights[2] += weights[2].swapaxes(-1, -2)  # both products of the shear
        return (np.ascontiguousarray(slopes.transpose(1, 0, 2)).reshape(slopes.shape[1], -1),
                np.ascontiguousarray(frame.transpose(2, 1, 0)), weights.reshape(3, -1))

    def one(self, u_e: Array) -> Array:
        """As calling it, (3,), where there is one point.

        Parameters
        ----------
        u_e
            Displacements of the coordinates of its element, shape (2, nb).
        """
        slopes, frame, weights = self._single
        H = (u_e @ slopes).T.reshape(-1, 2, 2)  # places, along which it is derived, component
        return weights @ ((frame + 0.5 * H) @ H.swapaxes(-1, -2)).ravel()
