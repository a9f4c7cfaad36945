"""Loads: force on the degrees of freedom of a beam, its derivative, and its potential."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, partial
from typing import Any, cast

import numpy as np
from scipy import sparse

from ..beam import (AXIS, Beam, Distribution, Domain, Layout, RigidBody, Sampled, WhichBeam,
                    WhichMember, add_nodal, direction, divided, element_dofs, entries_of, on_body,
                    on_facets, on_points, stations_of_vector, surfaces_of)
from ..beam.kernels.moments import MomentPack, add_mean_moments, add_moments
from ..core import (AncfError, Array, ArrayLike, InputError, ModelWarning, Place, TimeFunction,
                    along, ask_field, ask_number, gauss, is_builtin, read_only, refuse, refuse_any,
                    require_finite, require_finite_scalar, require_function, require_slope, sample,
                    shown, warn)
from ..mesh.places import facets_of, node_of
from ..sections.across import Pieces, pieces
from .bound import MemberForce, at_generic_displacements, require_entries, user_parts
from .item import Item, on_each, takes
from .places import Vector, at_node, dense_entries, members_at, section
from .symbols import (ARROWS, Symbol, arrows_along, faces_of, force_symbol, inside, values_at)


class Amplitude:
    """A user-defined function of time with checks of its values."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self.function = require_function("amplitude", function, "of time that returns a number")

    def __call__(self, t):
        return self.function(t) if np.ndim(t) else ask_number("amplitude(t={:g})", self.function, t)

    def sampled(self, times: Array) -> Array:
        """Values at times (n,)."""
        return sample(self, times, "amplitude")


class Load(Item):
    """Base class: a force on the degrees of freedom of one beam as a function of displacement.

    A user-defined load, for :meth:`skfem_ancf.Scene.add`, is a subclass. It defines

    * :meth:`force`, and :meth:`stiffness` and ``constant = False`` if the force depends on
      displacements,
    * :meth:`potential`, or ``symmetric = False`` if its stiffness is not symmetric,
    * :meth:`bind`, if it computes data of the beam; needed to act on another mesh.

    Parameters
    ----------
    beam
        Beam, name or number; None where the scene has only one.
    amplitude
        Factor as a function of time, or None.

    Attributes
    ----------
    beam
        A :class:`~skfem_ancf.Beam` once the load is bound.
    constant : bool
        The force does not depend on the displacement.
    symmetric : bool
        The derivative of the force is symmetric: the load has a potential.
    linear : bool
        The force is affine in the displacement: it is assembled once.
    scaled : bool
        Load factors scale it; False for permanent actions.
    for_bodies, for_domains : bool
        It may act on a :class:`~skfem_ancf.RigidBody`, or a :class:`~skfem_ancf.Domain`.

    Other Parameters
    ----------------
    u, u0, u1
        Displacements of the beam's degrees of freedom, shape (N,), also at both ends of a step.

    Examples
    --------
    Springs at the nodes of a beam, with stiffness k each:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.actions.loads import Load
    >>> class Springs(Load):
    ...     constant = False
    ...     def __init__(self, k, beam=None):
    ...         super().__init__(beam)
    ...         self.k = k
    ...     def bind(self, beam):
    ...         bound = super().bind(beam)
    ...         bound.dofs = np.arange(1, beam.N, beam.nd)  # r^2 of each node
    ...         return bound
    ...     def force(self, u):
    ...         out = np.zeros(self.beam.N)
    ...         out[self.dofs] = -self.k * u[self.dofs]
    ...         return out
    ...     def stiffness(self, u):
    ...         return self.dofs, self.dofs, np.full(len(self.dofs), -self.k)
    ...     def potential(self, u):
    ...         return 0.5 * self.k * float(u[self.dofs] @ u[self.dofs])
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamANCF(2),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(beam).clamp("left").gravity((0, -9.81)).add(Springs(2.0))
    >>> scene.solve_static().converged
    True
    """

    constant = True
    beam: Any
    amplitude: Amplitude | None = None
    linear = False
    turning = False
    scaled = True
    #: The factor in statics: 1 but for some loads of the package.
    at_rest = 1.0
    #: Its derivative belongs to a stress that it causes, which the initial tangent lacks.
    prestress = False
    #: Of an eigenstrain: for each element table of the beam an array (components, points,
    #: elements), see :func:`~skfem_ancf.beam.strain_energy.eigenstrain_body_of`.
    eigen_stresses: Sequence[Array] = ()
    for_bodies = for_domains = False
    #: Of a bound one, if it is known.
    _distribution: Any = None

    @property
    def first_order(self) -> bool:
        """True if linear theory includes its stiffness: user-defined loads, as springs."""
        return not is_builtin(self)

    def __init__(self, beam: WhichMember = None, amplitude: TimeFunction = None) -> None:
        self.beam = beam
        self.amplitude = amplitude if amplitude is None or isinstance(amplitude, Amplitude) else (
            Amplitude(amplitude))

    def expand(self, layout: Layout) -> Sequence[Item]:
        return (self._with(beam=layout.number(self.beam)),)

    def bind(self, beam: Any) -> Any:
        """A copy bound to a beam, or to a rigid body if :attr:`for_bodies`. Override it to compute
        data of the beam. Do not change ``self``, which is bound to other beams later."""
        return self._with(beam=beam)

    def bound_on(self, layout: Layout) -> list[Any]:
        load = bind_load(self, layout.beam(self.beam))
        return [load if load.scaled else MemberForce(load, layout.offset(load.beam), load),
                *user_parts(load, layout, force=False)]

    def factor(self, t: float | None) -> float:
        """The amplitude at time ``t``; 1 without one, or in statics, where ``t`` is None."""
        return self.at_rest if t is None else 1.0 if self.amplitude is None else self.amplitude(t)

    def times(self, factor: float) -> "Load":
        """A copy with a factor, in statics and over time."""
        return self._with(at_rest=factor * self.at_rest, amplitude=Amplitude(
            partial(_factored, factor, self.amplitude)))

    def factor_and_load(self, t: float | None) -> "tuple[float, Load]":
        """Factor and load at time ``t``; None in statics."""
        return self.factor(t), self

    def mean_force(self, u0: Array, u1: Array) -> Array:
        """Mean force (N,) from u0 to u1, (N,) each, with exact work if there is a potential."""
        return self.force(0.5 * (u0 + u1))

    def force(self, u: Array) -> Array:
        """Force on the beam's degrees of freedom at the displacement ``u``, shape (beam.N,)."""
        raise NotImplementedError

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        """Rows, columns and values of the derivative of the force. Rows and columns are degrees of
        freedom of one node or of neighbouring nodes."""
        raise NotImplementedError

    def potential(self, u: Array) -> float | None:
        """Minus the work done from the reference configuration; None if there is no potential."""
        return None

    def distribution(self, u: Array) -> Distribution | None:
        """Distribution of the force over the body at the displacement ``u``, for recovered fields.
        By default it acts on the nodes, or on the point inside an element, whose degrees of freedom
        it acts on; None (unknown) if these are neighbours."""
        if self._distribution is not None:
            return self._distribution
        stations = stations_of_vector(self.beam, self.force(u))
        return None if stations is None else Distribution(stations=stations)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        beam = layout.beam(self.beam)  # user-defined loads and forms: nodal forces
        if isinstance(beam, Beam):
            given = self if isinstance(self, DeadLoad) else self.bind(beam)
            force = given.force(np.zeros(beam.N)).reshape(-1, beam.nd)[:, :2]
            loaded = np.flatnonzero(np.hypot(*force.T) > 1e-9 * np.abs(force).max())
            some = loaded[::1 + len(loaded) // (2 * ARROWS)]
            yield force_symbol((at_node(layout, beam, k) for k in some), force[some], show=False)

    def __repr__(self):
        return f"<{type(self).__name__} on {self.beam!r}>"


def _factored(factor, amplitude, t):
    return factor * (1.0 if amplitude is None else amplitude(t))


def bind_load(load: Load, beam: Beam | RigidBody | Domain) -> Load:
    """A load bound to a beam; its results are checked."""
    refuse(isinstance(beam, RigidBody) and not load.for_bodies, "{} acts on beams and not on "
           "{!r}: a rigid body takes scene.gravity, point_force, follower_force, moment, springs "
           "and joints", type(load).__name__, beam)
    refuse(isinstance(beam, Domain) and is_builtin(load) and not load.for_domains, "{} acts on "
           "beams and not on {!r}: a domain takes scene.gravity, point_force, springs, joints, "
           "and scene.load(form, boundary) with any LinearForm", type(load).__name__, beam)
    bound = load.bind(cast("Beam", beam))
    if not isinstance(bound, Load) or bound.beam is not beam:
        raise InputError(f"{load!r}.bind(beam) must return a Load on that beam, got {shown(bound)}")
    if is_builtin(bound):
        if not bound._frozen:
            bound._freeze()
        return bound
    zero = np.zeros(beam.N)
    try:
        force = require_finite("its force", bound.force(zero), (beam.N,))
        bound._freeze()

        def require_constant(u: Array, _: Array) -> None:
            off = np.abs(bound.force(u) - force)
            refuse(np.any(off > 1e-12 * np.max(np.abs(force), initial=0.0)), "force(u) depends on "
                   "the displacement: set constant = False in its class and define stiffness(u)")

        if bound.constant:
            at_generic_displacements(require_constant, beam.sizes)
            return bound
        i, j, v = bound.stiffness(zero)
    except AncfError as error:
        raise InputError(f"{load!r} does not fit this beam: {error}. Meshes change, by adapt= and "
                         "refinement: compute arrays of their size in bind(beam) or force(u)"
                         ) from None
    except Exception as error:  # user-defined loads may raise anything
        raise InputError(f"{load!r} fails in the reference configuration: {type(error).__name__}: "
                         f"{error}; a load defines force(u) of shape (beam.N,), and stiffness(u) "
                         "unless it is constant") from error
    require_entries(f"the stiffness of {load!r}", i, j, v, beam.N)
    low, high = np.sort(np.stack([i, j]).astype(np.int64) // beam.nd, axis=0)
    far = high - low > (beam.bandwidth // beam.nd if isinstance(beam, Domain) else 1)
    if isinstance(beam, Beam):  # the next node may be that of another chain
        first, last = np.sort(beam.mesh.t, axis=0)
        far |= (low < high) & ~np.isin(low * beam.N + high, first * beam.N + last)
    refuse_any(far, "the stiffness of {!r} couples the nodes {} and {}: only neighbours of the "
               "chain may be coupled, as they are in its elements", load, low, high)
    at_generic_displacements(partial(_require_derivatives, bound), bound.beam.sizes)
    return bound


def _require_derivatives(load, u, d):
    try:
        force = along(lambda s: load.force(u + s * d))
        potential = along(lambda s: load.potential(u + s * d))
        i, j, v = load.stiffness(u)
    except Exception:  # it may be defined in the reference configuration only
        return
    K = sparse.coo_array((v, (i, j)), shape=(len(u), len(u)))
    require_slope(f"stiffness(u) of {load!r}", "force(u)", force, K @ d)
    if load.symmetric:
        require_slope(f"stiffness(u) of {load!r}, transposed,", "force(u)", force, K.T @ d, else_=(
            "; a load without a potential says so in its class: symmetric = False"))
    if load.potential(u) is not None:
        require_slope(f"minus force(u) of {load!r}", "potential(u)", potential, -force[1] @ d)


class Weight(Load):
    """Weight of beams and rigid bodies.

    Parameters
    ----------
    g
        Acceleration, shape (2,), as ``(0, -9.81)``.
    beam
        Beam or rigid body, name or number; None for all.
    amplitude
        Factor as a function of time.
    """

    for_bodies = for_domains = True

    def __init__(self, g: ArrayLike, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.g = require_finite("g", g, (2,))

    def expand(self, layout: Layout) -> Sequence[Item]:
        return on_each(self, range(len(layout.members)))

    def bind(self, beam: Beam | RigidBody) -> Load:
        distribution = Distribution(gravity=self.g) if isinstance(beam, Beam) else None
        return DeadLoad(beam, beam.weight(self.g), self.amplitude, distribution, self.g)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield force_symbol([Vector(np.zeros(2))], self.g)._replace(kind="weight", text="g = ")


def number_at(layout: Layout, at: Any, beam: Any) -> int:
    """The number of a beam or body; if none is named, of the one that has a point."""
    if beam is None and at is not None and len(layout.members) > 1:
        found = members_at(layout, at, nearest=True)
        if len(found) == 1:
            return found[0]
    return layout.number(beam)


class Traction(Load):
    """A dead traction on a surface. On a cable it acts on the axis, without moment.

    Parameters
    ----------
    boundary
        A place, see :func:`skfem_ancf.mesh.places.facets_of`.
    t
        Force per reference area, shape (2,), or a function of points x (2, ...) that returns
        (2, ...).
    beam, amplitude
        As for :class:`Load`.
    """

    def __init__(self, boundary: Place, t: ArrayLike | Callable[[Array], Array],
                 beam: WhichBeam = None, amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.boundary, self.t = boundary, t if callable(t) else require_finite("t", t, (2,))

    def bind(self, beam: Beam) -> Load:
        t, vector, mapping = self.t, np.zeros(beam.N), beam.mesh.mapping()
        found = surfaces_of(beam, self.boundary, 7 if callable(t) else beam.element.facet_points)
        forces: list[Array] = []

        def at(X, e):
            return ask_field("t(x)", t, mapping.F(X, e))

        if callable(t):
            found = [divided(beam, one, at) for one in found]
        for one in found:
            density = at(one.X, one.elements) if callable(t) else t[:, None, None]
            functions = beam.element.values(mapping, one.X, one.elements)
            forces.append(density * one.areas)
            add_nodal(beam, one.elements, np.einsum("iep,cep->eic", functions, forces[-1]), vector)
        if not beam.has_sections:  # warn where the moment that it leaves out is large
            length, lost, kept, size = np.sum(beam.mesh.lengths), dict[int, Any](), 0.0, 0.0
            for one, force in zip(found, forces):
                frame = mapping.frame(one.X, one.elements)
                along, across = np.einsum("ikep,iep->kep", frame, force)
                moment = np.sum(along * mapping.offset(one.X, one.elements), axis=1)
                lost[one.side] = lost.get(one.side, 0.0) + moment  # of an end's layers together
                kept += length * np.sum(np.abs(across))
                size += beam.mesh.height * np.sum(np.hypot(along, across))
            left_out = sum(np.sum(np.abs(moment)) for moment in lost.values())
            if left_out > 0.01 * kept + 1e-12 * size:  # that is round-off
                warn(f"a traction on {beam!r} acts on its axis: it leaves out a moment of "
                     f"{left_out:.3g} by the distance of the face. Use an element with sections, "
                     "as ElementBeamANCF(2), or give an end its moment by scene.moment",
                     ModelWarning)
        return DeadLoad(beam, vector, self.amplitude, on_facets(
            beam.mesh, np.concatenate([one.facets for one in found]), traction=t))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        for at, _, _ in faces_of(layout, layout.beam(self.beam), self.boundary):
            yield force_symbol(at, values_at(self.t, at))._replace(per=2)


class DeadLoad(Load):
    """A constant force on the degrees of freedom.

    Parameters
    ----------
    beam
        A :class:`~skfem_ancf.Beam`.
    vector
        Force on its degrees of freedom, shape (N,).
    amplitude
        As for :class:`Load`.
    distribution
        A :class:`~skfem_ancf.beam.distribution.Distribution`; None to determine it.
    g
        Of a weight the acceleration (2,), which acts on point masses too.
    """

    for_bodies = for_domains = True

    def __init__(self, beam: Beam | RigidBody | Domain, vector: ArrayLike,
                 amplitude: TimeFunction = None, distribution: Distribution | None = None,
                 g: Array | None = None) -> None:
        if not isinstance(beam, (Beam, RigidBody, Domain)):
            raise InputError(f"this load acts on a Beam, got {shown(beam)}")
        super().__init__(beam, amplitude)
        self.vector = read_only(require_finite("the load", vector, (beam.N,)))
        self._of, self._distribution, self.g = beam, distribution, g

    def distribution(self, u: Array) -> Distribution | None:
        if self._distribution is None:
            self._distribution = super().distribution(u)
        return self._distribution

    def bind(self, beam: Beam) -> Load:
        refuse(beam is not self._of, "a DeadLoad is a vector of the degrees of freedom of one mesh "
               "and does not fit another: use scene.load(form) or a Load with bind(beam)")
        return self._with(beam=beam)

    def force(self, u: Array) -> Array:
        return self.vector

    def potential(self, u: Array) -> float:
        return -float(self.vector @ u)


class Pressure(Load):
    """A follower pressure, normal to the deformed surface.

    It is linear in the position. On the bottom and the top of a cable it acts on the axis, with the
    length of the axis: at a radius of curvature R the resultant has a relative error of h / (2 R).

    Parameters
    ----------
    boundary
        A place, see :func:`skfem_ancf.mesh.places.facets_of`.
    p
        Force per deformed area; positive is compressive.
    beam, amplitude
        As for :class:`Load`.
    """

    constant = False
    symmetric = False
    linear = True
    # of a bound one
    matrix: Any
    _rows: Any

    def __init__(self, boundary: Place, p: float, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.boundary, self.p = boundary, require_finite_scalar("p", p)

    def bind(self, beam: Beam) -> Load:
        facets = np.asarray(facets_of(beam.mesh, self.boundary))
        refuse(not beam.has_sections and np.any(facets < beam.mesh.p.shape[1]),
               "a pressure at {!r} of a cable has no effect: a cable has no degrees of freedom "
               "across the section. Use an element with sections, as ElementBeamANCF(2), or for a "
               "force of constant direction scene.traction or scene.point_force", self.boundary)
        # sparse matrix from the position to the force of a pressure
        row, column, value = [], [], []
        for one in surfaces_of(beam, facets, beam.element.facet_points):
            functions, grad = beam.element.functions(
                beam.mesh.mapping(), one.X, one.elements)
            slopes = grad[:, 0] * one.along[0] + grad[:, 1] * one.along[1]
            both = self.p * np.einsum("iep,jep,ep->eij", functions, slopes, one.weights)
            i, j = entries_of(element_dofs(beam, one.elements)[:, ::2])
            row += [i, i + 1]
            column += [j + 1, j]
            value += [-both.ravel(), both.ravel()]
        rows = sparse.coo_array((np.concatenate(value), (np.concatenate(row), np.concatenate(
            column))), shape=(beam.N, beam.N)).tocsr()
        return self._with(beam=beam, _rows=rows, matrix=rows.tocoo(),
                          _distribution=on_facets(beam.mesh, facets, pressure=self.p))

    def force(self, u: Array) -> Array:
        return self._rows @ (self.beam.q0_local + u)

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        return self.matrix.row, self.matrix.col, self.matrix.data

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        for at, normals, turns in faces_of(layout, layout.beam(self.beam), self.boundary):
            yield force_symbol(at, -self.p * normals, turns)._replace(text="p = ", per=2)


class EndMoment(Load):
    """A moment M on a section, with the potential -M times the angle of the section.

    The section's direction is ``d = 12 / h^3 int Y r dY``, the best fit of a straight line to the
    deformed face, and its angle that of ``d``. The force is a traction linear in Y and normal
    to ``d``; it rotates with the section.

    Parameters
    ----------
    boundary
        A place that is one section, as "right" or the point of a node, see
        :func:`skfem_ancf.mesh.places.facets_of`; or a RigidBody.
    M
        The moment (force times length), counterclockwise.
    beam, amplitude
        As for :class:`Load`; the beam may be a RigidBody.
    """

    constant = False
    turning = True
    for_bodies = True
    #: An object shared by two opposite moments, which conserve the angular momentum.
    couple: Any = None
    # of a bound one: the node, and coordinates and weights of the direction of its section
    node: int
    dofs: Any
    c: Any

    def __init__(self, boundary: Any, M: float, beam: WhichMember = None,
                 amplitude: TimeFunction = None) -> None:
        self.boundary, beam = on_body(boundary, beam)
        super().__init__(beam, amplitude)
        self.M = require_finite_scalar("M", M)

    def bind(self, beam: Beam | RigidBody) -> Load:
        if isinstance(beam, RigidBody):
            beam.dofs(self.boundary)  # raises MeshError unless it is a place
            node, (dofs, c) = 0, beam.direction()
        else:
            node = node_of(beam.mesh, self.boundary)
            dofs, c = direction(beam, node)
        return self._with(beam=beam, node=node, dofs=dofs, c=c)

    def direction(self, u: Array) -> Array:
        """The section's direction d, shape (2,)."""
        return (self.beam.q0_local[self.dofs] + u[self.dofs]) @ self.c

    def angle(self, u: Array) -> float:
        """Rotation of the section in radians. Full turns are counted along the beam from the
        section at its other end, whose angle is taken in (-pi, pi]."""
        nd = self.beam.nd
        rows = self.dofs - self.node * nd + nd * np.arange(self.beam.N // nd)[:, None, None]
        start = self.beam.q0_local[rows] @ self.c
        now = start + u[rows] @ self.c
        turn = (now @ [1.0, 1.0j]) / (start @ [1.0, 1.0j])
        if self.node == 0:
            turn = turn[::-1]
        return float(np.angle(turn[0]) + np.sum(np.angle(turn[1:] / turn[:-1])))

    @cached_property
    def _pack(self):
        start = self.direction(np.zeros(self.beam.N))
        return MomentPack(self.dofs[None], self.c[None], start[None], np.array([float(self.M)]),
                          np.array([-1]))

    def force(self, u: Array) -> Array:
        out = np.zeros(self.beam.N, dtype=u.dtype)
        add_moments(self._pack, np.ones(1), u, out)
        return out

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        x, y = self.direction(u)
        D = np.array([[2.0 * x * y, y * y - x * x], [y * y - x * x, -2.0 * x * y]])
        values = np.einsum("ij,k,l->ikjl", self.M / (x * x + y * y) ** 2 * D, self.c, self.c)
        return dense_entries(self.dofs, self.dofs, values)

    def mean_force(self, u0: Array, u1: Array) -> Array:
        out = np.zeros(self.beam.N)
        add_mean_moments(self._pack, np.ones(1), u0, u1, out)
        return out

    def potential(self, u: Array) -> float:
        return -self.M * self.angle(u)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("moment", (section(layout, self.beam, self.boundary)[0],), value=self.M,
                     show=True)


# loads that depend on time


class TimedLoad(Load):
    """A force that depends on time and not on the displacement. A subclass defines :meth:`places`
    or :meth:`at`. Single static solutions take the load at time 1; :meth:`skfem_ancf.Scene.run` and
    motions take the current time."""

    constant = first_order = False
    # of the load at a time
    _time: float | None = None
    _vector: Any = None
    _last: Any = None

    def places(self, t: float) -> Sequence[tuple[Array, int, Array]]:
        """Forces (2,) at time t, each with its element and reference point (2,)."""
        raise NotImplementedError

    def at(self, t: float) -> tuple[Array, Distribution]:
        """Force (N,) at time t and its distribution; by default from :meth:`places`."""
        return on_points(self.beam, self.places(t))

    def factor_and_load(self, t: float | None) -> tuple[float, Load]:
        last, time = self._last, 1.0 if t is None else float(t)
        if last is None or last._time != time:
            last = self._last = self._now(time)._with(_time=time)
        return self.factor(t), last

    def _now(self, time: float) -> Load:
        vector, distribution = self.at(time)
        return self._with(_vector=vector, _last=None, _distribution=distribution)

    def force(self, u: Array) -> Array:
        return self.factor_and_load(None)[1].force(u) if self._vector is None else self._vector

    def mean_force(self, u0: Array, u1: Array) -> Array:
        return self.force(u1)

    def stiffness(self, u: Array) -> tuple[Array, Array, Array]:
        none = np.zeros(0, dtype=int)
        return none, none, np.zeros(0)

    def potential(self, u: Array) -> float:
        return -float(self.force(u) @ u)

    def distribution(self, u: Array) -> Distribution | None:
        if self._distribution is None:
            return self.factor_and_load(None)[1].distribution(u)
        return self._distribution

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        beam = layout.beam(self.beam)
        for t in (0.0, 1.0) if self._time is None else (self._time,):
            try:
                places = self.bind(beam).places(t)
            except AncfError:  # beyond the end of the beam
                continue
            yield from (force_symbol([inside(layout, beam, e, *X)], force)
                        for force, e, X in places)
            if places:
                return


class LineLoad(Load):
    """A dead force per length of the reference axis.

    Parameters
    ----------
    force
        Force per length, shape (2,), or a function of points x (2, ...) of the reference axis that
        returns (2, ...); or of x and the time.
    beam, amplitude
        As for :class:`~skfem_ancf.actions.loads.Load`.
    """

    #: Numbers of the loaded chains of elements, shape (k,); None for all.
    chains: Any = None
    #: Of one in a picture: the time at which it is drawn.
    _time: float | None = None

    def __init__(self, force: ArrayLike | Callable[[Array], Array], beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.per_length = force if callable(force) else require_finite("force", force, (2,))

    def bind(self, beam: Beam) -> Load:
        given = self.per_length
        if takes(given, 2):
            return LineLoadInTime(beam, self.chains, given, self.amplitude)
        vector, distribution = _along_axis(beam, self.chains, given, "force(x)")
        return DeadLoad(beam, vector, self.amplitude, distribution)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        beam = layout.beam(self.beam)
        given: Any = self.per_length
        chains = np.unique(beam.mesh.chains) if self.chains is None else self.chains
        times = (0.0, 1.0) if self._time is None else (self._time,)
        functions = [given] if not takes(given, 2) else [
            lambda x, t=t: given(x, t) for t in times]
        for k, chain in enumerate(chains):
            at = [inside(layout, beam, *place) for place in arrows_along(
                np.flatnonzero(beam.mesh.chains == chain), len(chains))]
            found = [values_at(function, at) for function in functions]
            yield force_symbol(at, next(filter(np.any, found), found[0]), show=k == 0)._replace(
                per=1)


def _along_axis(beam, chains, given, name):
    """Force (N,) and distribution of a force per length, on some chains of elements or on all."""
    mapping, (xi, w) = beam.mesh.mapping(), gauss(beam.element.axis_degree + 5)
    e = np.arange(beam.mesh.nelements)
    e = e if chains is None else e[np.isin(beam.mesh.chains, chains)]
    part, size = Pieces(e, np.zeros(len(e)), np.ones(len(e))), np.ones((len(e), 1))

    def at(X, e):
        return ask_field(name, given, mapping.F(X, e))

    if callable(given):
        part = pieces(at, e)
        size = (part.end - part.begin)[:, None]
    x = part.begin[:, None] + size * xi
    X = np.array([x, 0.5 + 0.0 * x])
    values = at(X, part.elements) if callable(given) else given[:, None, None]
    values = values * np.hypot(*mapping.DF(X, part.elements)[:, 0])
    vector = np.zeros(beam.N)
    functions = beam.element.values(mapping, X, part.elements)
    add_nodal(beam, part.elements, np.einsum("kep,iep->eik", values * size * w, functions), vector)
    return vector, Distribution(sampled=(Sampled(
        AXIS, part.elements, xi, values, parts=np.array([part.begin, part.end])),))


class LineLoadInTime(TimedLoad):
    """A time-dependent force per length of a beam, bound."""

    def __init__(self, beam: Beam, chains: Any, force: Any,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.chains, self.per_length = chains, force

    def at(self, t: float) -> tuple[Array, Distribution]:
        return _along_axis(self.beam, self.chains, lambda x: self.per_length(x, t), "force(x, t)")
