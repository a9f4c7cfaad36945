"""User-defined energy densities, their derivatives, and loads given by densities."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..beam import (AXIS, BODY, LEFT, RIGHT, UPPER, Beam, Distribution, Layout, Sampled, WhichBeam,
                    element_dofs, entries_of, groups_of, points_along, surfaces_of)
from ..core import (Array, ArrayLike, InputError, NameUnknown, Place, TimeFunction, along, ask,
                    gauss, product_rule, refuse, require_finite, require_flag, require_function,
                    require_module, require_slope, retold)
from .bound import at_generic_displacements
from .item import Item
from .loads import Load

# loads given by densities at points, for all local functions at once

#: Component and derivative (0: r, then the slopes) of r_0, r_1, F_00, F_01, F_10, F_11.
VARIABLES = np.array([[0, 2, 3], [1, 4, 5]])


class DensityPoints(NamedTuple):
    """Quadrature points of n elements or facets. ``dofs`` (n, 2 nb), material points ``X`` (2, n,
    np), ``weights`` (n, np), values and both derivatives of the local ``functions`` (n, nb, np, 3),
    and additional data ``of``."""

    dofs: Array
    X: Array
    weights: Array
    functions: Array
    of: Any = None


def points_of(beam: Beam, elements: Array, X: Array, weights: Array, of: Any) -> DensityPoints:
    """DensityPoints at reference points of elements of a beam."""
    mapping = beam.mesh.mapping()
    N, grad = beam.element.functions(mapping, X, elements)
    both = np.stack(np.broadcast_arrays(N, grad[:, 0], grad[:, 1]), axis=-1)
    return DensityPoints(element_dofs(beam, elements), np.asarray(mapping.F(X, elements)), weights,
                         np.ascontiguousarray(both.swapaxes(0, 1)), of)


class Density(Load):
    """A load defined by the derivative of a density with respect to r and F.

    The six variables ``y``, (6, n, np), are r_0, r_1, F_00, F_01, F_10, F_11. A subclass defines
    ``_slope(y, part)``, the derivatives of the density, (6, n, np), and ``_curvature(y, part)``,
    the second derivatives (6, 6, n, np), the differentiation last. ``_parts`` are the
    :class:`DensityPoints`, known once bound.
    """

    constant = False
    first_order = True
    # of a subclass
    _slope: Any
    _curvature: Any
    # of a bound one
    _parts: Sequence[DensityPoints]
    _time = 0.0

    def factor_and_load(self, t: float | None) -> tuple[float, Load]:
        return self.factor(t), self if t is None else self._with(_time=float(t))

    def _variables(self, u, part):
        """The six variables at points, shape (6, n, np)."""
        n, nb, points, _ = part.functions.shape
        moved = part.functions.reshape(n, nb, -1).swapaxes(1, 2) @ u[part.dofs].reshape(n, nb, 2)
        moved = moved.reshape(n, points, 3, 2).transpose(3, 2, 0, 1)
        y = np.empty((6, n, points), dtype=moved.dtype)
        y[VARIABLES] = moved
        y[:2] += part.X
        y[2] += 1.0
        y[5] += 1.0
        return y

    def _force(self, P, part):
        """Force (N,) of derivatives P (6, n, np) at the points."""
        n, nb = part.functions.shape[:2]
        P = (P * part.weights)[VARIABLES].transpose(2, 3, 1, 0).reshape(n, -1, 2)
        out = np.zeros(self.beam.N)
        np.add.at(out, part.dofs, -(part.functions.reshape(n, nb, -1) @ P).reshape(n, -1))
        return out

    def force(self, u: Array) -> Array:
        return sum((self._force(self._slope(self._variables(u, part), part), part)
                    for part in self._parts), np.zeros(self.beam.N))

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        rows, columns, values = [], [], []
        for part in self._parts:
            n, nb, points, _ = part.functions.shape
            A = self._curvature(self._variables(u, part), part) * part.weights
            A = A[VARIABLES[:, :, None, None], VARIABLES].transpose(4, 5, 0, 1, 2, 3)
            T = part.functions
            AT = A.reshape(n, points, 12, 3) @ T.transpose(0, 2, 3, 1)  # (n, np, (i, k, j), nb)
            AT = AT.reshape(n, points, 2, 3, 2, nb).transpose(0, 1, 3, 2, 5, 4)
            K = T.reshape(n, nb, -1) @ AT.reshape(n, 3 * points, -1)  # (n, nb, (i, b, j))
            i, j = entries_of(part.dofs)
            rows.append(i)
            columns.append(j)
            values.append(-K.ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)


# derivatives of densities given at a point, by Numba or by JAX

#: Complex step, and step of differences relative to a variable.
IMAGINARY, REAL = 1e-30, 1e-5


@lru_cache(32)
def by_jax(psi: Callable[..., Any]) -> dict[str, Callable[..., Any]]:
    """A density in JAX and its derivatives."""
    jax = require_module("jax", "autodiff")
    from jax import experimental
    double = jax.enable_x64 if hasattr(jax, "enable_x64") else experimental.enable_x64

    def one(y, X, t):
        return psi(y[:2], y[2:].reshape(2, 2), X, t)

    def at_points(function):
        found = jax.jit(jax.vmap(function, (1, 1, None), -1))

        def of(r, F, X, t):
            y = np.concatenate([r, F.reshape(4, *r.shape[1:])])
            with double(True):
                out = np.asarray(found(y.reshape(6, -1), X.reshape(2, -1), t))
            return out.reshape(*out.shape[:-1], *r.shape[1:])

        return of

    return {"psi": at_points(one), "gradient": _in_two(at_points(jax.grad(one))),
            "hessian": at_points(jax.hessian(one))}


def _in_two(gradient):
    """Split a gradient by all six variables into those by r and F."""
    def of(r, F, X, t):
        out = gradient(r, F, X, t)
        return out[:2], out[2:].reshape(F.shape)

    return of


@lru_cache(32)
def by_loops(psi: Any, gradient: Any, hessian: Any,
             height: float) -> dict[str, Callable[..., Any]]:
    """Compiled functions of one point as functions of arrays, with missing derivatives of psi."""
    # First derivatives are complex steps, second ones differences of these, with steps relative to
    # the height.
    from numba import njit

    steps = REAL * np.array([height] * 2 + [1.0] * 4)

    def stepped(r, F, x, t, z, first, out):
        for k in range(first, 6):
            kept = z[k]
            z[k] += 1j * IMAGINARY
            out[k] = complex(psi(r, F, x, t)).imag / IMAGINARY
            z[k] = kept

    def density(r, F, x, t, z, first, out):
        out[0] = psi(r, F, x, t)

    def given(r, F, x, t, z, first, out):
        out[:2], b = gradient(r, F, x, t)
        out[2:] = b.copy().reshape(4)

    def curvature(r, F, x, t, z, first, out):
        out[:] = hessian(r, F, x, t).copy().reshape(36)

    def differences(r, F, x, t, z, first, out):
        a = np.empty((2, 6))
        for k in range(6):
            kept = z[k]
            for side in range(2):
                z[k] = kept + (2 * side - 1) * steps[k]
                slope_of(r, F, x, t, z, k, a[side])
            z[k] = kept
            for i in range(k, 6):
                out[6 * i + k] = out[6 * k + i] = 0.5 * (a[1, i] - a[0, i]) / steps[k]

    slope = stepped if gradient is None else given
    slope_of, kind = njit(slope), complex if gradient is None else float

    def at_points(function, shape, dtype):
        one, size = njit(function), int(np.prod(shape))

        @njit(error_model="numpy")
        def loop(y, X, t, z, x, out):
            r, F = z[:2], z[2:].reshape(2, 2)
            for p in range(y.shape[1]):
                z[:], x[:] = y[:, p], X[:, p]
                one(r, F, x, t, z, 0, out[p])

        def of(r, F, X, t):
            y = np.concatenate([r, F.reshape(4, *r.shape[1:])]).reshape(6, -1)
            out = np.empty((y.shape[1], size))
            loop(y, X.reshape(2, -1), float(t), np.empty(6, dtype), np.empty(2), out)
            return out.T.reshape(*shape, *r.shape[1:])

        return of

    return {"psi": at_points(density, (), float),
            "gradient": _in_two(at_points(slope, (6,), kind)),
            "hessian": at_points(differences, (6, 6), kind) if hessian is None else
            at_points(curvature, (6, 6), float)}


#: Where an energy acts beside places of the boundary.
EVERYWHERE = "cells", "axis"
_LOWER = np.tril_indices(6)


class Energy(Density):
    """A user-defined energy density, with derivatives by complex steps, JAX or given functions.

    ``psi(r, F, X, t)`` is the energy per reference volume, per area of a side or an end, or per
    length of the axis. It is evaluated at many points at once:

    * ``r``: the position, shape (2, nelements, npoints),
    * ``F``: the deformation gradient, ``F[i, j] = d r_i / d X_j``, (2, 2, nelements, npoints),
    * ``X``: the position in the reference configuration, (2, nelements, npoints),
    * ``t``: the time of a motion; 0 in statics.

    The integral over the body, a side or an end includes the width of the beam; a form of
    scikit-fem, in ``scene.load(form)``, is not multiplied by the width.

    Load factors scale it, as they scale gravity, and ``scene.buckling()`` finds the critical
    factor; with ``scaled=False`` it acts in full, as an elastic foundation does. The
    energy-momentum scheme conserves the total energy. It acts on elements with sections.

    A psi compiled by ``numba.njit`` is called for one point at a time, with arrays of shapes (2,),
    (2, 2), (2,) and the time, and returns a number.

    Parameters
    ----------
    psi
        The density; returns numbers of shape (nelements, npoints).
    gradient
        Returns d psi / d r, (2, ...), and d psi / d F, (2, 2, ...), of the same arguments. By
        default by complex steps, for which psi must accept complex r and F.
    hessian
        Returns the second derivatives, (6, 6, ...), by r_0, r_1, F_00, F_01, F_10, F_11. By default
        by complex steps of the gradient, or by differences of complex steps of psi.
    over
        "cells" for the body, "axis", or a place: "top", "bottom", "left", "right", see
        :func:`skfem_ancf.mesh.places.facets_of`.
    beam
        Beam, name or number; None for all, or for a place in a scene with one beam.
    amplitude
        Factor as a function of time.
    scaled
        False for an energy that load factors do not scale. In statics its time is then the load
        factor, as for springs.
    autodiff
        psi is written in ``jax.numpy`` for one point, and JAX differentiates it. Needs the extra
        "autodiff".
    check
        Raise InputError if psi changes under rigid motions; a strain energy does not.

    Raises
    ------
    InputError
        When it is added, if psi or a derivative has the wrong shape or is not finite, or if the
        derivatives are not those of psi.

    Examples
    --------
    A beam in a soft elastic medium:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, Energy, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(beam).clamp("left").gravity((0, -9.81))
    >>> scene = scene.add(Energy(lambda r, F, X, t: 1e6 * ((r - X)**2).sum(axis=0)))
    >>> bool(-0.04 < scene.solve_static().displacement((1, 0))[1] < -0.03)
    True

    References
    ----------
    Squire, Trapp: "Using complex variables to estimate derivatives of real functions", SIAM Review
    40 (1998); Gonzalez: "Time integration and discrete Hamiltonian systems", Journal of Nonlinear
    Science 6 (1996).
    """

    def __init__(self, psi: Callable[..., Any], gradient: Callable[..., Any] | None = None,
                 hessian: Callable[..., Any] | None = None, over: Place = "cells",
                 beam: WhichBeam = None, amplitude: TimeFunction = None, scaled: bool = True,
                 autodiff: bool = False, check: bool = False) -> None:
        super().__init__(beam, amplitude)
        require_function("psi", psi, "of r, F, X and t")
        given = {"gradient": gradient, "hessian": hessian}
        for name, function in given.items():
            if function is not None:
                require_function(name, function, "of r, F, X and t")
                if autodiff or hasattr(psi, "py_func") > hasattr(function, "py_func"):
                    raise InputError(f"autodiff=True finds the {name}: leave it out" if autodiff
                                     else f"psi is compiled by Numba: the {name} has to be, too")
        self.scaled, self.check = require_flag("scaled", scaled), require_flag("check", check)
        refuse(amplitude is not None and not scaled, "an amplitude is for loads, and scaled=False "
               "excludes it: let psi depend on its time t")
        self.psi, self.gradient, self.hessian, self.over = psi, gradient, hessian, over
        self.autodiff = require_flag("autodiff", autodiff)

    def expand(self, layout: Layout) -> Sequence[Item]:
        which = range(len(layout.beams)) if self.beam is None and _everywhere(self.over) else [
            layout.number(self.beam)]
        return [self._with(beam=k) for k in which]

    def bind(self, beam: Beam) -> Any:
        if not getattr(beam, "has_sections", False):
            raise InputError(f"an Energy acts on elements with sections, as ElementBeamANCF(2), "
                             f"with positions linear in the degrees of freedom; not on {beam!r}")
        bound = self._with(beam=beam, _parts=self._points(beam))
        at_generic_displacements(bound._require_derivatives, beam.sizes)
        if not self.check:
            return bound
        shift, Q = beam.size * np.array([0.7, -0.4]), np.array([[0.6, -0.8], [0.8, 0.6]])
        for part in bound._parts:
            y = bound._variables(1e-2 * beam.sizes * np.cos(np.arange(beam.N)), part)
            moved = y.copy()
            moved[:2] += shift[:, None, None]
            turned = np.concatenate([moved[:2], np.einsum(
                "ij,jk...->ik...", Q, y[2:].reshape(2, 2, *y.shape[1:])).reshape(y[2:].shape)])
            psi, *others = (bound._density(x, part) for x in (y, moved, turned))
            for what, other in zip(("moved", "turned"), others):
                refuse(np.max(np.abs(other - psi)) > 1e-9 * np.max(np.abs(psi)),
                       "psi of {!r} changes where the body is {} as a whole: it is not a strain "
                       "energy, which depends on F^T F. Leave out check=True for external actions, "
                       "as a foundation or a field", bound, what)
        return bound

    def _points(self, beam: Beam) -> list[DensityPoints]:
        """Points of the cells, the axis or a place of a beam; of each the location BODY, AXIS, a
        face or -1, the elements (n,), and the rule."""
        over, out, every = self.over, [], np.arange(beam.mesh.nelements)
        if not _everywhere(over):
            rule = gauss(beam.element.facet_points + 1)
            try:
                surfaces = surfaces_of(beam, over, len(rule[0]))
            except NameUnknown as error:
                raise NameUnknown("place", error.name, EVERYWHERE + error.known) from None
            return [points_of(beam, one.elements, one.X, one.areas, (
                -1 if one.side in (LEFT, RIGHT) else one.side // UPPER, one.elements, rule))
                for one in surfaces]
        xi, w = gauss(points_along(beam) + 1)
        if over == "axis":
            X = np.array([xi, 0.5 + 0.0 * xi])
            lengths = np.sqrt(np.sum(beam.mesh.mapping().DF(X)[:, 0] ** 2, axis=0))
            return [points_of(beam, every, X, lengths * w, (AXIS, every, (xi, w)))]
        for layer, section in beam.across.rules(beam.element.order + 1, inertia=True):
            X, W = product_rule((xi, w), section)
            weights = np.broadcast_to(beam.across.volume(layer, X, W, every, full=True),
                                      (len(every), len(W)))
            out.append(points_of(beam, every, X, weights, (BODY, every, (xi, section[0]))))
        return out

    # the density and its derivatives at the six variables y, (6, n, np)

    @property
    def _functions(self):
        if self.autodiff:
            return by_jax(self.psi)
        if hasattr(self.psi, "py_func"):
            return by_loops(self.psi, self.gradient, self.hessian, self.beam.mesh.height)
        return {"psi": self.psi, "gradient": self.gradient, "hessian": self.hessian}

    def _ask(self, name, y, part, times=1):
        X = np.tile(part.X, (1, times, 1)) if times > 1 else part.X
        return ask(f"{name}(r, F, X, t) of an Energy", self._functions[name], y[:2],
                   y[2:].reshape(2, 2, *y.shape[1:]), X, self._time)

    def _density(self, y, part):
        flat = y.reshape(6, -1, y.shape[-1])
        found = self._ask("psi", flat, part, flat.shape[1] // part.X.shape[1])
        return _shaped("psi", found, flat.shape[1:]).reshape(y.shape[1:])

    def _slope(self, y, part):
        if self._functions["gradient"] is None:
            steps = IMAGINARY * 1j * np.eye(6)[:, :, None, None]
            return self._density(y[:, None] + steps, part).imag / IMAGINARY
        found = self._ask("gradient", y, part)
        refuse(not isinstance(found, (tuple, list)) or len(found) != 2, "gradient(r, F, X, t) of "
               "an Energy must return two arrays, of d psi / d r, (2, ...), and of d psi / d F, "
               "(2, 2, ...), got {!r}", found)
        shape = y.shape[1:]
        return np.concatenate([
            _shaped("gradient", found[0], (2, *shape)),
            _shaped("gradient", found[1], (2, 2, *shape)).reshape(4, *shape)])

    def _curvature(self, y, part):
        if self._functions["hessian"] is not None:
            return _shaped("hessian", self._ask("hessian", y, part), (6, *y.shape))
        if self.gradient is not None:
            steps = IMAGINARY * 1j * np.eye(6)[:, :, None, None]
            return np.array([self._slope(y + d, part).imag for d in steps]) / IMAGINARY
        i, j = _LOWER
        sizes = REAL * np.array([self.beam.mesh.height] * 2 + [1.0] * 4)
        d = (sizes * np.eye(6))[:, j, None, None]
        step = IMAGINARY * 1j * np.eye(6)[:, i, None, None]
        both = self._density(np.stack([y[:, None] + step + d, y[:, None] + step - d], 1), part).imag
        out = np.empty((6, *y.shape))
        out[i, j] = (both[0] - both[1]) / (2.0 * IMAGINARY * sizes[j])[:, None, None]
        out[j, i] = out[i, j]
        return out

    # energies

    def potential(self, u: Array) -> float:
        return self._gain(np.zeros(self.beam.N), u)[0]

    def _gain(self, u0, u1):
        """Change of the energy from u0 to u1, and its round-off."""
        gain = noise = 0.0
        for part in self._parts:
            a, b = (self._density(self._variables(u, part), part) for u in (u0, u1))
            gain += float(np.sum(part.weights * (b - a)))
            noise += 1e-15 * float(np.sum(part.weights * (np.abs(a) + np.abs(b))))
        return gain, noise

    def mean_force(self, u0: Array, u1: Array) -> Array:
        force, d = self.force(0.5 * (u0 + u1)), u1 - u0
        gain, noise = self._gain(u0, u1)
        rest = gain + float(force @ d)
        if abs(rest) <= noise:
            return force
        along = d / self.beam.sizes**2
        return force - rest / float(d @ along) * along

    def distribution(self, u: Array) -> Distribution | None:
        """Distribution of its force; None if psi depends on F, or for layered sections."""
        sampled = []
        for part in self._parts:
            P, (where, elements, rule) = self._slope(self._variables(u, part), part), part.of
            if np.any(np.abs(P[2:]) > 1e-12 * np.max(np.abs(P[:2]), initial=0.0)):
                return None
            if where == BODY:
                if not self.beam.across.plain:
                    return None
                xi, eta = rule
                values = -P[:2].reshape(*P[:2].shape[:2], len(xi), len(eta))
                sampled.append(Sampled(BODY, elements, xi, values, eta))
            elif where >= 0:
                xi, w = rule
                sampled.append(Sampled(where, elements, xi, -P[:2] * part.weights / w))
        stations: tuple[float, ...] = ()
        if not _everywhere(self.over):
            stations = groups_of(self.beam.mesh, surfaces_of(self.beam, self.over, 1))[1]
        return Distribution(sampled=tuple(sampled), stations=stations)

    def __repr__(self):
        name = getattr(self.psi, "__name__", type(self.psi).__name__)
        return f"<Energy {name} over {self.over!r}>"

    def _require_derivatives(self, u, d):
        for part in self._parts:
            y, dy = self._variables(u, part), self._variables(d, part)
            dy -= self._variables(0.0 * d, part)
            psi = along(lambda s, y=y, dy=dy, part=part: self._density(y + s * dy, part))
            slopes = along(lambda s, y=y, dy=dy, part=part: self._slope(y + s * dy, part))
            for name, one in (("psi", psi), ("its gradient", slopes)):
                require_finite(f"{name} of {self!r}", one[1])
            own = self.gradient is None
            require_slope(
                f"the complex step of psi of {self!r}" if own else f"gradient of {self!r}", "psi",
                psi, np.einsum("kep,kep->ep", slopes[1], dy), else_="; psi has to take complex "
                "arrays (no abs, real, comparisons), or give gradient=" if own else "")
            H = require_finite(f"the second derivatives of {self!r}", self._curvature(y, part))
            if self.hessian is not None or not own:
                require_slope(f"hessian of {self!r}", "gradient", slopes,
                              np.einsum("klep,lep->kep", H, dy))


def check_derivatives(energy: Energy, beam: Beam, u: ArrayLike | None = None) -> None:
    """Raise InputError unless gradient and hessian of an energy are derivatives of its psi.

    A scene does this near the reference configuration when the energy is added.

    Parameters
    ----------
    energy
        An :class:`Energy`.
    beam
        A :class:`~skfem_ancf.Beam` with sections, at whose points it is evaluated.
    u
        Another displacement of the degrees of freedom to check at, shape (N,).

    Examples
    --------
    >>> from skfem_ancf import (Beam, ElementBeamANCF, Energy, MeshBeam, StVenantKirchhoff,
    ...                         check_derivatives)
    >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> check_derivatives(Energy(lambda r, F, X, t: r[1]**2 * F[0, 1],
    ...                          lambda r, F, X, t: (r, 0 * F)), beam)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    skfem_ancf.core.errors.InputError: gradient of ... is not the derivative of psi: ...
    """
    refuse(not isinstance(energy, Energy), "check_derivatives takes an Energy, got {!r}", energy)
    bound = energy.bind(beam)
    if u is not None:
        bound._require_derivatives(require_finite("u", u, (beam.N,)),
                                   1e-6 * beam.sizes * np.sin(np.arange(beam.N) + 1.0))


def _shaped(name, found, shape):
    with retold(ValueError, "{}(r, F, X, t) of an Energy must return the shape {}, got {}; sums "
                "over components are (r**2).sum(axis=0)", name, shape, np.shape(found)):
        values = np.broadcast_to(np.asarray(found), shape)
    refuse(values.dtype.kind not in "biufc", "{}(r, F, X, t) of an Energy must return numbers, got "
           "{!r}", name, found)
    return values


def _everywhere(over):
    return isinstance(over, str) and over in EVERYWHERE
