"""Fields for plots, files and evaluation at points. :data:`FIELDS` has the name, definition, unit,
sign and components of each field. A user-defined field is a function of :class:`Values`, or a
:class:`Field` made from one."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..beam import (Beam, BeamPoints, Domain, by_history, displacement_strain, grade_of, kinematics,
                    remembers)
from ..beam.strains import points_of_grid, stress_at, stretched
from ..core import (Array, CallbackError, InputError, NameUnknown, ask, first_order, refuse,
                    require_finite_scalar, require_flag, require_function, require_integer,
                    require_label, require_text, retold, shown, step, stress_of)
from ..materials import LinearLaw
from ..mesh.mapping import cross
from .recovered import Recovery

COMPONENTS = ("xx", "yy", "xy")

#: Factors from (eps_xx, eps_yy, 2 eps_xy) to tensor components.
HALF_SHEAR = np.array([[1.0], [1.0], [0.5]])


@dataclass(frozen=True)
class Field:
    """A field on the body.

    Attributes
    ----------
    name : str
        Name in files.
    function : callable
        From :class:`Values` to the field at its points, shape (n,) or (components, n).
    title : str
        Title in plots; mathtext between dollars.
    unit : str
        Such as "force / area", in the units of the input.
    signed : bool
        Colours are symmetric about ``neutral``; otherwise they start there.
    components : int
        1; 2 for a vector in global axes; 3 for a symmetric tensor (xx, yy, xy).
    frame : str
        Frame of vectors, tensors and components: "global" or "beam".
    neutral : float
        Value in the reference configuration.

    Examples
    --------
    >>> from skfem_ancf.recovery.fields import Field
    >>> Field("utilisation", lambda v: v["von_mises"] / 1e3, "utilisation", signed=False).label()
    'utilisation'
    """

    name: str
    function: "Callable[[Values], Any]"
    title: str = ""
    unit: str = ""
    signed: bool = True
    components: int = 1
    frame: str = ""
    neutral: float = 0.0

    def __post_init__(self) -> None:
        if require_label("the name of a field", self.name) is None:
            raise InputError(f"the name of a field must be a text, got {shown(self.name)}")
        require_function("the function of a field", self.function, "of Values")
        require_integer("components", self.components, 1, 3)
        for name in ("title", "unit", "frame"):
            if require_text(name, getattr(self, name)) is None:
                raise InputError(f"{name} must be a text, got None")
        require_flag("signed", self.signed)
        require_finite_scalar("neutral", self.neutral)

    def label(self) -> str:
        """Title and unit."""
        return (self.title or self.name) + (f" ({self.unit})" if self.unit else "")

    @property
    def symbol(self) -> str:
        """The formula in the title, or all of it; "" for a function without a name."""
        formula = re.search(r"\$[^$]+\$", self.title)
        name = "" if self.name == "lambda" else self.name
        return formula.group() if formula else self.title or name

    def of(self, values: "Values") -> Array:
        """The field at the points of Values, (n,) or (components, n)."""
        own = FIELDS.get(self.name) is not self
        out = ask("the function of a field", self.function, values) if own else (
            self.function(values))
        shape = (values.n,) if self.components == 1 else (self.components, values.n)
        with retold((TypeError, ValueError), "the field {!r} must be an array of numbers, got {!r}",
                    self.name, out, error=CallbackError):
            out = np.asarray(out, dtype=float)
        refuse(out.shape not in (shape, ()) or (out.ndim == 0 and not np.isfinite(out)),
               "the field {!r} must have shape {} at {} points, got {}", self.name, shape, values.n,
               out.shape or out, error=CallbackError)
        return np.broadcast_to(out, shape)


class Values(Mapping):
    """Fields at n points of a beam, evaluated on demand.

    A mapping from the names of :data:`FIELDS` to arrays (n,) or (components, n). In a linear
    solution strain and S are linear, F is the identity plus the displacement gradient of the
    elements, and the Cauchy stress is S in global axes.

    Parameters
    ----------
    part
        The :class:`~skfem_ancf.beam.layout.BeamPoints`.
    u
        Displacement of the DOFs of the part, shape (N,); for a linear solution the
        :func:`~skfem_ancf.core.linear.step` from its base.
    find
        A function that returns the recovered field of the beam, or None; None for element fields.
    eigen
        Factors and loads of eigenstrains.
    beam
        The beam with the history of its materials, if they have one.

    Attributes
    ----------
    x, u
        Reference positions and displacements, (2, n).
    strain, elastic
        Green-Lagrange strain (eps_xx, eps_yy, 2 eps_xy) in the beam frame, (3, n), and the same
        minus the eigenstrain.
    S
        Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy) in the beam frame, (3, n).
    F
        Deformation gradient: derivatives along and across the axis, in global axes, (2, 2, n).
    frame
        Beam frame in the reference configuration, ``frame[:, 0]`` along the axis, (2, 2, n).
    """

    def __init__(self, part: BeamPoints, u: Array,
                 find: Callable[[], Recovery | None] | None = None,
                 eigen: Sequence[tuple[Any, Any]] = (), beam: Beam | None = None) -> None:
        self._part, self._u, self._find, self._eigen = part, u, find, eigen
        self.beam, self.n = beam or part.beam, len(part.e)
        #: The member is a cable.
        self.cable = not self.beam.has_sections
        #: Linear about the reference configuration.
        self._small = np.iscomplexobj(u) and not u.real.any()
        self._known: dict[str, Array] = {}
        #: True for a section of which only stiffnesses are known: it has no stress.
        self._shapeless = not self.beam.section.has_fields

    def __getitem__(self, name: str) -> Array:
        if name not in self._known:
            self._known[name] = find_field(name).of(self)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(FIELDS)

    def __len__(self) -> int:
        return len(FIELDS)

    @property
    def x(self) -> Array:
        return self._part.start

    @cached_property
    def u(self) -> Array:
        return first_order(self._part.displacement(self._u))

    @cached_property
    def _recovery(self):
        return None if self._find is None else self._find()

    @cached_property
    def strain(self) -> Array:
        return first_order(self._strain if self._recovery is None else
                           self._part.strain(self._u, self._recovery))

    @property
    def _strain(self):
        return self._part.strain(self._u)

    @property
    def _remembers(self):
        return remembers(self.beam)

    @cached_property
    def S(self) -> Array:
        if self._shapeless:
            return np.full((3, self.n), np.nan)
        return first_order(self._stress) if self._recovery is None else (
            self._recovery.at(self._part.e, self._part.X, slice(3, 6)))

    @property
    def _stress(self):
        part, u = self._part, self._u[self._part.slice]
        eigen = sum(load.stress_at(u, part.at, part.e, factor)[..., 0]
                    for factor, load in self._eigen)
        return stress_at(self.beam, u, part.e, part.X) - eigen

    @property
    def _eigenstrain(self):
        """Shape (3, n), or 0."""
        return sum(first_order(factor) * load.strain_at(self._part.at, self._part.e)[..., 0]
                   for factor, load in self._eigen)

    @cached_property
    def elastic(self) -> Array:
        return self.strain - self._eigenstrain

    def _by_history(self, ask, other):
        """A field (n,) of ``ask(material, history)``; ``other`` where a material has none."""
        if not self._remembers:
            return np.full(self.n, other)
        return by_history(self.beam, self._part.e, self._part.X, ask, other)

    def output(self, name: str, other: float = 0.0) -> Array:
        """A field (n,) of the history of materials.

        Parameters
        ----------
        name
            Its name in ``outputs`` of a :class:`~skfem_ancf.materials.HistoryMaterial`.
        other
            Value where materials have no history. NaN where one has a history without it.
        """
        return self._by_history(lambda law, history: law.outputs(
            self.elastic, history,
            stretched(self.strain[0])[0] * self.S if self.cable else self.S,
            ).get(name, np.full(self.n, np.nan)), other)

    def variable(self, name: str, components: int = 1) -> Array:
        """A history variable of materials, (n,) or (components, n); zero where materials have no
        history, NaN where one has a history without it.

        Parameters
        ----------
        name, components
            Its name and number of components in ``variables`` of a
            :class:`~skfem_ancf.materials.HistoryMaterial`.
        """
        found = np.array([self._by_history(
            lambda law, history, k=k: history[law.rows(name)][k] if name in law.variables else
            np.full(self.n, np.nan), 0.0) for k in range(components)])
        return found[0] if components == 1 else found

    def of_materials(self, ask: Callable[[Any], Array], graded: bool = False) -> Array:
        """A field (n,) that depends on the material at each point.

        Parameters
        ----------
        ask
            A function of a material that returns the field (n,).
        graded
            The field is proportional to the modulus.
        """
        across = self.beam.across
        if across.plain:
            return ask(self.beam.material)
        return across.of_layers(
            self._part.at, np.zeros((self.n, 1), self._u.dtype),
            lambda k: ask(across.layers[k].material)[:, None], self._part.e, graded)[:, 0]

    @cached_property
    def F(self) -> Array:
        if self._recovery is not None and not self._small:
            with np.errstate(invalid="ignore"):
                angle, = self._recovery.at(self._part.e, self._part.X, slice(6, 7))
                strain = self.strain
                lam_x, lam_y = np.sqrt(1.0 + 2.0 * strain[:2])
                across = angle + np.arccos(strain[2] / (lam_x * lam_y))
                return np.array([[lam_x * np.cos(angle), lam_y * np.cos(across)],
                                 [lam_x * np.sin(angle), lam_y * np.sin(across)]])
        return first_order(self._gradient)

    @property
    def _gradient(self):
        part = self._part
        return np.add(*kinematics.gradients(
            self.beam, self._u[part.slice], part.at, part.e))[..., 0]

    @cached_property
    def frame(self) -> Array:
        return self.beam.mesh.mapping().frame(self._part.at, self._part.e)[..., 0]

    @cached_property
    def _volume(self):
        """det F times the stretch of the thickness; NaN if the thickness vanishes."""
        return 1.0 if self._small else first_order(self._volume_of(self.F, self.elastic))

    def _volume_of(self, F, elastic):
        with np.errstate(invalid="ignore"):
            thicker = np.sqrt(1.0 + 2.0 * self._by_history(
                lambda law, history: law.out_of_plane(self.strain, history, self.S)[0], 0.0)
                ) if self._remembers else self.of_materials(
                    lambda law: law.thickness_stretch(elastic))
            return cross(F[:, 0], F[:, 1]) * thicker

    @cached_property
    def sigma(self) -> Array:
        """Cauchy stress F S F^T / J (sigma_xx, sigma_yy, sigma_xy), global axes, (3, n)."""
        if self._shapeless:
            return np.full((3, self.n), np.nan)
        F, S, volume = (self.frame if self._small else self.F), self.S, self._volume
        if np.iscomplexobj(self._u) and not self._small:
            F, S = self._gradient, self._stress
            volume = self._volume_of(F, self._strain - self._eigenstrain)
        with np.errstate(invalid="ignore", divide="ignore"):
            A = np.array([[S[0], S[2]], [S[2], S[1]]])
            sigma = np.einsum("iJn,JKn,jKn->ijn", F, A, F, optimize=True) / volume
        return first_order(np.array([sigma[0, 0], sigma[1, 1], sigma[0, 1]]))

    @cached_property
    def sigma_zz(self) -> Array:
        """Out-of-plane Cauchy stress, (n,); zero in plane stress."""
        if self.beam.material.plane == "stress":
            return np.zeros(self.n)
        if self._remembers:
            return self._by_history(lambda law, history: law.out_of_plane(
                self.elastic, history, self.S)[1], 0.0) / self._volume
        if self.cable:  # eps_zz = 0 and S_yy = 0
            return self.of_materials(lambda law: law.nu * self.S[0]) / self._volume
        with np.errstate(invalid="ignore", divide="ignore"):
            strain = step(0.0, self.elastic) if self._small else self.elastic
            return first_order(self.of_materials(
                lambda law: law.stress_zz(strain), True)) / self._volume

    @cached_property
    def energy(self) -> Array:
        """Strain energy per reference volume, (n,); of materials with a history what is stored."""
        if self.cable:
            stretch, longer = stretched(self.strain[0])
            longer = longer - (self._eigenstrain + 0.0 * self.strain)[0]
        if self.cable and not self._small:
            # half of the nominal stress times the elastic stretch - 1
            elastic = 0.5 * (stretch * self.S[0] * longer + self.elastic[2] * self.S[2])
        else:
            grade = self.of_materials(lambda material: np.ones(self.n), True)

            def of(material):
                law = material.law()
                if self._small or isinstance(law, LinearLaw):
                    return 0.5 * np.sum(self.elastic * self.S, axis=0)
                return law.energy(self.elastic) * grade

            elastic = self.of_materials(of)
        if not self._remembers or np.iscomplexobj(self._u):
            return elastic
        stored = self._by_history(lambda law, history: law.axial_energy(longer, history)
                                  if self.cable else law.energy(self.elastic, history), np.nan)
        return np.where(np.isnan(stored), elastic, stored)

    @cached_property
    def principal(self) -> tuple[Array, Array]:
        """Principal strains (2, n), the larger first, and the direction of the larger, (2, n)."""
        values, direction = _principal(self.strain * HALF_SHEAR)
        return values, np.einsum("iJn,Jn->in", self.frame, direction)

    @cached_property
    def principal_stress(self) -> tuple[Array, Array]:
        """In-plane principal Cauchy stresses (2, n), and the direction of the larger, (2, n)."""
        return _principal(self.sigma)


def _principal(tensor):
    """Eigenvalues (2, n) of (xx, yy, xy), the larger first, and its direction (2, n)."""
    xx, yy, xy = tensor
    middle, half = 0.5 * (xx + yy), 0.5 * (xx - yy)
    radius, angle = np.hypot(half, xy), 0.5 * np.arctan2(xy, half)
    return np.array([middle + radius, middle - radius]), np.array([np.cos(angle), np.sin(angle)])


def _von_mises(v):
    a, b, c = v.sigma
    z = v.sigma_zz
    return np.sqrt(0.5 * ((a - b)**2 + (b - z)**2 + (z - a)**2) + 3.0 * c * c)


def _extremes(v):
    """The largest and the least principal Cauchy stress, with that out of the plane."""
    high, low = v.principal_stress[0]
    return np.maximum(high, v.sigma_zz), np.minimum(low, v.sigma_zz)


def _utilisation(v):
    """Stress over strength; NaN where the material has none."""
    def of(law):
        strength = law.strength
        if strength is None:
            return np.full(v.n, np.nan)
        if not isinstance(strength, tuple):
            return _von_mises(v) / strength
        high, low = _extremes(v)
        return np.maximum(high / strength[0], -low / strength[1])

    return v.of_materials(of)


def _stretch(v):
    if v._small:
        return 1.0 + v.strain[0]
    with np.errstate(invalid="ignore"):
        return np.sqrt(1.0 + 2.0 * v.strain[0])


def _table():
    area, one = "force / area", "1"
    yield Field("displacement", lambda v: v.u, "displacement", "length", False, 2, "global")
    for k, name in enumerate("xy"):
        yield Field(f"u_{name}", lambda v, k=k: v.u[k], f"displacement $u_{name}$", "length", True,
                    1, "global")
    for k, c in enumerate(COMPONENTS):
        factor = 0.5 if c == "xy" else 1.0
        yield Field(f"eps_{c}", lambda v, k=k, f=factor: f * v.strain[k],
                    rf"Green–Lagrange strain $\varepsilon_{{{c}}}$, beam frame", one, frame="beam")
    for k, c in enumerate(COMPONENTS):
        yield Field(f"S_{c}", lambda v, k=k: v.S[k],
                    rf"second Piola–Kirchhoff stress $S_{{{c}}}$, beam frame", area, frame="beam")
    for k, c in enumerate(COMPONENTS):
        yield Field(f"sigma_{c}", lambda v, k=k: v.sigma[k],
                    rf"Cauchy stress $\sigma_{{{c}}}$, global axes", area, frame="global")
    yield Field("von_mises", _von_mises, "von Mises stress", area, False)
    yield Field("tresca", lambda v: np.subtract(*_extremes(v)), "Tresca stress", area, False)
    for k in (0, 1):
        yield Field(f"eps_{k + 1}", lambda v, k=k: v.principal[0][k],
                    rf"principal strain $\varepsilon_{k + 1}$", one)
    for k in (0, 1):
        yield Field(f"sigma_{k + 1}", lambda v, k=k: v.principal_stress[0][k],
                    rf"principal Cauchy stress $\sigma_{k + 1}$", area)
    yield Field("utilisation", _utilisation, "utilisation: stress over strength", one, False)
    yield Field("energy", lambda v: v.energy, "strain energy density", "energy / volume", False)
    yield Field("plastic_strain", lambda v: v.output("plastic_strain"),
                "accumulated plastic strain", one, False)
    yield Field("yield_ratio", lambda v: v.output("yield_ratio", np.nan),
                "von Mises stress over yield stress", one, False)
    yield Field("dissipated", lambda v: v.output("dissipated"), "dissipated energy density",
                "energy / volume", False)
    yield Field("back_stress", lambda v: v.variable("back_stress", 3), "back stress", area, True, 3,
                "beam")
    yield Field("stretch", _stretch, "stretch along the axis", one, neutral=1.0)
    yield Field("eps_1_direction", lambda v: v.principal[1],
                "direction of the larger principal strain, reference configuration", one, False, 2,
                "global")
    yield Field("sigma_1_direction", lambda v: v.principal_stress[1],
                "direction of the larger principal stress, deformed body", one, False, 2, "global")
    yield Field("strain", lambda v: v.strain * HALF_SHEAR,
                "Green–Lagrange strain", one, True, 3, "beam")
    yield Field("stress", lambda v: v.S, "second Piola–Kirchhoff stress", area, True, 3, "beam")
    yield Field("cauchy_stress", lambda v: v.sigma, "Cauchy stress", area, True, 3, "global")


#: Units of force per area, by those of force and length.
PRESSURES = {("N", "m"): "Pa", ("kN", "m"): "kPa", ("MN", "m"): "MPa", ("N", "mm"): "MPa"}


def units_of(state: Any) -> tuple[str, str] | None:
    """The units of force and length of the scene of a state, or None."""
    return getattr(getattr(state, "system", None), "units", None)


def unit_of(field: Field, units: tuple[str, str] | None) -> str:
    """The unit of a field from those of force and length; "1" if dimensionless.

    >>> from skfem_ancf.recovery.fields import FIELDS, unit_of
    >>> [unit_of(FIELDS["von_mises"], units) for units in (None, ("N", "mm"), ("lbf", "in"))]
    ['force / area', 'MPa', 'lbf/in²']
    """
    return field.unit if units is None else unit_in(units, field.unit)


def unit_in(units: tuple[str, str] | None, kind: str) -> str:
    """The unit of a "force", "length", "moment", "force / area" or "energy / volume"; "" if those
    of force and length are not known."""
    if units is None:
        return ""
    force, length = units
    area = PRESSURES.get(units, f"{force}/{length}²")
    return {"force": force, "length": length, "moment": f"{force} {length}", "force / area": area,
            "energy / volume": area}.get(kind, kind)


def with_unit(text: str, unit: str) -> str:
    """A text with a unit, which may be "" or "1" for none."""
    return text if unit in ("", "1") else f"{text} ({unit})".strip()


#: All fields by their names.
FIELDS = {field.name: field for field in _table()}

#: Default fields in files.
DEFAULT = ("displacement", "strain", "stress", "cauchy_stress", "von_mises")
#: Those added by default for materials that yield.
PLASTIC = "plastic_strain", "yield_ratio", "dissipated", "back_stress"

#: Fields that plots can show.
DRAWN = tuple(name for name, f in FIELDS.items() if f.components == 1 or name == "displacement")


#: Names that :class:`~skfem_ancf.Contact` has, and what is said of them.
CONTACT = "pressure", "gap", "sticking", "penetration", "contact"
OF_CONTACT = "; state.contact(on=...) has pressure, gap and sticking of the surface of a member"


def find_field(field: str | Field | Callable[[Values], Any], known: tuple[str, ...] | None = None,
               ) -> Field:
    """The Field of a name, a function of :class:`Values` or a Field."""
    if isinstance(field, Field):
        return field
    if isinstance(field, str):
        known = tuple(FIELDS) if known is None else known
        if field not in known:
            if field in FIELDS:
                raise InputError(f"a plot shows a field of one component, as "
                                 f"{', '.join(map(repr, known[:4]))}, got {field!r}")
            raise NameUnknown("field", field, known, OF_CONTACT if field in CONTACT else "")
        return FIELDS[field]
    if callable(field) and not isinstance(field, type):
        name = getattr(field, "__name__", type(field).__name__).strip("<>")
        return Field(name, field)
    raise NameUnknown("field", field, tuple(FIELDS) if known is None else known)


def no_value(field: Field) -> InputError:
    """The error for a field that is NaN all over a scene."""
    return InputError(f"the field {field.name!r} has no value anywhere in this scene" + (
        ": give a material its strength, as StVenantKirchhoff(..., strength=235e6)"
        if field.name == "utilisation" else
        ": stress needs sections with a shape; state.resultants() has the section forces"
        if field.unit == "force / area" and field.name not in PLASTIC else
        ": a user-defined law gives it by outputs(strain, history, stress); v.output(name) of a "
        "function of Values has what it gives now" if field.name in PLASTIC else ""))


def find_fields(fields: Any, beams: Sequence[Any] = ()) -> list[Field]:
    """The Fields of one or several names, functions or Fields; None for the default of beams."""
    if fields is None:
        yields = any("plastic_strain" in getattr(layer.material, "variables", ())
                     for beam in beams for layer in beam.across.layers)
        fields = (*DEFAULT, *PLASTIC) if yields else DEFAULT
    if isinstance(fields, (str, Field)) or callable(fields):
        fields = (fields,)
    if not isinstance(fields, (list, tuple)):
        raise InputError(f"fields must be a list of names or functions, got {shown(fields)}")
    found = [find_field(field) for field in fields]
    names = [field.name for field in found]
    refuse(len(set(names)) < len(names), "the fields must have different names, got {}", names)
    return found


class DomainValues(Values):
    """Fields at points x of a domain, with displacements u (2, n) and their gradient (2, 2, n), or
    :func:`~skfem_ancf.core.linear.step` of them; components are in global axes."""

    def __init__(self, domain: Domain, x: Array, u: Array, gradient: Array) -> None:
        self.beam: Any = domain
        self.cable = False
        self._start, self._u, self._H = x, u, gradient
        self._find, self._eigen, self._known, self.n = None, (), {}, x.shape[1]
        self._small = np.iscomplexobj(u) and not gradient.real.any()

    _shapeless = False

    @property
    def x(self) -> Array:
        return self._start

    @cached_property
    def u(self) -> Array:
        return first_order(self._u)

    @property
    def _strain(self):
        return displacement_strain(self._H)

    @property
    def _gradient(self):
        return self._H + self.frame

    @property
    def _stress(self):
        law = self.beam.material.reference()[0].law()
        return stress_of(law, self._strain) * grade_of(self.beam, self._start)

    @property
    def _remembers(self):
        return self.beam.material is None  # raises for user-defined forms

    @property
    def frame(self) -> Array:
        return np.broadcast_to(np.eye(2)[..., None], (2, 2, self.n))

    def of_materials(self, ask: Callable[[Any], Array], graded: bool = False) -> Array:
        found = ask(self.beam.material.reference()[0])
        return found * grade_of(self.beam, self._start) if graded else found


def values_on_grid(state: Any, beam: Beam, X: Array, recover: bool = True) -> Values:
    """Values at points (xi, eta) of all elements, (2, [nelements,] npoints), flattened."""
    known = hasattr(state, "values_of")
    number, s = (state.beams.index(beam), state.system.of(beam)) if known else (0, slice(beam.N))
    part = BeamPoints(beam, number, s, None, *points_of_grid(beam.mesh.nelements, X, None)[:2])
    return state.values_of(part, recover) if known else Values(part, state.u_of(beam))
