"""The section of one beam: weights of points, stiffnesses and inertia along its axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError, shown
from ..frozen import Frozen
from ..kept import cached_property
from .base import Rectangle, asked
from .shear import shear_factor

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..elements.base import ElementBeam
    from ..formulations.base import Formulation, Term
    from ..materials import Material
    from ..mesh import MeshBeam
    from ..types import Array, Rule
    from .base import Section, Slab

#: Points across a slab for areas and moments.
POINTS = 4


class Across(Frozen):
    """A :class:`~skfem_ancf.sections.Section` on a mesh.

    Parameters
    ----------
    mesh, element
        Those of the beam.
    section
        A Section.
    material
        That of the beam; None if the section has its own.
    """

    def __init__(self, mesh: MeshBeam, element: ElementBeam, section: Section,
                 material: Material | None) -> None:
        self.mesh, self.element = mesh, element
        self.slabs = tuple(section.slabs(mesh, material))
        #: A rectangle of one width and one material.
        self.plain = isinstance(section, Rectangle) and not self.slabs[0].varies
        varying = any(s.varies for s in self.slabs)
        #: That of a mesh of constant height.
        self.simple = self.plain and mesh.heights is None
        #: It is the same all along the beam.
        self.constant = mesh.heights is None and not varying
        #: One table serves all elements.
        self.uniform = mesh.is_uniform and self.constant
        self._check()

    def _check(self):
        """Ask functions all over the body, so that they fail when the beam is made."""
        if any(s.varies for s in self.slabs):
            X = np.array(np.meshgrid(np.linspace(0, 1, 5), np.linspace(0, 1, 9))).reshape(2, -1)
            for slab in self.slabs:
                inside = X[:, (slab.measure.low <= X[1]) & (X[1] <= slab.measure.high)]
                for name in ("width", "grade", "density"):
                    if callable(getattr(slab, name)):
                        asked(_NAMES[name], getattr(slab, name), *self.coordinates(inside))

    # points

    def coordinates(self, X: Array, tind: Array | None = None) -> tuple[Array, Array]:
        """Material coordinates x, the parameter of the axis, and y, the distance from it.

        Parameters
        ----------
        X
            Reference points, shape (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        x, y
            Shape (nelements, npoints) both.
        """
        s, t = self.mesh.parameters, self.mesh.t if tind is None else self.mesh.t[:, tind]
        a, b = s[t][:, :, None]
        x = a + np.asarray(X[0]) * (b - a)
        return x, np.broadcast_to(self.mesh.mapping().offset(X, tind), x.shape)

    def which(self, X: Array) -> Array:
        """The number of the slab at each of reference points (2, ...); shape (...).

        Parameters
        ----------
        X
            Reference points, shape (2, ...); one between two slabs is in the upper.
        """
        tops = np.array([s.measure.high for s in self.slabs[:-1]])
        return np.searchsorted(tops, np.asarray(X[1]), side="right")

    def of_slabs(self, X: Array, like: Array, values: list[Callable[[], Array]],
                 tind: Array | None = None, graded: bool = True) -> Array:
        """A field that each slab has by its own law.

        Parameters
        ----------
        X, tind
            Reference points, shape (2, npoints) or (2, nelements, npoints), and elements, shape
            (nelements,), or None for all.
        like
            An array of the shape of the field, (..., nelements, npoints).
        values
            For each slab a function without arguments that returns the field as if all were of it.
        graded
            It is proportional to the energy.
        """
        if self.plain:
            return values[0]()
        which = np.broadcast_to(self.which(X), like.shape[-2:])
        out = np.empty(like.shape)
        for k, (slab, value) in enumerate(zip(self.slabs, values)):
            on = which == k
            if np.any(on):
                found = value() * (self.grade(slab, X, tind) if graded else 1.0)
                out[..., on] = np.broadcast_to(found, like.shape)[..., on]
        return out

    def _mean(self, what, function, slab, X, tind, whole):
        """A function at points, or for points that stand for the section its mean there."""
        if not whole:
            return asked(what, function, *self.coordinates(X, tind))
        eta, w = slab.measure.gauss(POINTS + 4)
        points = np.array([np.repeat(X[0][..., None], len(eta), -1),
                           np.broadcast_to(eta, X[0].shape + eta.shape)])
        values = asked(what, function, *self.coordinates(
            points.reshape(X.shape[:-1] + (-1,)), tind))
        return values.reshape(values.shape[0], -1, len(eta)) @ w

    def volume(self, slab: Slab, X: Array, W: Array, tind: Array | None = None,
               whole: bool = False) -> Array:
        """Volumes that the points of a rule of a slab stand for, shape (nelements, npoints).

        Parameters
        ----------
        slab
            One of :attr:`slabs`.
        X, W
            Points (2, npoints) and weights (npoints,) of the rule on the reference cell.
        tind
            Elements, shape (nelements,), or None for all.
        whole
            The points stand for their sections.
        """
        if self.simple and self.uniform and tind is not None:
            return slab.width * self.mesh.height * self.mesh.lengths[tind][:, None] * W
        return self.breadth(slab, X, tind, whole) * W * self.mesh.mapping().detDF(X, tind)

    def breadth(self, slab: Slab, X: Array, tind: Array | None = None, whole: bool = False) -> Any:
        """What the weights of a slab's rules, whose sum is 1, are multiplied by: area over height.

        Parameters
        ----------
        slab, X, tind, whole
            As for :meth:`grade`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or a number.
        """
        if callable(slab.width):
            return self._mean("width", slab.width, slab, X, tind, whole) * slab.part
        if slab.by_height and self.mesh.heights is not None:
            return slab.width * self.mesh.mapping().height(X[0], tind)[0] / self.mesh.height
        return slab.width

    def grade(self, slab: Slab, X: Array, tind: Array | None = None, whole: bool = False) -> Any:
        """The factor on the energy of a slab at points.

        Parameters
        ----------
        slab, X, tind, whole
            As for :meth:`volume`, X of shape (2, npoints) or (2, nelements, npoints), tind of
            shape (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or 1.
        """
        if slab.grade is None:
            return 1.0
        return self._mean("E", slab.grade, slab, X, tind, whole)

    def density(self, slab: Slab, X: Array, tind: Array | None = None, whole: bool = False) -> Any:
        """Mass per volume of a slab at points; arguments as for :meth:`grade`.

        Parameters
        ----------
        slab, X, tind, whole
            As for :meth:`grade`, shapes (2, npoints) or (2, nelements, npoints), and (nelements,).

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or a number.

        Raises
        ------
        InputError
            If its material has none.
        """
        if slab.density is None:
            raise InputError(f"{slab.material!r} has no density: give one to use mass or gravity")
        if callable(slab.density):
            return self._mean("density", slab.density, slab, X, tind, whole)
        return slab.density

    def face(self, side: int, X: Array, tind: Array | None = None) -> Any:
        """The width of the bottom (0) or the top (1).

        Parameters
        ----------
        side
            Which.
        X, tind
            Points on it, shape (2, npoints) or (2, nelements, npoints), and elements, shape
            (nelements,), or None for all.

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or a number.

        Raises
        ------
        InputError
            If there is no face, as of a circle.
        """
        slab = self.slabs[-side]
        if slab.face is None:
            return self.breadth(slab, X, tind) / slab.part
        if slab.face[side] == 0.0:
            raise InputError("this section has no width at its bottom and its top: load the axis, "
                             "by scene.line_load")
        return slab.face[side]

    def outline(self, X: Array, tind: Array | None = None) -> Any:
        """The largest width of sections, of a function that on the axis.

        Parameters
        ----------
        X, tind
            Points of the axis, shape (2, npoints) or (2, nelements, npoints), and elements, shape
            (nelements,), or None for all.

        Returns
        -------
        ndarray
            Shape (nelements, npoints), or a number.
        """
        scale = [s.outer * s.part / s.width if s.outer else 1.0 for s in self.slabs]
        return np.maximum.reduce([k * self.breadth(s, X, tind) / s.part + 0.0 * X[0]
                                  for k, s in zip(scale, self.slabs)])

    # rules

    def rules(self, n: int, inertia: bool = False) -> list[tuple[Slab, Rule]]:
        """Each slab with its rule of n points across it.

        Parameters
        ----------
        n
            Number of points.
        inertia
            Those for mass.
        """
        return [(slab, (slab.inertia if inertia and slab.inertia is not None else
                        slab.measure).gauss(n)) for slab in self.slabs]

    def terms(self, formulation: Formulation) -> list[tuple[Slab, list[Term]]]:
        """The terms of the strain energy of each slab.

        Parameters
        ----------
        formulation
            That of the beam.

        Raises
        ------
        InputError
            If the rules of the formulation do not know the section.
        """
        if self.plain:
            slab = self.slabs[0]
            return [(slab, list(formulation.terms(self.element, slab.material)))]
        out = []
        for slab in self.slabs:
            terms = list(formulation.terms(self.element.measured(slab.measure, self.shear),
                                           slab.material))
            eta, w = slab.measure.gauss(2)
            for term in terms:
                x, v = term.section
                if len(x) > 1 and abs(np.dot(v, x) - np.dot(w, eta)) > 1e-9:
                    raise InputError(
                        f"formulation {formulation.name!r} has a rule across the section that is "
                        f"not that of {shown(slab.measure)}: take the rules that "
                        "self.full_rules(element) returns")
            out.append((slab, terms))
        return out

    @cached_property
    def shear(self) -> float | None:
        """The shear factor for the element, None for that of a rectangle of one material."""
        if self.plain or self.element.order == 0 or any(s.varies for s in self.slabs):
            return None
        return shear_factor(self.slabs, self.element.order)

    def stabilisation(self, formulation: Formulation) -> Array | None:
        """The constant element stiffness of a formulation, for the section's own E I.

        It is asked for a width of 1 and the largest height, and is proportional to the width.

        Parameters
        ----------
        formulation
            That of the beam.

        Returns
        -------
        ndarray or None
            Shape (1 or nelements, 2 nb, 2 nb).
        """
        first = self.slabs[0]
        if self.simple:
            return formulation.stabilisation(self.mesh, self.element, first.material, first.width)
        held = formulation.stabilisation(self.mesh, self.element, first.material, 1.0)
        if held is None:
            return None
        width = 12.0 * self.bending / (first.material.E * self.mesh.height**3)
        return held * width[:, None, None]

    # integrals over the section

    def moments(self, xi: Array, tind: Array | None = None, what: str = "stiffness") -> Array:
        """Integrals over the section of a quantity times 1, Y and Y^2: as (EA, ES, EI).

        Parameters
        ----------
        xi
            Places along the elements, shape (npoints,) or (nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.
        what
            "stiffness" for the axial modulus, "E" for Young's, "mass" for the density, "area" for
            1.

        Returns
        -------
        ndarray
            Shape (3, nelements, npoints).
        """
        ne, n = self.mesh.nelements if tind is None else len(tind), xi.shape[-1]
        if self.simple:
            found = np.empty((3, ne, n))
            found[0], found[1], found[2] = self.simple_moments(what)
            return found
        mapping = self.mesh.mapping()
        out = np.zeros((3, ne, n))
        for slab, (eta, w) in self.rules(POINTS, what == "mass"):
            X = np.array(np.broadcast_arrays(np.repeat(xi, len(eta), -1), np.tile(eta, n)))
            w = np.tile(w, n)
            h, y = mapping.height(X[0], tind)[0], mapping.offset(X, tind)
            size = w * h * self.breadth(slab, X, tind)
            if what == "mass":
                size = size * self.density(slab, X, tind)
            elif what != "area":
                size = size * self.grade(slab, X, tind) * getattr(slab.material, _MODULI[what])
            size = np.broadcast_to(size, (ne, len(w))).reshape(ne, n, -1)
            y = np.broadcast_to(y, (ne, len(w))).reshape(size.shape)
            out += np.array([np.sum(size * y**k, axis=-1) for k in range(3)])
        out[1, np.abs(out[1]) <= 1e-13 * np.sqrt(out[0] * out[2])] = 0.0  # as symmetric as it is
        return out

    def simple_moments(self, what: str = "stiffness") -> tuple[float, float, float]:
        """The numbers of :meth:`moments` where :attr:`simple` says that they are the same all over.

        Parameters
        ----------
        what
            As there.
        """
        slab, h = self.slabs[0], self.mesh.height
        size = slab.width * h * (1.0 if what == "area" else self.density(slab, _NOWHERE)
                                 if what == "mass" else getattr(slab.material, _MODULI[what]))
        return size, 0.0, size * h**2 / 12.0

    @cached_property
    def bending(self) -> Array:
        """E I about the centroid, of the middles of the elements, (nelements,) or (1,)."""
        tind = np.zeros(1, dtype=int) if self.uniform else None
        EA, ES, EI = self.moments(np.array([0.5]), tind, "E")[:, :, 0]
        return EI - ES**2 / EA

    def bending_over_mass(self, density: float) -> float:
        """E I over the mass per length, where it is least.

        Parameters
        ----------
        density
            Mean mass per volume.
        """
        if self.simple:
            return self.slabs[0].material.E * self.mesh.height**2 / density / 12.0
        mass = self.moments(np.array([0.5]), what="mass")[0]
        return float(np.min(self.bending[:, None] / mass))


_NOWHERE = np.zeros((2, 0))
_MODULI = {"stiffness": "axial_modulus", "E": "E"}
_NAMES = {"width": "width", "grade": "E", "density": "density"}
