"""Runs of Exudyn's planar beams, where it is installed."""

import sys
from contextlib import redirect_stdout

from .problems import GRAVITY, THROW_ALONG, arm_angle, throw
from .runs import Run, Solver

CODE = "Exudyn"
sys.exudynFast = True  # its build without range checks, where the processor allows
try:
    with redirect_stdout(None):
        import exudyn
        import exudyn.itemInterface as items
        from exudyn.beams import GenerateBeamElementsAlongLine
    exudyn.config.printToConsole = False
except ImportError:
    exudyn = items = None

KINDS = {"ANCFCable2D": ("cable", 0), "GE2D linear": ("rod", 2), "GE2D quadratic": ("rod", 3)}


def beam_system(problem, kind, n):
    """The assembled system and its tip node."""
    p, (model, nodes) = problem, KINDS[kind]
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    common = dict(massPerLength=p.rho * p.b * p.h, bendingStiffness=p.EI, axialStiffness=p.EA)
    if model == "cable":
        template = items.ObjectANCFCable2D(**common)
        held = {"clamp": [1, 1, 0, 1], "pin": [1, 1, 0, 0], "arm": [1, 1, 0, 0]}
    else:
        template = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=[0] * nodes, crossSectionInertia=p.rho * p.b * p.h**3 / 12.0,
            shearStiffness=p.GA, **common)
        held = {"clamp": [1, 1, 1], "pin": [1, 1, 0], "arm": [1, 1, 0]}
    gravity = [0.0, -GRAVITY, 0.0] if p.load == "gravity" else [0.0, 0.0, 0.0]
    made = GenerateBeamElementsAlongLine(mbs, [0.0, 0.0, 0.0], [p.L, 0.0, 0.0], n, template,
                                         gravity=gravity,
                                         groundConstraintsStart=held.get(p.support))
    root, tip = made["nodes"][0], made["nodes"][-1]
    if p.support == "arm":
        _turn(mbs, model, root)
    if p.support == "free":
        for node in made["nodes"]:
            vy, slope = throw(mbs.GetNode(node)["referenceCoordinates"][0], p.L)
            rates = [0.0, slope] if model == "cable" else [slope]
            mbs.SetNodeParameter(node, "initialVelocities", [THROW_ALONG, vy, *rates])
    if p.load == "force":
        marker = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=tip))
        mbs.AddLoad(items.Force(markerNumber=marker, loadVector=[0.0, -p.value, 0.0]))
    elif p.load == "moment":
        marker = mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=tip))
        mbs.AddLoad(items.Torque(markerNumber=marker, loadVector=[0.0, 0.0, p.value]))
    mbs.Assemble()
    return container, mbs, tip


def _turn(mbs, model, root):
    """The root node follows the angle of the arm."""
    if model == "rod":
        ground = mbs.AddNode(items.NodePointGround())
        markers = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=k, coordinate=c))
                   for k, c in ((ground, 0), (root, 2))]
        mbs.AddObject(items.CoordinateConstraint(
            markerNumbers=markers, offsetUserFunction=lambda mbs, t, number, offset: arm_angle(t)))
        return
    body = mbs.AddObject(items.ObjectGround())
    markers = [mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=body)),
               mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=root))]
    mbs.AddObject(items.GenericJoint(
        markerNumbers=markers, constrainedAxes=[0, 0, 0, 0, 0, 1],
        offsetUserFunction=lambda mbs, t, number, offsets: [0.0] * 5 + [arm_angle(t)]))


def settings(problem, steps, rtol, dense=False, modified=None):
    """Its settings: nothing written, sparse LU with its pattern kept unless dense.

    ``adaptiveStep`` is off in time: where the residual cannot fall by rtol for round-off, its
    steps would collapse.
    """
    s = exudyn.SimulationSettings()
    s.solution.file.write = s.solution.sensors.active = False
    kinds = exudyn.LinearSolverType
    s.linearSolver.solverType = kinds.EXUdense if dense else kinds.EigenSparse
    s.linearSolver.reuseAnalyzedPattern = not dense
    if problem.t_end is None:
        s.staticSolver.verboseMode = 0
        s.staticSolver.numberOfLoadSteps = steps
        s.staticSolver.computeLoadsJacobian = problem.load == "moment"
        newton = s.staticSolver.newton
    else:
        integration = s.timeIntegration
        integration.verboseMode = 0
        integration.endTime, integration.numberOfSteps = problem.t_end, steps
        integration.adaptiveStep = False
        newton = integration.newton
        newton.absoluteTolerance = 1e-11 * problem.EA  # about the round-off of the axial force
    newton.relativeTolerance = rtol
    if modified is not None:
        newton.useModifiedNewton = modified
    return s


def run(problem, kind, n, steps=1, rtol=1e-8, dense=False, modified=None):
    """A Run of one of its beams."""
    p, static = problem, problem.t_end is None
    words = [kind, *([f"{steps} load steps"] if static else []), f"rtol {rtol:g}",
             *(["dense"] if dense else [])]
    if modified is not None:
        words.append("modified Newton" if modified else "full Newton")

    def build():
        container, mbs, tip = beam_system(p, kind, n)
        options = settings(p, steps, rtol, dense, modified)
        function, name = ((mbs.SolveStatic, "staticSolver") if static
                          else (mbs.SolveDynamic, "dynamicSolver"))

        def solve():
            if not function(options):
                raise RuntimeError("not solved")
            return container

        def read(_):
            u = mbs.GetNodeOutput(tip, exudyn.OutputVariableType.Displacement)
            return u[:2], steps, mbs.sys[name].it.newtonStepsCount

        return Solver(solve, read, mbs.systemData.ODE2Size())

    recipe = "exudyn_beams", (kind, n, steps, rtol, dense, modified), {}
    return Run(p, CODE, ", ".join(words), n, KINDS[kind][0], build, steps, recipe)
