"""Every public call with arguments that work, and for each argument what it takes.

:data:`CALLS` is the table: a name, a function of keywords, the kind of each argument, and valid
arguments. :data:`BAD` are the values that are tried for each of them; :data:`TAKES` says for each
kind which of those are right after all. Beams are not compiled: the doors are the same.
"""

import pickle
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import meshio
import numpy as np
from skfem import Basis, ElementVector, LinearForm

from skfem_ancf import (HHT, Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable,
                        ElementBeamPatelShabana, EnergyMomentum, Frame, GeneralizedAlpha,
                        KelvinVoigt, MeshBeam, NeoHookean, Newmark, RigidBody, Scene,
                        StVenantKirchhoff, forms, reference_coordinates)
from skfem_ancf.dynamics import get_scheme
from skfem_ancf.elements import choose_element
from skfem_ancf.formulations import Assumed, Continuum, get_formulation
from skfem_ancf.recovery.fields import Field
from skfem_ancf.io import PvdWriter, body_fields, save_vtu
from skfem_ancf.io.vtkhdf import VtkHdfWriter
from skfem_ancf.actions.loads import Weight
from skfem_ancf.core.quadrature import gauss, lagrange, tensor
from skfem_ancf.core.sampling import sample


def fails(*args, **kwargs):
    """A function that raises."""
    raise KeyError("r")


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
    "masked": np.ma.array([0.5, 0.0], mask=[False, True]), "masked integers": np.ma.array(
        [0, 1], mask=[False, True]),
    "list of masked": [(0.0, 0.0), np.ma.array([1.0, 0.0], mask=[False, True])],
    "array of nan": np.full(3, np.nan), "float class": float,
    "returns text": lambda *args, **kwargs: "text",
    "returns None": lambda *args, **kwargs: None,
    "returns nan": lambda *args, **kwargs: float("nan"),
    "returns complex": lambda *args, **kwargs: 1j,
    "returns (3, 3)": lambda *args, **kwargs: np.zeros((3, 3)),
    "raises": fails,
    "takes nothing": lambda: 0.0,
}

#: The values of BAD that a kind of argument rightly takes, with the reason. They may still be
#: refused for their size.
TAKES = {
    "number": {k: "a finite number" for k in ("10**30", "-1", "0", "3.5", "1e-320")},
    "positive": {k: "a positive number" for k in ("10**30", "3.5", "1e-320")},
    "graded": {k: "a positive number, or a function that beams ask" for k in (
        "10**30", "3.5", "1e-320", "returns text", "returns None", "returns nan",
        "returns complex", "returns (3, 3)", "raises", "takes nothing")},
    "not negative": {k: "zero or a positive number" for k in ("10**30", "0", "3.5", "1e-320")},
    "ratios": {"[1.0, 2.0, 3.0]": "three ratios", "[99]": "one ratio", "[]": "none"},
    "count": {},
    "index": {k: "an index" for k in ("0", "-1")},
    "vector": {},
    "factor": {"10**30": "a positive number", "3.5": "a positive number"},
    "increasing": {"[1.0, 2.0, 3.0]": "three increasing numbers", "[99]": "one number"},
    "numbers": {k: "numbers" for k in ("[1.0, 2.0, 3.0]", "[99]", "[]", "zeros(2, 2, 2)")},
    "flag": {"True": "a flag"},
    "progress": {"True": "a flag", "None": "decide"},
    "name": {},
    "label": {k: "any text is a label" for k in ("'text'", "'1.0'")},
    "beam": {"0": "the number of a beam"},
    "facets": {k: "the number of a facet" for k in ("0",)},
    "elements": {"0": "no refinement, or the first element", "[]": "no element",
                 "[True, False]": "a mask"},
    "coordinates": {"[]": "no degree of freedom"},
    "fields": {"[]": "no field"},
    "function": {"float class": "a function of a number"},
    "drawn": {"[]": "none"},
    "components": {},
    "title": {k: "any text" for k in ("'text'", "'1.0'", "''")},
    "nodes": {"0": "the number of a node"},
    "other": {},
    "file": {},
}
_OPTIONAL = {"None": "the default"}


#: What messages call an argument, where that is not its name: regular expressions.
WORDS = {
    "doflocs": "nodes", "diffs": "shift", "x": "points|nodes", "y": "points", "s": "nodes",
    "test": "function", "data": "dictionary", "thing": "Load or a Joint",
    "k": "number of modes|index", "cmap": "colour map", "names": "degree of freedom",
    "form": "[Ff]orm|load",
    "times_or_ix": "refinements|elements|subdomain|function", "tind": "elements|subdomain|function",
    "elements": "element|subdomain|points", "at": "place|point|boundary|section|facet|beam|node",
    "boundary": "place|point|facet|function|node", "place": "place|node", "what": "held",
    "hinges": "hinge|node|line", "groups": "group|lines", "curves": "curve", "mesh": "mesh",
    "facets": "place|point|boundary|function",
    "fields": "field", "dr": "derivative", "factors": "factor|body", "filename": "file|read|write",
    "shear_correction": "shear correction", "t_start": "t_eval", "radius": "joints",
    "t_end": "times", "adapt": "max_elements", "function": "function|the field 'f'",
    "side": "place|facet|boundary|point", "between": "point of a spring|beam",
    "other": "beam|place",
    "first": "point|beam|places", "second": "point|beam|places", "body": "rigid bod|beam",
    "beams": "[Bb]eam",
    "on": "beam|direction|point", "torque": "torque|amplitude",
}


class Call(NamedTuple):
    """A public call: its name, the function, the kind of each argument, valid arguments."""

    name: str
    function: object
    kinds: dict
    valid: dict
    takes: dict  # argument: values of BAD that it takes besides those of its kind, with reasons


CALLS = []


def call(name, function, valid, takes=None, /, **kinds):
    """Enter a call; a kind that ends with ``?`` takes None too."""
    CALLS.append(Call(name, function, kinds, valid, takes or {}))


def taken(entry, argument):
    """The labels of BAD that an argument rightly takes, with the reasons."""
    kind = entry.kinds[argument]
    out = dict(TAKES[kind.rstrip("?")])
    if kind.endswith("?"):
        out.update(_OPTIONAL)
    out.update(entry.takes.get(argument, {}))
    return out


# tiny scenes, built once

@lru_cache(None)
def mesh():
    return MeshBeam.init_line([0.0, 0.5, 1.0], height=0.1)


@lru_cache(None)
def steel():
    return StVenantKirchhoff(E=1e6, nu=0.3, density=1.0)


@lru_cache(None)
def beam(cable=False, name=None):
    return Beam(mesh(), ElementBeamCable() if cable else ElementBeamANCF(2), steel(), width=0.1,
                name=name, compiled=False)


@lru_cache(None)
def second():
    """A beam that goes on where :func:`beam` ends."""
    m = MeshBeam.init_line([0.0, 0.5, 1.0], height=0.1, origin=(1.0, 0.0))
    return Beam(m, ElementBeamANCF(2), steel(), width=0.1, name="second", compiled=False)


def free():
    return Scene(beam())


def clamped():
    return Scene(beam()).clamp("left")


def loaded():
    return clamped().point_force((0.0, -1.0), at=(1.0, 0.0))


@lru_cache(None)
def loaded_once():
    """For calls that leave a scene as it is."""
    return loaded()


def two():
    return Scene(beam(), second()).clamp("left", beam=0)


@lru_cache(None)
def state():
    return loaded_once().solve_static()


@lru_cache(None)
def history():
    return loaded_once().integrate(t_end=0.02, dt=0.01)


def add_to_vtkhdf(**arguments):
    with VtkHdfWriter("s.vtkhdf", subdivide=(1, 1)) as writer:
        writer.add(**arguments)


@lru_cache(None)
def path():
    return loaded_once().continuation(steps=2)


@lru_cache(None)
def column():
    return clamped().point_force((-1.0, 0.0), at=(1.0, 0.0))


@lru_cache(None)
def modes():
    return clamped().modes(1)


@lru_cache(None)
def jointed():
    scene = clamped()
    joint = scene.joint("line", at=(1.0, 0.0), direction=(1.0, 0.0))
    scene.point_force((0.0, -1.0), at=(0.5, 0.0))
    return joint, scene.solve_static(), scene.integrate(t_end=0.01, dt=0.01)


@lru_cache(None)
def basis():
    return Basis(mesh(), ElementVector(ElementBeamANCF(1)))


# meshes

line = dict(x=[0.0, 0.5, 1.0], height=0.1, origin=(0.0, 0.0), angle=0.0)
call("MeshBeam.init_line", MeshBeam.init_line, line,
     x="increasing", height="positive", origin="vector", angle="number")


def circle(s):
    return np.array([np.cos(s), np.sin(s)])


def circle_rate(s):
    return np.array([-np.sin(s), np.cos(s)])


call("MeshBeam.init_curve", MeshBeam.init_curve,
     dict(r=circle, s=[0.0, 0.5, 1.0], height=0.1, dr=circle_rate),
     r="function", s="increasing", height="positive", dr="function?")
call("MeshBeam.init_curve without dr", MeshBeam.init_curve,
     dict(r=circle, s=[0.0, 0.5, 1.0], height=0.1), r="function")
call("MeshBeam", MeshBeam,
     dict(doflocs=np.array([[0.0, 0.5, 1.0], [0.0, 0.0, 0.0]]), t=np.array([[0, 1], [1, 2]]),
          height=0.1, p_X=np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]]),
          p_Y=np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), lengths=np.array([0.5, 0.5]),
          p_XY=np.zeros((2, 3)), sections="linear"),
     doflocs="other", t="other", height="positive", p_X="other?", p_Y="other", lengths="other",
     p_XY="other?", sections="name")
call("mesh.with_sections", lambda **k: mesh().with_sections(**k), dict(sections="cubic"),
     sections="name")
call("mesh.refined", lambda **k: mesh().refined(**k), dict(times_or_ix=1), times_or_ix="elements")
call("mesh.restrict", lambda **k: mesh().restrict(**k), dict(elements=[0]),
     {}, elements="elements")
call("mesh.translated", lambda **k: mesh().translated(**k), dict(diffs=(1.0, 0.0)), diffs="vector")
call("mesh.rotated", lambda **k: mesh().rotated(**k), dict(angle=1.0, about=(0.0, 0.0)),
     angle="number", about="vector")
call("mesh.scaled", lambda **k: mesh().scaled(**k), dict(factors=2.0),
     {"factors": {"[99]": "the same in all directions"}}, factors="factor")
call("mesh.to_meshquad", lambda **k: mesh().to_meshquad(**k), dict(nx=2, ny=2), nx="count",
     ny="count")
call("mesh.element_finder", lambda x, y: mesh().element_finder()(x, y),
     dict(x=[0.2], y=[0.0]), x="other", y="other")
call("forms.of", forms.of, dict(beam=beam()), beam="other")
call("mesh.facets_satisfying", lambda **k: mesh().facets_satisfying(**k),
     dict(test=lambda x: x[0] < 0.1), test="function")
call("mesh.elements_satisfying", lambda **k: mesh().elements_satisfying(**k),
     dict(test=lambda x: x[0] < 0.5), test="function")
call("mesh.save", lambda **k: mesh().save(**k), dict(filename="m.npz"), filename="file")
call("mesh.save_npz", lambda **k: mesh().save_npz(**k), dict(filename="m.npz"),
     {"filename": {"'text'": "NumPy adds .npz", "'1.0'": "NumPy adds .npz"}}, filename="file")


def load(filename):
    """Save a mesh, spoil the file as its name says, and load it."""
    if not isinstance(filename, str):
        return MeshBeam.load(filename)
    path = Path(filename)
    if path.stem == "truncated":
        mesh().save(path)
        path.write_bytes(path.read_bytes()[:200])
    elif path.stem == "pickled":
        path.write_bytes(pickle.dumps({"p": [1, 2]}))
    elif path.stem == "objects":
        np.savez(path, doflocs=np.array([{}, None], dtype=object), t=1, height=1, p_X=1, p_Y=1,
                 lengths=1, sections=1)
    elif path.stem == "array":
        with path.open("wb") as file:
            np.save(file, np.zeros(3))
    elif path.stem == "picture":
        path.write_bytes(b"\x89PNG\r\n\x1a\n\x00\x00")
    elif path.stem == "empty":
        path.write_bytes(b"")
    elif path.stem == "list":
        path.write_text("[1, 2]")
    elif path.stem == "other":
        path.write_text('{"p": [[0, 0], [1, 0]], "t": "none", "height": {}}')
    elif path.stem == "folder":
        path.mkdir(exist_ok=True)
    elif path.stem == "m":
        mesh().save(path)
    return MeshBeam.load(path)


#: Files that are no mesh, whatever they end with.
FILES = [f"{stem}.npz" for stem in ("truncated", "pickled", "objects", "array", "picture", "empty",
                                    "list", "other", "folder", "missing")] + ["m.png"]
call("MeshBeam.load", load, dict(filename="m.npz"), filename="file")

# elements, rules, materials, formulations

call("ElementBeamANCF", ElementBeamANCF, dict(order=2, points="chebyshev"), order="count",
     points="name")
call("ElementBeamANCFCubic", ElementBeamANCFCubic, dict(order=2, points="chebyshev"), order="count",
     points="name")
call("ElementBeamCable", ElementBeamCable, dict(degree=5), degree="count")
call("ElementBeamPatelShabana", ElementBeamPatelShabana, {})
call("choose_element", choose_element,
     dict(mesh=mesh(), material=steel(), fields=["S_xx"], tolerance=1e-3),
     mesh="other", material="other", fields="fields", tolerance="positive")
call("gauss", gauss, dict(n=2), n="count")
call("tensor", tensor, dict(axis=gauss(2), section=gauss(2)), axis="other", section="other")
call("lagrange", lagrange, dict(nodes=[0.0, 1.0], x=[0.5]), nodes="numbers", x="numbers")
call("sample", sample, dict(function=lambda t: 2.0 * t, times=np.array([0.0, 1.0])),
     {"function": {k: "a value of any shape" for k in ("returns (3, 3)",)}},
     function="function", times="numbers")
law = dict(E=1e6, nu=0.3, density=1.0, plane="stress", shear_correction="auto")
for _law in (StVenantKirchhoff, NeoHookean):
    call(_law.__name__, _law, law, E="graded", nu="number", density="graded?", plane="name",
         shear_correction="positive")
    call(f"{_law.__name__}.law", _law(1e6, 0.3).law, dict(k_s=0.9), k_s="positive")
call("material.shear_factor", lambda **k: steel().shear_factor(**k),
     dict(element=ElementBeamANCF(2)), element="other")
call("Assumed", Assumed, dict(alpha=1.0),
     {"alpha": {"0": "no stabilisation"}}, alpha="positive")
call("get_formulation", get_formulation, dict(formulation="ecm"), formulation="name")
call("get_scheme", get_scheme, dict(scheme="hht"), scheme="name")
call("formulation.terms", Continuum().terms, dict(element=ElementBeamANCF(2), material=steel()),
     element="other", material="other")
call("GeneralizedAlpha", GeneralizedAlpha, dict(rho_inf=0.9), rho_inf="number")
call("HHT", HHT, dict(alpha=0.05), alpha="number")
call("Newmark", Newmark, dict(beta=0.25, gamma=0.5), beta="number", gamma="number")
call("EnergyMomentum", EnergyMomentum, {})

# forms

for _name in ("energy", "internal_force", "tangent"):
    call(f"forms.{_name}", getattr(forms, _name), dict(material=steel(), width=0.1, k_s=1.0),
         material="other", width="positive", k_s="positive")
for _name in ("internal_force", "tangent"):
    call(f"forms.textbook.{_name}", getattr(forms.textbook, _name),
         dict(material=steel(), width=0.1, k_s=1.0),
         material="other", width="positive", k_s="positive")
call("forms.mass", forms.mass, dict(density=1.0, width=0.1), density="positive", width="positive")
call("forms.gravity", forms.gravity, dict(density=1.0, g=(0.0, -1.0), width=0.1),
     density="positive", g="vector", width="positive")
call("forms.pressure", forms.pressure, dict(width=0.1), width="positive")
call("forms.traction",
     lambda **k: forms.traction(**k).assemble(beam().facet_basis("top")),
     dict(t=(0.0, 1.0), width=0.1), t="vector", width="positive")
call("forms.of", forms.of, dict(beam=beam()), beam="other")
call("reference_coordinates", reference_coordinates, dict(basis=basis()), basis="other")

# beams

whole = dict(mesh=mesh(), element=ElementBeamANCF(2), material=steel(), width=0.1,
             formulation="ecm", name="rod", compiled=False)
call("Beam", Beam, whole, mesh="other", element="other", material="other", width="positive",
     formulation="name", name="label?", compiled="flag")
call("Beam, auto", Beam, {**whole, "element": "auto", "fields": "S_xx", "tolerance": 1e-3},
     fields="fields", tolerance="positive")
call("Beam, damped", Beam, {**whole, "damping": KelvinVoigt(1e-3)}, damping="other?")
call("beam.dofs", lambda **k: beam().dofs(**k), dict(boundary="left", names=["r^1"]),
     boundary="facets", names="coordinates?")
call("beam.probe", lambda **k: beam().probe(**k), dict(point=(0.5, 0.0)), point="vector")
call("beam.facet_basis", lambda **k: beam().facet_basis(**k), dict(facets="top", intorder=2),
     {"intorder": {"0": "a rule of degree 0"}}, facets="facets", intorder="count?")
at = dict(u=np.zeros(beam().N), X=np.array([[0.5], [0.5]]), tind=np.array([0]))
for _name in ("strain", "stress", "displacements", "gradients"):
    call(f"beam.{_name}", lambda _name=_name, **k: getattr(beam(), _name)(**k), at,
         u="other", X="other", tind="elements?")
call("beam.weight", lambda **k: beam().weight(**k), dict(g=(0.0, -1.0)), g="vector")

# scenes: supports and loads

call("Scene", lambda **k: Scene(*k.values()), dict(beams=beam()), beams="other")
call("Scene of a list", lambda **k: Scene([beam(), *k.values()]), dict(beams=second()),
     beams="other")
call("scene.beam", lambda **k: two().beam(**k), dict(beam=0), beam="beam")
call("scene.clamp", lambda **k: free().clamp(**k),
     dict(boundary="left", beam=0, thickness="fixed"), boundary="facets", beam="beam?",
     thickness="name")
call("scene.pin", lambda **k: free().pin(**k), dict(boundary="left", beam=0), boundary="facets",
     beam="beam?")
call("scene.fix", lambda **k: free().fix(**k),
     dict(boundary="left", names=["r^1"], displacement=0.0, beam=0),
     boundary="facets", names="coordinates?", displacement="number", beam="beam?")


def amplitude(t):
    return 1.0 + t


def moved(scene, **options):
    """A motion of two steps, which asks for amplitudes and driven joints."""
    return scene.integrate(t_end=0.02, dt=0.01, **options)


call("KelvinVoigt", KelvinVoigt, dict(time=1e-3), time="not negative")
call("scene.damping", lambda **k: moved(clamped().damping(**k)),
     dict(mass=0.1, stiffness=1e-3, modal=[0.1]), mass="not negative", stiffness="not negative",
     modal="ratios")
ends = dict(between=((1.0, 0.0), (1.0, 0.5)), k=1.0, damping=0.1)
call("scene.spring", lambda **k: moved(clamped().spring(**k)), {**ends, "length": 0.4},
     k="not negative", between="other", damping="not negative", length="not negative?")
call("scene.torsional_spring", lambda **k: moved(clamped().torsional_spring(**k)),
     dict(k=1.0, at="right", damping=0.1, beam=0, other=None, angle=0.1), k="not negative",
     at="facets", damping="not negative", beam="beam?", other="other?", angle="number")
call("scene.foundation", lambda **k: moved(clamped().foundation(**k)),
     dict(k=1.0, side="bottom", one_sided=True, damping=0.1, beam=0), k="not negative",
     side="facets", one_sided="flag", damping="not negative", beam="beam?")
call("scene.drag", lambda **k: moved(clamped().drag(**k)),
     dict(density=1.0, normal=1.0, tangential=0.1, beam=0), density="not negative",
     normal="not negative", tangential="not negative", beam="beam?")
call("scene.point_mass", lambda **k: moved(clamped().point_mass(**k)),
     dict(mass=1.0, at=(1.0, 0.0), inertia=0.1, beam=0), mass="not negative", at="vector",
     inertia="not negative", beam="beam?")
call("scene.follower_force", lambda **k: moved(clamped().follower_force(**k)),
     dict(force=(0.0, -0.1), at=(1.0, 0.0), beam=0, amplitude=amplitude, line=0), force="vector",
     at="vector", beam="beam?", amplitude="function?", line="nodes?")
call("scene.line_load", lambda **k: moved(clamped().line_load(**k)),
     dict(force=(0.0, -0.1), beam=0, amplitude=amplitude), force="vector", beam="beam?",
     amplitude="function?")
def frame(points=((0, 0), (0, 1), (1, 1)), lines=((0, 1), (1, 2)), **options):
    return Frame.from_lines(points, lines, **{
        "nodes": {"ground": [0]}, "height": 0.02, "width": 0.02,
        "material": StVenantKirchhoff(2e11, 0.3, density=7800.0), **options})


call("Frame.from_lines", lambda **k: frame(**k),
     dict(points=((0, 0), (0, 1), (1, 1)), lines=((0, 1), (1, 2)), groups={"a": [0]},
          nodes={"b": [1]}, hinges=[(0, 1)], curves={}, elements=2, sections={}, tol=1e-6,
          height=0.02),
     {name: {"{}": "none"} for name in ("groups", "nodes", "curves", "sections")}
     | {"hinges": {"[]": "none", "0": "a node"}}, points="other", lines="other",
     groups="other?", nodes="other?", hinges="other", curves="other?", elements="other",
     sections="other?", tol="not negative?", height="positive")
call("Frame.from_meshio", lambda **k: Frame.from_meshio(
    **k, height=0.02, width=0.02, material=StVenantKirchhoff(2e11, 0.3)),
     dict(mesh=meshio.Mesh([[0, 0], [0, 1]], [("line", [[0, 1]])]), groups=None, tol=None),
     {"groups": {"[]": "none"}}, mesh="other", groups="other?", tol="not negative?")
call("frame.line_load", lambda **k: moved(frame().clamp(0).line_load(**k)),
     dict(force=(0, -1), beam=None, amplitude=amplitude), force="vector", beam="beam?",
     amplitude="function?")
call("frame.nodes", lambda **k: frame().nodes(**k), dict(place=(0, 1)), place="nodes")
call("frame.hold", lambda place, what: frame().hold(place, what), dict(place=0, what="x"),
     place="nodes", what="other")
call("frame.clamp", lambda **k: frame().clamp(**k), dict(boundary=0, thickness="free"),
     boundary="nodes", thickness="other")
call("frame.settle", lambda **k: frame(elements=4).clamp(0).settle(**k).solve_static(),
     dict(place=2, x=1e-3, y=1e-3, angle=0.1),
     {name: {"float class": "a function of a number"} for name in ("x", "y", "angle")},
     place="nodes", x="number?", y="number?", angle="number?")
call("frame.pin", lambda **k: frame().pin(**k), dict(boundary="ground"), boundary="nodes")
call("frame.point_force", lambda **k: moved(frame().clamp(0).point_force(**k)),
     dict(force=(0, -1), at=2, beam=None, amplitude=amplitude), force="vector",
     at="nodes", amplitude="function?")
call("frame.moment", lambda **k: moved(frame().clamp(0).moment(**k)),
     dict(boundary=2, M=1e-3, amplitude=amplitude), boundary="nodes", M="number",
     amplitude="function?")


call("RigidBody", lambda **k: moved(Scene(beam(), RigidBody(**k)).clamp("left")),
     dict(mass=1.0, inertia=0.1, position=(0.0, 2.0), angle=0.1, name="b",
          outline=[(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]),
     mass="positive", inertia="positive", position="vector", angle="number", name="label?",
     outline="other?")
call("body.replace", lambda mass: RigidBody(1.0, 1.0).replace(mass=mass), dict(mass=2.0),
     mass="positive")
call("scene.hinge", lambda first, second, name: moved(
    Scene(beam(), RigidBody(1.0, 1.0, (1.0, 0.0))).clamp("left").hinge(first, second, name=name)
    and clamped()), dict(first=(0, (1.0, 0.0)), second=(1, (1.0, 0.0)), name="h"),
     first="other", second="other", name="label?")
call("scene.weld", lambda first, second, name, apart: moved(
    Scene(beam(), RigidBody(1.0, 1.0, (1.0, 0.0))).clamp("left").weld(
        first, second, name=name, apart=apart) and clamped()),
     dict(first=(0, "right"), second=(1, (1.0, 0.0)), name="w", apart=True),
     first="other", second="other", name="label?", apart="flag")
def slid(**options):
    """A scene with a slider on a beam, or on the ground if a direction is given."""
    scene = Scene(beam(), RigidBody(1.0, 1.0, (0.5, 0.0))).clamp("left")
    return scene.slider(**options), moved(scene)


call("scene.slider", slid, dict(at=(1, (0.5, 0.0)), on=0, angle=True, name="s"), at="other",
     on="beam?", angle="flag", name="label?")
call("scene.slider, line", slid, dict(at=(0, (1.0, 0.0)), on="ground", direction=(0.0, 1.0)),
     at="other", direction="vector")
def driven(**options):
    """A beam turned at its left end."""
    scene = free().pin("left")
    return scene.motor(**options), moved(scene)


call("scene.motor", driven,
     dict(at=(0, "left"), angle=lambda t: 0.1 * t), at="other", angle="function")
call("scene.motor, speed", driven,
     dict(at=(0, "left"), speed=0.1), {"speed": {"float class": "a function of a number"}},
     speed="number")
call("scene.motor, torque", driven,
     dict(at=(0, "left"), torque=0.1), {"torque": {"float class": "a function of a number"}},
     torque="number")
call("joint turn", lambda **k: joined("turn", two, **k),
     dict(at=(0, "right"), other=(1, "left"), angle=lambda t: 0.1 * t, name="t"), at="other",
     other="other", angle="function", name="label?")
call("joint sleeve", lambda **k: joined("sleeve", clamped, **k),
     dict(at=("ground", (0.5, 0.0)), on=0, angle=False, name="s"), at="other", on="beam?",
     angle="flag", name="label?")
call("joint slot", lambda **k: joined("slot", clamped, **k),
     dict(at=(0, (0.75, 0.0)), on="ground", direction=(1.0, 0.0), through=(0.75, 0.0), angle=False,
          name="s"), at="other", on="other", direction="vector", through="vector?", angle="flag",
     name="label?")
call("state.angle", lambda **k: Scene(beam(), RigidBody(1.0, 1.0)).state().angle(**k),
     dict(body=1), body="other")


def with_body():
    """A beam and a rigid body beside it."""
    return Scene(beam(), RigidBody(1.0, 1.0, (5.0, 5.0))).clamp("left")


for _name in ("point_force", "follower_force"):
    call(f"scene.{_name}, body", lambda _name=_name, **k: moved(
        getattr(with_body(), _name)((0.0, -0.1), **k)), dict(at=(1.0, 0.0), beam=None),
         at="vector", beam="beam?")
call("scene.point_mass, body", lambda **k: moved(with_body().point_mass(1.0, **k)),
     dict(at=(1.0, 0.0), beam=0), at="vector", beam="beam?")
for _name in ("moment", "pressure"):
    call(f"scene.{_name}, body", lambda _name=_name, **k: moved(getattr(with_body(), _name)(**k)),
         dict(boundary="right", beam=0, **{"M" if _name == "moment" else "p": 0.1}),
         boundary="facets", beam="beam?")
for _name in ("displacement", "position", "velocity", "strain", "stress", "resultants"):
    _at = "at" if _name == "resultants" else "point"
    call(f"state.{_name}, body", lambda _name=_name, **k: getattr(with_body().state(), _name)(
        **k), {_at: (1.0, 0.0), "beam": 0}, **{_at: f"vector{'?' * (_at == 'at')}"}, beam="beam?")
call("state.field, body", lambda **k: with_body().state().field("S_xx", **k),
     dict(point=(1.0, 0.0), beam=None), point="vector", beam="beam?")
call("scene.sensor, body", lambda **k: with_body().sensor("s", "displacement", **k),
     dict(at=(1.0, 0.0), beam=None), at="vector", beam="beam?")
call("scene.gravity", lambda **k: moved(clamped().gravity(**k)),
     dict(g=(0.0, -1.0), beam=0, amplitude=amplitude), g="vector", beam="beam?",
     amplitude="function?")
call("scene.point_force", lambda **k: moved(clamped().point_force(**k)),
     dict(force=(0.0, -1.0), at=(1.0, 0.0), beam=0, amplitude=amplitude),
     force="vector", at="vector", beam="beam?", amplitude="function?")
call("scene.traction", lambda **k: moved(clamped().traction(**k)),
     dict(boundary="top", t=(0.0, -1.0), beam=0, amplitude=amplitude),
     boundary="facets", t="vector", beam="beam?", amplitude="function?")
call("scene.pressure", lambda **k: moved(clamped().pressure(**k)),
     dict(boundary="top", p=1.0, beam=0, amplitude=amplitude),
     boundary="facets", p="number", beam="beam?", amplitude="function?")
call("scene.moment", lambda **k: moved(clamped().moment(**k)),
     dict(boundary="right", M=0.1, beam=0, amplitude=amplitude),
     boundary="facets", M="number", beam="beam?", amplitude="function?")


def weight(v, w):
    return -v[1]


def load_of(form, **options):
    form = LinearForm(form) if callable(form) and form is not float else form
    return moved(clamped().load(form, **options))


call("scene.load", load_of, dict(form=weight, boundary="top", beam=0, amplitude=amplitude),
     form="other", boundary="facets?", beam="beam?", amplitude="function?")
call("scene.initial_velocity", lambda **k: moved(clamped().initial_velocity(**k)),
     dict(v=lambda x: 0.0 * x, beam=0), v="other", beam="beam?")
call("scene.replace of beams", lambda **k: clamped().replace(**k), dict(beams=[beam()]),
     beams="other?")
call("scene.plan", lambda **k: loaded_once().plan(**k), dict(kind="static"), kind="name")


# joints

def joined(kind, scene, **options):
    """A scene with a joint, moved, which asks the joint for all there is."""
    scene = scene()
    return scene.joint(kind, **options), moved(scene)


call("scene.joint", lambda joint: clamped().joint(joint, at=(1.0, 0.0), direction=(1.0, 0.0)),
     dict(joint="line"), joint="name")
call("scene.add", lambda **k: free().add(**k), dict(item=Weight((0.0, -1.0))), item="other")
call("joint hinge", lambda **k: joined("hinge", two, **k),
     dict(beams=(0, 1), at=(1.0, 0.0), name="h"), beams="other", at="vector", name="label?")
call("joint weld", lambda **k: joined("weld", two, **k),
     dict(beams=(0, 1), at=("right", "left"), name="w"), beams="other", at="other", name="label?")
call("joint line", lambda **k: joined("line", clamped, **k),
     dict(at=(1.0, 0.0), direction=(1.0, 0.0), beam=0, through=(1.0, 0.0), name="l"),
     at="vector", direction="vector", beam="beam?", through="vector?", name="label?")
call("joint circle", lambda **k: joined("circle", clamped, **k),
     dict(at=(1.0, 0.0), center=(0.0, 0.0), beam=0, radius=1.0, name="c"),
     at="vector", center="vector", beam="beam?", radius="positive?", name="label?")
call("joint position", lambda **k: joined("position", clamped, **k),
     dict(at=(1.0, 0.0), r=lambda t: (1.0, 0.0 * t), beam=0, name="p"),
     at="vector", r="function", beam="beam?", name="label?")
call("joint angle", lambda **k: joined("angle", clamped, **k),
     dict(at="right", angle=lambda t: 0.1 * t, beam=0, name="a"),
     at="facets", angle="function", beam="beam?", name="label?")
call("joint plane", lambda **k: joined("plane", lambda: free().pin("left"), **k),
     dict(at="left", beam=0, name="s"), at="facets", beam="beam?", name="label?")

# solutions

call("scene.solve_static", lambda **k: loaded_once().solve_static(**k),
     dict(start=None, method="mixed", tol=1e-8, max_iterations=30, first_step=1.0, min_step=1e-4,
          progress=False),
     start="other?", method="name", tol="positive", max_iterations="count", first_step="positive",
     min_step="positive", progress="progress")
call("scene.solve_static, adapt", lambda **k: loaded_once().solve_static(**k),
     dict(adapt=0.5, max_elements=16, max_degree=5), adapt="positive?", max_elements="count",
     max_degree="count")
call("scene.solve_linear", lambda **k: loaded_once().solve_linear(**k), {})
call("scene.continuation", lambda **k: loaded_once().continuation(**k),
     dict(steps=2, ds=0.02, ds_max=0.1, max_load=None, until=lambda point: True, tol=1e-8,
          max_iterations=15, progress=False),
     steps="count", ds="positive", ds_max="positive?", max_load="positive?", until="function?",
     tol="positive", max_iterations="count", progress="progress")
call("scene.continuation, located", lambda **k: loaded_once().continuation(steps=1, **k),
     dict(locate=1e-8, branch=None, side=1),
     {"side": {"-1": "the other side"}}, locate="positive?", branch="other?", side="other")
motion = dict(t_end=0.02, dt=0.01, scheme="energy-momentum", start=None, t_eval=[0.0, 0.02],
              tol=1e-10, t_start=0.0, progress=False, breakpoints=[0.005], checkpoint=None,
              every=None)
call("scene.integrate", lambda **k: loaded_once().integrate(**k), motion,
     {"t_eval": {"[]": "no time"}},
     dt="positive", scheme="name", start="other?", t_eval="increasing?",
     tol="positive?", t_start="number?", progress="progress")
call("scene.integrate, until", lambda **k: loaded_once().integrate(t_end=0.02, dt=0.01, **k),
     dict(until=lambda state: state.displacement((1.0, 0.0))[1] + 1.0), until="function?")
call("scene.integrate, t_end", lambda t_end: clamped().integrate(t_end=t_end, dt=0.5),
     dict(t_end=1.0), t_end="positive")
call("scene.integrate, auto",
     lambda **k: loaded_once().integrate(t_end=1e-3, dt="auto", **k), dict(rtol=1e-2),
     rtol="positive")
call("scene.modes", lambda **k: loaded_once().modes(**k), dict(k=1, state=None), k="count",
     state="other?")
call("scene.buckling", lambda **k: column().buckling(**k), dict(k=1), k="count")

# results

for _name in ("displacement", "position", "strain", "stress"):
    call(f"state.{_name}", lambda _name=_name, **k: getattr(state(), _name)(**k),
         dict(point=(1.0, 0.0), beam=0), point="vector", beam="beam?")
for _name in ("strain", "stress"):
    call(f"state.{_name}, recover",
         lambda _name=_name, **k: getattr(state(), _name)((1.0, 0.0), **k),
         dict(recover=False), recover="flag")
for _name in ("displacement", "position", "velocity", "strain", "stress", "resultants"):
    _at = "at" if _name == "resultants" else "point"
    call(f"state.{_name}, line", lambda _name=_name, **k: getattr(
        frame().clamp(0).state(), _name)(**k), {_at: (0.0, 0.5), "line": 0},
         **{_at: f"vector{'?' * (_at == 'at')}"}, line="nodes?")
call("frame.sensor, line", lambda **k: frame().clamp(0).sensor("s", "N", **k),
     dict(at=(0.0, 0.5), line=0), at="vector", line="nodes?")
call("state.recovery", lambda **k: state().recovery(**k), dict(beam=0), beam="beam?")
call("scene.state", lambda **k: loaded_once().state(**k),
     dict(u=np.zeros(beam().N), multipliers=None, load=1.0),
     {"multipliers": {"[]": "there are none"}}, u="other?", multipliers="other?", load="number")
call("state.reactions", lambda **k: state().reactions(**k), dict(boundary="left", beam=0),
     boundary="facets", beam="beam?")
call("state.u_of", lambda **k: state().u_of(**k), dict(beam=state().beams[0]),
     {"beam": {"None": "the only one"}}, beam="beam")
call("state.joint_force", lambda joint=None, **k: jointed()[1].joint_force(
    jointed()[0] if isinstance(joint, str) and joint == "its own" else joint, **k),
     dict(joint="its own"), joint="other")
pictures = dict(subdivide=(2, 2), lagrange=False, undeformed=False, recover=False)
for _name, _call in (("state.save", lambda **k: state().save(**k)),
                     ("save_vtu", lambda **k: save_vtu(state(), **k))):
    call(_name, _call, dict(filename="s.vtu", **pictures), filename="file", subdivide="other",
         lagrange="flag", undeformed="flag", recover="flag")
call("body_fields", lambda **k: body_fields(**k), dict(state=state(), **pictures), state="other",
     subdivide="other", lagrange="flag", undeformed="flag", recover="flag")
call("PvdWriter", lambda **k: PvdWriter(**k).add(state(), 0.0),
     dict(filename="s.pvd", **pictures), filename="file", subdivide="other", lagrange="flag",
     undeformed="flag")
call("PvdWriter.add", lambda **k: PvdWriter("s.pvd", subdivide=(1, 1)).add(**k),
     dict(state=state(), t=0.0), state="other", t="number")
call("history.state", lambda **k: history().state(**k), dict(k=0), k="index")
for _name in ("displacement", "position", "velocity"):
    call(f"history.{_name}", lambda _name=_name, **k: getattr(history(), _name)(**k),
         dict(point=(1.0, 0.0), beam=0), point="vector", beam="beam?")
for _name in ("strain", "stress"):
    call(f"history.{_name}", lambda _name=_name, **k: getattr(history(), _name)(**k),
         dict(point=(1.0, 0.0), beam=0, recover=False), point="vector", beam="beam?",
         recover="flag")
for _name, _make in (("state", state), ("history", history)):
    call(f"{_name}.field", lambda _make=_make, **k: _make().field(**k),
         dict(field="S_xx", point=(1.0, 0.0), beam=0, recover=False), field="name",
         point="vector", beam="beam?", recover="flag")
call("state.resultants", lambda **k: state().resultants(**k),
     dict(at=(0.5, 0.0), beam=0, recover=True), at="vector?", beam="beam?", recover="flag")
call("history.resultants", lambda **k: history().resultants(**k),
     dict(at=(0.5, 0.0), beam=0, recover=True), at="vector", beam="beam?", recover="flag")
call("history.states", lambda **k: list(history().states(**k)), dict(instants=[0, -1]),
     {"instants": {"[]": "none", "None": "all"}}, instants="other")
call("Field", lambda **k: state().field(Field(**k), (0.5, 0.0)),
     dict(name="f", function=lambda v: v["S_xx"], title="t", unit="Pa", signed=True, components=1,
          frame="beam", neutral=0.0),
     name="label", function="other", title="title", unit="title", signed="flag",
     components="components", frame="title", neutral="number")
call("VtkHdfWriter", lambda **k: VtkHdfWriter(**k).__exit__(None), dict(
    filename="s.vtkhdf", subdivide=(1, 1), fields=["S_xx"], precision="single", lagrange=False,
    undeformed=False, recover=False), filename="file", precision="name")
call("VtkHdfWriter.add", lambda **k: add_to_vtkhdf(**k), dict(state=state(), t=0.0),
     state="other", t="number")
for _name, _call, _file in (
        ("save_vtu, fields", lambda **k: save_vtu(state(), "s.vtu", **k), "s.vtu"),
        ("history.save, vtkhdf", lambda **k: history().save("h.vtkhdf", **k), "h.vtkhdf")):
    call(_name, _call, dict(fields=["S_xx"], precision="single", subdivide=(1, 1), recover=False),
         {"fields": {"None": "the usual ones"}}, fields="drawn", precision="name",
         subdivide="other", recover="flag")
call("history.joint_force", lambda joint=None, **k: jointed()[2].joint_force(
    jointed()[0] if isinstance(joint, str) and joint == "its own" else joint, **k),
     dict(joint="its own"), joint="other")
call("history.save", lambda **k: history().save(**k),
     dict(filename="h.pvd", progress=False, subdivide=(1, 1)), filename="file",
     progress="progress", subdivide="other")
call("path.state", lambda **k: path().state(**k), dict(k=0), k="index")
call("path.displacement", lambda **k: path().displacement(**k), dict(point=(1.0, 0.0), beam=0),
     point="vector", beam="beam?")
call("modes.mode", lambda **k: modes().mode(**k), dict(i=0, amplitude=0.1), i="index",
     amplitude="number")

# pictures

drawing = dict(field="S_xx", thickness=1.0, undeformed=True, colorbar=False, cmap="viridis",
               limits=(-1.0, 1.0), title="title", unit="Pa", subdivide=(2, 2), dpi=50)
call("state.plot", lambda **k: state().plot(**k), drawing, {"limits": {"[True, False]": ""}},
     field="name", ax="other?", thickness="positive", undeformed="flag", colorbar="flag",
     cmap="name?", limits="other?", title="title?", unit="title?", subdivide="other",
     filename="file?", dpi="positive")
call("history.plot", lambda **k: history().plot(**k), dict(field="S_xx", times=[0.0, 0.02]),
     field="name")
film = dict(filename="f.gif", field="S_xx", frames=2, fps=5.0, thickness=1.0,
            undeformed=True, cmap="viridis", limits=(-1.0, 1.0), unit="Pa", subdivide=(1, 1),
            recover=False, size=(320, 240))
call("history.animate", lambda **k: history().animate(**k), film,
     {"limits": {"[True, False]": ""}, "frames": {"10**30": "all", "10**400": "all"}},
     filename="file",
     field="name", frames="count?", fps="positive?", thickness="positive",
     undeformed="flag", cmap="name?", limits="other?", unit="title?", subdivide="other",
     recover="flag", size="other")
call("state.view", lambda **k: state().view(**k).close(),
     dict(field="S_xx", plotter=None, thickness=1.0, undeformed=True, cmap="viridis",
          limits=(-1.0, 1.0), unit="Pa", subdivide=(1, 1), recover=False, off_screen=True,
          window_size=(100, 100)), {"off_screen": {"None": "decide"}}, field="name",
     plotter="other?", thickness="positive", undeformed="flag", cmap="name?", limits="other?",
     unit="title?", subdivide="other", recover="flag", window_size="other", filename="file?")
for _name, _make in (("state", state), ("history", history)):
    call(f"{_name}.to_pyvista", lambda _make=_make, **k: _make().to_pyvista(**k),
         dict(fields=["S_xx"], subdivide=(1, 1), lagrange=False, undeformed=False, recover=False),
         {"fields": {"None": "all of them"}}, fields="drawn", subdivide="other", lagrange="flag",
         undeformed="flag", recover="flag")
call("series.update", lambda **k: history().to_pyvista(fields="S_xx").update(**k), dict(k=1),
     k="index")
call("state.plot_resultants", lambda **k: state().plot_resultants(**k),
     dict(beam=0, title="title", recover=True, dpi=50), beam="beam?", axes="other?",
     title="title?", recover="flag", filename="file?", dpi="positive")
call("path.plot", lambda **k: path().plot(**k), dict(point=(1.0, 0.0), component=1, beam=0),
     {"component": {"0": "the first"}}, point="vector", component="index", beam="beam?",
     title="title?", filename="file?", dpi="positive")
