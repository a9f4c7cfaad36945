"""Bad arguments end in the package's own errors: never in foreign ones, a hang or a wrong number.

:data:`CALLS` are public calls with arguments that work. Each argument whose kind is known, by its
name or as the call says, is given every value of :data:`BAD`; :data:`TAKES` says which of those are
right after all. Beams are not compiled: the checks are the same.
"""

import contextlib
import pickle
import re
import signal
import threading
import warnings
from functools import lru_cache, partial
from pathlib import Path
from typing import NamedTuple

import meshio
import numpy as np
import pytest
from skfem import LinearForm

from skfem_ancf import (HHT, AncfError, Beam, CallbackError, ConvergenceError, ElementBeamANCF,
                        ElementBeamANCFCubic, ElementBeamCable, Frame, GeneralizedAlpha,
                        KelvinVoigt, MeshBeam, MissingExtra, ModelWarning, NameUnknown, NeoHookean,
                        Newmark, RigidBody, Scene, StVenantKirchhoff, forms)
from skfem_ancf.core.errors import CallError
from skfem_ancf.elements import choose_element
from skfem_ancf.formulations import Assumed, get_formulation
from skfem_ancf.io import PvdWriter
from skfem_ancf.recovery.fields import Field

SECONDS = 5.0  # of the processor that a call with a bad argument may take


def fails(*args, **kwargs):
    """A function that raises."""
    raise KeyError("r")


def returning(value):
    return lambda *args, **kwargs: value


#: What is tried for every argument, by a name for messages.
BAD = {
    "10**400": 10**400, "-10**5000": -10**5000, "10**30": 10**30, "-1": -1, "0": 0, "3.5": 3.5,
    "nan": float("nan"), "inf": float("inf"), "-inf": -float("inf"), "1e-320": 1e-320,
    "True": True, "None": None, "'1.0'": "1.0", "'text'": "text", "''": "", "b'1'": b"1",
    "1j": 1j, "object()": object(), "[]": [], "[99]": [99], "{}": {}, "set": {1.0},
    "[1.0, 2.0, 3.0]": [1.0, 2.0, 3.0], "['0', '1']": ["0", "1"], "ragged": [[1.0, 2.0], [3.0]],
    "ragged pair": [[0.0, 0.0], [1.0, [2.0, 3.0]]], "lone surrogate": "a\ud800b.vtu",
    "[10**400, 0]": [10**400, 0], "[nan, 0]": [float("nan"), 0.0], "[1j, 0]": [1j, 0.0],
    "[None, None]": [None, None], "[True, False]": [True, False],
    "zeros(2, 2, 2)": np.zeros((2, 2, 2)), "object array": np.array([object(), object()]),
    "masked": np.ma.array([0.5, 0.0], mask=[False, True]),
    "list of masked": [(0.0, 0.0), np.ma.array([1.0, 0.0], mask=[False, True])],
    "array of nan": np.full(3, np.nan), "float class": float, "returns text": returning("text"),
    "returns None": returning(None), "returns nan": returning(float("nan")),
    "returns complex": returning(1j), "returns (3, 3)": returning(np.zeros((3, 3))),
    "raises": fails, "takes nothing": lambda: 0.0,
}
POSITIVE = {"10**30", "3.5", "1e-320"}
FUNCTIONS = {"returns text", "returns None", "returns nan", "returns complex", "returns (3, 3)",
             "raises", "takes nothing"}
#: The values of BAD that a kind of argument takes. They may still be refused for their size.
TAKES = {
    "number": POSITIVE | {"-1", "0"}, "positive": POSITIVE, "not negative": POSITIVE | {"0"},
    "graded": POSITIVE | FUNCTIONS,  # a function of the place, which beams ask
    "ratios": {"[1.0, 2.0, 3.0]", "[99]", "[]"}, "index": {"0", "-1"}, "factor": {"10**30", "3.5"},
    "increasing": {"[1.0, 2.0, 3.0]", "[99]"}, "flag": {"True"}, "progress": {"True", "None"},
    "label": {"'text'", "'1.0'"}, "title": {"'text'", "'1.0'", "''"}, "beam": {"0"},
    "facets": {"0"}, "nodes": {"0"}, "elements": {"0", "[]", "[True, False]"},
    "coordinates": {"[]"}, "fields": {"[]"}, "drawn": {"[]", "None"}, "function": {"float class"},
    "varying": POSITIVE | {"-1", "0", "float class"},  # a number, or a function of the time
    "count": set(), "vector": set(), "name": set(), "other": set(), "file": set(),
}
#: Arguments of each kind; with "?" they take None too.
KINDS = {argument: kind for kind, arguments in {
    "vector": "origin diffs about g force t direction center position point",
    "vector?": "through", "number": "displacement M p nu beta gamma rho_inf load neutral",
    "positive": "height width E k_s tol ds dt first_step min_step thickness rtol tolerance dpi",
    "positive?": "fps ds_max max_load adapt locate radius",
    "not negative": "k damping mass normal tangential time inertia", "not negative?": "length",
    "graded": "density", "count": "order degree n max_iterations steps max_elements max_degree nx",
    "name": "points plane sections formulation scheme method kind field precision cmap",
    "beam?": "beam on", "facets": "boundary facets side", "increasing": "x s t_eval",
    "coordinates?": "names", "function": "r test", "function?": "dr amplitude until",
    "flag": "lagrange undeformed recover colorbar one_sided compiled apart signed",
    "progress": "progress", "label?": "name", "title?": "title unit", "index": "i component",
    "file": "filename", "fields": "fields", "elements": "elements tind", "nodes?": "line",
    "other": "mesh element material u X beams between first second subdivide limits state",
    "other?": "start multipliers other outline groups curves"}.items()
    for argument in arguments.split()}
#: What messages call an argument, where that is not its name: regular expressions.
WORDS = {
    "diffs": "shift", "doflocs": "nodes", "x": "points|nodes", "y": "points", "s": "nodes",
    "test": "function", "cmap": "colour map",
    "k": "number of modes|index", "names": "degree of freedom", "form": "[Ff]orm|load",
    "times_or_ix": "refinements|elements|subdomain|function", "item": "Load or a Joint",
    "elements": "element|subdomain|points", "place": "place|node", "what": "component",
    "at": "place|point|boundary|section|facet|beam|node", "tind": "elements|subdomain|function",
    "boundary": "place|point|facet|function|node", "hinges": "hinge|node|line",
    "groups": "group|lines", "curves": "curve", "facets": "place|point|boundary|function",
    "fields": "field", "dr": "derivative", "factors": "factor|body|nodes",
    "filename": "file|read|write",
    "shear_correction": "shear correction", "t_start": "t_eval", "radius": "joints",
    "t_end": "times", "adapt": "max_elements", "function": "function|the field 'f'",
    "side": "place|facet|boundary|point", "between": "point of a spring|beam",
    "other": "beam|place", "first": "point|beam|places", "second": "point|beam|places",
    "body": "rigid bod|beam", "beams": "[Bb]eam", "on": "beam|direction|point",
    "torque": "torque|amplitude",
}


class Call(NamedTuple):
    """A public call: its name, the function, the kind of each argument, valid arguments."""

    name: str
    function: object
    kinds: dict
    valid: dict
    takes: dict  # argument: values of BAD that it takes besides those of its kind


CALLS = []


def call(_name, _function, _kinds="", _takes=None, /, **valid):
    """Enter a call; ``_kinds`` are those that the names of arguments do not say."""
    kinds = {argument: KINDS[argument] for argument in valid if argument in KINDS}
    for pair in _kinds.split():
        argument, kind = pair.split("=")
        kinds[argument] = kind.replace("_", " ")
    CALLS.append(Call(_name, _function, kinds, valid, _takes or {}))


def taken(entry, argument):
    """The labels of BAD that an argument rightly takes."""
    kind = entry.kinds[argument]
    return (TAKES[kind.rstrip("?")] | set(entry.takes.get(argument, ()))
            | ({"None"} if kind.endswith("?") else set()))


# tiny scenes, built once

@lru_cache(None)
def mesh():
    return MeshBeam.init_line([0.0, 0.5, 1.0], height=0.1)


STEEL = StVenantKirchhoff(E=1e6, nu=0.3, density=1.0)


@lru_cache(None)
def beam():
    return Beam(mesh(), ElementBeamANCF(2), STEEL, width=0.1, compiled=False)


@lru_cache(None)
def second():
    """A beam that goes on where :func:`beam` ends."""
    m = MeshBeam.init_line([0.0, 0.5, 1.0], height=0.1, origin=(1.0, 0.0))
    return Beam(m, ElementBeamANCF(2), STEEL, width=0.1, name="second", compiled=False)


def free():
    return Scene(beam())


def clamped():
    return Scene(beam()).clamp("left")


def loaded():
    return clamped().point_force((0.0, -1.0), at=(1.0, 0.0))


def two():
    return Scene(beam(), second()).clamp("left", beam=0)


def with_body(at=(5.0, 5.0)):
    """A beam and a rigid body beside it, or on it."""
    return Scene(beam(), RigidBody(1.0, 1.0, at)).clamp("left")


def frame(points=((0, 0), (0, 1), (1, 1)), lines=((0, 1), (1, 2)), **options):
    return Frame.from_lines(points, lines, **{
        "nodes": {"ground": [0]}, "height": 0.02, "width": 0.02,
        "material": StVenantKirchhoff(2e11, 0.3, density=7800.0), **options})


def held_frame():
    return frame().clamp(0)


state = lru_cache(None)(lambda: loaded().solve_static())
history = lru_cache(None)(lambda: loaded().integrate(t_end=0.02, dt=0.01))
path = lru_cache(None)(lambda: loaded().continuation(steps=2))
column = lru_cache(None)(lambda: clamped().point_force((-1.0, 0.0), at=(1.0, 0.0)))


def of(make, method, **fixed):
    """A method of what ``make`` returns."""
    return lambda **k: getattr(make(), method)(**fixed, **k)


def moving(make, method, *fixed):
    """The same of a scene, and a motion of two steps, which asks what was added."""
    def add(**k):
        scene = make()
        getattr(scene, method)(*fixed, **k)
        return scene.integrate(t_end=0.02, dt=0.01)
    return add


def amplitude(t):
    return 1.0 + t


def circle(s):
    return np.array([np.cos(s), np.sin(s)])


# meshes, elements, materials, beams

call("MeshBeam.init_line", MeshBeam.init_line, "angle=number", x=[0.0, 0.5, 1.0], height=0.1,
     origin=(0.0, 0.0), angle=0.0)
call("MeshBeam.init_curve", MeshBeam.init_curve, r=circle, s=[0.0, 0.5, 1.0], height=0.1,
     dr=lambda s: np.array([-np.sin(s), np.cos(s)]))
call("MeshBeam.init_curve without dr", MeshBeam.init_curve, r=circle, s=[0.0, 0.5], height=0.1)
call("MeshBeam", MeshBeam, "doflocs=other t=other p_X=other? p_Y=other lengths=other p_XY=other?",
     doflocs=np.array([[0.0, 0.5, 1.0], [0.0, 0.0, 0.0]]), t=np.array([[0, 1], [1, 2]]), height=0.1,
     p_X=np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]]), p_XY=np.zeros((2, 3)), sections="linear",
     p_Y=np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), lengths=np.array([0.5, 0.5]))
call("mesh.refined", of(mesh, "refined"), "times_or_ix=elements", times_or_ix=1)
call("mesh.restrict", of(mesh, "restrict"), elements=[0])
call("mesh.translated", of(mesh, "translated"), diffs=(1.0, 0.0))
call("mesh.rotated", of(mesh, "rotated"), "angle=number", angle=1.0, about=(0.0, 0.0))
call("mesh.scaled", of(mesh, "scaled"), "factors=factor", {"factors": ["[99]"]}, factors=2.0)
call("mesh.element_finder", lambda x, y: mesh().element_finder()(x, y), "x=other y=other",
     x=[0.2], y=[0.0])
call("mesh.facets_satisfying", of(mesh, "facets_satisfying"), test=lambda x: x[0] < 0.1)
call("mesh.save", of(mesh, "save"), filename="m.npz")
call("ElementBeamANCF", ElementBeamANCF, order=2, points="chebyshev")
call("ElementBeamANCFCubic", ElementBeamANCFCubic, order=2, points="chebyshev")
call("ElementBeamCable", ElementBeamCable, degree=5)
call("choose_element", choose_element, mesh=mesh(), material=STEEL, fields=["S_xx"], tolerance=1e-3)
for _law in (StVenantKirchhoff, NeoHookean):
    call(_law.__name__, _law, "E=graded density=graded? shear_correction=positive", E=1e6, nu=0.3,
         density=1.0, plane="stress", shear_correction="auto")
call("material.shear_factor", STEEL.shear_factor, element=ElementBeamANCF(2))
call("Assumed", Assumed, "alpha=not_negative", alpha=1.0)
call("get_formulation", get_formulation, formulation="ecm")
call("GeneralizedAlpha", GeneralizedAlpha, rho_inf=0.9)
call("HHT", HHT, "alpha=number", alpha=0.05)
call("Newmark", Newmark, beta=0.25, gamma=0.5)
call("KelvinVoigt", KelvinVoigt, time=1e-3)
for _name in ("energy", "internal_force", "tangent"):
    call(f"forms.{_name}", getattr(forms, _name), material=STEEL, width=0.1, k_s=1.0)
call("forms.mass", forms.mass, "density=positive", density=1.0, width=0.1)
call("forms.traction", lambda **k: forms.traction(**k).assemble(beam().facet_basis("top")),
     t=(0.0, 1.0), width=0.1)
call("forms.of", forms.of, "beam=other", beam=beam())
whole = dict(mesh=mesh(), element=ElementBeamANCF(2), material=STEEL, width=0.1)
call("Beam", Beam, **whole, formulation="ecm", name="rod", compiled=False)
call("Beam, auto", Beam, **{**whole, "element": "auto"}, fields="S_xx", tolerance=1e-3)
call("Beam, damped", Beam, "damping=other?", **whole, damping=KelvinVoigt(1e-3))
call("beam.dofs", of(beam, "dofs"), boundary="left", names=["r^1"])
call("beam.facet_basis", of(beam, "facet_basis"), "intorder=count?", {"intorder": ["0"]},
     facets="top", intorder=2)
for _name in ("strain", "stress", "displacements"):
    call(f"beam.{_name}", of(beam, _name), "tind=elements?", u=np.zeros(beam().N),
         X=np.array([[0.5], [0.5]]), tind=np.array([0]))

# scenes

call("Scene", lambda **k: Scene(*k.values()), beams=beam())
call("scene.clamp", of(free, "clamp"), "thickness=name", boundary="left", beam=0, thickness="fixed")
call("scene.pin", of(free, "pin"), boundary="left", beam=0)
call("scene.fix", of(free, "fix"), "displacement=varying", boundary="left", names=["r^1"],
     displacement=0.0, beam=0)
call("scene.damping", moving(clamped, "damping"), "stiffness=not_negative modal=ratios", mass=0.1,
     stiffness=1e-3, modal=[0.1])
call("scene.spring", moving(clamped, "spring"), between=((1.0, 0.0), (1.0, 0.5)), k=1.0,
     damping=0.1, length=0.4)
call("scene.torsional_spring", moving(clamped, "torsional_spring"), "at=facets angle=number", k=1.0,
     at="right", damping=0.1, beam=0, other=None, angle=0.1)
call("scene.foundation", moving(clamped, "foundation"), k=1.0, side="bottom", one_sided=True,
     damping=0.1, beam=0)
call("scene.drag", moving(clamped, "drag"), "density=not_negative", density=1.0, normal=1.0,
     tangential=0.1, beam=0)
for _name, _valid in {
        "gravity": dict(g=(0.0, -1.0)), "line_load": dict(force=(0.0, -0.1)),
        "point_force": dict(force=(0.0, -1.0), at=(1.0, 0.0)),
        "follower_force": dict(force=(0.0, -0.1), at=(1.0, 0.0), line=0),
        "traction": dict(boundary="top", t=(0.0, -1.0)), "pressure": dict(boundary="top", p=1.0),
        "moment": dict(boundary="right", M=0.1)}.items():
    _kinds = "at=vector" if "at" in _valid else ""
    _takes = {"at": ["returns None"]} if _name == "point_force" else None  # off the beam
    call(f"scene.{_name}", moving(clamped, _name), _kinds, _takes, **_valid, beam=0,
         amplitude=amplitude)
for _name in (clamped, with_body):
    call(f"scene.point_mass, {_name.__name__}", moving(_name, "point_mass"), "at=vector", mass=1.0,
         at=(1.0, 0.0), inertia=0.1, beam=0)
call("scene.load", lambda form, **k: moving(clamped, "load")(
    form=LinearForm(form) if callable(form) and form is not float else form, **k),
     "form=other boundary=facets?", form=lambda v, w: -v[1], boundary="top", beam=0,
     amplitude=amplitude)
call("scene.initial_velocity", moving(clamped, "initial_velocity"), "v=other",
     v=lambda x: 0.0 * x, beam=0)
call("scene.replace", of(clamped, "replace"), "beams=other?", beams=[beam()])
call("scene.plan", of(loaded, "plan"), kind="static")
call("scene.add", of(free, "add"), "item=other", item=loaded().loads[0])
call("scene.state", of(loaded, "state"), "u=other?", {"multipliers": ["[]"]},
     u=np.zeros(beam().N), multipliers=None, load=1.0)

# joints and bodies

for _kind, _make, _kinds, _valid in (
        ("hinge", two, "at=vector", dict(beams=(0, 1), at=(1.0, 0.0))),
        ("weld", two, "at=other", dict(beams=(0, 1), at=("right", "left"))),
        ("line", clamped, "at=vector", dict(at=(1.0, 0.0), direction=(1.0, 0.0), beam=0,
                                            through=(1.0, 0.0))),
        ("circle", clamped, "at=vector", dict(at=(1.0, 0.0), center=(0.0, 0.0), beam=0,
                                              radius=1.0)),
        ("position", clamped, "at=vector", dict(at=(1.0, 0.0), r=lambda t: (1.0, 0.0 * t), beam=0)),
        ("angle", clamped, "at=facets angle=function", dict(at="right", angle=lambda t: 0.1 * t,
                                                            beam=0)),
        ("plane", lambda: free().pin("left"), "at=facets", dict(at="left", beam=0)),
        ("turn", two, "at=other other=other angle=function",
         dict(at=(0, "right"), other=(1, "left"), angle=lambda t: 0.1 * t)),
        ("sleeve", clamped, "at=other angle=flag", dict(at=("ground", (0.5, 0.0)), on=0,
                                                        angle=False)),
        ("slot", clamped, "at=other on=other angle=flag",
         dict(at=(0, (0.75, 0.0)), on="ground", direction=(1.0, 0.0), through=(0.75, 0.0),
              angle=False))):
    call(f"joint {_kind}", moving(_make, "joint", _kind), _kinds, **_valid, name="j")
call("RigidBody", lambda **k: Scene(beam(), RigidBody(**k)).clamp("left").integrate(0.02, 0.01),
     "angle=number mass=positive inertia=positive", mass=1.0, inertia=0.1, position=(0.0, 2.0),
     angle=0.1, name="b", outline=[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
for _name in ("hinge", "weld"):
    call(f"scene.{_name}", lambda first, second, _name=_name, **k: getattr(
        with_body((1.0, 0.0)), _name)(first, second, **k), first=(0, (1.0, 0.0)),
         second=(1, (1.0, 0.0)), name="h")
call("scene.slider", moving(partial(with_body, (0.5, 0.0)), "slider"), "at=other angle=flag",
     at=(1, (0.5, 0.0)), on=0, angle=True, name="s")
for _what, _kind in (("angle", "function"), ("speed", "varying"), ("torque", "varying")):
    call(f"scene.motor, {_what}", moving(lambda: free().pin("left"), "motor"),
         f"at=other {_what}={_kind}", at=(0, "left"),
         **{_what: 0.1 if _kind == "varying" else lambda t: 0.1 * t})

# frames

call("Frame.from_lines", frame, "points=other lines=other nodes=other? hinges=other elements=other "
     "sections=other? tol=not_negative?", {"hinges": ["[]", "0"], **{
         name: ["{}"] for name in ("groups", "nodes", "curves", "sections")}},
     points=((0, 0), (0, 1), (1, 1)), lines=((0, 1), (1, 2)), groups={"a": [0]}, nodes={"b": [1]},
     hinges=[(0, 1)], curves={}, elements=2, sections={}, tol=1e-6, height=0.02)
call("Frame.from_meshio", partial(Frame.from_meshio, height=0.02, width=0.02, material=STEEL),
     "tol=not_negative?", {"groups": ["[]"]}, groups=None, tol=None,
     mesh=meshio.Mesh([[0, 0], [0, 1]], [("line", [[0, 1]])]))
call("frame.hold", lambda place, what: frame().hold(place, what), "place=nodes what=other", place=0,
     what="x")
call("frame.clamp", of(frame, "clamp"), "boundary=nodes", boundary=0)
call("frame.settle", lambda **k: frame(elements=4).clamp(0).settle(**k).solve_static(),
     "place=nodes x=varying? y=varying? angle=varying?", place=2, x=1e-3, y=1e-3, angle=0.1)
call("frame.point_force", moving(held_frame, "point_force"), "at=nodes", force=(0, -1), at=2,
     amplitude=amplitude)
call("frame.moment", moving(held_frame, "moment"), "boundary=nodes", boundary=2, M=1e-3,
     amplitude=amplitude)

# solutions

call("scene.solve_static", of(loaded, "solve_static"), start=None, method="mixed", tol=1e-8,
     max_iterations=30, first_step=1.0, min_step=1e-4, progress=False)
call("scene.solve_static, adapt", of(loaded, "solve_static"), adapt=0.5, max_elements=16,
     max_degree=5)
call("scene.continuation", of(loaded, "continuation"), steps=2, ds=0.02, ds_max=0.1, max_load=None,
     until=lambda point: True, tol=1e-8, max_iterations=15, progress=False)
call("scene.continuation, located", of(loaded, "continuation", steps=1), "branch=other? side=other",
     {"side": ["-1"]}, locate=1e-8, branch=None, side=1)
call("scene.integrate", of(loaded, "integrate", t_end=0.02), "tol=positive? t_eval=increasing? "
     "t_start=number?", {"t_eval": ["[]"]}, dt=0.01, scheme="energy-momentum", start=None,
     t_eval=[0.0, 0.02], tol=1e-10, t_start=0.0, progress=False)
call("scene.integrate, until", of(loaded, "integrate", t_end=0.02, dt=0.01),
     until=lambda state: state.displacement((1.0, 0.0))[1] + 1.0)
call("scene.integrate, t_end", of(clamped, "integrate", dt=0.5), "t_end=positive", t_end=1.0)
call("scene.integrate, auto", of(loaded, "integrate", t_end=1e-3, dt="auto"), rtol=1e-2)
call("scene.modes", of(loaded, "modes"), "k=count state=other?", k=1, state=None)
call("scene.buckling", of(column, "buckling"), "k=count state=other?", k=1, state=None)

# results, files, pictures

for _name in ("displacement", "position", "velocity", "strain", "stress"):
    for _what, _make in {"state": state, "history": history}.items():
        if (_what, _name) != ("state", "velocity"):
            call(f"{_what}.{_name}", of(_make, _name), point=(1.0, 0.0), beam=0)
    call(f"state.{_name}, body", of(lambda: with_body().state(), _name), point=(1.0, 0.0), beam=0)
    call(f"state.{_name}, line", of(lambda: held_frame().state(), _name), point=(0.0, 0.5), line=0)
for _what, _make in {"state": state, "history": history}.items():
    call(f"{_what}.field", of(_make, "field"), field="S_xx", point=(1.0, 0.0), beam=0,
         recover=False)
    call(f"{_what}.to_pyvista", of(_make, "to_pyvista"), "fields=drawn", fields=["S_xx"],
         subdivide=(1, 1), lagrange=False, undeformed=False, recover=False)
call("state.resultants", of(state, "resultants"), "at=vector?", at=(0.5, 0.0), beam=0, recover=True)
call("history.resultants", of(history, "resultants"), "at=vector", at=(0.5, 0.0), beam=0)
call("state.reactions", of(state, "reactions"), boundary="left", beam=0)
call("state.u_of", of(state, "u_of"), "beam=beam?", beam=state().beams[0])
call("history.state", of(history, "state"), "k=index", k=0)
call("history.states", lambda **k: list(history().states(**k)), "instants=other",
     {"instants": ["[]", "None"]}, instants=[0, -1])
call("path.state", of(path, "state"), "k=index", k=0)
call("modes.mode", of(lambda: clamped().modes(1), "mode"), "amplitude=number?", i=0, amplitude=0.1)
call("Field", lambda **k: state().field(Field(**k), (0.5, 0.0)), "name=label function=other "
     "title=title unit=title components=other frame=title", name="f", function=lambda v: v["S_xx"],
     title="t", unit="Pa", signed=True, components=1, frame="beam", neutral=0.0)
call("state.save", of(state, "save"), "fields=drawn", filename="s.vtu", subdivide=(2, 2),
     lagrange=False, undeformed=False, recover=False, fields=["S_xx"], precision="single")
call("PvdWriter", lambda **k: PvdWriter(**k).add(state(), 0.0), filename="s.pvd",
     subdivide=(2, 2), lagrange=False)
call("PvdWriter.add", of(lambda: PvdWriter("s.pvd", subdivide=(1, 1)), "add"), "t=number",
     state=state(), t=0.0)
call("history.save", of(history, "save"), filename="h.pvd", progress=False, subdivide=(1, 1))
call("state.plot", of(state, "plot"), "field=name? cmap=name? limits=other?",
     {"limits": ["[True, False]"]},
     field="S_xx", thickness=1.0, undeformed=True, colorbar=False, cmap="viridis",
     limits=(-1.0, 1.0), title="title", unit="Pa", subdivide=(2, 2), dpi=50)
call("state.plot, magnified", of(state, "plot"),
     "field=name? scale=positive supports=flag loads=flag",
     field="S_xx", scale=2.0, loads=True, supports=True, subdivide=(1, 1), dpi=50)
call("scene.plot", of(clamped, "plot"), "nodes=flag names=flag loads=flag supports=flag",
     nodes=True, names=True, loads=True, supports=True, thickness=1.0, title="title", dpi=50)
call("history.animate", of(history, "animate"), "field=name? frames=count? size=other?",
     {"frames": ["10**30", "10**400"]}, filename="f.gif", field="S_xx", frames=2, fps=5.0,
     recover=False, subdivide=(1, 1), size=(320, 240))
call("state.view", lambda **k: state().view(**k, off_screen=True).close(), "field=name?",
     field="S_xx",
     thickness=1.0, unit="Pa", subdivide=(1, 1), recover=False)
call("state.plot_resultants", of(state, "plot_resultants"), beam=0, title="title", dpi=50)
call("path.plot", of(path, "plot"), "", {"component": ["0"]}, point=(1.0, 0.0), component=1, beam=0)


class Hang(BaseException):
    """A call takes too long."""


@contextlib.contextmanager
def limit(seconds):
    """Raise Hang after some seconds of the processor, where the system can."""
    main = threading.current_thread() is threading.main_thread()
    if not (main and hasattr(signal, "setitimer")):
        yield
        return

    def stop(*_):
        raise Hang

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, seconds),  # at work, whatever else runs
              (signal.SIGALRM, signal.ITIMER_REAL, 12.0 * seconds))  # waiting for something
    before = [signal.signal(number, stop) for number, *_ in timers]
    for _, timer, length in timers:
        signal.setitimer(timer, length)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(timers, before):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)


def wrong(entry, argument, label):
    """What is wrong with the outcome of a call with a bad value, or None."""
    try:
        with limit(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # complex made real, overflow
            warnings.filterwarnings("error", module="skfem_ancf")
            entry.function(**{**entry.valid, argument: BAD[label]})
    except Hang:
        return "takes too long"
    except (ModelWarning, ConvergenceError):
        return None  # the loads are beyond what the body can bear
    except AncfError as error:
        said = rf"\b{re.escape(argument)}\b|{WORDS.get(argument, '(?!)')}"
        return None if re.search(said, str(error)) else f"is not named: {error}"
    except Exception as error:
        return f"raises {type(error).__name__}: {str(error)[:150]}"
    return None if label in taken(entry, argument) else "is accepted"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """What is written goes into a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("entry", CALLS, ids=lambda entry: entry.name)
def test_bad_arguments(entry):
    try:
        entry.function(**entry.valid)
    except MissingExtra as error:
        pytest.skip(str(error))
    found = [f"{argument}={label} {what}" for argument in entry.kinds for label in BAD
             if (what := wrong(entry, argument, label))]
    assert not found, f"{entry.name}:\n" + "\n".join(found)


@pytest.mark.parametrize("action", [MeshBeam.init_line, ElementBeamANCF, Beam, of(free, "clamp"),
                                    of(loaded, "solve_static"), of(state, "displacement"),
                                    of(history, "save", filename="h.pvd"),
                                    of(clamped, "gravity")])
def test_unknown_arguments_are_named(action):
    with pytest.raises((TypeError, NameUnknown), match="nonsense"):
        action(nonsense=1)


def test_files_that_are_no_mesh():
    Path("truncated.npz").write_bytes(b"PK\x03\x04" + bytes(200))
    Path("pickled.npz").write_bytes(pickle.dumps({"p": [1, 2]}))
    np.savez("objects.npz", doflocs=np.array([{}, None], dtype=object), t=1, height=1)
    Path("empty.npz").write_bytes(b"")
    Path("text.npz").write_text("[1, 2]")
    Path("folder.npz").mkdir()
    for name in ("truncated", "pickled", "objects", "empty", "text", "folder", "missing"):
        with pytest.raises(AncfError, match=f"{name}.npz"):
            MeshBeam.load(f"{name}.npz")


# counts that would hang or fill the memory, and times without digits

@pytest.mark.parametrize("action, message", [
    (lambda: loaded().continuation(steps=10**30), "steps must be an integer from 1 to 1000000"),
    (lambda: state().save("s.vtu", subdivide=(10**9, 1)), "two positive integers up to 1000"),
    (lambda: state().plot("S_xx", subdivide=(1, 10**9)), "two positive integers up to 1000"),
    (lambda: loaded().integrate(t_end=1e30, dt=1e-3), "below the round-off of the times"),
    (lambda: loaded().integrate(t_end=1e8, dt=1e-3), r"1e\+11 steps .* the limit is 1e\+09"),
    (lambda: loaded().integrate(t_end=1e-320, dt=1e-3), "between 1e-100 and 1e100"),
    (lambda: loaded().integrate(t_end=1.0, dt=1e-320), "between 1e-100 and 1e100"),
    (lambda: loaded().integrate(t_end=1.0, dt="auto", rtol=1e-300), "at least 1e-12"),
    (lambda: loaded().solve_static(max_iterations=10**12), "from 1 to 10000"),
    (lambda: loaded().solve_static(adapt=1e-3, max_elements=10**30), "from 1 to 10000000"),
    (lambda: beam().mesh.refined(60), "from 0 to 23 .a mesh of 16777216 elements"),
    (lambda: beam().mesh.to_meshquad(10**9, 1), "nx must be an integer from 1 to 1000"),
    (lambda: ElementBeamANCF(10**6), "from 1 to 64"),
    (lambda: history().state(99), "k must be an integer from -3 to 2, got 99"),
    (lambda: path().state(-4), "k must be an integer from -3 to 2, got -4"),
    (lambda: clamped().modes(19), "from 1 to 18, got 19"),
    (lambda: column().buckling(0), "from 1 to 18, got 0"),
])
def test_bounds(action, message):
    with limit(SECONDS), pytest.raises(AncfError, match=message):
        action()


# functions of the caller's

def arc(r):
    return MeshBeam.init_curve(r, [0.0, 0.5, 1.0], height=0.1)


@pytest.mark.parametrize("action, message, cause", [
    (lambda: arc(lambda s: 1 / 0), r"r\(s\) raised ZeroDivisionError.*returns positions",
     ZeroDivisionError),
    (lambda: arc(lambda s: np.array([s, 0.0])), r"r\(s\) raised ValueError.*0 \* s \+ 1",
     ValueError),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: {}[t]).integrate(0.1, 0.1),
     r"amplitude\(t=.*\) raised KeyError", KeyError),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: "1").integrate(0.1, 0.1),
     r"amplitude\(t=.*\) must be a number, got '1'", None),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: None).integrate(0.1, 0.1),
     "got None; does the function return something", None),
    (lambda: clamped().traction("top", lambda x: x[2]), r"t\(x\) raised IndexError", IndexError),
    (lambda: clamped().traction("top", lambda x: "up"), r"t\(x\) must", None),
    (lambda: clamped().initial_velocity(lambda x: 1 / 0), r"v\(x\) raised", ZeroDivisionError),
    (lambda: loaded().continuation(until=lambda point: point.nothing),
     r"until\(point\) raised AttributeError", AttributeError),
    (lambda: loaded().continuation(until=lambda point: None), "must return True or False", None),
    (lambda: clamped().load(LinearForm(lambda v, w: w.q[0] * v[1])), r"uses w\.q.*w\.x",
     (KeyError, AttributeError)),
])
def test_functions_of_the_caller(action, message, cause):
    with pytest.raises(AncfError, match=message) as caught:
        action()
    if cause is not None:
        assert isinstance(caught.value.__cause__, cause)


def test_a_failing_amplitude_keeps_the_motion():
    scene = clamped().gravity((0, -1), amplitude=lambda t: 1.0 if t < 0.055 else 1 / 0)
    with pytest.raises(CallbackError, match="ZeroDivisionError") as caught:
        scene.integrate(t_end=0.1, dt=0.01, scheme="newmark")
    assert 2 <= len(caught.value.state) <= 6


def test_a_component_of_a_curve_may_be_constant():
    mesh = arc(lambda s: (2.0 * s, 0.5))
    assert np.allclose(mesh.p, [[0.0, 1.0, 2.0], [0.5, 0.5, 0.5]], rtol=0, atol=1e-12)
    assert np.allclose(mesh.lengths, 1.0, rtol=1e-10)


# messages

def test_the_nearest_name_is_suggested():
    for action, name in ((lambda: clamped().solve_static(method="Newtn"), "newton"),
                         (lambda: free().clamp("rigth"), "right"),
                         (lambda: free().fix("left", "r_Y0^3"), r"r_Y0\^2"),
                         (lambda: clamped().integrate(1.0, 0.1, scheme="newmrk"), "newmark"),
                         (lambda: state().plot("eps_xz"), "eps_x[xy]"),
                         (lambda: beam().replace(formulation="assumd"), "assumed"),
                         (lambda: free().joint("hing"), "hinge"),
                         (lambda: loaded().plan("statics"), "static"),
                         (lambda: StVenantKirchhoff(1.0, 0.3, plane="stres"), "stress")):
        with pytest.raises(AncfError, match=f"did you mean '{name}'"):
            action()


def test_errors_pickle():
    for error in (NameUnknown("scheme", "hhtt", ("hht",)), MissingExtra("tqdm", "progress"),
                  ConvergenceError("no"), CallError("no")):
        copy = pickle.loads(pickle.dumps(error))
        assert type(copy) is type(error) and str(copy) == str(error)


def test_messages_of_joints_and_supports():
    scene = free().pin("left")
    assert repr(scene.joint("plane", at="left")) == "<PlaneSection at 'left'>"
    assert repr(scene.joint("plane", at="right", name="end")) == "<PlaneSection end at 'right'>"
    with pytest.raises(AncfError, match="name of an end, as 'right', got 'rigth'"):
        clamped().point_force((0, -1), at="rigth")
    clamped().clamp("left", thickness="free").gravity((0, -1)).solve_static()  # the same again
    twice = clamped().gravity((0, -1))
    twice.joint("plane", at="left")
    with pytest.warns(ModelWarning, match="repeat others.*PlaneSection at 'left'"):
        twice.solve_static()


def test_a_missing_package_can_be_installed_from_a_clone_too():
    message = str(MissingExtra("tqdm", "progress"))
    assert 'pip install "skfem-ancf[progress]"' in message
    assert 'pip install ".[progress]"' in message


