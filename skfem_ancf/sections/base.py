"""What a section is made of: slabs from bottom to top, each of a material and a width."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, ask_array, require_positive, shown
from ..core.frozen import Frozen
from ..materials import Material
from ..core.pickling import require_picklable
from .measure import MORE, WHOLE, Uniform

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..mesh.mesh_beam import MeshBeam
    from ..core.types import Array


@dataclass(frozen=True)
class Slab:
    """A part of a section, all along the beam.

    Attributes
    ----------
    material
        Its material, of numbers.
    width
        Area over the height of the beam: a number, or a function of material coordinates (x, y).
    measure
        Its rules across, places eta in [0, 1].
    face
        Widths of its bottom and its top; None for ``width``.
    outer
        Its largest width; None for ``width``.
    by_height
        The width grows with the height of a tapered beam.
    grade
        A function of (x, y) that multiplies its energy, or None.
    density
        Mass per volume: a number, a function of (x, y), or None.
    inertia
        The measure of its mass, if that is another.
    shear
        Factor on the shear modulus under the shear stress that equilibrium asks for.
    """

    material: Material
    width: Any
    measure: Any
    face: tuple[float, float] | None = None
    outer: float | None = None
    by_height: bool = False
    grade: Callable[..., Any] | None = None
    density: Any = None
    inertia: Any = None
    shear: float = 1.0

    @property
    def part(self) -> float:
        """Of the height of the beam, that it takes."""
        return self.measure.high - self.measure.low

    @property
    def varies(self) -> bool:
        """True if something is a function of material coordinates."""
        return callable(self.width) or callable(self.grade) or callable(self.density)


class Section(Frozen):
    """The section of a beam: what lies across it. It does not change.

    Sections are made by :meth:`profile`, :meth:`layers` and :meth:`numbers`, and given to
    ``Beam(mesh, element, section=...)``. A subclass of your own gives :meth:`slabs`.

    Attributes
    ----------
    has_materials : bool
        It has materials of its own: the beam is given none.
    has_fields : bool
        Strain and stress across it are known; not so of numbers.
    """

    has_materials = False
    has_fields = True

    @staticmethod
    def profile(name: str, scaled: bool = False, **sizes: float) -> Section:
        """A profile of one material, as high as the mesh.

        Rules across it are Gauss rules of its width, exact to round-off for the polynomials of the
        element, jumps of the width and the ends of circles included: see
        :class:`~skfem_ancf.sections.measure.Weighted`. The axis is in the middle of the height,
        which of a T is not the centroid: its extension and bending are coupled.

        Parameters
        ----------
        name
            "rectangle" (width), "I" and "T" (width, web, flange; the flange of a T is at the top),
            "box" (width, wall), "tube" (wall) or "circle".
        scaled
            Of a mesh whose height varies. False: flanges and walls keep their thickness. True:
            sizes are those where it is largest, and flanges and the lower and upper walls of a box
            are the same part of the height everywhere; webs and widths stay. A tube is scaled as a
            whole, a circle always.
        **sizes
            Width over all, thickness of the web, of a flange and of the walls.

        Raises
        ------
        NameUnknown
            If the name is not known.
        CallError
            If it has other sizes.
        InputError
            If a size is not positive, or walls do not fit; in a Beam also in the height.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Section, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850),
        ...             section=Section.profile("I", width=0.05, web=0.005, flange=0.008))
        >>> round(beam.total_mass, 6)  # (2 * 0.05 * 0.008 + 0.084 * 0.005) * 2 * 7850
        19.154
        """
        from .profiles import Profile

        return Profile(name, scaled, **sizes)

    @staticmethod
    def layers(*layers: Any, width: float | Callable[..., Any] | None = None) -> Section:
        """Bonded layers, from the bottom to the top; together as high as the mesh.

        Strains are continuous, and the stress of each layer is that of its own law: it jumps
        between two.

        Parameters
        ----------
        *layers
            Pairs of a thickness and a material; a third entry is the width of that layer. The
            thickness of one may be None: it takes what the others leave of the height, which may
            vary along the mesh.
        width
            Width of the others: a positive number, or a function of material coordinates (x, y).

        Raises
        ------
        InputError
            If a layer is no such pair or is not positive; in a Beam if they do not fill the height.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Section, StVenantKirchhoff
        >>> steel, brass = (StVenantKirchhoff(E=E, nu=0.3, density=8000) for E in (2e11, 1e11))
        >>> strip = Section.layers((0.001, steel), (0.002, brass), width=0.01)
        >>> beam = Beam(MeshBeam.init_line([0, 1], height=0.003), ElementBeamANCF(2), section=strip)
        >>> round(beam.total_mass, 6)
        0.24
        """
        from .layers import Layers

        return Layers(*layers, width=width)

    @staticmethod
    def numbers(EA: float, EI: float, GA: float | None = None, rhoA: float | None = None,
                rhoI: float | None = None, width: float = 1.0) -> Section:
        """A section given by its stiffnesses and inertias about the axis.

        Parameters
        ----------
        EA, EI
            Stiffnesses against extension and bending.
        GA
            Against shear, its factor included; None for that of a rectangle, 5/12 EA. A cable does
            not shear: a ModelWarning says where that is felt.
        rhoA, rhoI
            Mass per length, and its moment of inertia; None for rhoI is rhoA EI / EA.
        width
            Of the faces, where pressures and tractions act.

        Raises
        ------
        InputError
            If a number is not positive.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Section
        >>> beam = Beam(MeshBeam.init_line([0, 2], height=0.01), ElementBeamCable(5),
        ...             section=Section.numbers(EA=1e5, EI=2.0, rhoA=0.3))
        >>> round(beam.total_mass, 12)
        0.6
        """
        from .numbers import Numbers

        return Numbers(EA, EI, GA, rhoA, rhoI, width)

    def slabs(self, mesh: MeshBeam, material: Any) -> list[Slab]:
        """What it is made of in a beam, from the bottom to the top.

        Parameters
        ----------
        mesh, material
            Those of the beam; the material is None if the section has its own.

        Raises
        ------
        InputError
            If it does not fit the height of the mesh.
        """
        raise NotImplementedError

    def functions(self) -> list[tuple[str, Callable[..., Any]]]:
        """Pairs of a description and a function, for those that it was given."""
        return []

    def __getstate__(self):
        require_picklable(self.functions())
        return super().__getstate__()


class Rectangle(Section):
    """A full section of one width: what ``Beam(..., width=...)`` has.

    Parameters
    ----------
    width
        A positive number, or a function of material coordinates: x, the parameter of the axis, and
        y, the distance from it; arrays of one shape, of which it returns another.
    """

    def __init__(self, width: float | Callable[..., Any]) -> None:
        self.width = width if callable(width) else require_positive("width", width)

    def slabs(self, mesh: MeshBeam, material: Any) -> list[Slab]:
        return [slab_of(material, self.width)]

    def functions(self) -> list[tuple[str, Callable[..., Any]]]:
        return [("the function width(x, y) of the section", self.width)] if callable(
            self.width) else []

    def __repr__(self) -> str:
        return f"<rectangle of width {shown(self.width)}>"


def slab_of(material: Material, width: Any, measure: Any = None, **more: Any) -> Slab:
    """The Slab of a material that may be graded.

    Parameters
    ----------
    material
        Its moduli or its density may be functions.
    width, measure, **more
        As for :class:`Slab`; a measure of None is the whole height.
    """
    uneven = callable(width) or material.graded
    if measure is None:
        measure = Uniform(more=MORE) if uneven else WHOLE
    elif uneven and isinstance(measure, Uniform):
        measure = Uniform(measure.low, measure.high, MORE)
    reference, grade = material.reference()
    return Slab(reference, width, measure, grade=grade, density=material.density, **more)


def asked(what: str, function: Callable[..., Any], x: Array, y: Array) -> Array:
    """A function of material coordinates, whose values must be positive.

    Parameters
    ----------
    what
        What messages call it, as ``"width"``.
    function
        Takes arrays of one shape.
    x, y
        Material coordinates, shape (...).

    Returns
    -------
    ndarray
        Shape (...).

    Raises
    ------
    InputError
        If a value is not positive.
    """
    x, y = (np.ascontiguousarray(a) for a in np.broadcast_arrays(x, y))
    out = ask_array(f"{what}(x, y)", x.shape, function, x, y, number=True)
    if not np.all(out > 0.0):
        k = np.unravel_index(np.argmin(out), out.shape)
        raise InputError(f"the {what} must be positive all over the body: the function returns "
                         f"{out[k]:.6g} at x = {x[k]:.6g}, y = {y[k]:.6g}")
    return out
