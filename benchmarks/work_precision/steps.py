"""One step of each kind: quasi-static, through a snap, in contact, under a load that moves.

Seconds are those of a whole run over its steps. Errors are relative, against closed forms: limit
loads of the von Mises truss, the angle of friction between arm and pin, Krylov's sag of a simple
beam under a moving force, the tip of example 5.2.
"""

import numpy as np

from skfem_ancf import (Beam, Circle, ElementBeamANCF, ElementBeamCable, MeshBeam, Scene, Steps,
                        StVenantKirchhoff)

from .micro import CODE, row, scene, seconds
from .problems import PROBLEMS
from .references import reference


def ramped():
    """Example 5.2 in ten increments of its load."""
    made, P = scene(PROBLEMS["5.2"], ElementBeamANCF(2), 16), PROBLEMS["5.2"]

    def error(history):
        tip = history.state(-1).displacement(P.tip)
        return np.linalg.norm(tip - reference("5.2", "section 2")) / P.L

    return made, lambda: made.run(1.0, increments=10), error


def truss():
    """A bar snaps through and back, increments of the program's choice."""
    rise, span, E, A = 0.3, 1.0, 1e6, 0.03
    length = np.hypot(rise, span)
    mesh = MeshBeam.init_line([0, length / 2, length], 0.3, angle=np.arctan2(rise, span))
    bar = Beam(mesh, ElementBeamANCF(1), StVenantKirchhoff(E, 0.0, 1000.0), width=0.1)
    limit, steps = E * A * rise**3 / (3 * np.sqrt(3) * length**3), Steps(down=1.0, up=1.0)
    load = steps.ramp(down=1.5, up=-1.5)
    made = Scene(bar).pin("left").fix("right", "r^1").point_force(
        (0, -limit), at="right", amplitude=load)
    return made, lambda: made.run(steps), lambda history: np.max(
        np.abs(np.abs(load(history.jumps)) - 1.0))


def snap_fit():
    """A tapered arm rides over a pin with friction, 30 increments a step."""
    mesh = MeshBeam.init_line(np.linspace(0, 20.0, 17), height=lambda s: 2.0 - s / 20.0)
    arm = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2000.0, 0.35, 1e-9), width=5.0)
    steps = Steps(insert=1.0, pull=1.0)
    stroke = steps.ramp(insert=9.0, pull=0.0)

    def of(friction):
        return Scene(arm).clamp("left").obstacle(
            Circle((22.5, -1.5), 1.5), friction=friction, points=40,
            position=lambda t: (-stroke(t), 0.0))

    smooth, made = of(0.0).run(steps, increments=30), of(0.2)

    def error(rough):
        at = smooth.during("insert")
        at = at[(stroke(smooth.t[at]) > 5.0) & (stroke(smooth.t[at]) < 8.5)]
        Fx, Fy = -smooth.reactions("left").force[at].T
        found = np.interp(smooth.t[at], rough.t, np.arctan2(*(
            rough.reactions("left").force.T * [[1], [-1]])))
        return abs(np.tan(found - np.arctan2(-Fx, Fy)).mean() / 0.2 - 1.0)

    return made, lambda: made.run(steps, increments=30), error


def moving_force():
    """A force crosses a simple beam of 60 elements in 400 steps."""
    concrete, h, b, span, P = StVenantKirchhoff(3e10, 0.2, 2500), 0.6, 0.4, 20.0, 500.0
    EI, mass = concrete.E * b * h**3 / 12, concrete.density * b * h
    speed = 0.45 * np.pi / span * np.sqrt(EI / mass)
    mesh = MeshBeam.init_line(np.linspace(0, span, 61), h)
    beam = Beam(mesh, ElementBeamCable(3), concrete, width=b)
    made = Scene(beam).pin("left").fix("right", "r^2").point_force(
        (0, -P), at=lambda t: (speed * t, 0.0))
    end = 0.999 * span / speed

    def error(history):
        n, t = np.arange(1, 60)[:, None], history.t
        passing, frequency = n * np.pi * speed / span, (n * np.pi / span)**2 * np.sqrt(EI / mass)
        sag = np.sum(2 * P / (mass * span) * np.sin(n * np.pi / 2) * (
            np.sin(passing * t) - passing / frequency * np.sin(frequency * t))
            / (frequency**2 - passing**2), axis=0)
        return np.max(np.abs(history.displacement((span / 2, 0))[:, 1] + sag)) / sag.max()

    return made, lambda: made.integrate(end, end / 400, "generalized-alpha"), error


KINDS = {"quasi-static, 5.2 in increments": ramped, "through a snap, von Mises truss": truss,
         "contact with friction, snap-fit": snap_fit, "time step, moving force": moving_force}


def measure(about, watch):
    """A row of each kind."""
    rows = []
    for name in watch(KINDS, "steps"):
        made, run, error = KINDS[name]()
        history = run()
        number = len(history.t) - 1
        rows.append(row("steps", CODE, name, made.beams[0].mesh.nelements, made.N,
                        seconds(run) / number, about, float(error(history)), steps=number))
    return rows
