"""Eigenstrains: stress-free strains of temperature, swelling or actuation. The strain energy is W(E
- E0). For stress linear in the strain it is W(E) minus the work of ``S0 = D E0`` in the strain, a
load with the initial stress -S0. E0 is sampled and interpolated as the formulation does with E. For
other laws see :mod:`skfem_ancf.actions.eigenstrain`."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np
from numpy.polynomial.legendre import legvander

from ..beam import (Beam, Distribution, Layout, WhichBeam, element_dofs, entries_of, has_history,
                    remembers)
from ..beam.kernels.kernel import energy_at, fibre_points, strains, stresses_of
from ..beam.kernels.tables import CUSTOM, HISTORY, LINEAR, POINTWISE
from ..beam.strains import on_grid, strain_at, stretched
from ..core import (Array, InputError, TimeFunction, ask_array, refuse, require_finite_scalar,
                    require_function, retold, stress_of)
from ..formulations import COMPONENTS
from ..sections import Layer
from .item import Item, takes
from .loads import Amplitude, Load
from .symbols import Symbol, middle

# eigenstrains of nonlinear laws

#: Half the number of points across a layer, and round-off relative to the largest strain.
SECTION, ROUND_OFF = 6, 1e-12


def unmatched(beam: Beam, eigen: Any, layer: Any, X: Array, tind: Array | None = None) -> Array:
    """The part of eps_yy that a section develops freely and its element cannot represent."""
    # A section that bends freely under E0 has a linear eps_xx and S_yy = 0, thus eps_yy = E0_yy -
    # nu (eps_xx - E0_xx). It jumps between layers and may have any degree, while eps_yy of an
    # element is one polynomial. Without this part E0 causes no spurious S_yy.
    across, degree = beam.across, beam.element.order - 1
    x, y = across.coordinates(X, tind)
    if degree < 1:  # its Poisson coupling is to the mean over the section
        return np.zeros(x.shape)
    fit: Any = np.zeros((*x.shape, degree + 1, degree + 1))
    right, N, M, parts = np.zeros(fit.shape[:-1]), np.zeros(x.shape), np.zeros(x.shape), []
    for one, (eta, w) in across.rules(2 * SECTION):
        Z = np.stack([np.repeat(X[0], len(eta), -1),
                      np.broadcast_to(eta, (*X[0].shape, len(eta))).reshape(*X.shape[1:-1], -1)])
        shape = (*x.shape, len(eta))
        size = (np.tile(w, x.shape[1]) * beam.mesh.mapping().height(Z[0], tind)[0]
                * one.material.axial_modulus * across.breadth(one, Z, tind, times="grade"))
        size = np.broadcast_to(size, (len(x), Z.shape[-1])).reshape(shape)
        s, t = across.coordinates(Z, tind)
        E0 = eigen.of_layer(one, s, t).reshape(3, *shape)
        parts.append((size, t.reshape(shape), legvander(2.0 * eta - 1.0, degree), E0,
                      one.material.lateral_ratio))
        N += np.sum(size * E0[0], axis=-1)
        M += np.sum(size * E0[0] * parts[-1][1], axis=-1)
    EA, ES, EI = across.moments(X[0], tind)
    det = EA * EI - ES * ES
    mean, slope = (EI * N - ES * M) / det, (EA * M - ES * N) / det

    def free(y, mean, slope, E0, ratio):
        return E0[1] - ratio * (mean + slope * y - E0[0])

    largest = 0.0
    for size, t, P, E0, ratio in parts:
        yy = free(t, mean[..., None], slope[..., None], E0, ratio)
        largest = max(largest, float(np.max(np.abs(yy))))
        fit += np.einsum("enk,ki,kj->enij", size, P, P)
        right += np.einsum("enk,ki->eni", size * yy, P)
    c = np.linalg.solve(fit, right[..., None])[..., 0]
    out = free(y, mean, slope, eigen.of_layer(layer, x, y), layer.material.lateral_ratio) - np.sum(
        c * legvander(2.0 * np.broadcast_to(X[1], x.shape) - 1.0, degree), axis=-1)
    return np.where(np.abs(out) > ROUND_OFF * largest, out, 0.0)


#: Largest number of products.
MOST = 8


class EigenStrain(Load):
    """An eigenstrain E0: the stress is that of the strain E - E0.

    It is given in the beam's frame, along and across the axis. Of a cable only ``xx`` acts, as a
    stretch minus 1: its mean extends the axis and its gradient across bends it. With sections it is
    a Green-Lagrange strain.

    Parameters
    ----------
    xx, yy, xy
        eps_xx, eps_yy and eps_xy (not twice that): numbers, or functions of material coordinates
        (x, y), the parameter of the axis and the distance from it, as arrays of one shape; or of
        (x, y, t), with t = 1 in statics. None for zero.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.

    Other Parameters
    ----------------
    layer, x, y
        A :class:`~skfem_ancf.sections.Layer` and material coordinates, shape (...).
    X, e
        Reference points, shape (2, n, m), and their elements, shape (n,).
    u, factor
        Displacement of the beam's degrees of freedom, shape (N,); a factor on the strain.
    """

    constant = False
    prestress = True
    # of a bound one: strains (ns, ne) and weighted stresses (ne, ns) of each of the kernel's tables
    _strains: Any = None
    _stresses: Any = None
    #: True for nonlinear laws, whose forces are not proportional to the eigenstrain.
    grows = False
    # that in a motion
    _size = 1.0
    #: Arguments and their names in messages.
    given: ClassVar = {"xx": "eps_xx", "yy": "eps_yy", "xy": "eps_xy"}

    def __init__(self, xx: Any = None, yy: Any = None, xy: Any = None, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        if xx is None and yy is None and xy is None:
            raise InputError("an eigenstrain needs a component: give xx, yy or xy")
        self.xx, self.yy, self.xy = (f if f is None else _number_or_function(f"eps_{name}", f)
                                     for name, f in (("xx", xx), ("yy", yy), ("xy", xy)))

    def of_layer(self, layer: Layer, x: Array, y: Array) -> Array:
        """(eps_xx, eps_yy, 2 eps_xy) of a layer at coordinates x, y (...), shape (3, ...)."""
        factors = 1.0, 1.0, 2.0
        return np.array([c * _evaluated(f"eps_{name}", f, x, y) for c, name, f in zip(
            factors, COMPONENTS, (self.xx, self.yy, self.xy))])

    def expand(self, layout: Layout) -> Sequence[Item]:
        """Split functions of (x, y, t) into products of functions of place and of time."""
        k, beam = layout.number(self.beam), layout.beam(self.beam)
        given = {name: getattr(self, name) for name in self.given}
        timed = {name: f for name, f in given.items() if takes(f, 3)}
        out: list[Item] = []
        for name, f in timed.items():
            for g, c in products(self.given[name], f, beam, self.amplitude):
                only = {**dict.fromkeys(given), name: g}
                out.append(self._with(beam=k, amplitude=Amplitude(c), at_rest=c(1.0), **only))
        if not timed or any(f is not None for name, f in given.items() if name not in timed):
            out.append(self._with(beam=k, **dict.fromkeys(timed)))
        return out

    # the load

    def bind(self, beam: Beam) -> Load:
        bound = cast("EigenStrain", super().bind(beam))
        # elements that remember have the strain minus the eigenstrain
        bound._distribution = Distribution() if remembers(beam) else Distribution(eigen=bound)
        kernel = beam.kernel
        if not beam.has_sections:
            bound.eigen_stresses, bound._stresses = _of_fibres(beam, self)
            return bound
        bound._strains = []
        for one in kernel.integrals:  # where a term samples the strain, (ns, nelements)
            term, layer, rows = one.term, one.layer, []
            for row, name in enumerate(COMPONENTS):
                xi, eta = term.nodes(name), term.section_nodes
                X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
                values = self.of_layer(layer, *beam.across.coordinates(X))[row]
                rows.append(values - unmatched(beam, self, layer, X) if name == "yy" else values)
            bound._strains.append(np.concatenate(rows, axis=1).T)
        bound._stresses = list(map(stresses_of, kernel.elements, bound._strains))
        # nonlinear laws have the strains at the points in place of stresses
        bound.eigen_stresses = [
            stress if e.t.law.kind == LINEAR else e.at_points(E0)
            for e, E0, stress in zip(kernel.elements, bound._strains, bound._stresses)]
        bound.grows = any(t.law.kind in (POINTWISE, CUSTOM) for t in kernel.tables)
        bound._size = bound.at_rest if bound.grows else 1.0
        return bound

    def times(self, factor: float) -> Load:
        return super().times(factor)._with(_size=factor * self.at_rest if self.grows else 1.0)

    def factor_and_load(self, t: float | None) -> tuple[float, Load]:
        if not self.grows:
            return super().factor_and_load(t)
        one = self._thawed()
        one._size = self.factor(t)
        return 1.0, one

    def element_forces(self, u: Array, factor: float = 1.0) -> Array:
        """Element forces (nelements, nb, 2) at u (N,)."""
        return -self.beam.kernel.eigenstrain_forces([-factor * T for T in self.eigen_stresses], u)

    def small_forces(self, factor: float = 1.0) -> Array:
        """As :meth:`element_forces` at u = 0, linear in the strain."""
        if not self.grows and not remembers(self.beam):
            return self.element_forces(np.zeros(self.beam.N), factor)
        return self.beam.kernel.forces_of([factor * T for T in self._stresses],
                                          np.zeros(self.beam.N))

    def force(self, u: Array) -> Array:
        return self.beam.kernel.scatter(self.element_forces(u, self._size))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        kernel, stresses = self.beam.kernel, [-self._size * T for T in self.eigen_stresses]
        return -kernel.scatter(kernel.eigenstrain_forces(stresses, u0, u1))

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        K = self.beam.kernel.eigenstrain_tangents([-self._size * T for T in self.eigen_stresses], u)
        return *entries_of(element_dofs(self.beam)), -K.ravel()

    def potential(self, u: Array) -> float:
        if self._strains is not None:  # minus the integral of W(E) - W(E - factor E0)
            total, factor = 0.0, self._size
            for e, E0 in zip(self.beam.kernel.elements, self._strains):
                start, E = strains(e, 0.0 * u), strains(e, u)
                if e.t.law.kind == LINEAR:
                    total -= factor * float(np.sum(stresses_of(e, E0).T * (E - start)))
                elif e.t.law.kind != HISTORY:  # that is in its stored energy
                    W = [energy_at(e, e.at_points(x)) for x in (
                        E, E - factor * E0, start, start - factor * E0)]
                    total -= float(np.sum(W[0] - W[1]) - np.sum(W[2] - W[3]))
            return total
        strain = self.beam.kernel.strain(u)
        return -sum(float(np.sum(T.T * strain.reshape(-1, strain.shape[2])))
                    for t, T in zip(self.beam.kernel.tables, self.eigen_stresses)
                    if t.law.kind == LINEAR)

    # fields

    def strain_at(self, X: Array, e: Array) -> Array:
        """E0 at reference points X (2, n, m) of elements e (n,), shape (3, n, m)."""
        across = self.beam.across
        x, y = across.coordinates(X, e)
        which, out = np.broadcast_to(across.which(X, e), x.shape), np.empty((3, *x.shape))
        for k, layer in enumerate(across.layers):
            on = which == k
            out[:, on] = self.of_layer(layer, x[on], y[on])
        return out

    def stress_at(self, u: Array, X: Array, e: Array, factor: float = 1.0) -> Array:
        """Reduction of the stress at points, S(E) - S(E - factor E0), shape (3, n, m)."""
        beam, E0 = self.beam, self.strain_at(X, e)
        if not beam.has_sections:
            stretch, _ = stretched(on_grid(strain_at, beam, u, X, e)[0])
            return self.nominal_at(X, e, factor) / stretch
        which = np.broadcast_to(beam.across.which(X, e), E0.shape[1:])
        for k, layer in enumerate(beam.across.layers):
            E0[1] -= np.where(which == k, unmatched(beam, self, layer, X, e), 0.0)
        E = on_grid(strain_at, beam, u, X, e) if self.grows else 0.0 * factor * E0
        laws = [partial(stress_of, layer.law) for layer in beam.layers]
        return beam.across.of_layers(X, E, lambda k: 0.0 * E if has_history(beam, k) else
                                     laws[k](E) - laws[k](E - factor * E0), e)

    def nominal_at(self, X: Array, e: Array, factor: float = 1.0) -> Array:
        """Reduction of a cable's nominal stress, force per reference area, (3, n, m)."""
        E0 = factor * self.strain_at(X, e) * np.array([1.0, 0.0, 0.0])[:, None, None]
        layers = self.beam.across.layers
        return self.beam.across.of_layers(X, E0, lambda k: 0.0 * E0 if has_history(
            self.beam, k) else layers[k].material.axial_modulus * E0, e)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        for name in self.given:
            given, what = getattr(self, name), "ΔT" if name == "change" else f"eps_{name}"
            if callable(given):
                yield Symbol("eigenstrain", (middle(layout, self.beam),), text=f"{what}(x, y)")
            elif given is not None:
                yield Symbol("eigenstrain", (middle(layout, self.beam),), show=True,
                             text=f"{what} = ", value=given)


class Temperature(EigenStrain):
    """Thermal strain: a temperature change times the ``thermal_expansion`` of each material.

    Parameters
    ----------
    change
        Degrees from the reference configuration: a number, or a function of material coordinates
        (x, y), the parameter of the axis and the distance from it, as arrays of one shape; or of
        (x, y, t), with t = 1 in statics.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    """

    given: ClassVar = {"change": "the temperature"}

    def __init__(self, change: Any, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        Load.__init__(self, beam, amplitude)
        self.change = _number_or_function("the temperature", change)

    def bind(self, beam: Beam) -> Load:
        if not any(layer.material.thermal_expansion for layer in beam.across.layers):
            raise InputError(f"no material of {beam!r} expands with the temperature: give one a "
                             "thermal_expansion, as StVenantKirchhoff(..., thermal_expansion=1e-5)")
        return super().bind(beam)

    def of_layer(self, layer: Layer, x: Array, y: Array) -> Array:
        law = layer.material
        size = law.thermal_expansion * (1.0 + law.nu if law.plane == "strain" else 1.0)
        T = size * _evaluated("the temperature", self.change, x, y)
        return np.array([T, T, 0.0 * T])


def _number_or_function(name, value):
    if callable(value):
        return require_function(name, value, "of (x, y)")
    with retold(InputError, "{} must be a number or a function of (x, y), got {!r}", name, value):
        return require_finite_scalar(name, value)


def _evaluated(name, f, x, y):
    if not callable(f):
        return np.full(np.shape(x), 0.0 if f is None else f)
    return ask_array(f"{name}(x, y)", np.shape(x), f, x, y, number=True)


def _of_fibres(beam, eigen):
    """The kernel's arguments for a cable, and the linear stresses, a list for each table."""
    tables, across, xi = beam.kernel.tables, beam.across, beam.kernel.points
    together = len(tables) == 1 and tables[0].law.kind != HISTORY  # one table has all layers
    # normal forces and moments of each table, (2, ne, points)
    both = np.zeros((len(tables), 2, beam.mesh.nelements, len(xi)))
    given: list[Any] = [None] * len(tables)
    for number, (layer, (eta, w)) in enumerate(across.rules(8)):
        X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
        x, y = across.coordinates(X)
        size = (layer.material.axial_modulus * across.breadth(layer, X, times="grade")
                * beam.mesh.mapping().height(X[0])[0] * np.tile(w, len(xi)))
        S0, k = size * eigen.of_layer(layer, x, y)[0], 0 if together else number
        for out, moment in zip(both[k], (S0, -S0 * y)):
            out += moment.reshape(*out.shape, -1).sum(axis=-1)
        if tables[k].law.kind == HISTORY:
            E0 = eigen.of_layer(layer, *across.coordinates(fibre_points(layer, xi)[1]))[0]
            given[k] = (E0 + np.zeros((beam.mesh.nelements, 1))).T[None]
    stresses = [np.concatenate(one * beam.kernel.weights, axis=1) for one in both]
    return [s if E0 is None else E0 for s, E0 in zip(stresses, given)], stresses


# functions of time too


def products(name: str, function: Callable[..., Any], beam: Beam, amplitude: TimeFunction
             ) -> list[tuple[Callable[..., Any], Callable[..., Any]]]:
    """A function (x, y, t) as a sum of products of functions of (x, y) and of t, exact where such a
    sum exists: by empirical interpolation at some times and as many places (Barrault, Maday,
    Nguyen, Patera: "An empirical interpolation method", Comptes Rendus Mathematique 339 (2004)).
    Those of t are multiplied by the amplitude."""
    X = np.array(np.meshgrid(np.linspace(0.02, 0.97, 7), np.linspace(0.01, 0.98, 9))
                 ).reshape(2, -1)
    x, y = (c.ravel() for c in beam.across.coordinates(X))
    times = np.append(np.linspace(0.0, 1.0, 33), np.geomspace(1e-3, 1e3, 40) * 1.0371)
    at = [partial(_at_time, function, float(t)) for t in times]
    F = np.array([_evaluated(f"{name}(t={t:g})", f, x, y) for t, f in zip(times, at)])
    size, left, chosen, places = np.max(np.abs(F)), F.copy(), [], []
    while np.max(np.abs(left)) > 1e-9 * size:
        k, p = np.unravel_index(np.argmax(np.abs(left)), left.shape)
        chosen.append(k)
        places.append(p)
        refuse(len(chosen) > MOST, "{}(x, y, t) is no sum of at most {} functions of (x, y) times "
               "functions of t, as x * np.sin(t) is: give such a sum, or several eigenstrains with "
               "an amplitude each", name, MOST)
        left = F - np.linalg.solve(F[np.ix_(chosen, places)].T, F[:, places].T).T @ F[chosen]
    inverse = np.linalg.inv(F[np.ix_(chosen, places)])
    return [(at[k], partial(_factor, name, function, x[places], y[places], inverse[:, j],
                            amplitude)) for j, k in enumerate(chosen)]


def _at_time(function, t, x, y):
    return function(x, y, t)


def _factor(name, function, x, y, weights, amplitude, t):
    """The time factor of one product: weighted values of the function at some places."""
    if np.ndim(t):
        return np.array([_factor(name, function, x, y, weights, amplitude, s) for s in t])
    found = _evaluated(f"{name}(t={t:g})", partial(_at_time, function, float(t)), x, y)
    return float(found @ weights) * (1.0 if amplitude is None else amplitude(t))
