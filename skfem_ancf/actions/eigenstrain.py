"""Strains that a body would have without stress: of temperature, growth, muscles.

The potential energy is W(E - E0). For stress linear in the strain this is W(E) less the work of
``S0 = D E0`` in the strain, which is a load: the body is pushed apart by stresses S0. They enter at
the points of integration, E0 sampled and interpolated there as the formulation does E. Other laws:
:mod:`skfem_ancf.actions.nonlinear_eigenstrain`.
"""

from __future__ import annotations

import inspect
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from scipy import sparse

from ..core.errors import InputError, ask_array, require_finite_scalar, require_function, shown
from ..formulations import COMPONENTS
from .nonlinear_eigenstrain import energy_lost, sampled, unmatched
from ..beam.strains import on_grid, strain_at, stretched
from ..beam.kernels.base import GIVEN, MEAN, apart, no_stresses, nowhere
from ..beam.kernels.law import LINEAR
from ..beam.kernels.section import linearised
from ..core.linear import first_order, step, stress_of
from .item import Item
from .loads import Load
from ..beam.distribution import Spread

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..beam.beam import Beam
    from ..sections import Layer
    from ..core.types import Array, TimeFunction
    from ..beam.layout import Layout, WhichBeam

#: Products of a function of place and one of time that a function of both may be.
MOST = 8

#: How well they have to give it, relative to its largest value.
CLOSE = 1e-9


class EigenStrain(Load):
    """A stress-free strain: the elastic strain is what is left of E.

    It is given in the beam's frame, along the axis and across it. Of a cable only ``xx`` acts: its
    mean stretches the axis, and its slope across bends it. There it is the stretch minus 1 that a
    fibre has without stress; of sections it is that of Green and Lagrange.

    Parameters
    ----------
    xx, yy, xy
        eps_xx, eps_yy and eps_xy (not twice that): numbers, or functions of material coordinates x,
        the parameter of the axis, and y, the distance from it, arrays of one shape; or of
        (x, y, t), which statics take at t = 1. None for zero.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    """

    constant = False
    linear = True
    prestress = True
    # of a bound one: a matrix for each element, with sections
    _elements: Any = None
    _matrix: Any = None
    _spread: Any = None
    #: True under laws that are not linear: what it does is not in proportion to its size.
    grows = False
    # that in a motion
    _size = 1.0
    #: What is given, and what messages call it.
    given: ClassVar = {"xx": "eps_xx", "yy": "eps_yy", "xy": "eps_xy"}

    def __init__(self, xx: Any = None, yy: Any = None, xy: Any = None, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        if xx is None and yy is None and xy is None:
            raise InputError("a stress-free strain has a component: give xx, yy or xy")
        self.xx, self.yy, self.xy = (_number_or_function(f"eps_{name}", f) for name, f in (
            ("xx", xx), ("yy", yy), ("xy", xy)))

    def of_layer(self, layer: Layer, x: Array, y: Array) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) of a layer of a section at material coordinates.

        Parameters
        ----------
        layer
            A :class:`~skfem_ancf.sections.Layer`.
        x, y
            Coordinates, shape (...).

        Returns
        -------
        ndarray
            Shape (3, ...).
        """
        factors = 1.0, 1.0, 2.0
        return np.array([c * _asked(f"eps_{name}", f, x, y) for c, name, f in zip(
            factors, COMPONENTS, (self.xx, self.yy, self.xy))])

    def expand(self, layout: Layout) -> Sequence[Item]:
        """Products of functions of place and of time, and what does not depend on time."""
        k, beam = layout.number(self.beam), layout.beam(self.beam)
        given = {name: getattr(self, name) for name in self.given}
        timed = {name: f for name, f in given.items() if takes_time(f)}
        out: list[Item] = []
        for name, f in timed.items():
            for g, c in products(self.given[name], f, beam):
                only = {**dict.fromkeys(given), name: g}
                out.append(self._with(beam=k, amplitude=c.times(self.amplitude), **only))
        if not timed or any(f is not None for name, f in given.items() if name not in timed):
            out.append(self._with(beam=k, **dict.fromkeys(timed)))
        return out

    # the load

    def bind(self, beam: Beam) -> Load:
        bound = cast("EigenStrain", super().bind(beam))
        bound._spread = Spread(eigen=bound)
        function = getattr(self.amplitude, "function", None)
        if isinstance(function, Coefficient):
            bound.at_rest = function(1.0)
        if beam.has_sections and any(t.pack.law.kind != LINEAR for t in beam.kernel.tables):
            bound.pushes = [sampled(beam, table, self) for table in beam.kernel.tables]
            bound.grows, bound.linear, bound._size = True, False, bound.at_rest
        elif beam.has_sections:
            K = _pushed_apart(beam, self)
            bound._elements, bound.linear = K, True
            i, j = _entries(beam)
            bound._matrix = sparse.coo_matrix((K.ravel(), (i.ravel(), j.ravel())),
                                              shape=(beam.N, beam.N)).tocsr()
        else:
            bound.pushes, bound.linear = [_resultants(beam, self)], False
        return bound

    @property
    def alone(self) -> bool:
        """True if what it does depends on other stress-free strains of its beam."""
        return self.grows

    def acting(self, t: float | None) -> tuple[float, Load]:
        if not self.grows:
            return super().acting(t)
        one = self._thawed()
        one._size = self.factor(t)
        return 1.0, one

    def element_forces(self, u: Array, factor: float = 1.0) -> Array:
        """The forces on the coordinates of each element.

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        factor
            On the strain.

        Returns
        -------
        ndarray
            Shape (nelements, nb, 2).
        """
        beam = self.beam
        u_e = beam.kernel.gather(u)
        if self._elements is not None:
            q = beam.kernel.gather(beam.q0_local) + u_e
            return factor * np.einsum("eij,ej->ei", self._elements,
                                      q.reshape(len(q), -1)).reshape(q.shape)
        u = np.ascontiguousarray(u_e).ravel()
        return self._pushed(GIVEN, u, u, factor, self._apart()).reshape(u_e.shape)

    def small_forces(self, factor: float = 1.0) -> Array:
        """As :meth:`element_forces` without displacement, linear in the strain."""
        if not self.grows:
            return self.element_forces(np.zeros(self.beam.N), factor)
        kernel = self.beam.kernel
        u = np.zeros(kernel.gather(np.zeros(self.beam.N)).shape, dtype=complex)
        packs = [linearised(pack) for pack in self._apart()]
        return first_order(self._pushed(GIVEN, u.ravel(), u.ravel(), step(0.0, factor), packs)
                           ).reshape(u.shape)

    def _apart(self):
        """The packs of :attr:`pushes`, each element with coordinates of its own."""
        return [apart(pack, slice(None)) for pack in self.beam.kernel.pushed_packs()]

    def _pushed(self, what, u, v, factor, packs):
        """The force, or the mean force, of :attr:`pushes` times a factor."""
        out = np.zeros_like(u)
        for pack, given in zip(packs, self.pushes):
            self.beam.kernel.texts.evaluate(pack, what, u, v, out, -factor * given,
                                            no_stresses(pack), nowhere(out))
        return -out

    def force(self, u: Array) -> Array:
        if self._matrix is not None:
            return self._matrix @ (self.beam.q0_local + u)
        return self.beam.kernel.scatter(self.element_forces(u, self._size))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        if self._matrix is not None:
            return super().mean_force(u0, u1)
        return self._pushed(MEAN, u0, u1, self._size, self.beam.kernel.pushed_packs())

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        if self._matrix is not None:
            A = self._matrix.tocoo()
            return A.row, A.col, A.data
        kernel = self.beam.kernel
        K = kernel.tangents_of(self._apart(), kernel.gather(u),
                               [-self._size * given for given in self.pushes])
        rows, columns = _entries(self.beam)
        return rows.ravel(), columns.ravel(), -K.ravel()

    def potential(self, u: Array) -> float:
        if self.grows:
            return energy_lost(self.beam, 0.0 * u, self.pushes, self._size) - energy_lost(
                self.beam, u, self.pushes, self._size)
        if self._matrix is not None:
            return -float(u @ (self._matrix @ (self.beam.q0_local + 0.5 * u)))
        kernel = self.beam.kernel
        return -float(np.sum(kernel.packs[0].weights * self.pushes[0] * kernel.strain(
            kernel.gather(u))))

    def spread(self, u: Array) -> Spread:
        return self._spread

    # fields

    def strain_at(self, X: Array, e: Array) -> Array:
        """E0 at points, shape (3, n, m).

        Parameters
        ----------
        X, e
            Reference points (2, n, m) and their elements (n,).
        """
        across = self.beam.across
        x, y = across.coordinates(X, e)
        which, out = np.broadcast_to(across.which(X, e), x.shape), np.empty((3, *x.shape))
        for k, layer in enumerate(across.layers):
            on = which == k
            out[:, on] = self.of_layer(layer, x[on], y[on])
        return out

    def stress_at(self, u: Array, X: Array, e: Array, factor: float = 1.0) -> Array:
        """What the stress is less by at points, S(E) - S(E - factor E0), shape (3, n, m).

        Parameters
        ----------
        u
            Displacement of the coordinates, shape (N,).
        X, e
            Reference points (2, n, m) and their elements (n,).
        factor
            On the strain.
        """
        beam, E0 = self.beam, self.strain_at(X, e)
        if not beam.has_sections:
            stretch, _ = stretched(on_grid(strain_at, beam, u, X, e)[0])
            return self.nominal_at(X, e, factor) / stretch
        which = np.broadcast_to(beam.across.which(X, e), E0.shape[1:])
        for k, layer in enumerate(beam.across.layers):  # what acts on the elements
            E0[1] -= np.where(which == k, unmatched(beam, self, layer, X, e), 0.0)
        E = on_grid(strain_at, beam, u, X, e) if self.grows else 0.0 * factor * E0
        laws = [partial(stress_of, layer.law) for layer in beam.layers]
        return beam.across.of_layers(
            X, E, [lambda law=law: law(E) - law(E - factor * E0) for law in laws], e)

    def nominal_at(self, X: Array, e: Array, factor: float = 1.0) -> Array:
        """What the nominal stress of a cable, force per stress-free area, is less by, (3, n, m).

        Parameters
        ----------
        X, e, factor
            As for :meth:`stress_at`, shapes (2, n, m) and (n,).
        """
        E0 = factor * self.strain_at(X, e) * np.array([1.0, 0.0, 0.0])[:, None, None]
        return self.beam.across.of_layers(X, E0, [
            lambda layer=layer: layer.material.axial_modulus * E0
            for layer in self.beam.across.layers], e)


class Temperature(EigenStrain):
    """The stress-free strain of a temperature: that of each material's ``thermal_expansion``.

    Parameters
    ----------
    change
        In degrees from the stress-free state: a number, or a function of material coordinates x,
        the parameter of the axis, and y, the distance from it, arrays of one shape; or of
        (x, y, t), which statics take at t = 1.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    """

    given: ClassVar = {"change": "the temperature"}

    def __init__(self, change: Any, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        Load.__init__(self, beam, amplitude)
        self.change = _number_or_function("the temperature", change, False)

    def bind(self, beam: Beam) -> Load:
        if not any(layer.material.thermal_expansion for layer in beam.across.layers):
            raise InputError(f"no material of {beam!r} expands with the temperature: give one a "
                             "thermal_expansion, as StVenantKirchhoff(..., thermal_expansion=1e-5)")
        return super().bind(beam)

    def of_layer(self, layer: Layer, x: Array, y: Array) -> Array:
        law = layer.material
        size = law.thermal_expansion * (1.0 + law.nu if law.plane == "strain" else 1.0)
        T = size * _asked("the temperature", self.change, x, y)
        return np.array([T, T, 0.0 * T])


def _number_or_function(name, value, optional=True):
    if value is None and optional:
        return None
    if callable(value):
        return require_function(name, value, "of (x, y)")
    try:
        return require_finite_scalar(name, value)
    except InputError as error:
        raise InputError(f"{name} must be a number or a function of (x, y), got {shown(value)}"
                         ) from error


def _asked(name, f, x, y):
    """A number or a function of material coordinates, at arrays of one shape."""
    if not callable(f):
        return np.full(np.shape(x), 0.0 if f is None else f)
    return ask_array(f"{name}(x, y)", np.shape(x), f, x, y, number=True)


def require_alone(loads: Sequence[Any]) -> None:
    """Raise InputError where two stress-free strains of one beam do not add up.

    Parameters
    ----------
    loads
        Loads, bound.
    """
    beams = [load.beam for load in loads if isinstance(load, EigenStrain)]
    for load in loads:
        if getattr(load, "alone", False) and sum(beam is load.beam for beam in beams) > 1:
            raise InputError(
                f"{load.beam!r} has a stress that is not linear in the strain, so its stress-free "
                "strains do not add up: give their sum as one eigenstrain, a function of (x, y) "
                "or one product of it and a function of t")


def _entries(beam):
    """Rows and columns of the matrices of all elements, shape (nelements, 2 nb, 2 nb) each."""
    dofs = beam.mesh.t[0][:, None] * beam.nd + np.arange(2 * beam.nd)
    return np.broadcast_arrays(dofs[:, :, None], dofs[:, None])


def _pushed_apart(beam, eigen):
    """The derivative of the forces of the stresses S0: constant matrices of the elements."""
    kernel, ne, parts = beam.kernel, beam.mesh.nelements, []
    for table in kernel.tables:
        pack = table.pack
        S0 = np.einsum("cd,dpe->epc", pack.law.D, sampled(beam, table, eigen)) * np.broadcast_to(
            pack.weights.T, (ne, len(pack.weights)))[..., None]
        parts.append(S0.transpose(0, 2, 1).reshape(ne, -1))
    stress, nb = np.concatenate(parts, axis=1), beam.nd // 2
    return np.concatenate([kernel.geometric(np.zeros((part.stop - part.start, 2 * nb, 2)), part,
                                            stress[part])
                           for part in (slice(k.start, min(k.stop, ne)) for k in kernel.chunks())])


def _resultants(beam, eigen):
    """Normal forces and moments of a cable that a strain would take, (2, points, elements)."""
    xi = beam.kernel.points
    out = np.zeros((2, beam.mesh.nelements, len(xi)))
    across = beam.across
    for layer, (eta, w) in across.rules(8):
        X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
        x, y = across.coordinates(X)
        size = (layer.material.axial_modulus * across.breadth(layer, X, times="grade")
                * beam.mesh.mapping().height(X[0])[0] * np.tile(w, len(xi)))
        S0 = size * eigen.of_layer(layer, x, y)[0]
        for k, moment in enumerate((S0, -S0 * y)):
            out[k] += moment.reshape(*out[k].shape, -1).sum(axis=-1)
    return np.ascontiguousarray(out.transpose(0, 2, 1))


# functions of time too


def takes_time(function: Any) -> bool:
    """True if a function takes three arguments, x, y and t."""
    if not callable(function):
        return False
    try:
        kinds = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    return sum(p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
               for p in kinds) == 3


def products(name: str, function: Callable[..., Any], beam: Beam
             ) -> list[tuple[Callable[..., Any], Coefficient]]:
    """A function (x, y, t) as a sum of functions of (x, y) times functions of t.

    Found by empirical interpolation: the function at some times, and its values at as many places
    as the factors; exact for what is such a sum.

    Parameters
    ----------
    name
        For messages.
    function
        Takes arrays x and y of one shape, and a time.
    beam
        The :class:`~skfem_ancf.Beam` on which it is wanted.

    Returns
    -------
    list
        Pairs of a function of place and one of time.

    Raises
    ------
    InputError
        If it takes more than a few products.

    References
    ----------
    Barrault, Maday, Nguyen, Patera: "An empirical interpolation method", Comptes Rendus
    Mathematique 339 (2004).
    """
    X = np.array(np.meshgrid(np.linspace(0.02, 0.97, 7), np.linspace(0.01, 0.98, 9))
                 ).reshape(2, -1)
    x, y = (c.ravel() for c in beam.across.coordinates(X))
    times = np.append(np.linspace(0.0, 1.0, 33), np.geomspace(1e-3, 1e3, 40) * 1.0371)
    at = [_at(function, t) for t in times]
    F = np.array([_asked(f"{name}(t={t:g})", f, x, y) for t, f in zip(times, at)])
    size, left, chosen, places = np.max(np.abs(F)), F.copy(), [], []
    while np.max(np.abs(left)) > CLOSE * size:
        k, p = np.unravel_index(np.argmax(np.abs(left)), left.shape)
        chosen.append(k)
        places.append(p)
        if len(chosen) > MOST:
            raise InputError(
                f"{name}(x, y, t) is no sum of at most {MOST} functions of (x, y) times functions "
                "of t, as x * np.sin(t) is: give such a sum, or several eigenstrains with an "
                "amplitude each")
        left = F - np.linalg.solve(F[np.ix_(chosen, places)].T, F[:, places].T).T @ F[chosen]
    inverse = np.linalg.inv(F[np.ix_(chosen, places)])
    return [(at[k], Coefficient(name, function, x[places], y[places], inverse[:, j]))
            for j, k in enumerate(chosen)]


def _at(function, t):
    return _AtTime(function, float(t))


class _AtTime:
    """A function (x, y, t) at one time."""

    def __init__(self, function, t):
        self.function, self.t = function, t

    def __call__(self, x, y):
        return self.function(x, y, self.t)


class Coefficient:
    """The factor of one product as a function of time.

    Parameters
    ----------
    name, function
        For messages, and the function (x, y, t).
    x, y, weights
        Places at which it is asked, and what its values there are multiplied by, shape (k,).
    amplitude
        Another factor, a function of time, or None.
    """

    def __init__(self, name: str, function: Callable[..., Any], x: Array, y: Array,
                 weights: Array, amplitude: TimeFunction = None) -> None:
        self.name, self.function, self.x, self.y, self.weights = name, function, x, y, weights
        self.amplitude = amplitude

    def times(self, amplitude: TimeFunction) -> Coefficient:
        """The product with a function of time."""
        return Coefficient(self.name, self.function, self.x, self.y, self.weights, amplitude)

    def __call__(self, t):
        if np.ndim(t):
            return np.array([self(s) for s in t])
        found = _asked(f"{self.name}(t={t:g})", _AtTime(self.function, float(t)), self.x, self.y)
        return float(found @ self.weights) * (1.0 if self.amplitude is None else self.amplitude(t))
