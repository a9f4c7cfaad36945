"""Motions that no number of the step size was chosen by: ``tolerances.py --others``.

Other elements, sections and slendernesses, curved axes, tapers, damping, joints, springs, pulses,
and loads that begin at once.
"""

import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                        ElementBeamCable, ElementBeamPatelShabana, KelvinVoigt, MeshBeam,
                        NeoHookean, RigidBody, Scene, StVenantKirchhoff)

GRAVITY = (0.0, -9.81)


def line(n, height, length=1.0, start=0.0, **options):
    return MeshBeam.init_line(np.linspace(start, start + length, n + 1), height, **options)


def arc(n, height, angle=np.pi, radius=0.5, start=np.pi):
    """Of a circle, clockwise: by default a half above the ground."""
    return MeshBeam.init_curve(lambda s: radius * np.array([np.cos(start - s), np.sin(start - s)]),
                               np.linspace(0.0, angle, n + 1), height)


def wave(n, height):
    return MeshBeam.init_curve(lambda s: np.array([s, 0.1 * np.sin(2.0 * np.pi * s)]),
                               np.linspace(0.0, 1.0, n + 1), height)


def body(mesh, element, E, density=1200.0, width=0.02, law=StVenantKirchhoff, **options):
    return Beam(mesh, element, law(E, 0.3, density), width, **options)


def held(beam, how="pin", g=GRAVITY, **options):
    return getattr(Scene(beam), how)("left").gravity(g, **options)


def pushed(beam, force, at=(1.0, 0.0), amplitude=None):
    return Scene(beam).clamp("left").point_force(force, at, amplitude=amplitude)


def pulse(t):
    return np.where(t < 0.1, np.sin(np.pi * t / 0.1) ** 2, 0.0)


def twice():
    """A double pendulum of two rigid bodies."""
    a, b = (RigidBody(1.0, 0.02, (x, 0.0), name=name) for x, name in ((0.25, "a"), (0.75, "b")))
    scene = Scene(a, b).pin((0, 0), a).gravity(GRAVITY)
    scene.hinge((a, (0.5, 0)), (b, (0.5, 0)))
    return scene


def bob():
    """A rigid body on a hinge at the end of a cable."""
    rope = body(line(3, 0.01), ElementBeamCable(5), 5e7, name="rope")
    weight = RigidBody(0.3, 2e-3, (1.1, 0.0), name="weight")
    scene = Scene(rope, weight).pin("left", rope).gravity(GRAVITY)
    scene.hinge((rope, (1, 0)), (weight, (1, 0)))
    return scene


def chain():
    """Three sections on hinges."""
    parts = [body(line(1, 0.05, 0.4, 0.4 * k), ElementBeamANCF(2), 1e6, name=f"{k}")
             for k in range(3)]
    scene = Scene(*parts).pin("left", parts[0]).gravity(GRAVITY)
    for k in (1, 2):
        scene.hinge((parts[k - 1], (0.4 * k, 0)), (parts[k], (0.4 * k, 0)))
    return scene


def corner():
    """Two cables at a right angle, welded, swing on a pin."""
    a = body(line(2, 0.02), ElementBeamCable(5), 1e8, name="a")
    b = body(line(2, 0.02, angle=0.5 * np.pi, origin=(1.0, 0.0)), ElementBeamCable(5), 1e8,
             name="b")
    scene = Scene(a, b).pin("left", a).gravity(GRAVITY)
    scene.weld((a, (1, 0)), (b, (1, 0)))
    return scene


def linkage():
    """A crank drives a flexible coupler and a rocker."""
    crank = RigidBody(0.2, 1e-3, (0.0, 0.1), name="crank")
    rocker = RigidBody(0.4, 5e-3, (0.8, 0.1), name="rocker")
    coupler = body(line(2, 0.01, 0.8, origin=(0.0, 0.2)), ElementBeamCable(5), 2e9, name="coupler")
    scene = Scene(crank, coupler, rocker).pin((0, 0), crank).pin((0.8, -0.1), rocker)
    scene.motor(crank, angle=lambda t: 3.0 * t**3 / (1.0 + t**2))
    scene.hinge((crank, (0, 0.2)), (coupler, (0, 0.2)))
    scene.hinge((coupler, (0.8, 0.2)), (rocker, (0.8, 0.2)))
    return scene


def cart():
    """A cart on a rail, from which a beam hangs sideways."""
    wagon = RigidBody(0.5, 1e-2, (0.0, 0.0), name="wagon")
    beam = body(line(2, 0.02), ElementBeamCable(5), 2e7, name="beam")
    scene = Scene(wagon, beam).gravity(GRAVITY)
    scene.slider(wagon, "ground", direction=(1, 0), angle=True)
    scene.hinge((wagon, (0, 0)), (beam, (0, 0)))
    return scene


def turned():
    """A torque that begins at once turns a section about a pin."""
    scene = Scene(body(line(2, 0.05), ElementBeamANCF(2), 2e6)).pin("left")
    return scene.moment("left", 0.5)


def sprung():
    """A cable on two springs, at an end and at the middle."""
    scene = Scene(body(line(2, 0.02), ElementBeamCable(5), 1e8)).gravity(GRAVITY)
    scene.spring(20.0, ((0, 0), ("ground", (0.0, 0.5))))
    return scene.spring(40.0, ((0.5, 0), ("ground", (0.7, 0.5))))


def twisted():
    """A pin with a torsional spring that resists."""
    scene = held(body(line(3, 0.02), ElementBeamCable(5), 5e7))
    return scene.torsional_spring(2.0, "left", damping=0.02)


def topped():
    """A cantilever with a mass that turns at its end."""
    scene = held(body(line(3, 0.02), ElementBeamCable(5), 2e8), "clamp")
    return scene.point_mass(0.5, (1.0, 0.0), inertia=1e-3)


def shaken():
    scene = Scene(body(line(2, 0.1), ElementBeamANCF(1), 5e6))
    scene.joint("position", at=(0, 0), r=lambda t: (0.05 * np.sin(12.0 * t)**2, 0.0))
    scene.joint("angle", at="left", angle=lambda t: 0.0 * t)
    return scene


def thrown():
    """A free arc that turns and opens."""
    return Scene(body(arc(3, 0.03), ElementBeamCable(5), 1e7)).initial_velocity(
        lambda x: np.array([-4.0 * x[1] + x[0], 4.0 * x[0]]))


def flown():
    """A free beam, pushed by a force that turns with it."""
    return Scene(body(line(2, 0.05), ElementBeamANCF(2), 1e6)).follower_force((0.0, 2.0), (0, 0))


def damped(**options):
    return held(body(line(3, 0.02), ElementBeamCable(5), 5e7), "clamp").damping(**options)


#: By name: what builds it, the end, steps of the reference, whether it has joints.
MOTIONS = {
    "quintic section": (lambda: held(body(line(2, 0.1), ElementBeamANCFHermite(2, 5), 1e6)), 0.8,
                        3000, False),
    "quintic, pushed": (lambda: pushed(body(line(2, 0.1), ElementBeamANCFHermite(1, 5), 1e6),
                                       (0, -5.0)), 0.5, 3000, False),
    "L/h 20, pushed": (lambda: pushed(body(line(4, 0.05), ElementBeamANCF(2), 2e7), (0, -2.0)),
                       0.5, 3000, False),
    "order 1, moment": (lambda: Scene(body(line(4, 0.1), ElementBeamANCF(1), 1e6)).clamp(
        "left").moment("right", 0.5), 0.5, 3000, False),
    "order 3": (lambda: held(body(line(2, 0.1), ElementBeamANCF(3), 5e5)), 0.8, 3000, False),
    "Patel, Shabana": (lambda: held(body(line(2, 0.1), ElementBeamPatelShabana(), 1e6), "clamp"),
                       0.5, 4000, False),
    "cubic section": (lambda: held(body(line(2, 0.1), ElementBeamANCFCubic(2), 5e5)), 0.8, 3000,
                      False),
    "arch": (lambda: Scene(body(arc(4, 0.02), ElementBeamCable(5), 1e8)).clamp("left").clamp(
        "right").gravity((0, -40.0)), 0.5, 4000, False),
    "degree 7": (lambda: held(body(line(2, 0.02), ElementBeamCable(7), 1e8), "clamp"), 0.8, 4000,
                 False),
    "degree 9": (lambda: held(body(line(1, 0.02), ElementBeamCable(9), 2e7)), 0.8, 4000, False),
    "hook": (lambda: pushed(body(arc(3, 0.05, 0.5 * np.pi), ElementBeamANCF(2), 1e7), (0.0, -1.0),
                            (0.0, 0.5)), 0.5, 4000, False),
    "wave": (lambda: held(body(wave(4, 0.02), ElementBeamCable(5), 2e7)), 0.8, 4000, False),
    "damped section": (lambda: held(body(line(2, 0.1), ElementBeamANCF(2), 1e6,
                                         damping=KelvinVoigt(1e-2))), 1.0, 2000, False),
    "damped cable": (lambda: held(body(line(3, 0.05), ElementBeamCable(5), 1e8,
                                       damping=KelvinVoigt(1e-3)), "clamp"), 1.0, 3000, False),
    "Rayleigh": (lambda: damped(mass=0.5, stiffness=5e-4), 1.0, 3000, False),
    "by mass": (lambda: damped(mass=3.0), 1.0, 4000, False),
    "bodies": (twice, 1.5, 2000, True),
    "bob": (bob, 1.0, 4000, True),
    "chain": (chain, 0.8, 4000, True),
    "corner": (corner, 1.0, 4000, True),
    "linkage": (linkage, 1.5, 4000, True),
    "cart": (cart, 1.0, 4000, True),
    "turned": (turned, 0.8, 3000, False),
    "sprung": (sprung, 1.0, 4000, False),
    "twisted": (twisted, 1.0, 4000, False),
    "topped": (topped, 1.0, 4000, False),
    "taper": (lambda: held(body(line(4, lambda x: 0.04 - 0.03 * x), ElementBeamCable(5), 5e7),
                           "clamp"), 0.8, 4000, False),
    "rubber": (lambda: held(body(line(2, 0.1), ElementBeamANCF(2), 2e5, law=NeoHookean)), 0.6,
               3000, False),
    "L/h 10, ramp": (lambda: held(body(line(3, 0.1), ElementBeamANCF(2), 1e8), "clamp", (0, -300.0),
                                  amplitude=lambda t: 1.0 - np.exp(-t / 0.02)), 0.2, 4000, False),
    "L/h 200": (lambda: held(body(line(4, 0.005), ElementBeamCable(5), 2e9)), 0.8, 8000, False),
    "L/h 1000": (lambda: held(body(line(2, 0.001), ElementBeamCable(5), 1e10)), 0.6, 12000, False),
    "pulse": (lambda: pushed(body(line(3, 0.05), ElementBeamCable(5), 1e8), (0.0, -5.0),
                             amplitude=pulse), 0.5, 3000, False),
    "shaken root": (shaken, 0.8, 3000, True),
    "thrown arc": (thrown, 0.8, 4000, False),
    "follower": (flown, 0.6, 3000, False),
}
