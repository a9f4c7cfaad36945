"""Checks of a state against the range of the law and the resolution of the mesh."""

from dataclasses import dataclass
from math import atan, sqrt
from typing import Any

import numpy as np

from ..actions.contact.contacts import YIELDS
from ..actions.joints.weld import PrescribedDisplacement
from ..beam import SNAP, Beam, kinematics
from ..beam.kinematics import tangents
from ..core import ModelWarning, StabilityWarning, warn
from ..equations.evaluation import RANGE
from ..equations.mobility import who
from ..equations.rank import linked
from ..equations.stability import response
from ..materials.base import LinearLaw
from ..recovery.grids import values_of_domain

#: Stretch below which St. Venant-Kirchhoff softens in compression: the force of a fibre,
#: E (l^3 - l) / 2, has its minimum there.
COMPRESSED = 1.0 / sqrt(3.0)
#: Largest rotation of the axis over one element in radians, for a cubic axis and others. Tip errors
#: in pure bending are then about 1 % of the length, and 1e-5.
TURNING = {3: 1.0, 5: 1.6, 7: 2.0}
TURNING_SMOOTH = 2.5
#: Largest strain of Hooke's law, where laws that agree for small strains differ by 5 % in stress;
#: largest strain of any law that is not asked for its units.
HOOKE, UNITS = 0.03, 10.0
#: Largest rotation in linear theory, in radians, with an error of about 1 %.
SMALL = 0.1
#: Least ratio of lateral to normal force of a checked kink, and least length of the kink due to
#: bending stiffness, relative to an element.
KINKED, FOLLOWED = 0.05, 0.3


@dataclass(frozen=True)
class Checks:
    """Extreme values of a state.

    Attributes
    ----------
    smallest_det
        Smallest determinant of the deformation gradient at the integration points of beams, and at
        the points of domains that pictures show.
    smallest_stretch, largest_stretch
        Smallest and largest principal stretch at these points; for a cable in its outermost fibres.
    turning
        Largest rotation of the axis over one element, in radians, from the reference configuration.
    utilisation : Extreme or None
        The largest stress over strength, see :meth:`State.extremes
        <skfem_ancf.State.extremes>`; None if no material has a strength.
    findings : tuple of str
        Violations of the range of the law or the mesh.

    For a linear solution the values are linear, and a finding tells if displacements are not small.
    """

    smallest_det: float
    smallest_stretch: float
    largest_stretch: float
    turning: float
    findings: tuple = ()
    utilisation: Any = None

    def __str__(self):
        lines = [f"det F from {self.smallest_det:.4g}, stretch from {self.smallest_stretch:.4g} to "
                 f"{self.largest_stretch:.4g}, turning {self.turning:.3g} rad an element"]
        if self.utilisation is not None:
            lines.append(f"largest utilisation {self.utilisation}")
        return "\n".join(lines + [f"beyond its range: {text}" for text in self.findings])


def _of(member):
    """Whose it is, in words."""
    kind = "beam" if isinstance(member, Beam) else "domain"
    return "" if member.name is None else f" of {kind} {member.name!r}"


def check(state: Any) -> Checks:
    """The :class:`Checks` of a state."""
    values, found = [], []
    for beam in state.beams:
        u, base = state.u_of(beam), None if state.base is None else state.base.u_of(beam)
        ratio, stretches = kinematics.deformation(beam, state._places[state.system.of(beam)])
        least, most = np.min(stretches), np.max(stretches)
        if base is None:
            bent = kinematics.bent(beam, u)[0]
            found += _findings(beam, least, bent)
            if not state._eigenstrains(beam):
                found += _strained(beam, beam.kernel.linear, least, most)
        else:  # turns of the nodes, linear about the base
            start = tangents(beam, base)
            turns, (left, right) = (tangents(beam, u) / start).imag, beam.mesh.t
            before = np.angle(start / tangents(beam, 0.0))
            bent = np.max(np.abs((before + turns)[right] - (before + turns)[left]))
            if (by := np.max(np.abs(turns))) > SMALL:
                found.append(
                    f"the axis{_of(beam)} turns by {by:.3g} rad, and what is linear leaves out "
                    "what is of the order of the square of that; beyond "
                    f"{SMALL:g} rad use solve_static()")
        values.append((np.min(ratio), least, most, bent))
    for domain in state.system.domains if state.base is None else ():
        v = values_of_domain(state, domain)[0]
        stretches = np.sqrt(np.maximum(1.0 + 2.0 * v.principal[0], 0.0))
        values.append((np.min(np.linalg.det(np.moveaxis(v.F, 2, 0))), np.min(stretches),
                       np.max(stretches), 0.0))
        hooke = any(isinstance(one.law(), LinearLaw) for one, _, _ in materials_of(domain))
        found += _strained(domain, hooke, *values[-1][1:3])
    found += pushed_points(state.system)
    if state.converged and state.t is None and state.base is None:
        found += [f"strain and stress{_of(beam)} are those of the elements, recovery failed: {why}"
                  for k, (beam, why) in enumerate(zip(state.beams, state.recovered.values()))
                  if state._recoveries[k].failed]
    worst = None
    if has_strength(state):
        worst = state.extremes(count=1)[0]
        if worst.value > 1.0:
            found.append(f"the stress at {worst.point.round(6).tolist()} of {worst.kind} "
                         f"{worst.beam!r} is {worst.value:.3g} times the strength of the material: "
                         "it yields or breaks there. Use a larger section, a stronger material or "
                         "less load")
    if state.base is None:
        found += _yields(state)
    if state.t is None and state.base is None and state.system.forces.contacts.anchored:
        found += [f"points slip on {one!r}, and friction depends on the path: solve_static goes "
                  "from start to end in one step, along which every point slips straight on. Use "
                  "scene.run with the path of loads, supports and obstacles"
                  for one in state._equations.forces.contacts.slipping(
                      np.array(state.u), state.load)]
    det, low, high, turn = zip(*values or [(1.0, 1.0, 1.0, 0.0)])
    return Checks(float(min(det)), float(min(low)), float(max(high)), float(max(turn)),
                  tuple(found), worst)


def materials_of(member: Any) -> list[tuple[Any, Any, Any]]:
    """Materials of a beam or domain, each with its modulus E(x, y) and its density."""
    if isinstance(member, Beam):
        return [(layer.material, layer.grade, layer.density) for layer in member.across.layers]
    solid = getattr(member, "_solid", None)
    return [] if solid is None else [(solid.material, None, solid.material.density)]


def has_strength(state: Any) -> bool:
    """True if a material of a state has a strength."""
    return any(material.strength is not None for member in state.system.members
               for material, _, _ in materials_of(member))


def _yields(state):
    """Findings of ends and stout bodies that press obstacles of default stiffness in too far."""
    system = state._equations
    contacts = system.forces.contacts
    soft = any(group.largest_factor > 1.0 for _, group in contacts.groups)
    if not soft or system.constraints.missing_supports:
        return
    t = state._time
    respond = response(system, state.u, state.load, t, state.multipliers, state.t)
    yields = contacts.yielding(state.u, t, respond) if system.solver.stays() else []
    for k, share in enumerate(yields):
        if share > YIELDS:
            which, group = contacts.groups[k]
            stiffness = (1.0 + contacts.stiffening[k]) * group.law.stiffness
            yield (f"{contacts.obstacles[which]!r} of default stiffness yields under the end "
                   f"of a beam or a stout body: some {100.0 * share:.2g} % of its force or of "
                   "the displacement. solve_static and scene.run stiffen it; for motions and "
                   f"continuation give stiffness={2.0 * stiffness * share / YIELDS:.2g}, and small "
                   "steps where it touches")


#: Length over height from which on the reaction of a pushed point is right to 0.2 %.
SHORT = 30.0


def warn_of(state: Any) -> None:
    """Warn of a doubtful static solution, and of what is found beyond the range of the model."""
    if state.doubt:
        warn(f"{state.doubt}; the state is {state.verdict}", StabilityWarning)
    contacts = state.system.forces.contacts
    if contacts.groups and not contacts.untouched(state.u):
        for text in state._equations.forces.contacts.sunk(state.u, state.load):
            warn(text, ModelWarning)
    for text in _kinks(state):
        warn(text, ModelWarning)
    warn_of_points(state.system)
    if state._seen == RANGE:
        return
    for beam, s in zip(state.system.beams, state.system.slices):
        u = state.u[s]
        shortest = 1.0 if beam.has_sections and not beam.kernel.linear else (
            kinematics.shortest(beam, u))
        for text in _findings(beam, shortest, 0.0 if state._seen else (
                kinematics.bent(beam, u)[0])):
            warn(f"{text} (state.checks has the numbers)", ModelWarning)


def warn_of_points(system: Any) -> None:
    """Warn of :func:`pushed_points`."""
    for text in pushed_points(system):
        warn(text, ModelWarning)


def warn_of_meetings(system: Any) -> None:
    """Warn of members that meet in the reference configuration where nothing joins them."""
    elements = system.forces.elements
    found = [(e, *met) for e in elements if hasattr(e, "broad_search")
             for met in e.broad_search.meetings()]
    if not found:
        return
    # DOFs that equations, the ground or force elements link
    rows, columns, _ = system.constraints.slopes
    others = [system.constraints.fixed, *(
        e.all_dofs for e in elements if len(e.links) and not hasattr(e, "broad_search"))]
    first = rows.max(initial=-1) + 1
    rows = np.append(rows, np.repeat(first + np.arange(len(others)), list(map(len, others))))
    m = first + len(others)
    group = linked(rows, np.concatenate([columns, *others]), m, system.N)[1][m:]
    told = set()
    for contact, x, ((i, a), (j, b)) in found:
        one, other = (group[2 * contact.dofs[at][:, None] + (0, 1)] for at in (a, b))
        if (i, j) not in told and not np.isin(one, other).any():
            told |= {(i, j), (j, i)}
            x, names = np.round(x + contact.origin, 9) + 0.0, [
                (who(system.members, k) or " of the beam").removeprefix(" of ") for k in (i, j)]
            names[1:] = ["itself"] if i == j else names[1:]
            warn(f"{names[0]} meets {names[1]} near ({x.real:.2g}, {x.imag:.2g}) in the "
                 "reference configuration, and nothing joins them there: "
                 f"{contact!r} takes them for joined, and they do not touch within three heights "
                 "of it. Join them, as by scene.hinge or scene.weld, or move one of them away",
                 ModelWarning)


def pushed_points(system: Any) -> list[str]:
    """Findings of end faces of which a single point is moved along the axis."""
    c, out = system.constraints, list[str]()
    if not (c.moves or c.joints):
        return out
    moved = [dof for dof, value in zip(c.fixed, c.values(1.0)) if value]
    moved += [dof for joint in c.joints if isinstance(joint, PrescribedDisplacement)
              for dof in joint.dofs]
    if not moved:
        return out
    known = {*c.fixed.tolist(), *c.jacobian_entries(np.zeros(system.N), 0.0)[1].tolist()}
    for beam, s in zip(system.beams, system.slices):
        here = [dof - s.start for dof in moved if s.start <= dof < s.stop]
        slopes = [k for k, (_, _, y) in enumerate(beam.element.functionals) if y > 0]
        short = beam.mesh.chain_lengths.min() < SHORT * beam.mesh.height
        if not here or not short or not beam.has_sections or beam.element.order < 2:
            continue
        places = {divmod(dof, beam.nd) for dof in here if dof % beam.nd < 2}
        for node, c in places:
            # a point that is carried along both axes bends the beam rather than pushing it
            end = np.sum(beam.mesh.t == node) == 1 and (node, 1 - c) not in places
            first, along = s.start + node * beam.nd + c, abs(beam.mesh.p_X[c, node])
            if end and along > 0.5 and known.isdisjoint(first + 2 * k for k in slopes):
                out.append(
                    f"a support moves one point of an end face{_of(beam)} along the axis: sections "
                    f"of order {beam.element.order} deform there, and the reaction is too small, "
                    "by up to 17 % if the beam is short. Keep the face plane, by "
                    'scene.joint("plane", at="right") or "left"; where it has to turn, use a cable '
                    "or ElementBeamANCF(1), whose faces are rigid")
    return out


def _kinks(state):
    """Findings of point forces that bend a rope more sharply than its elements can."""
    for load in state.system.loads:
        if not hasattr(load.beam, "mesh"):
            continue  # a rigid body
        distribution, vector = getattr(load, "_distribution", None), getattr(load, "vector", None)
        if vector is None or distribution is None or len(distribution.stations) != 1:
            continue
        beam, station = load.beam, distribution.stations[0]
        force = state.load * load.factor(state.t) * vector.reshape(-1, beam.nd // 2, 2)[:, 0].sum(0)
        at_node = abs(station - round(station)) < SNAP
        if not np.any(force) or (at_node and beam.element.axis_degree == 3):
            continue  # a cubic axis has no curvature in common at a node
        t, k = beam.mesh.t, round(station)
        if at_node and (not 0 < k < t.shape[1] or t[1, k - 1] != t[0, k]):
            continue  # an end
        sides, u = [k - 1, k] if at_node else [int(station)] * 2, state.u_of(beam)
        r = (beam.mesh.p.T + u.reshape(-1, beam.nd // 2, 2)[:, 0])[t[:, sides]]
        chord = (r[1] - r[0]) / np.hypot(*(r[1] - r[0]).T)[:, None]
        left, right = np.split(state._with_history(beam).kernel.forces(u)[sides], 2, axis=1)
        N = min(-left[0, 0] @ chord[0], right[1, 0] @ chord[1])
        along = chord[0] + chord[1]
        lateral = abs(along[0] * force[1] - along[1] * force[0]) / np.hypot(*along)
        if N <= 0.0 or lateral < KINKED * N:
            continue
        # the length of the kink due to bending stiffness, and that of the elements
        EI, length = beam.across.bending, float(np.max(beam.mesh.lengths[sides]))
        reach = sqrt(float(EI[min(max(sides), len(EI) - 1)]) / N)
        if reach < FOLLOWED * length:
            who = " of a beam" if beam.name is None else _of(beam)
            yield (f"a force at a point inside{who} bends its axis by "
                   f"{2.0 * atan(0.5 * lateral / N):.2g} rad within sqrt(EI / N) = {reach:.2g}, "
                   f"and elements there are {length:.2g} long: their axis is smooth, so that the "
                   "deflection is off by up to some per cent, and converges slowly. Let the beam "
                   "end at the point and join another to it by scene.hinge, or use "
                   "ElementBeamCable(3) with a node there, or elements as short as that")


def _findings(beam, stretch, turn):
    who = _of(beam)
    out = []
    if stretch < COMPRESSED and beam.has_sections and beam.kernel.linear:
        out.append(f"a fibre{who} is compressed to {stretch:.3g} of its length; below "
                   f"{COMPRESSED:.3g} St. Venant-Kirchhoff resists less and less: use NeoHookean, "
                   "or a smaller load")
    if not beam.has_sections and stretch <= 0.0:
        out.append(f"the sections{who} overlap: the axis is bent to a radius below half the height")
    limit = TURNING.get(beam.element.axis_degree, TURNING_SMOOTH)
    if turn > limit:
        out.append(f"the mesh{who} is too coarse for the curvature found: the axis turns by "
                   f"{turn:.3g} rad over one element, where {limit:g} is the limit: use more "
                   "elements there, or solve_static(adapt=...); in a Frame, elements=")
    return out


def _strained(member, hooke, low, high):
    """Findings of strains outside of the law."""
    strain = max(high - 1.0, 1.0 - low)
    if strain <= (HOOKE if hooke else UNITS):
        return []
    law = (f": Hooke's law, as in St. Venant-Kirchhoff, is meant for at most {HOOKE:g}, and metals "
           "yield before (ElasticPlastic); for rubber use NeoHookean" if hooke else "")
    return [f"the strain{_of(member)} is {strain:.3g}{law}. Are E and the lengths in the same "
            "units, as Pa and m, or MPa and mm?"]
