"""Recovered strain and stress: from the section forces and the equilibrium of the body.

The strain of an element at a point is the derivative of its displacement, which is less accurate
than the displacement, and not continuous. Here the fields are found again, for each piece of a
beam between two places where its section force jumps:

1. The internal forces of the elements give the force and the moment of every section
   (:mod:`skfem_ancf.recovery.section_forces`).
2. The stretch of the fibres follows from the compatibility ``d(r_X)/dY = d(r_Y)/dX``: they turn at
   the rate of their section. This rate and the stretch of the axis are those for which the
   section has its force and moment; S_xx is that of the law.
3. S_xy and S_yy follow from the equilibrium of the body, ``div P + b = 0``, integrated across the
   section from the lower face with its load. What is left at the upper face is spread over the
   area, and Jourawski's shear stress (of a rectangle a parabola) added to S_xy that gives the
   section its shear force. The law's inverse gives eps_yy and eps_xy, which enter step 2: both are
   repeated. Where the width or the law jumps across the section, so do they
   (:mod:`skfem_ancf.recovery.intervals`): P_2 times the width does not.
4. This is the solution of Saint-Venant, to high order in h / L. Supports and point loads cause
   boundary layers of the length h besides. Where the elements there are short enough to resolve
   them, their own stress is taken, from where it is most accurate: the mean of two Gauss points,
   put at the element's centre (sections cubic along the axis: at the Gauss points), splined.
"""

from __future__ import annotations

from copy import copy
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial.chebyshev import chebint, chebvander
from scipy import sparse

from ..formulations.ecm import EnhancedContinuum
from ..core.kept import cached_property, kept
from ..core.linear import first_order
from ..materials import LinearLaw
from .intervals import Moved, Panels
from .segments import Piece, largest, refuse
from ..core.quadrature import gauss
from ..mesh.refinement import by_element
from .section_forces import NotRecovered, SectionForces, viscous_forces
from ..beam.distribution import SNAP, Sampled, station_of_node, stations_of_vector

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike

    from ..beam.beam import Beam
    from ..beam.configuration import Configuration
    from ..beam.interpolation import Part
    from ..core.types import Array, Law

#: Fields that the last round changes by more than this part of the largest strain have not settled;
#: strains below the other are round-off.
UNSETTLED, TINY = 0.01, 1e-12


def strain_of_stress(law: Law, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2),
                     tol: float = 1e-10) -> Array:
    """The strain whose stress is given, by Newton's method.

    Parameters
    ----------
    law
        With ``stress`` and ``moduli``.
    stress
        Of a field of n times m points, shape (3, n, m), or of several, shape (3, ..., n, m); only
        the components ``unknown`` are used.
    strain
        To start from, shape (3, ..., n, m); components not in ``unknown`` keep their values.
    unknown
        Components to find, neighbours.
    tol
        Largest difference of the stress of a field, relative to its largest value.

    Returns
    -------
    ndarray
        As ``strain``.

    Raises
    ------
    NotRecovered
        If there is no such strain.
    """
    k, field = list(unknown), (0, -2, -1)
    strain = np.array(strain, dtype=np.result_type(strain, stress, float))
    if isinstance(law, LinearLaw):
        gap = (stress - law.stress(strain))[k[0]:k[-1] + 1]
        strain[k[0]:k[-1] + 1] += law.compliance(tuple(unknown)).dot(
            gap.reshape(len(k), -1)).reshape(gap.shape)
        return strain
    with np.errstate(all="ignore"):
        for _ in range(30):
            found = law.stress(strain)
            gap = (stress - found)[k]
            size = np.max(np.abs(gap), axis=field)
            if not np.all(np.isfinite(size)):
                left = ~np.isfinite(size)
                break
            left = size > tol * np.maximum(np.max(np.abs(found), axis=field),
                                           np.max(np.abs(stress), axis=field))
            if not np.any(left):
                return strain
            D = np.moveaxis(law.moduli(strain)[np.ix_(k, k)], (0, 1), (-2, -1))
            change = np.linalg.solve(D, np.moveaxis(gap, 0, -1)[..., None])[..., 0]
            strain[k] += left[..., None, None] * np.moveaxis(change, -1, 0)
    raise NotRecovered("no strain has the stress of the section under this law", left)


def _small(law):
    """The law of small strains."""
    return law if isinstance(law, LinearLaw) else LinearLaw(law.moduli(np.zeros(3)))


def _axial(law, strain):
    """Change of S_xx with eps_xx while S_yy and S_xy stay, shape (...), of strains (3, ...)."""
    D = law.D if isinstance(law, LinearLaw) else law.moduli(strain)
    det = D[1, 1] * D[2, 2] - D[1, 2] * D[2, 1]
    return 0.0 * strain[0] + D[0, 0] - (
        D[0, 1] * (D[1, 0] * D[2, 2] - D[1, 2] * D[2, 0])
        + D[0, 2] * (D[1, 1] * D[2, 0] - D[1, 0] * D[2, 1])) / det


def _geometry(beam):
    """The mapping to the body whose sections turn as its axis at jumps of the curvature, if that
    is not the mapping of the mesh.
    """
    if beam.mesh.sections == "linear" or not len(beam.across.bends):
        return None
    return by_element(beam.mesh, beam.across.bends.astype(int)).mapping()


class Recovery:
    """The recovered field of one beam, in one state or in several at once.

    What several states have in common is made once, and the sections of all of them are solved
    together; :meth:`of` is the field of one.

    Parameters
    ----------
    forces
        The :class:`~skfem_ancf.recovery.section_forces.SectionForces` of the beam.
    u
        Displacement of its coordinates, shape (N,), or (states, N).

    Raises
    ------
    NotRecovered
        If the fields cannot be recovered.
    """

    def __init__(self, forces: SectionForces, u: Array) -> None:
        self.forces, self.beam = forces, forces.beam
        beam = self.beam
        #: Why it has section forces, but no fields; "" if it has.
        self.why = "" if beam.section.has_fields else (
            f"{beam.section!r} does not say what it is made of: strain and stress are those of a "
            "rectangle with these numbers; State.resultants() has what is known")
        slabs = beam.across.slabs
        if not all(hasattr(slab.measure, "pieces") for slab in slabs):
            raise NotRecovered(f"{beam.section!r} has a measure that does not say its width: give "
                               "it pieces and mean, as Weighted has")
        self.panels = kept(beam.tables, "across", lambda: Panels(slabs, beam.element.order))
        #: Where the points of :attr:`panels` are, of those that move where the section is highest.
        self.eta = self.panels.eta
        self.laws = [(columns, _small(law) if forces.small else law)
                     for slab, columns in zip(slabs, self.panels.slabs)
                     for law in (slab.material.law(slab.shear),)]
        self.lengths, self._inside = kept(beam.tables, "arc", self._arc_tables)
        self.geometry = kept(beam.tables, "geometry", lambda: _geometry(beam))
        self.has_stress = (len(slabs) == 1 and slabs[0].face is None
                           and beam.element.carries_shear_parabola
                           and not isinstance(beam.formulation, EnhancedContinuum))
        self._u = u
        self.pieces = [Piece(self, a, b) for a, b in zip(forces.cuts[:-1], forces.cuts[1:])]
        for piece in self.pieces:
            refuse(~np.all(np.isfinite(piece.strain), axis=(0, -2, -1)))
        strain = np.max([largest(piece.stretch - 1.0) for piece in self.pieces], axis=0)
        change = np.max([piece.change for piece in self.pieces], axis=0) / np.maximum(strain, TINY)
        if np.any(change > UNSETTLED):
            raise NotRecovered("the fields do not settle: the last of their rounds changes the "
                               f"strain by {np.max(change):.0%} of its largest value",
                               change > UNSETTLED)
        self._tables = [p.table(first_order(np.concatenate([p.strain, p.stress, p.angle[None]])))
                        for p in self.pieces]
        self._cuts = forces.cuts.tolist()

    def moved(self, e: Array, xi: Array) -> Moved | None:
        """Where the points across are at sections, if not at :attr:`eta` in all of them.

        Parameters
        ----------
        e, xi
            Elements of the sections and places along them, shapes (n,).
        """
        if not self.panels.moving:
            return None
        return kept(self.beam.tables, ("moved", e.tobytes(), xi.tobytes()),
                    lambda: self.panels.moved(self._height(e, xi)))

    def _height(self, e, xi):
        """Of sections on a tapered mesh: numbers or arrays (n,)."""
        mesh = self.beam.mesh
        return mesh.height * mesh.mapping().relative_height(e, xi)[0]

    def modulus(self, strain: Array) -> Array:
        """Change of S_xx with eps_xx while S_yy and S_xy stay, at strains (3, ...)."""
        return self.by_law(_axial, strain)

    def strain_of(self, stress: Array, strain: Array, unknown: Sequence[int] = (0, 1, 2)) -> Array:
        """:func:`strain_of_stress` of each point's law, at the points across sections.

        Parameters
        ----------
        stress, strain, unknown
            As there, shapes (3, ..., n, m).
        """
        return self.by_law(partial(strain_of_stress, unknown=unknown), stress, strain)

    def by_law(self, function: Callable[..., Array], *fields: Array) -> Array:
        """A function of a law and of fields (..., n, m), of the law that each point has.

        Parameters
        ----------
        function
            Takes the law and the fields where it is that of the material.
        *fields
            At the points across sections, shape (..., n, m).
        """
        if len(self.laws) == 1:
            return function(self.laws[0][1], *fields)
        return np.concatenate([function(law, *(f[..., columns] for f in fields))
                               for columns, law in self.laws], axis=-1)

    def of_slabs(self, of: Callable[..., Any], X: Array, e: Array) -> Any:
        """What a method of Across says of each slab at its points.

        Parameters
        ----------
        of
            Takes a slab, points and elements.
        X, e
            Points across sections, shape (2, n, m), and elements, shape (n,).
        """
        slabs = self.beam.across.slabs
        if len(slabs) == 1:
            return of(slabs[0], X, e)
        return np.concatenate([np.broadcast_to(of(slab, X[..., at], e), X[0, :, at].shape)
                               for slab, at in zip(slabs, self.panels.slabs)], axis=-1)

    def of(self, k: int) -> Recovery:
        """The field of one of several states.

        Parameters
        ----------
        k
            Its number.
        """
        one = copy(self)
        one.forces, one._u = self.forces.of(k), self._u[k]
        one.pieces = [piece.of(k) for piece in self.pieces]
        one._tables = [table.of(k) for table in self._tables]
        return one

    def _arc_tables(self):
        x, w = gauss(8)
        axis = self.beam.mesh.mapping().DF(np.array([x, np.full(8, 0.5)]))[:, 0]
        speed = np.hypot(*axis)
        series = np.linalg.solve(chebvander(2.0 * x - 1.0, 7), speed.T)
        inside = chebint(series, lbnd=-1.0, scl=0.5).T  # (ne, 9): the length from xi = 0
        return np.append(0.0, np.cumsum(speed @ w)), inside

    def arc(self, e: ArrayLike, xi: ArrayLike) -> Array:
        """Arc length along the stress-free axis of places of elements.

        Parameters
        ----------
        e, xi
            Elements and places on [0, 1] along them, of any shapes (...) that fit.

        Returns
        -------
        ndarray
            Shape (...).
        """
        e, xi = np.broadcast_arrays(e, xi)
        if self.beam.mesh.is_straight:
            return self.lengths[e] + xi * (self.lengths[e + 1] - self.lengths[e])
        return self.lengths[e] + np.einsum("...k,...k->...", chebvander(2.0 * xi - 1.0, 8),
                                           self._inside[e])

    @cached_property
    def samples(self) -> tuple[Array, Array]:
        """Places along an element, (p,), and its own stress there, (3, ..., ne, p, m)."""
        beam, x = self.beam, self.beam.element.sampling.places("xx")
        X = np.array([np.repeat(x, len(self.eta)), np.tile(self.eta, len(x))])
        of = beam.kinematics
        own = [of.stress(beam, of.strain(beam, u, X, None), u, X, None)
               for u in np.atleast_2d(self._u)]
        stress = own[0] if self._u.ndim == 1 else np.stack(own, axis=1)
        for factor, eigen in self.forces.eigen:
            e = np.arange(beam.mesh.nelements)
            stress = stress - (eigen.stress_at(self._u, X, e, factor) if self._u.ndim == 1 else
                               np.stack([eigen.stress_at(u, X, e, f)
                                         for u, f in zip(self._u, factor)], axis=1))
        stress = stress.reshape(stress.shape[:-1] + (len(x), len(self.eta)))
        if beam.element.sections == "linear":
            return np.array([0.5]), stress.mean(axis=-2, keepdims=True)
        return x, stress

    def fields(self, X: Array, tind: Array | None = None) -> tuple[Array, Array, Array]:
        """Strain (eps_xx, eps_yy, 2 eps_xy), stress (S_xx, S_yy, S_xy) and angle of the fibres.

        Parameters
        ----------
        X
            Reference points, (2, npoints) or (2, nelements, npoints).
        tind
            Elements, shape (nelements,), or None for all.

        Returns
        -------
        strain, stress, angle
            Shapes (3, ne, np), (3, ne, np) and (ne, np).
        """
        e = np.arange(self.beam.mesh.nelements) if tind is None else np.asarray(tind)
        shape = (len(e), X.shape[-1])
        xi, eta = (np.broadcast_to(x, shape).ravel() for x in X)
        e = np.broadcast_to(e[:, None], shape).ravel()
        values = self._values(self._places(e, xi, eta), slice(7)).reshape((7,) + shape)
        return values[:3], values[3:6], values[6]

    def at(self, part: Part, rows: slice = slice(7)) -> Array:
        """Rows of strain, stress and angle (7 in all) at points of the beam; (rows, n).

        Parameters
        ----------
        part
            The :class:`~skfem_ancf.beam.interpolation.Part` with the points.
        rows
            A slice of the seven rows.
        """
        places = part.tables.get("recovery")
        if places is None:
            places = part.tables["recovery"] = self._places(part.e, *part.X)
        return self._values(places, rows)

    def _places(self, e, xi, eta):
        """What evaluation at points (n,) needs and does not change with the state.

        Stations, whether they are the right end of their element, arc lengths, and what lies
        across: what :meth:`.panels.Panels.by_panel` returns.
        """
        end = xi > 1.0 - SNAP
        station = e + np.where(end, 1.0, np.where(xi < SNAP, 0.0, xi))
        if self.panels.moving:
            eta = self.panels.place(eta, self._height(e, xi))
        return station, end, self.arc(e, xi), self.panels.by_panel(eta)

    def _values(self, places, rows):
        station, end, s, panels = places
        # a point at a cut that is a node belongs to the piece of its own element
        piece = np.where(end, np.searchsorted(self._cuts, station),
                         np.searchsorted(self._cuts, station, side="right")) - 1
        piece = np.clip(piece, 0, len(self._tables) - 1)
        out = np.empty((len(range(*rows.indices(7))), len(s)))
        for at, columns, weights in panels:
            where, of = s[at], piece[at]
            found = np.empty((len(out), len(where)))
            alone = len(self._tables) == 1
            for k in (0,) if alone else np.unique(of):
                on = slice(None) if alone else of == k
                found[:, on] = self._tables[k].many(where[on], weights[on], rows, columns)
            out[:, at] = found
        return out

    @staticmethod
    def gradient(strain: Array, angle: Array) -> Array:
        """The deformation gradient.

        ``F[:, 0]`` and ``F[:, 1]`` are the derivatives of the position along the axis and across
        the section, in global components.

        Parameters
        ----------
        strain
            (eps_xx, eps_yy, 2 eps_xy), shape (3, ...).
        angle
            Angle of the fibres, in radians, shape (...).

        Returns
        -------
        ndarray
            Shape (2, 2, ...).
        """
        lam_x, lam_y = np.sqrt(1.0 + 2.0 * strain[:2])
        across = angle + np.arccos(strain[2] / (lam_x * lam_y))
        return np.array([[lam_x * np.cos(angle), lam_y * np.cos(across)],
                         [lam_x * np.sin(angle), lam_y * np.sin(across)]])


def actions(state: Configuration) -> list[list[float]]:
    """Where supports and joints act on each beam of a state: element + xi, a list a beam."""
    system = state.system
    t = state.load if state.t is None else state.t
    held = np.zeros(system.N)
    held[system.constraints.fixed] = 1.0
    acting = system.forces.acting_rows()
    u = state.u if state.base is None else state.base.u
    J = sparse.vstack([system.constraints.sparse_jacobian(u, t), acting]).tocsc() if (
        system.constraints.m or len(acting)) else None
    out: list[list[float]] = []
    for beam, s in zip(system.beams, system.slices):
        nodes = np.nonzero(np.any(held[s].reshape(-1, beam.nd) != 0, axis=1))[0]
        stations = [station_of_node(beam.mesh, int(k)) for k in nodes]
        here = None if J is None else J[:, s]
        for row in () if here is None else here[np.unique(here.indices)].toarray():
            if np.any(row):
                # an equation between neighbouring nodes: at both
                loaded = np.nonzero(np.any(row.reshape(-1, beam.nd) != 0, axis=1))[0]
                stations += (stations_of_vector(beam, row)
                             or [station_of_node(beam.mesh, int(k)) for k in loaded])
        out.append(stations)
    return out


def distributed(states: Sequence[Configuration], beam: Beam) -> tuple[list[Sampled], list[float]]:
    """What force elements that act all along a beam do there, and the stations of other parts.

    Parameters
    ----------
    states
        States of one scene.
    beam
        One of its beams.

    Raises
    ------
    NotRecovered
        If a force element does not say where it acts.
    """
    system = states[0].system
    sampled: list[Sampled] = []
    stations: list[float] = []
    elements = [e for e in system.forces.elements if e.distributed]
    if not elements:
        return sampled, stations
    force = -np.array([
        system.part_forces(state.u, state.v) if state.base is None else state.unit
        * system.small_part_forces(state.base.u, state.u - state.base.u, state.load)
        for state in states])
    for element in elements:
        if element.along is None:
            raise NotRecovered(f"how {element!r} acts along the beam is not known to it")
        where, facets, at = element.along
        if where is not beam:
            continue
        stations += at
        rows = system.forces.rows_of(element)
        for group in facets:
            w = np.linalg.solve(np.vander(group.xi, increasing=True).T,
                                1.0 / np.arange(1, len(group.xi) + 1))  # of its own rule
            values = force[:, :, rows[len(w) * group.chosen[:, None] + np.arange(len(w))]] / w
            sampled.append(Sampled(group.where, group.elements, group.xi,
                                   values.swapaxes(0, 1)))
    return sampled, stations


def recover(states: Sequence[Configuration], number: int) -> list[Recovery | NotRecovered]:
    """The recovered fields of one beam in some states of a scene, found together.

    Parameters
    ----------
    states
        Each a :class:`~skfem_ancf.results.State`.
    number
        The number of the beam.

    Returns
    -------
    list
        For each state its Recovery, or the NotRecovered that says why there is none.
    """
    loads: list[Any] = []
    alike: dict[Any, list[int]] = {}
    for k, state in enumerate(states):
        u = (state if state.base is None else state.base).u_of(number)
        loads.append([(state.unit * state.load * load.factor(state.t), load.spread(u))
                      for load in state.system.loads if load.beam is state.beams[number]])
        # what acts at other places cuts the beam into other pieces
        case: list[Any] = [tuple(state.actions[number])]
        for factor, spread in loads[-1]:
            case += ([None] if spread is None else [spread.stations] if spread.acts_at_stations
                     else [id(spread), factor != 0.0])
        alike.setdefault(tuple(case), []).append(k)
    found: dict[int, Recovery | NotRecovered] = {}
    for same in alike.values():
        found.update(zip(same, _recover_alike([states[k] for k in same], number,
                                              [loads[k] for k in same])))
    return [found[k] for k in range(len(states))]


def _recover_alike(states, number, loads):
    """As :func:`recover`, of states whose loads act at the same places."""
    first, system = states[0], states[0].system
    beam, s = first.beams[number], system.of(first.beams[number])
    if first.base is not None and not first.from_rest:
        return len(states) * [NotRecovered(
            "it is linearised about a state that is not free of load, a mode of it: its strain "
            "and stress are those of the elements")]
    try:
        together = [(np.array([of[k][0] for of in loads]), spread)
                    for k, (_, spread) in enumerate(loads[0])]
        u = np.array([state.places[s] for state in states])
        sampled, stations = distributed(states, beam)
        acceleration = None if first.acceleration is None else first.unit * np.array(
            [(state.acceleration + system.damping_acceleration(state.v))[s] for state in states])
        time = system.retardation[number]
        viscous = None if first.t is None or time == 0.0 else np.array(
            [viscous_forces(beam, state.u[s], state.v[s], time) for state in states])
        with np.errstate(all="ignore"):
            found = Recovery(SectionForces(
                beam, u, together, [*first.actions[number], *stations], acceleration, sampled,
                viscous), u)
        return [found.of(k) for k in range(len(states))]
    except NotRecovered as reason:
        if reason.which is None or len(states) == 1:
            return [reason] * len(states)
        out = []
        good = [k for k, bad in enumerate(reason.which) if not bad]
        rest = iter(_recover_alike([states[k] for k in good], number, [loads[k] for k in good])
                    if good else ())
        for k, bad in enumerate(reason.which):
            out += _recover_alike([states[k]], number, [loads[k]]) if bad else [next(rest)]
        return out
