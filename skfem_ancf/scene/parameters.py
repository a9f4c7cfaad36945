"""Parameters of a scene by object and name, and gradients of its states by them."""

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
import scipy

from ..actions.item import Item
from ..beam import Beam
from ..core import (Array, Immutable, InputError, ask_array, is_builtin, rebuilt, refuse,
                    require_option, shown)
from ..mesh.mapping import PLACES
from ..mesh.mesh_beam import MeshBeam
from ..sections.section import Layers, Profile, Rectangle

#: Kinds of fields, and the names of a beam that may be one.
FIELDS, FIELD_NAMES = ("nodes", "elements"), ("height", "E", "width")
#: Where a name of a beam is found.
PARTS = ("material", "mesh", "section")
#: Arguments that items of the package store by another name.
STORED = {"force": ("total", "per_length"), "stiffness": ("penalty",), "r": ("motion",)}
#: Numbers of the layers of a section, by the name for the beam.
OF_LAYERS = {"thickness": 0, "width": 2}


class Parameter(NamedTuple):
    """One parameter, which may be an array: ``name`` of ``owner``, or a field of a beam. ``name``
    is a path of attributes, or several; ``field`` one of FIELDS, "axis", "time" for a function of
    time, a function for coefficients, or empty; ``sizes`` are typical."""

    owner: Any
    name: Any
    field: Any
    start: Array
    sizes: Array
    at: slice


class Parameters:
    """Parameters of a scene by object and name, for a :class:`~skfem_ancf.Design`.

    ``Parameters(scene, wrt)(p)`` is the scene with other values; a Design knows what fields act on,
    so that its first gradient costs no more than others.

    Parameters
    ----------
    scene
        A :class:`~skfem_ancf.Scene`.
    wrt
        Pairs ``(object, name)`` of a beam, material, rigid body, section, item or shape of the
        scene, or anything that these consist of, and an argument of it, a number or an array. A
        beam has the names of its material, mesh and section, too; "thickness" and "width" of layers
        are arrays. Parts of an argument follow after dots, as (spring, "between.1.1"). A function
        of time is its value at t = 1, which changes in proportion to t. ``(beam, "nodes")`` are the
        positions (2, n) of the nodes, with a cubic spline between their changes. Triples ``(beam,
        name, "nodes")`` or ``(beam, name, "elements")`` are fields: "height", "E" or "width",
        linear between nodes or constant in elements. Triples ``(object, name, basis)`` are
        coefficients (k,) from zero, with which a function ``basis`` of the arguments of the
        property that returns (k, ...) is added to it: x and y, for heights the parameter of the
        axis.

    Attributes
    ----------
    start
        The values in the scene, (n,).
    sizes
        Typical sizes of coefficients and changes of the axis, (n,), zero for others.
    each
        The ``Parameter`` of each of ``wrt``.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, Design, ElementBeamCable, MeshBeam, Parameters, Scene
    >>> from skfem_ancf import StVenantKirchhoff
    >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
    ...             StVenantKirchhoff(2e8, 0.3), width=0.01)
    >>> scene = Scene(beam).clamp("left").point_force((0, -1e-4), at=(1, 0))
    >>> scene = scene.sensor("tip", "displacement", at=(1, 0))
    >>> heights = Parameters(scene, [(beam, "height", "nodes")])
    >>> Design(heights, ["tip"]).jacobian(heights.start).shape
    (2, 5)
    """

    def __init__(self, scene: Any, wrt: Sequence[Any]) -> None:
        self._scene, self.each, n = scene, [], 0
        for one in wrt:
            refuse(not isinstance(one, tuple) or len(one) not in (2, 3), 'wrt must be a list, as '
                   '[(beam, "height")] or [(beam, "height", "nodes")], got {!r}', one)
            owner, name, field = (*one, "")[:3]
            sizes = 0.0
            if callable(field):
                name, start, sizes = self._coefficients(owner, name, field)
            elif field:
                start = self._field(owner, name, require_option("field", field, FIELDS))
            elif name == "nodes" and isinstance(owner, Beam):
                start, field = owner.mesh.p.copy(), "axis"
                sizes = 0.1 * owner.mesh.lengths.min()
                refuse(owner.mesh.curve is None and not owner.mesh.is_straight, "{!r} does not "
                       "know its curve: use MeshBeam.init_curve or from_points", owner)
            else:
                name, start, field = self._number(owner, name)
            self.each.append(Parameter(owner, name, field, start, np.broadcast_to(
                sizes, start.shape), slice(n, n + start.size)))
            n += start.size
        self.start, self.sizes = (np.concatenate([np.zeros(0), *(
            getattr(one, name).ravel() for one in self.each)]) for name in ("start", "sizes"))
        for one in self.each:
            refuse(not _has([*scene.beams, *scene.bodies, *scene.items], one.owner),
                   "{!r} is not in scene.beams, scene.bodies or scene.items", one.owner)

    def _number(self, owner, name):
        """Path of an argument, for a beam as "material.E", its value, and "time" or nothing."""
        section = owner.section if isinstance(owner, Beam) else owner
        if isinstance(section, Layers) and name in OF_LAYERS:
            before, k = "section." if section is not owner else "", OF_LAYERS[name]
            values = {f"{before}parts.{i}.{k}": part[k] for i, part in enumerate(section.parts)
                      if isinstance(part[k], float)}
            return tuple(values), np.array(list(values.values())), ""
        path = self._path(owner, name)
        value = reduce(_part, path.split("."), owner)
        refuse(path == "mesh.height" and owner.mesh.heights is not None, "the height of {!r} "
               "varies: use the field (beam, 'height', 'nodes')", owner)
        refuse(not isinstance(owner, Immutable) or value is None, "{!r} has no argument {!r} that "
               "can be changed alone; use a Design with a function", owner, name)
        try:
            timed = callable(value) and isinstance(owner, Item) and not isinstance(value, float)
            return path, np.array(value(1.0) if timed else value, dtype=float), "time" * timed
        except (TypeError, ValueError):
            raise InputError(f"{name!r} of {owner!r} is {shown(value)} and no number or array: add "
                             f"a function, as (object, {name!r}, basis)") from None

    def _path(self, owner, name):
        """Where the argument of an object is found, attributes with dots between them."""
        if isinstance(owner, Beam) and not (name == "width" and isinstance(
                owner.section, Rectangle)):
            if isinstance(owner.section, Profile) and name in owner.section.sizes:
                return f"section.sizes.{name}"
            return next((f"{part}.{name}" for part in PARTS
                         if getattr(getattr(owner, part), name, None) is not None), name)
        if isinstance(owner, Profile) and name in owner.sizes:
            return f"sizes.{name}"
        if isinstance(owner, Item) and is_builtin(owner):
            first, dot, rest = name.partition(".")
            return next((x for x in STORED.get(first, ()) if x in vars(owner)), first) + dot + rest
        return name

    def _coefficients(self, owner, name, basis):
        """Path, zeros (k,) and sizes (k,) of the coefficients of a function."""
        beam = owner if isinstance(owner, Beam) else self._scene.beams[0]
        x = beam.mesh.parameters
        if name == "height" and owner is beam:
            path, old, found = "height", beam.mesh.height, basis(x)
        else:
            path = self._path(owner, name)
            old = reduce(_part, path.split("."), owner)
            refuse(old is None, "{!r} has no argument {!r} to which a function could be added",
                   owner, name)
            old = np.max(np.abs(old(x, 0.0 * x) if callable(old) else old))
            found = basis(x, 0.0 * x)
        found = np.asarray(found, dtype=float)
        refuse(found.ndim < 2 or found.shape[-1] != len(x), "the function of {!r} must return "
               "shape (k, ..., n) for n points, got {} for {}", name, found.shape, len(x))
        largest = np.abs(found).reshape(len(found), -1).max(axis=1)
        return path, np.zeros(len(found)), (old or 1.0) / np.where(largest > 0.0, largest, 1.0)

    def _field(self, beam, name, field):
        """The values of a field at nodes or in elements."""
        refuse(not any(beam is one for one in self._scene.beams), "fields are of beams of the "
               "scene, got {!r}", beam)
        require_option("field of a beam", name, FIELD_NAMES)
        mesh, n = beam.mesh, beam.mesh.p.shape[1]
        if name == "height" and mesh.heights is not None:
            if field == "elements":
                return mesh.heights.mean(axis=0)
            out = np.empty(n)
            out[mesh.t] = mesh.heights[[0, 3]]
            return out
        value = mesh.height if name == "height" else (
            beam.material.E if name == "E" else beam.width)
        refuse(not isinstance(value, (int, float)), "{} of {!r} is no number before it becomes a "
               "field: use a Design with a function that builds the scene", name, beam)
        return np.full(n if field == "nodes" else mesh.nelements, float(value))

    def __call__(self, p: Array) -> Any:
        """The scene with other values of the parameters, (n,)."""
        new: dict[int, dict[str, Any]] = {}
        for one in self.each:
            value = np.asarray(p[one.at]).reshape(one.start.shape)
            if not np.array_equal(value, one.start):
                new.setdefault(id(one.owner), {}).update(self._changed(one, value))
        made: dict[int, Any] = {}
        return self._scene._rebuilt(*([_replaced(x, new, made) for x in some] for some in (
            self._scene.beams, self._scene.bodies, self._scene.items)))

    def _changed(self, one, value):
        """Arguments and values of a changed parameter."""
        change, owner = value - one.start, one.owner
        if isinstance(one.name, tuple):
            found = dict(zip(one.name, value.tolist()))
            parts = owner.section.parts if isinstance(owner, Beam) else ()
            if one.name[0].endswith(".0") and parts and all(part[0] for part in parts):
                found["mesh.height"] = float(value.sum())
            return found
        if not one.field:
            return {one.name: value if value.ndim else float(value)}
        if one.field == "time":
            function = _part(owner, one.name)
            return {one.name: lambda t: function(t) + t * (change if change.ndim else (
                float(change)))}
        if one.field == "axis":
            return {"mesh": _bent(owner.mesh, change)}
        if one.name == "height":
            mesh = owner.mesh
            nodal = change if one.field == "nodes" else change @ one.field(mesh.parameters) if (
                callable(one.field)) else None
            ends = np.array([change, change]) if nodal is None else nodal[mesh.t]
            old = np.full((4, mesh.nelements), mesh.height) if mesh.heights is None else (
                mesh.heights)
            heights = old + np.outer(1.0 - PLACES, ends[0]) + np.outer(PLACES, ends[1])
            return {"mesh": replace(mesh, heights=heights, height=float(heights.max()),
                                    taper=None)}
        if callable(one.field):
            old = reduce(_part, one.name.split("."), owner)

            def added(*x):
                return (old(*x) if callable(old) else old) + np.tensordot(
                    change, ask_array("basis", None, one.field, *x), 1)

            return {one.name: added}
        s = owner.mesh.parameters

        def field(x, _):
            if one.field == "nodes":
                return np.interp(x, s, value)
            return value[np.clip(np.searchsorted(s, x) - 1, 0, len(value) - 1)]

        return {"material.E" if one.name == "E" else one.name: field}

    def groups(self, size: int) -> list[tuple[list[int], Array]]:
        """Parameters that change different rows, and the parameter of each of ``size`` rows. Rows
        are those of degrees of freedom and of joints, for which it is not known (-1). A component
        of a field acts on the nodes of its elements: each third one at once."""
        out = []
        for one in self.each:
            first, n = one.at.start, one.start.size
            if one.field not in FIELDS:
                out += [([k], np.full(size, k)) for k in range(first, first + n)]
                continue
            beam, offset = one.owner, self._scene.layout.offset(one.owner)
            nodes = np.arange(beam.mesh.p.shape[1])
            # components are numbered by their node, elements by their left node
            at = nodes if one.field == "nodes" else beam.mesh.t[0]
            number = np.full(len(nodes) + 2, -1)
            number[at + 1] = first + np.arange(n)
            for colour in range(3):
                near = nodes - 1 + (colour - nodes + 1) % 3  # the one of that colour
                found, of = number[near + 1], np.full(size, -1)
                if one.field == "elements":
                    found[near > nodes] = -1
                of[offset:offset + beam.N] = np.repeat(found, beam.nd)
                members = first + np.flatnonzero(at % 3 == colour)
                if len(members):
                    out.append((members.tolist(), of))
        return out


def _part(thing, name):
    """An attribute, or an entry of a list or dict; None if there is none."""
    if isinstance(thing, dict):
        return thing.get(name)
    if name.isdigit() and isinstance(thing, (tuple, list, np.ndarray)):
        return thing[int(name)] if int(name) < len(thing) else None
    return getattr(thing, name, None)


def _bent(mesh, change):
    """The mesh with nodes moved by (2, n), and a cubic spline of these changes between them."""
    s, old = mesh.parameters, mesh.curve
    spline = scipy.interpolate.CubicSpline(s, change.T)
    start, tangent = mesh.p[:, :1], mesh.p_X[:, :1]

    def r(x):
        return (old(x) if old else start + tangent * (x - s[0])) + spline(x).T

    def dr(x):
        return (old.rate(x) if old else tangent + 0.0 * x) + spline(x, 1).T

    return replace(MeshBeam.init_curve(r, s, mesh.height, dr), heights=mesh.heights,
                   height=mesh.height, taper=mesh.taper)


def _arguments(thing):
    """Arguments of the constructor of an object by name, if it stores them."""
    if isinstance(thing, Beam):
        return {name: getattr(thing, name) for name in ("mesh", "material", "section")}
    if not isinstance(thing, Immutable):
        return {}
    found = {name: getattr(thing, name, None) for name in type(thing).__signature__.parameters}
    return {name: value for name, value in found.items()
            if isinstance(value, (Immutable, tuple, list))}


def _has(thing, owner):
    """True if an object is, or consists of, another one."""
    inner = thing if isinstance(thing, (tuple, list)) else _arguments(thing).values()
    return thing is owner or any(_has(x, owner) for x in inner)


def _replaced(thing, new, made):
    """The object with changed arguments of the objects in ``new``, by id; ``made`` are copies."""
    if isinstance(thing, (tuple, list)):
        inner = [_replaced(x, new, made) for x in thing]
        return thing if all(a is b for a, b in zip(inner, thing)) else type(thing)(inner)
    if not isinstance(thing, Immutable):
        return thing
    if id(thing) not in made:
        changes = {name: other for name, value in _arguments(thing).items()
                   if (other := _replaced(value, new, made)) is not value}
        changes |= new.get(id(thing), {})
        made[id(thing)] = _copy(thing, changes) if changes else thing
    return made[id(thing)]


def _copy(thing, given):
    """A copy with changed arguments, whose names may be those of parts of them, with dots."""
    changes = {name: value for name, value in given.items() if "." not in name}
    parts: dict[str, dict[str, Any]] = {}
    for name, value in given.items():
        first, dot, inner = name.partition(".")
        if dot:
            parts.setdefault(first, {})[inner] = value
    for name, inner in parts.items():
        changes[name] = _copy(changes.get(name, _part(thing, name)), inner)
    if isinstance(thing, (tuple, list)):
        return type(thing)(changes.get(str(k), x) for k, x in enumerate(thing))
    if isinstance(thing, dict):
        return thing | changes
    if isinstance(thing, Item) and is_builtin(thing):
        # linear laws of springs are floats, too
        other = thing._with(**{name: type(old)(value) if isinstance(
            old := getattr(thing, name), float) else value for name, value in changes.items()})
        other._freeze()
        return other
    return thing.replace(**changes) if hasattr(thing, "replace") else rebuilt(thing, changes)
