"""A scikit-fem LinearForm as a load."""

import logging
import re
from typing import Any

import numpy as np
from skfem.assembly import BilinearForm, FacetBasis, LinearForm
from skfem.assembly.form.form import FormExtraParams
from skfem.element import DiscreteField

from ..beam import AXIS, BODY, Distribution, Domain, Sampled, WhichMember, station_of_node
from ..core import (Array, CallbackError, Place, TimeFunction, explained, gauss, refuse,
                    require_finite, require_flag, require_slope, warnings_as_errors)
from .energy import Density, DensityPoints
from .bound import COMPLEX, at_generic_displacements
from .loads import DeadLoad

logger = logging.getLogger(__name__)
#: Steps of differences, relative to the size of a variable.
STEP = 1e-6


class _Parameters(FormExtraParams):
    """The parameters w of a form, which record what is used."""

    def __getitem__(self, name):
        vars(self).setdefault("asked", set()).add(name)
        return super().__getitem__(name)


class FormLoad(Density):
    """A scikit-fem ``LinearForm`` as a load, on the body or on a place of its boundary.

    It is a dead load if it depends on the place only. If it uses the position ``w.r``, a field with
    ``grad``, the deformation gradient ``w.F``, (2, 2, ...), or the time ``w.t``, 0 in statics, it
    depends on the deformation, and acts on elements with sections. If its derivative is symmetric,
    it is conservative: its potential, the work along a straight path by Gauss quadrature, is in the
    ``potential_energy`` of a History, or with ``scaled=False`` in the ``strain_energy``. On a
    :class:`~skfem_ancf.Domain` it is dead.

    As in scikit-fem, the form is integrated over the plane of the body or along the line of a
    boundary, and not over the width: multiply a force per volume, or per area of a face, by the
    width. An :class:`~skfem_ancf.Energy` is multiplied by the width.

    Parameters
    ----------
    form
        A ``LinearForm`` with the parameters ``w.x``, ``w.h``, on a boundary ``w.n``, and ``w.r``,
        ``w.F``, ``w.t``.
    boundary
        A place, see :func:`skfem_ancf.mesh.places.facets_of`; None for the body. The second
        argument, as of tractions and pressures: a tangent is given by its name.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    tangent
        The ``BilinearForm`` of the derivative of the form: of u, the change of r, v and w; by
        default differences.
    scaled
        False for an action that load factors do not scale.

    Examples
    --------
    Wind that increases with height, with its derivative:

    >>> import numpy as np
    >>> from skfem import BilinearForm, LinearForm
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01, angle=np.pi / 2),
    ...             ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> wind = LinearForm(lambda v, w: 1000 * beam.width * w.r[1] * v[0])
    >>> state = Scene(beam).clamp("left").load(
    ...     wind, tangent=BilinearForm(
    ...         lambda u, v, w: 1000 * beam.width * u[1] * v[0])).solve_static()
    >>> bool(0.05 < state.displacement((0, 1))[0] < 0.06)
    True
    """

    symmetric = False
    for_domains = True
    # of a bound one
    _basis: Any

    def __init__(self, form: LinearForm, boundary: Place | None = None, beam: WhichMember = None,
                 amplitude: TimeFunction = None, tangent: BilinearForm | None = None,
                 scaled: bool = True) -> None:
        super().__init__(beam, amplitude)
        refuse(not isinstance(form, LinearForm), "a load is a scikit-fem LinearForm, got {!r}; "
               "what is no form is a subclass of skfem_ancf.actions.loads.Load, for scene.add",
               form)
        refuse(isinstance(boundary, BilinearForm), "the second argument of a load is the boundary, "
               "got {!r}: give the derivative as tangent=", boundary)
        refuse(tangent is not None and not isinstance(tangent, BilinearForm), "tangent must be a "
               "scikit-fem BilinearForm, of u, v and w, got {!r}", tangent)
        self.form, self.boundary, self.tangent = form, boundary, tangent
        self.scaled = require_flag("scaled", scaled)

    def bind(self, beam: Any) -> Any:
        if isinstance(beam, Domain):
            return DeadLoad(beam, beam.load(self.form, self.boundary), self.amplitude)._with(
                scaled=self.scaled)
        basis = (beam.exact_basis() if self.boundary is None else
                 beam.facet_basis(self.boundary))
        functions = np.array([(f[0], *f.grad[0]) for f, in basis.basis[::2]])
        part = DensityPoints(basis.element_dofs.T, np.asarray(basis.default_parameters()["x"]),
                             basis.dx, np.ascontiguousarray(functions.transpose(2, 0, 3, 1)))
        bound = self._with(beam=beam, _parts=[part], _basis=basis)
        P, w = bound._evaluated(bound._variables(np.zeros(beam.N), part))
        require_finite(f"the force of {bound!r}", P)
        used = vars(w).get("asked", set()) & {"r", "F", "t"}
        if not used:
            dead = DeadLoad(beam, bound._force(-P, part), self.amplitude, bound._acting(P))
            return dead._with(scaled=self.scaled)
        refuse(not beam.has_sections, "a form with w.r acts on elements with sections, as "
               "ElementBeamANCF(2), and not on {!r}", beam)
        if self.tangent is None:
            logger.info("%r has no tangent=: its derivative is found by differences", self)
        else:
            at_generic_displacements(bound._require_tangent, beam.sizes)
        # It is conservative if its derivative is symmetric, but for errors of differences, at some
        # displacements and times, one at which nothing is zero.
        sizes = np.array([beam.size] * 2 + [1.0] * 4)[:, None, None]
        times = (0.0, 0.7310585786) if "t" in used else (0.0,)
        for t, scale in [(t, scale) for t in times for scale in (0.0, 1e-2)]:
            y = bound._variables(scale * beam.sizes * np.cos(np.arange(beam.N)), part)
            try:
                now = bound._with(_time=t)
                A, P = now._curvature(y, part) * sizes * sizes[:, None], now._slope(y, part)
            except CallbackError:
                return bound
            off, size = np.abs(A - A.swapaxes(0, 1)).max(), np.abs(A).max()
            if not off <= 1e-6 * (size + STEP * np.abs(P * sizes).max()):
                return bound
        return bound._with(symmetric=True)

    def _evaluated(self, y):
        w = self._fields(y)
        return np.array([self._values(self.form.form, v, w) for v in self._tests]), w

    @property
    def _tests(self):
        """Test functions of which one entry of value or gradient is 1, the others 0."""
        for k in range(6):
            y = np.zeros((6, *self._basis.dx.shape))
            y[k] = 1.0
            yield _field(y)

    def _fields(self, y):
        return _Parameters({**self._basis.default_parameters(), "r": _field(y),
                            "F": y[2:].reshape(2, 2, *y.shape[1:]), "t": self._time})

    def _values(self, form, *args):
        """Values of a user-defined form at the points."""
        what = f"the form of a load, form({'u, ' * (len(args) == 3)}v, w),"
        hint = "it must return a real number at each point, as v[1]"
        with explained("{} fails", hint, CallbackError, what), warnings_as_errors(COMPLEX):
            found = np.empty(self._basis.dx.shape)
            try:
                found[:] = form(*args)
            except (KeyError, AttributeError) as error:
                name = re.search("'([^']*)' not found in 'w'|^'([^']*)'$", str(error))
                if name is None:
                    raise CallbackError(f"{what} raised {type(error).__name__}: {error}") from error
                raise CallbackError(
                    f"{what} uses w.{name[1] or name[2]}, which there is not: it knows w.x, w.h, "
                    "on a boundary w.n, and w.r, w.F and w.t") from error
            return found

    def _slope(self, y, part):
        return -self._evaluated(y)[0]

    def _curvature(self, y, part):
        if self.tangent is not None:
            w = self._fields(y)
            return -np.array([[self._values(self.tangent.form, u, v, w) for u in self._tests]
                              for v in self._tests])
        steps = STEP * np.array([self.beam.size] * 2 + [1.0] * 4)
        return np.stack([(self._slope(y + d, part) - self._slope(y - d, part)) / (2.0 * step)
                         for step, d in zip(steps, (steps * np.eye(6))[:, :, None, None])], axis=1)

    def potential(self, u: Array) -> float | None:
        if not self.symmetric:
            return None
        part, = self._parts
        rest = self._variables(np.zeros(self.beam.N), part)
        d = self._variables(u, part) - rest
        return float(sum(w * np.sum(part.weights * self._slope(rest + s * d, part) * d)
                         for s, w in zip(*gauss(6))))

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """Mean of the force on a straight path: of exact work for polynomials of degree 5."""
        if not self.symmetric:
            return super().mean_force(u0, u1)
        return sum((w * self.force(u0 + s * (u1 - u0)) for s, w in zip(*gauss(3))),
                   np.zeros(self.beam.N))

    def _require_tangent(self, u, d):
        part, = self._parts
        y, dy = self._variables(u, part), self._variables(d, part)
        dy -= self._variables(0.0 * d, part)
        slope = np.einsum("klep,lep->kep", self._curvature(y, part), dy)
        require_slope(f"tangent of {self!r}", "the form",
                      lambda s: -self._slope(y + s * dy, part), -slope)

    def distribution(self, u: Array) -> Distribution | None:
        part, = self._parts
        return self._acting(-self._slope(self._variables(u, part), part))

    def _acting(self, P):
        """Distribution of a force over the body; None if it acts on derivatives."""
        basis, f = self._basis, P[:2]
        if np.any(P[2:]):
            return None
        if isinstance(basis, FacetBasis):
            mesh, facets, sampled = self.beam.mesh, np.asarray(basis.find), []
            n, ne, xi = mesh.p.shape[1], mesh.nelements, np.asarray(basis.X[0]).ravel()
            for side in (0, 1):  # bottom and top; others are ends
                on, = np.nonzero((facets >= n + side * ne) & (facets < n + (side + 1) * ne))
                if len(on):
                    sampled.append(Sampled(side, facets[on] - n - side * ne, xi,
                                           (f * basis.dx / basis.W)[:, on]))
            return Distribution(sampled=tuple(sampled), stations=tuple(
                station_of_node(mesh, int(k)) for k in facets[facets < n]))
        xi, eta = (np.unique(np.round(x, 14)) for x in basis.X)
        if not self.beam.has_sections:
            return Distribution(sampled=(
                Sampled(AXIS, np.arange(f.shape[1]), xi, f * basis.dx / basis.W),))
        if not self.beam.across.plain:
            return None
        values = (f / self.beam.across.layers[0].width).reshape(*f.shape[:2], len(xi), len(eta))
        return Distribution(sampled=(Sampled(BODY, np.arange(f.shape[1]), xi, values, eta),))

    def __repr__(self):
        name = getattr(self.form.form, "__name__", type(self.form).__name__)
        return f"<FormLoad {name}>"


def _field(y):
    return DiscreteField(value=y[:2], grad=y[2:].reshape(2, 2, *y.shape[1:]))
