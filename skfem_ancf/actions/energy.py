"""An energy density of one's own, of position, deformation gradient, material point and time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..beam.distribution import AXIS, BODY, Sampled, Spread
from ..beam.masses import points_along
from ..beam.surfaces import LEFT, RIGHT, TOP, add_nodal, groups_of, surfaces_of
from ..core.errors import InputError, ask, require_finite, require_function, require_slope
from ..core.quadrature import gauss, product_rule
from .item import beside
from .loads import Load

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..beam.beam import Beam
    from ..beam.layout import Layout, WhichBeam
    from ..core.types import Array, Place, TimeFunction
    from .item import Item

#: The six variables are r_0, r_1, F_00, F_01, F_10, F_11: by component, of r and of both slopes.
_VARIABLES = np.array([[0, 2, 3], [1, 4, 5]])
_LOWER = np.tril_indices(6)
#: Steps of the imaginary part, and of the real part relative to the size of a variable.
_IMAGINARY, _REAL = 1e-30, 1e-5
#: Part of the energies that is round-off of their sums.
_ROUND_OFF = 1e-15


class _Points(NamedTuple):
    """Points of elements (n,): where, X (2, n, np), weights (n, np), functions (n, nb, np, 3)."""

    where: int
    elements: Array
    rule: Any
    X: Array
    weights: Array
    functions: Array


class Energy(Load):
    """An energy whose density is a function of yours, with derivatives that may be found.

    ``psi(r, F, X, t)`` is the energy per volume of the stress-free body, per area of a side or an
    end, or per length of the axis. It is asked at many points at once:

    * ``r``: the position, shape (2, nelements, npoints),
    * ``F``: the deformation gradient, ``F[i, j] = d r_i / d X_j``, (2, 2, nelements, npoints),
    * ``X``: the material point, (2, nelements, npoints), its place in the stress-free body,
    * ``t``: the time of a motion; 0 in statics.

    It is scaled with the loads, as gravity is: ``scene.buckling()`` finds the factor on it. The
    energy-momentum scheme keeps the total energy. It acts on elements with sections.

    Parameters
    ----------
    psi
        The density: returns numbers of shape (nelements, npoints), whatever these are.
    gradient
        Returns d psi / d r, (2, ...), and d psi / d F, (2, 2, ...), of the same arguments. Without
        it by complex steps: psi then has to take complex r and F.
    hessian
        Returns the second derivatives, (6, 6, ...), by r_0, r_1, F_00, F_01, F_10, F_11. Without it
        by complex steps of the gradient, without that by differences of complex steps.
    over
        "cells" for the body, "axis", or a place: "top", "bottom", "left", "right", see
        :func:`skfem_ancf.mesh.places.facets_of`.
    beam
        The beam, its name or its number; None for all, of a place where the scene has only one.
    amplitude
        A function of time by which the energy is multiplied in a motion.

    Raises
    ------
    InputError
        When it is added, if psi or a derivative has another shape, is not finite, or if the
        derivatives are not those of psi.

    Examples
    --------
    A beam in a soft medium that holds each of its points:

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

    constant = False
    # of a bound one
    _parts: Sequence[_Points]
    _time = 0.0

    def __init__(self, psi: Callable[..., Any], gradient: Callable[..., Any] | None = None,
                 hessian: Callable[..., Any] | None = None, over: Place = "cells",
                 beam: WhichBeam = None, amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        for name, function in (("psi", psi), ("gradient", gradient), ("hessian", hessian)):
            if function is not None or name == "psi":
                require_function(name, function, "of r, F, X and t")
        self.psi, self.gradient, self.hessian, self.over = psi, gradient, hessian, over

    @property
    def first_order(self) -> bool:
        return True

    def expand(self, layout: Layout) -> Sequence[Item]:
        everywhere = self.beam is None and isinstance(self.over, str) and (
            self.over in ("cells", "axis"))
        which = range(len(layout.beams)) if everywhere else [layout.number(self.beam)]
        return [self._with(beam=k) for k in which]

    def bind(self, beam: Beam) -> Load:
        if not getattr(beam, "has_sections", False):
            raise InputError(f"an Energy acts on elements with sections, as ElementBeamANCF(2), "
                             f"with positions linear in the degrees of freedom; not on {beam!r}")
        bound = self._with(beam=beam, _parts=_parts_of(beam, self.over))
        beside(bound._require_derivatives, beam.sizes)
        return bound

    def acting(self, t: float | None) -> tuple[float, Load]:
        return self.factor(t), self if t is None else self._with(_time=float(t))

    # the density and its derivatives at the six variables y, (6, n, np)

    def _of_points(self, part, u):
        """The six variables at the points, shape (6, n, np)."""
        n, nb, points, _ = part.functions.shape
        moved = part.functions.reshape(n, nb, -1).swapaxes(1, 2) @ (
            self.beam.kernel.gather(u, part.elements))
        moved = moved.reshape(n, points, 3, 2).transpose(3, 2, 0, 1)
        y = np.empty((6, n, points), dtype=moved.dtype)
        y[_VARIABLES] = moved
        y[:2] += part.X
        y[2] += 1.0
        y[5] += 1.0
        return y

    def _ask(self, name, y, X):
        return ask(f"{name}(r, F, X, t) of an Energy", getattr(self, name), y[:2],
                   y[2:].reshape(2, 2, *y.shape[1:]), X, self._time)

    def _density(self, y, X):
        """psi at the variables (6, ..., n, np), all at once; X of shape (2, n, np)."""
        flat = y.reshape(6, -1, y.shape[-1])
        times = flat.shape[1] // X.shape[1]
        found = self._ask("psi", flat, np.tile(X, (1, times, 1)) if times > 1 else X)
        return _shaped("psi", found, flat.shape[1:]).reshape(y.shape[1:])

    def _slope(self, y, X):
        if self.gradient is None:
            steps = _IMAGINARY * 1j * np.eye(6)[:, :, None, None]
            return self._density(y[:, None] + steps, X).imag / _IMAGINARY
        found = self._ask("gradient", y, X)
        if not isinstance(found, (tuple, list)) or len(found) != 2:
            raise InputError("gradient(r, F, X, t) of an Energy must return two arrays, of "
                             "d psi / d r, (2, ...), and of d psi / d F, (2, 2, ...)")
        shape = y.shape[1:]
        return np.concatenate([
            _shaped("gradient", found[0], (2, *shape)),
            _shaped("gradient", found[1], (2, 2, *shape)).reshape(4, *shape)])

    def _curvature(self, y, X):
        if self.hessian is not None:
            return _shaped("hessian", self._ask("hessian", y, X), (6, *y.shape))
        if self.gradient is not None:
            steps = _IMAGINARY * 1j * np.eye(6)
            return np.array([self._slope(y + d[:, None, None], X).imag for d in steps]) / _IMAGINARY
        i, j = _LOWER
        sizes = _REAL * np.array([self.beam.mesh.height] * 2 + [1.0] * 4)
        d = (sizes * np.eye(6))[:, j, None, None]
        step = _IMAGINARY * 1j * np.eye(6)[:, i, None, None]
        both = self._density(np.stack([y[:, None] + step + d, y[:, None] + step - d], 1), X).imag
        out = np.empty((6, *y.shape))
        out[i, j] = (both[0] - both[1]) / (2.0 * _IMAGINARY * sizes[j])[:, None, None]
        out[j, i] = out[i, j]
        return out

    # contracted for all local functions at once

    def force(self, u: Array) -> Array:
        out = np.zeros(self.beam.N)
        for part in self._parts:
            n, nb = part.functions.shape[:2]
            P = self._slope(self._of_points(part, u), part.X) * part.weights
            P = P[_VARIABLES].transpose(2, 3, 1, 0).reshape(n, -1, 2)
            add_nodal(self.beam, part.elements, -(part.functions.reshape(n, nb, -1) @ P), out)
        return out

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        rows, columns, values = [], [], []
        for part in self._parts:
            n, nb, points, _ = part.functions.shape
            A = self._curvature(self._of_points(part, u), part.X) * part.weights
            A = A[_VARIABLES[:, :, None, None], _VARIABLES].transpose(4, 5, 0, 1, 2, 3)
            T = part.functions
            AT = A.reshape(n, points, 12, 3) @ T.transpose(0, 2, 3, 1)  # (n, np, (i, k, j), nb)
            AT = AT.reshape(n, points, 2, 3, 2, nb).transpose(0, 1, 3, 2, 5, 4)
            K = T.reshape(n, nb, -1) @ AT.reshape(n, 3 * points, -1)  # (n, nb, (i, b, j))
            dofs = self.beam.basis.element_dofs.T[part.elements]
            i, j = np.broadcast_arrays(dofs[:, :, None], dofs[:, None])
            rows.append(i.ravel())
            columns.append(j.ravel())
            values.append(-K.ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def potential(self, u: Array) -> float:
        return self._gain(np.zeros(self.beam.N), u)[0]

    def _gain(self, u0, u1):
        """The energy at u1 less that at u0, and what of it is round-off."""
        gain = noise = 0.0
        for part in self._parts:
            a, b = (self._density(self._of_points(part, u), part.X) for u in (u0, u1))
            gain += float(np.sum(part.weights * (b - a)))
            noise += _ROUND_OFF * float(np.sum(part.weights * (np.abs(a) + np.abs(b))))
        return gain, noise

    def mean_force(self, u0: Array, u1: Array) -> Array:
        force, d = self.force(0.5 * (u0 + u1)), u1 - u0
        gain, noise = self._gain(u0, u1)
        rest = gain + float(force @ d)
        if abs(rest) <= noise:
            return force
        along = d / self.beam.sizes**2
        return force - rest / float(d @ along) * along

    def spread(self, u: Array) -> Spread | None:
        """How its force is distributed; None if psi depends on F, or in sections of layers."""
        sampled = []
        for part in self._parts:
            y = self._of_points(part, u)
            P = self._slope(y, part.X)
            if np.any(np.abs(P[2:]) > 1e-12 * np.max(np.abs(P[:2]), initial=0.0)):
                return None
            if part.where == BODY:
                if not self.beam.across.plain:
                    return None
                xi, eta = part.rule
                values = -P[:2].reshape(*P[:2].shape[:2], len(xi), len(eta))
                sampled.append(Sampled(BODY, part.elements, xi, values, eta))
            elif part.where >= 0:
                xi, w = part.rule
                sampled.append(Sampled(part.where, part.elements, xi, -P[:2] * part.weights / w))
        stations: tuple[float, ...] = ()
        if self.over not in ("cells", "axis"):
            stations = groups_of(self.beam.mesh, surfaces_of(self.beam, self.over, 1))[1]
        return Spread(sampled=tuple(sampled), stations=stations)

    def __repr__(self):
        name = getattr(self.psi, "__name__", type(self.psi).__name__)
        return f"<Energy {name} over {self.over!r}>"

    def _require_derivatives(self, u, d):
        """Raise InputError unless all functions fit together near a displacement u."""
        for part in self._parts:
            y, dy = self._of_points(part, u), self._of_points(part, d)
            dy -= self._of_points(part, 0.0 * d)
            psi, before, after = (self._density(y + s * dy, part.X) for s in (0.0, -1.0, 1.0))
            slopes = [self._slope(y + s * dy, part.X) for s in (-1.0, 0.0, 1.0)]
            for name, one in (("psi", psi), ("its gradient", slopes[1])):
                require_finite(f"{name} of {self!r}", one)
            noise = 1e-13 * np.max(np.abs(psi))
            own = self.gradient is None
            require_slope(
                f"the complex step of psi of {self!r}" if own else f"gradient of {self!r}", "psi",
                (after - before).ravel(), 2.0 * np.einsum("kep,kep->ep", slopes[1], dy).ravel(),
                noise, "; psi has to take complex arrays (no abs, real, comparisons), or give "
                "gradient=" if own else "")
            H = require_finite(f"the second derivatives of {self!r}", self._curvature(y, part.X))
            if self.hessian is not None or not own:
                require_slope(f"hessian of {self!r}", "gradient", (slopes[2] - slopes[0]).ravel(),
                              2.0 * np.einsum("klep,lep->kep", H, dy).ravel(),
                              1e-13 * np.max(np.abs(slopes[1])))


def _shaped(name, found, shape):
    try:
        return np.broadcast_to(np.asarray(found), shape)
    except ValueError:
        raise InputError(f"{name}(r, F, X, t) of an Energy must return the shape {shape}, got "
                         f"{np.shape(found)}; sums over components are (r**2).sum(axis=0)"
                         ) from None


def _parts_of(beam, over):
    """The points of the cells, the axis or a place of a beam."""
    mapping, along, out = beam.mesh.mapping(), points_along(beam) + 1, []
    every = np.arange(beam.mesh.nelements)
    if over == "cells":
        axis = gauss(along)
        for layer, section in beam.across.rules(beam.element.order + 1, inertia=True):
            X, W = product_rule(axis, section)
            weights = np.broadcast_to(beam.across.volume(layer, X, W, every, full=True),
                                      (len(every), len(W)))
            out.append(_points(beam, BODY, every, X, weights, (axis[0], section[0])))
    elif over == "axis":
        xi, w = gauss(along)
        X = np.array([xi, 0.5 + 0.0 * xi])
        lengths = np.sqrt(np.sum(mapping.DF(X)[:, 0] ** 2, axis=0))
        out.append(_points(beam, AXIS, every, X, lengths * w, (xi, w)))
    else:
        rule = gauss(beam.element.facet_points + 1)
        for one in surfaces_of(beam, over, len(rule[0])):
            where = -1 if one.side in (LEFT, RIGHT) else one.side // TOP
            out.append(_points(beam, where, one.elements, one.X, one.areas, rule))
    return out


def _points(beam, where, elements, X, weights, rule):
    mapping = beam.mesh.mapping()
    N, grad = beam.element.functions(mapping, X, elements)
    both = np.stack(np.broadcast_arrays(N, grad[:, 0], grad[:, 1]), axis=-1)
    functions = np.ascontiguousarray(both.swapaxes(0, 1))
    return _Points(where, elements, rule, np.asarray(mapping.F(X, elements)), weights, functions)
