"""A slider-crank with a flexible rod, by Exudyn: the motion that this package is measured against.

    python benchmarks/slider_crank.py

solves it with Exudyn's ANCFCable2D and ObjectRigidBody2D (nothing of skfem_ancf is imported for it)
with two meshes and steps, and writes where the slider and the middle of the rod are to
tests/data/slider_crank.npz, with the largest difference of the two.

A rigid crank of length 0.15 turns by a given angle, from rest to 150 rad/s within 0.04 s, and goes
on; a steel rod of length 0.3 with a square section of 6 mm; a slider of half the mass of the rod on
the line of the crank's axis. The speed is that of Jonker (1989): the rod bends by some percent of
its length.

J. B. Jonker: "A finite element dynamic analysis of spatial mechanisms with flexible links",
Computer Methods in Applied Mechanics and Engineering 76 (1989).
"""

from pathlib import Path

import numpy as np

CRANK, ROD, SIDE, E, DENSITY = 0.15, 0.3, 0.006, 2e11, 7870.0
SPEED, RISE, END = 150.0, 0.04, 0.08
CRANK_MASS, CRANK_INERTIA = 0.5, 1e-3
SLIDER_MASS = 0.5 * DENSITY * SIDE**2 * ROD
FILE = Path(__file__).parents[1] / "tests" / "data" / "slider_crank.npz"
INSTANTS = 80


def angle(t):
    """The angle of the crank."""
    rise = 0.5 * SPEED * (t - RISE / np.pi * np.sin(np.pi * t / RISE))
    return np.where(t < RISE, rise, 0.5 * SPEED * RISE + SPEED * (t - RISE))


def scene(elements):
    """The same of skfem_ancf, with quintic cables: the scene, and its crank, rod and slider.

    Exudyn's cables have no rotary inertia.
    """
    from skfem_ancf import Beam, ElementBeamCable, MeshBeam, RigidBody, Scene, Section

    x = np.linspace(CRANK, CRANK + ROD, elements + 1)
    A = SIDE**2
    rod = Beam(MeshBeam.init_line(x, SIDE), ElementBeamCable(), section=Section.numbers(
        EA=E * A, EI=E * A * A / 12, rhoA=DENSITY * A, rhoI=1e-9 * DENSITY * A * A))
    crank = RigidBody(CRANK_MASS, CRANK_INERTIA, (CRANK / 2, 0), name="crank")
    slider = RigidBody(SLIDER_MASS, 1e-6, (x[-1], 0), name="slider")
    out = Scene(crank, rod, slider).pin((0, 0), crank)
    out.motor(crank, angle=angle)
    out.hinge((crank, (x[0], 0)), (rod, (x[0], 0)))
    out.hinge((rod, (x[-1], 0)), slider)
    out.slider(slider, "ground", direction=(1, 0), angle=True)
    return out, crank, rod, slider


def solve(elements, steps):
    """Times, places of the slider and of the middle of the rod: shapes (nt,), (nt,), (nt, 2)."""
    import exudyn as exu
    from exudyn.beams import GenerateStraightLineANCFCable2D
    from exudyn.itemInterface import (Cable2D, CoordinateConstraint, MarkerBodyPosition,
                                      MarkerNodeCoordinate, MarkerNodePosition, NodePoint2D,
                                      NodePointGround, NodeRigidBody2D, ObjectGround,
                                      ObjectJointRevolute2D, ObjectMassPoint2D, ObjectRigidBody2D,
                                      SensorNode)

    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(ObjectGround())
    fixed = mbs.AddMarker(MarkerNodeCoordinate(
        nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))

    crank_node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[CRANK / 2, 0, 0]))
    crank = mbs.AddObject(ObjectRigidBody2D(physicsMass=CRANK_MASS, physicsInertia=CRANK_INERTIA,
                                            nodeNumber=crank_node))
    cable = Cable2D(physicsMassPerLength=DENSITY * SIDE**2, physicsAxialStiffness=E * SIDE**2,
                    physicsBendingStiffness=E * SIDE**4 / 12, useReducedOrderIntegration=False)
    nodes = GenerateStraightLineANCFCable2D(
        mbs, [CRANK, 0, 0], [CRANK + ROD, 0, 0], elements, cable)[0]
    slider_node = mbs.AddNode(NodePoint2D(referenceCoordinates=[CRANK + ROD, 0]))
    mbs.AddObject(ObjectMassPoint2D(physicsMass=SLIDER_MASS, nodeNumber=slider_node))

    def body(x):
        return mbs.AddMarker(MarkerBodyPosition(bodyNumber=crank, localPosition=[x, 0, 0]))

    def node(number):
        return mbs.AddMarker(MarkerNodePosition(nodeNumber=number))

    def coordinate(number, k):
        return mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=number, coordinate=k))

    origin = mbs.AddMarker(MarkerBodyPosition(bodyNumber=ground))
    for pair in ([origin, body(-CRANK / 2)], [body(CRANK / 2), node(nodes[0])],
                 [node(nodes[-1]), node(slider_node)]):
        mbs.AddObject(ObjectJointRevolute2D(markerNumbers=pair))
    mbs.AddObject(CoordinateConstraint(markerNumbers=[fixed, coordinate(slider_node, 1)]))
    mbs.AddObject(CoordinateConstraint(
        markerNumbers=[fixed, coordinate(crank_node, 2)],
        offsetUserFunction=lambda mbs, t, number, offset: float(angle(t))))
    sensors = [mbs.AddSensor(SensorNode(nodeNumber=n, storeInternal=True,
                                        outputVariableType=exu.OutputVariableType.Position))
               for n in (slider_node, nodes[elements // 2])]
    mbs.Assemble()

    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = steps, END
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.8
    settings.timeIntegration.newton.relativeTolerance = 1e-6
    settings.timeIntegration.newton.absoluteTolerance = 1e-6
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = END / INSTANTS
    settings.timeIntegration.verboseMode = 0
    if not mbs.SolveDynamic(settings):
        raise RuntimeError("Exudyn has not solved it")
    slider, middle = (np.array(mbs.GetSensorStoredData(s)) for s in sensors)
    return slider[:, 0], slider[:, 1], middle[:, 1:3]


def main():
    """Write the file."""
    rough, fine = solve(16, 4000), solve(32, 8000)
    error = max(np.abs(a - b).max() for a, b in zip(rough[1:], fine[1:]))
    t, slider, middle = fine
    np.savez_compressed(FILE, t=t, slider=slider, middle=middle, error=error)
    print(f"{FILE}: {len(t)} instants, off by {error:.2g} m")


if __name__ == "__main__":
    main()
