"""Frames: lines between nodes with rigid or hinged connections."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..actions.joints.nodes import COMPONENTS, Nodes, chain_ends
from ..actions.loads import DeadLoad, EndMoment, LineLoad, Load, number_at
from ..actions.places import at_node, members_at
from ..actions.symbols import Symbol, force_symbol
from ..beam import Beam, Layout, RigidBody, WhichBeam, WhichMember
from ..beam.kinematics import direction
from ..core import (Array, ArrayLike, InputError, TimeFunction, refuse, require_finite,
                    require_finite_scalar, require_function, require_integer, require_names,
                    require_option, require_options, require_positive, require_unmasked, shown)
from ..elements import ElementBeam, ElementBeamCable
from ..formulations import Formulation
from ..materials import Material
from ..materials.damping import KelvinVoigt
from ..mesh.frame_files import graph_from_meshio
from ..mesh.frame_graph import FrameGraph, mapping_of
from ..mesh.places import as_point, is_point
from .solve import displacement
from ..results.state import State
from ..sections import Section
from .model import Entry
from .scene import Scene

#: Arguments for all lines, or for those of a group.
BEAM = "height", "material", "width", "section", "element", "formulation", "damping", "compiled"
#: Default element.
CABLE = ElementBeamCable(5)
#: Largest number of elements of a line.
MOST = 2**16
#: Name of the beam of lines without a group.
REST = "lines"


class NodeForce(Load):
    """A dead force ``value`` on each of some ends of lines, which are numbered two for each."""

    def __init__(self, ends: Array, value: Array, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(beam, amplitude)
        self.ends, self.value = ends, value

    def bind(self, beam: Beam) -> Load:
        vector = np.zeros(beam.N)
        vector.reshape(-1, beam.nd)[chain_ends(beam).ravel()[self.ends], :2] = self.value
        return DeadLoad(beam, vector, self.amplitude)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        beam = layout.beam(self.beam)
        for node in chain_ends(beam).ravel()[self.ends].tolist():
            yield force_symbol([at_node(layout, beam, node)], self.value)


class NodeMoment(EndMoment):
    """A moment on the section at an end, with the angle in (-pi, pi]."""

    def __init__(self, end: int, M: float, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> None:
        super().__init__(None, M, beam, amplitude)
        self.end = end

    def bind(self, beam: Any) -> Load:
        node = int(chain_ends(beam).ravel()[self.end])
        dofs, c = direction(beam, node)
        return self._with(beam=beam, node=node, dofs=dofs, c=c)

    def angle(self, u: Array) -> float:
        start = self.beam.q0_local[self.dofs] @ self.c @ [1.0, 1.0j]
        return float(np.angle(self.direction(u) @ [1.0, 1.0j] / start))

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        beam = layout.beam(self.beam)
        node = int(chain_ends(beam).ravel()[self.end])
        yield Symbol("moment", (at_node(layout, beam, node),), value=self.M, show=True)


class Frame(Scene):
    """A :class:`Scene` of lines between nodes: use :meth:`from_lines` or :meth:`from_meshio`.

    Lines that meet at a node share its position, and unless hinged its rotation. The degrees of
    freedom of the lines are condensed to those of the nodes, so that cost and memory are those of a
    sparse matrix with three rows for each node, independent of the number of elements. The lines of
    a group are one beam with the name of the group: ``beam="columns"`` in loads, section forces and
    pictures. Supports, forces and moments take nodes: a name, a number, a point (x, y), a function
    of the points, or a list of these.

    Parameters
    ----------
    graph
        The graph, a :class:`~skfem_ancf.mesh.frame_graph.FrameGraph`.
    beams
        A Beam with a chain for each line of a group, for all groups, and one for the other lines.
    lines
        Numbers of the lines in the order of the chains, shape (m,).
    hinged
        Whether the start and the end of each line are hinged, shape (2, m).

    Examples
    --------
    >>> from skfem_ancf import Frame, StVenantKirchhoff
    >>> steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850)
    >>> frame = Frame.from_lines([(0, 0), (0, 3), (4, 3), (4, 0)], [(0, 1), (1, 2), (2, 3)],
    ...                          nodes={"ground": [0, 3]}, material=steel, height=0.2, width=0.1)
    >>> state = frame.clamp("ground").point_force((1e4, 0), at=(0, 3)).solve_static()
    >>> state.converged, round(float(state.displacement((4, 3))[0]), 5)
    (True, 0.00124)
    """

    def __init__(self, graph: FrameGraph, beams: Sequence[Beam], lines: Array,
                 hinged: Array) -> None:
        super().__init__(*beams)
        self.graph, self._lines, self._hinged = graph, lines, hinged
        ends = graph.lines[:, lines].T.ravel()
        self._take(Nodes(ends, hinged[:, lines].T.ravel(),
                         np.zeros((graph.points.shape[1], 3), dtype=bool), graph, lines))
        self.layout.nodes = self._nodes

    def _take(self, nodes):
        with self._lock:
            self._entries, self._system = (Entry(nodes, ()), *self._entries[1:]), None

    @property
    def _nodes(self) -> Any:
        return self._entries[0].given

    def _all(self, kind):
        with self._lock:
            nodes, *others = self._entries
            if issubclass(Nodes, kind) and not nodes.bound:  # after the last support
                nodes = nodes._replace(bound=tuple(nodes.given.bound_on(self.layout)))
                self._entries = nodes, *others
        return super()._all(kind)

    @classmethod
    def from_lines(cls, points: Any, lines: Any, groups: Mapping[str, Any] | None = None,
                   nodes: Mapping[str, Any] | None = None, hinges: Any = (),
                   curves: Mapping[int, Callable[[Array], Any]] | None = None, elements: Any = 1,
                   sections: Mapping[str, Mapping[str, Any]] | None = None,
                   tol: float | None = None, *, height: Any = None,
                   material: Material | None = None,
                   width: float | Callable[..., ArrayLike] | None = None,
                   section: Section | None = None, element: ElementBeam = CABLE,
                   formulation: str | Formulation | type[Formulation] = "assumed",
                   damping: KelvinVoigt | None = None, compiled: bool = True) -> "Frame":
        """A frame of lines between points.

        Parameters
        ----------
        points
            Pairs (x, y): a list, or an array of shape (n, 2).
        lines
            Pairs of numbers of points: a list, or an array of shape (m, 2).
        groups
            Numbers of lines by name: each group is a beam of that name. A line is in one group at
            most; the other lines are the beam "lines".
        nodes
            Numbers of points by name, for supports and loads.
        hinges
            "all" for a truss; or a list of numbers and names of nodes, where all lines are hinged,
            and of pairs (line, node), each by number or name; or an array of such pairs, shape (k,
            2).
        curves
            For the number of a line a function of parameters s (k,) in [0, 1] that returns points
            (2, k) of its axis.
        elements
            Number of elements of every line, or of each line, shape (m,).
        sections
            Arguments of a group, from ``height`` on, that differ from those of the others:
            ``{"columns": {"height": 0.3}}``.
        tol
            Points closer than this are merged into one node, at the place of the first, and a line
            between two of them is omitted; the numbering of points and lines does not change. By
            default 1e-5 of the size of the frame, at most 1e-3 of its longest line, with a
            ModelWarning that lists merged points and points that are nearly as close. With 0
            nothing is merged.
        height
            Of the section, by default that of a standard profile: a number, or for tapered lines a
            function of s (n,), from 0 to 1 along each line from its first point to its second, that
            returns heights (n,), with kinks at nodes of the elements; or a list with one of these
            for each line, in ``sections`` for each line of the group.
        material, width, section, element, formulation, damping, compiled
            As for :class:`~skfem_ancf.Beam`; the element is ``ElementBeamCable(5)`` by default. The
            material coordinate x of functions (x, y) is s.

        Examples
        --------
        A portal with haunches:

        >>> import numpy as np
        >>> from skfem_ancf import Frame, StVenantKirchhoff
        >>> hall = Frame.from_lines(
        ...     [(0, 0), (0, 4), (10, 4), (10, 0)], [(0, 1), (1, 2), (3, 2)], elements=4,
        ...     groups={"columns": [0, 2], "girder": [1]}, width=0.2, sections={
        ...         "columns": {"height": lambda s: 0.3 + 0.3 * s},
        ...         "girder": {"height": lambda s: 0.4 + 0.8 * np.maximum(abs(s - 0.5) - 0.25, 0)}},
        ...     material=StVenantKirchhoff(E=2.1e11, nu=0.3))
        >>> state = hall.clamp([0, 3]).line_load((0, -1e5), beam="girder").solve_static()
        >>> round(float(hall.rotations(state)[1]), 5)
        -0.00188
        """
        graph = FrameGraph(points, lines, groups, nodes, curves, tol)
        beam = dict(height=height, material=material, width=width, section=section, element=element,
                    formulation=formulation, damping=damping, compiled=compiled)
        return cls._made(graph, hinges, elements, sections, beam)

    @classmethod
    def from_meshio(cls, mesh: Any, hinges: Any = (), elements: Any = 1,
                    sections: Mapping[str, Mapping[str, Any]] | None = None, groups: Any = None,
                    tol: float | None = None, *, height: Any = None,
                    material: Material | None = None,
                    width: float | Callable[..., ArrayLike] | None = None,
                    section: Section | None = None, element: ElementBeam = CABLE,
                    formulation: str | Formulation | type[Formulation] = "assumed",
                    damping: KelvinVoigt | None = None, compiled: bool = True,
                    unit: str | None = None) -> "Frame":
        """A frame of the line cells of a mesh: Gmsh's ``.msh``, ``.vtu``, and others.

        Parameters
        ----------
        mesh
            A ``meshio.Mesh``, or a file that meshio reads, or a DXF drawing, whose layers are sets.
            Each cell "line", or a curved "line3", "line4", ..., is a line. Cell sets and physical
            groups are names: those of vertices and point sets name nodes, those of lines name their
            ends, and in :meth:`line_load` the lines. Other kinds of cells are refused.
        hinges, elements, sections, tol
            As for :meth:`from_lines`.
        height, material, width, section, element, formulation, damping, compiled
            As for :meth:`from_lines`.
        groups
            Names of the sets of lines that are beams, without common lines; other sets may overlap.
            By default those named in ``sections``, and those that share no line with another set.
            In files without sets, where meshio stores names as data called "column-girder", one of
            the names must appear here or in ``sections``.
        unit
            Unit of length of the frame, as "m" or "mm": coordinates of a drawing in DXF are
            converted to it from the unit that the drawing states. By default all coordinates are
            taken as they are.

        Examples
        --------
        >>> import meshio
        >>> from skfem_ancf import Frame, StVenantKirchhoff
        >>> mesh = meshio.Mesh([[0, 0], [0, 1], [1, 1]], [("line", [[0, 1], [1, 2]])],
        ...                    cell_sets={"column": [[0]], "girder": [[1]]})
        >>> frame = Frame.from_meshio(mesh, material=StVenantKirchhoff(E=2e11, nu=0.3), height=0.1,
        ...                           width=0.1)
        >>> [beam.name for beam in frame.beams]
        ['column', 'girder']
        """
        named = list(mapping_of("sections", sections))
        beam = dict(height=height, material=material, width=width, section=section, element=element,
                    formulation=formulation, damping=damping, compiled=compiled)
        graph = graph_from_meshio(mesh, groups, named, tol, unit)
        return cls._made(graph, hinges, elements, sections, beam)

    @classmethod
    def _made(cls, graph, hinges, elements, sections, options):
        for name, value in {**options, "hinges": hinges}.items():
            require_unmasked(name, value)
        m = graph.lines.shape[1]
        if isinstance(elements, (int, np.integer)) and not isinstance(elements, bool):
            elements = np.full(m, require_integer("elements", elements, 1, MOST))
        found = require_finite("elements", elements, (m,))
        if np.any(found != np.floor(found)) or not np.all((found >= 1) & (found <= MOST)):
            raise InputError(f"elements is an integer from 1 to {MOST}, or one for each line, got "
                             f"{shown(elements)}")
        elements = found.astype(np.int64)
        sections = mapping_of("sections", sections)
        require_names("group of lines in sections", list(sections), [*graph.beams, REST])
        for name, given in sections.items():
            require_options(f"the section of {name!r}", mapping_of(f"sections[{name!r}]", given),
                            BEAM)
        groups = {name: graph.groups[name] for name in graph.beams}
        rest = np.setdiff1d(graph.distinct, np.concatenate([*groups.values(), [-1]]))
        if len(rest):
            refuse(REST in groups, "lines {} are in no group and would be the beam {!r}, which is "
                   "the name of a group: name it otherwise", rest[:5].tolist(), REST)
            groups[REST] = rest
        beams = []
        for name, lines in groups.items():
            given = {**options, **sections.get(name, {})}
            if given["height"] is None:
                given["height"] = getattr(given["section"], "height", None)
            refuse(given["height"] is None, "the lines need a height: give height=, or in "
                   "sections, as {{{!r}: {{'height': 0.1}}}}", name)
            numbers = lines if "height" in sections.get(name, {}) else np.arange(m)
            height = given.pop("height")
            groups[name] = lines = np.intersect1d(lines, graph.distinct)
            if isinstance(height, (list, tuple)) or not callable(height) and np.ndim(height) == 1:
                refuse(len(height) != len(numbers), "height has {} entries for {} line(s): give "
                       "one for each, or a number or a function of s from 0 to 1 for all",
                       len(height), len(numbers))
                found = [one if callable(one) else require_positive(f"height of line {k}", one)
                         for k, one in zip(numbers, height)]
                height = [found[k] for k in np.searchsorted(numbers, lines)]
            elif not callable(height):
                height = require_finite_scalar("height", height)
            mesh = graph.mesh(lines, elements, height)
            beams.append(Beam(mesh, name=name, **given))
        graph.curves = {}  # the meshes have them
        return cls(graph, beams, np.concatenate(list(groups.values())), _hinged(graph, hinges))

    def __repr__(self):
        n, m = len(np.unique(self.graph.same)), len(self._lines)
        return f"<Frame of {m} line(s) between {n} nodes, {len(self.loads)} load(s)>"

    @property
    def points(self) -> Array:
        """Positions of the nodes, shape (2, n)."""
        return self.graph.points

    def nodes(self, place: Any) -> Array:
        """Numbers of the nodes at a place, shape (k,).

        Parameters
        ----------
        place
            The name of nodes, or of lines for their ends, the number of a node, a point (x, y) as a
            tuple, a function of points x (2, n) that returns n truth values, an array of numbers,
            an array of points (k, 2), or a list of these.
        """
        return self.graph.nodes_at(place)

    # supports

    def hold(self, place: Any, *what: str | Sequence[str]) -> "Frame":
        """Fix the displacement of nodes along x or y, or their rotation.

        Parameters
        ----------
        place, *what
            Nodes, see :meth:`nodes`, and some of "x", "y" and "angle", or a list of these.
        """
        names = [name for one in what for name in require_names("fixed component", one, COMPONENTS)]
        refuse(not names, 'name what is held: "x", "y" or "angle", as hold(0, "x", "y")')
        return self._hold(place, names)

    def _hold(self, place, names, settlements=None):
        """Fix nodes, with optional displacements."""
        known, nodes = self._nodes, self.nodes(place)
        fixed = known.fixed.copy()
        for name in names:
            fixed[nodes, COMPONENTS.index(name)] = True
        if "angle" in names:
            self._require_rigid(nodes, "it has no rotation to hold, pin it")
        self._take(known._with(fixed=fixed, settlements=settlements or known.settlements))
        return self

    def settle(self, place: Any, x: float | Callable[[float], float] | None = None,
               y: float | Callable[[float], float] | None = None,
               angle: float | Callable[[float], float] | None = None) -> "Frame":
        """Prescribe the displacement of nodes along x or y, or their rotation.

        Parameters
        ----------
        place
            Nodes, see :meth:`nodes`.
        x, y, angle
            Displacement from the reference configuration; rotation in radians, counterclockwise: a
            number, proportional to the load factor of a static solution; or a function of time, in
            statics of the load factor.

        Examples
        --------
        Settlement w of a clamp of a girder, E I = 1, causes the shear force 12 E I w / L^3:

        >>> from skfem_ancf import Frame, StVenantKirchhoff
        >>> frame = Frame.from_lines([(0, 0), (1, 0)], [(0, 1)], height=0.01, width=0.01,
        ...                          material=StVenantKirchhoff(12e8, 0.3))
        >>> state = frame.clamp([0, 1]).settle(1, y=-1e-4).solve_static()
        >>> round(float(state.reactions(0).force[1]), 6)
        0.0012
        """
        given = {name: value for name, value in zip(COMPONENTS, (x, y, angle)) if value is not None}
        refuse(not given, "settle() needs a displacement: give x=, y= or angle=, a number or a "
               "function of time")
        settlements, nodes = self._nodes.settlements, self.nodes(place)
        for name, value in given.items():
            settlements = settlements.given(nodes, COMPONENTS.index(name), require_function(
                name, value, "of time that returns a number") if callable(value) else
                require_finite_scalar(name, value))
        return self._hold(place, list(given), settlements)

    def _require_rigid(self, nodes, advice):
        loose = nodes[~self._nodes.rigid[nodes]]
        refuse(len(loose), "all lines are hinged at node {[0]}: {}", loose, advice)

    def clamp(self, boundary: Any, beam: WhichBeam = None, thickness: str = "free") -> "Frame":
        """Fix positions and rotations of nodes, see :meth:`nodes`; hinged lines stay hinged. The
        rotation is that of the best-fit line of a section, which may warp and change its thickness.
        ``beam`` is None and ``thickness`` "free" for a frame."""
        _no_beam(beam)
        require_option("thickness at the nodes of a frame", thickness, ("free",))
        return self._hold(boundary, COMPONENTS)

    def pin(self, boundary: Any, beam: WhichBeam = None) -> "Frame":
        """Fix the positions of nodes, see :meth:`nodes`; ``beam`` is None for a frame."""
        _no_beam(beam)
        return self._hold(boundary, ("x", "y"))

    # loads

    def point_force(self, force: ArrayLike, at: Any, beam: WhichMember = None,
                    amplitude: TimeFunction = None) -> "Frame":
        """A dead force on each of some nodes, see :meth:`nodes`, or on a material point. A point
        (x, y) may lie between nodes, with or without ``beam``; or ``at`` is a function of time that
        returns such points, with ``beam``."""
        require_unmasked("at", at)
        if beam is not None or (  # a point of a line between nodes
                is_point(at) and not isinstance(at, list)
                and not self._nodes.ends_at(self.layout, at) and members_at(self.layout, at)):
            super().point_force(force, at, beam, amplitude)
            return self
        force = require_finite("force", force, (2,))
        number, end = self._ends_at(at)
        self._put(*(NodeForce(end[number == k], force, int(k), amplitude)
                    for k in np.unique(number)))
        return self

    def moment(self, boundary: Any, M: float, beam: WhichMember = None,
               amplitude: TimeFunction = None) -> "Frame":
        """A moment on nodes, see :meth:`nodes`, each with a rigid line; ``beam`` is None."""
        _no_beam(beam)
        M = require_finite_scalar("M", M)
        self._require_rigid(self.nodes(boundary), "no line takes a moment there; leave one of them "
                            "rigid, by pairs (line, node) in hinges")
        self._put(*(NodeMoment(int(end), M, int(k), amplitude)
                    for k, end in zip(*self._ends_at(boundary))))
        return self

    def follower_force(self, force: ArrayLike, at: Any, beam: WhichMember = None,
                       amplitude: TimeFunction = None, line: int | None = None) -> "Frame":
        """A force that rotates with a line: a :class:`~skfem_ancf.FollowerForce`. ``line`` is the
        number of the line whose tangent is used, where several meet."""
        points = self.system.points
        if line is not None:
            beam, line = points.chain_of(line, beam)
        elif not isinstance(beam, RigidBody):
            one = self.layout.beam(number_at(self.layout, at, beam))
            points.find(as_point(at, one.mesh), one, ask=True)
        return super().follower_force(force, at, beam, amplitude, line)

    def line_load(self, force: ArrayLike | Callable[[Array], Array], beam: WhichBeam = None,
                  amplitude: TimeFunction = None) -> "Frame":
        """A dead force per length of the axis of lines. ``beam`` may also be the name of a set of
        lines of the mesh."""
        known = [b.name for b in self.beams]
        if not isinstance(beam, str) or beam in known or beam not in self.graph.groups:
            super().line_load(force, beam, amplitude)
            return self
        loads, chains = [], np.isin(self._lines, self.graph.groups[beam])
        for k, b in enumerate(self.beams):
            some, chains = np.split(chains, [len(chain_ends(b))])
            if np.any(some):
                load = LineLoad(force, k, amplitude)
                loads.append(load._with(chains=np.flatnonzero(some)))
        self._put(*loads)
        return self

    def _ends_at(self, place):
        """Beams (k,) with ends at nodes, and numbers of these ends (k,)."""
        ends = self._nodes.leading(self.nodes(place))
        first = np.cumsum([0] + [chain_ends(beam).size for beam in self.beams])
        number = np.searchsorted(first, ends, side="right") - 1
        return number, ends - first[number]

    # results

    def rotations(self, state: State) -> Array:
        """Rotations of the nodes in (-pi, pi], shape (n,); NaN where all lines are hinged. For a
        linear solution they are linear."""
        joint: Any = self.joints[0]
        u = displacement(self.system, state, "state")
        out = np.full(self.points.shape[1], np.nan)
        rigid = joint.leaders[~joint.hinged[joint.leaders]]
        if state.base is None:
            out[joint.nodes[rigid]] = np.angle(joint.turns(u)[rigid])
        else:
            turns, start = joint.turns(u)[rigid], joint.turns(state.base.u)[rigid]
            out[joint.nodes[rigid]] = np.angle(start) + (turns / start).imag
        return out[self.graph.same]

    def _bare(self, beams):
        for old, new in zip(self.beams, beams):
            a, b = (beam.mesh.p[:, chain_ends(beam)] for beam in (old, new))
            refuse(a.shape != b.shape or np.max(np.abs(a - b)) > 1e-9 * self.graph.size, "{!r} "
                   "must have the lines of {!r} between the same points", new, old)
        frame = type(self)(self.graph, beams, self._lines, self._hinged)
        frame._take(self._entries[0].given)
        return frame


def _no_beam(beam):
    refuse(beam is not None, "a frame is supported and loaded at nodes, got beam={!r}: give a "
           "name, a number, or a point (x, y)", beam)


def _hinged(graph, hinges):
    """Whether the start and the end of each line are hinged, (2, m)."""
    lines = graph.given  # before merging: hinges at a merged end remain
    out = np.zeros(lines.shape, dtype=bool)
    if isinstance(hinges, str) and hinges == "all":
        return ~out
    if isinstance(hinges, (str, int, np.integer)):
        hinges = [hinges]
    refuse(not isinstance(hinges, (list, tuple, set, frozenset)) and not np.ndim(hinges), 'hinges '
           'are "all", or a list of nodes and of pairs (line, node), got {!r}', hinges)
    for one in hinges:
        if isinstance(one, (tuple, list, np.ndarray)) and len(one) == 2:
            line, node = (int(graph.lines_of(one[0])[0]), int(graph.points_at(one[1])[0]))
            at = lines[:, line] == node
            refuse(not np.any(at), "line {} does not end at node {}: it joins {}", line, node,
                   lines[:, line].tolist())
            refuse(line not in graph.distinct, "line {} cannot be hinged: its ends are one node "
                   "within tol = {:.3g}", line, graph.tol)
            out[at, line] = True
        else:
            out |= np.isin(lines, graph.points_at(one))
    return out
