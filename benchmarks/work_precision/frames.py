"""Square frames under a lateral load, from parameters to the displacement of a corner.

Cells of 1 m, lines of 0.02 m x 0.02 m of steel, clamped to the ground; a force on each node of the
left side. The error is that of the upper left corner, over the height of the frame.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from skfem_ancf import ElementBeamCable, Frame, StVenantKirchhoff

from . import exudyn_beams, ours
from .exudyn_beams import exudyn, items
from .runs import Run, Solver, Timed

SIZE, E, NU, RHO = 0.02, 2.1e11, 0.3, 7850.0
EA = E * SIZE**2
EI = EA * SIZE**2 / 12.0
GA = 10.0 * (1.0 + NU) / (12.0 + 11.0 * NU) * EA / (2.0 * (1.0 + NU))
#: Forces on the nodes (N) that bend frames of so many cells.
FORCE = {2: 2000.0, 14: 2000.0, 30: 1500.0, 100: 600.0}
#: The same of other numbers, times that.
ALL = 6e4
#: Cells up to which Exudyn takes part: with 60 it takes more than 50 s for one element a line.
MOST = 30


@dataclass(frozen=True)
class Square:
    """A frame of so many cells; what a Run asks of a problem."""

    L: int
    name: str = "frames"


def net(cells):
    """Points (n, 2), lines (m, 2), and the numbers of the nodes by storey and axis."""
    number = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    y, x = np.divmod(number.ravel(), cells + 1)
    lines = np.hstack([[number[:-1].ravel(), number[1:].ravel()],
                       [number[1:, :-1].ravel(), number[1:, 1:].ravel()]])
    return np.array([x, y], dtype=float).T, lines.T, number


def force(cells):
    """The force on each node of the left side."""
    return FORCE.get(cells, ALL / cells)


def frame(cells, degree=5, elements=1, part=1.0):
    """The Frame of this package, under a part of the forces."""
    points, lines, number = net(cells)
    made = Frame.from_lines(points, lines, element=ElementBeamCable(degree), elements=elements,
                            material=StVenantKirchhoff(E, NU, RHO), height=SIZE, width=SIZE)
    return made.clamp(number[0]).point_force((part * force(cells), 0.0), at=number[1:, 0])


def run(cells, degree, elements):
    """A Run of this package: all of it is timed."""
    def solve():
        state = frame(cells, degree, elements).solve_static()
        return state, state.displacement((0.0, float(cells)))

    def read(found):
        return found[1], len(found[0].steps), found[0].iterations

    lines = 2 * cells * cells + cells
    dofs = 2 * lines * (elements + 1) * (degree + 1) // 2
    return Run(Square(cells), ours.CODE, f"cable {degree}, {elements} a line", lines * elements,
               "cable", lambda: Solver(solve, read, dofs))


def exudyn_system(cells, elements, nodes, part=1.0):
    """The assembled system of GE2D beams of so many nodes, and its corner."""
    points, lines, number = net(cells)
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()

    def add_node(p):
        return mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*p, 0.0]))

    corners = [add_node(p) for p in points]
    parts = elements * (nodes - 1)
    for i, j in lines:
        a, d = points[i], points[j] - points[i]
        chain = [corners[i], *(add_node(a + k / parts * d) for k in range(1, parts)), corners[j]]
        for k in range(0, parts, nodes - 1):
            mbs.AddObject(items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=chain[k:k + nodes], length=float(np.hypot(*d)) / elements,
                massPerLength=RHO * SIZE**2, crossSectionInertia=RHO * SIZE**4 / 12.0,
                bendingStiffness=EI, axialStiffness=EA, shearStiffness=GA))
    ground = mbs.AddNode(items.NodePointGround())
    fixed = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for k in number[0]:
        for c in range(3):
            marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=corners[k], coordinate=c))
            mbs.AddObject(items.CoordinateConstraint(markerNumbers=[fixed, marker]))
    for k in number[1:, 0]:
        marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=corners[k]))
        mbs.AddLoad(items.Force(markerNumber=marker, loadVector=[part * force(cells), 0.0, 0.0]))
    mbs.Assemble()
    return container, mbs, corners[number[-1, 0]]


def exudyn_run(cells, nodes, elements):
    """A Run of Exudyn's geometrically exact beams: all of it is timed."""
    def solve():
        system = exudyn_system(cells, elements, nodes)  # its container has to live
        mbs, corner = system[1:]
        settings = exudyn_beams.settings(STATIC, 1, 1e-8)
        if not mbs.SolveStatic(settings):
            raise RuntimeError("not solved")
        u = mbs.GetNodeOutput(corner, exudyn.OutputVariableType.Displacement)
        return u[:2], 1, mbs.sys["staticSolver"].it.newtonStepsCount

    kind, lines = {2: "linear", 3: "quadratic"}[nodes], 2 * cells * cells + cells
    inner = lines * (elements * (nodes - 1) - 1)
    return Run(Square(cells), exudyn_beams.CODE, f"GE2D {kind}, {elements} a line",
               lines * elements, "rod",
               lambda: Solver(solve, lambda found: found, 3 * ((cells + 1) ** 2 + inner)))


class STATIC:
    """What the settings of a run ask of a problem."""

    t_end, load = None, "force"


@cache
def reference(cells, model):
    """Displacement (2,) of the corner by the converged model: many elements, and the limit."""
    def tip(made):
        solver = made.build()
        return np.array(solver.read(solver.solve())[0])

    if model == "cable":
        return tip(run(cells, 5, 3))
    coarse, fine = (tip(exudyn_run(cells, 3, n)) for n in (4, 8))
    return fine + (fine - coarse) / 15.0


def runs_of(cells):
    """The runs of a size."""
    yield run(cells, 5, 1)
    if cells < 100:
        yield run(cells, 5, 2)
        yield run(cells, 3, 2)
        yield run(cells, 3, 4)
    if exudyn is None or cells > MOST:
        return
    for nodes, numbers in ((2, (2, 4, 8)), (3, (1, 2, 4))):
        for n in numbers:
            yield exudyn_run(cells, nodes, n)


def measure(sizes, about, watch, memory):
    """Rows of all sizes; the peak memory of this package's is that of one linear system."""
    rows = []
    for cells in watch(sizes, "frames"):
        for made in runs_of(cells):
            timed = Timed(made)
            timed.repeat()
            peak = memory.peak("frames", cells) if made.code == ours.CODE else ""
            rows.append(timed.row(reference(cells, made.model), peak, about))
            rows[-1]["cells"] = cells
    return rows
