"""Meshes of planar beams: nodes along the axis, and the height of the section."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from skfem import Element, MeshQuad
from skfem.generic_utils import OrientedBoundary

from ..core import (Array, ArrayLike, FileError, Immutable, InputError, MeshError, StrPath, archive,
                    cached_property, is_builtin, picklable, refuse, refuse_any, require_finite,
                    require_finite_scalar, require_function, require_integer, require_moderate,
                    require_option, require_options, require_path, require_positive,
                    require_unmasked, retold)
from .curve import Curve, axis_of, derivative_of
from .mapping import SECTIONS, MappingBeam, heights_of, scaled
from .numbering import NODAL, ElementBeamP1, NumberedMesh, default_tags, halved
from .places import Finder, as_point, is_point, points_of_rows

EPS = float(np.finfo(float).eps)

#: Largest number of elements of :meth:`MeshBeam.refined`.
MAX_ELEMENTS = 2**24

#: Formats of several files that refer to each other: written in place.
IN_PARTS = (".xdmf", ".xmf", ".node", ".ele")
#: Optional and required attributes of a mesh in a file.
OPTIONAL = ("s", "p_XY", "heights")
NEEDED = ("doflocs", "t", "height", "p_X", "p_Y", "lengths", "sections")

#: Largest number of quads along and across an element in a picture or a file.
MAX_SUBDIVISION = 1000


@dataclass(repr=False, eq=False)
class MeshBeam(NumberedMesh):
    """The reference configuration of a planar beam, divided into elements along its axis.

    A mesh is immutable; its methods return other meshes. Use :meth:`init_line`, :meth:`init_curve`
    or :meth:`from_points`. The nodes are numbered along the axis, which makes matrices banded. The
    boundaries ``left`` and ``right`` are the end sections, ``bottom`` and ``top`` the surfaces at Y
    = -h/2 and +h/2.

    Attributes
    ----------
    doflocs, p
        Positions of the nodes, shape (2, nvertices).
    t
        Left and right node of each element, shape (2, nelements).
    height
        Height h of the section; the largest of a tapered beam.
    heights
        Heights of a tapered beam at xi = 0, 1/3, 2/3 and 1 of each element, shape (4, nelements),
        cubic in between; else None.
    taper
        The height as a function of the parameter of the axis, which :meth:`refined` evaluates, or
        None.
    p_X, p_Y
        Derivatives of the position along the axis and across the section at the nodes, shape
        (2, nvertices): unit tangent and unit normal.
    lengths
        Length of each element along the axis, shape (nelements,).
    p_XY
        Derivative of ``p_Y`` along the axis, shape (2, nvertices), or None if it is not known.
    sections
        Interpolation of ``p_Y`` between the nodes, "linear", "cubic", ...: see
        :meth:`with_sections`.
    s
        Parameter of each node on the curve, or None.
    curve
        The function r(s) -> (2, n) on which :meth:`refined` places new nodes, or None.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import MeshBeam
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1)
    >>> mesh.nelements, sorted(mesh.boundaries)
    (4, ['bottom', 'left', 'right', 'top'])
    >>> mesh.refined([3]).p[0].tolist()
    [0.0, 0.25, 0.5, 0.75, 0.875, 1.0]
    """

    elem: type[Element] = ElementBeamP1
    height: float = None  # type: ignore[assignment]
    p_X: np.ndarray = None  # type: ignore[assignment]
    p_Y: np.ndarray = None  # type: ignore[assignment]
    lengths: np.ndarray = None  # type: ignore[assignment]
    s: np.ndarray | None = None
    curve: Curve | None = None
    p_XY: np.ndarray | None = None
    sections: str = "linear"
    heights: np.ndarray | None = None
    taper: Callable[[Array], ArrayLike] | None = None
    #: Name of the class in files.
    kind = "beam"

    # construction

    @classmethod
    def init_line(cls, x: ArrayLike, height: float | Callable[[Array], ArrayLike],
                  origin: ArrayLike = (0.0, 0.0), angle: float = 0.0) -> "MeshBeam":
        """A straight beam.

        Raises MeshError if ``x`` does not increase, or a height is not positive.

        Parameters
        ----------
        x
            Increasing positions of the nodes along the axis, shape (n,), n >= 2.
        height
            Height of the section: a number, or for a tapered beam a function of ``x`` (n,) that
            returns heights (n,), with kinks at nodes only.
        origin
            The point, shape (2,), at x = 0.
        angle
            Angle of the axis from the first coordinate axis in radians, at most 2 pi in magnitude.

        Examples
        --------
        >>> mesh = MeshBeam.init_line([0, 1, 3], height=0.2)
        >>> mesh.lengths.tolist()
        [1.0, 2.0]
        >>> MeshBeam.init_line([0, 1, 3], height=lambda x: 0.3 - 0.05 * x).heights[0].tolist()
        [0.3, 0.25]
        """
        x = require_finite("x", x, (None,), "np.linspace(0, length, elements + 1)")
        origin = require_finite("origin", origin, (2,))
        angle = _radians(angle)
        e1 = np.array([np.cos(angle), np.sin(angle)])
        p = origin[:, None] + e1[:, None] * x
        t = _chain("x", x)
        return cls._from_nodes(p, t, e1[:, None], x[1:] - x[:-1], heights_of(height, x, t),
                               x.copy())

    @classmethod
    def init_curve(cls, r: Callable[[Array], ArrayLike], s: ArrayLike,
                   height: float | Callable[[Array], ArrayLike],
                   dr: Callable[[Array], ArrayLike] | None = None) -> "MeshBeam":
        """A beam with a curved reference configuration.

        The axis of an element is the cubic through its end points with the unit tangents and the
        arc length of the curve. :meth:`refined` places new nodes on the curve. Raises MeshError if
        the curve folds (radius of curvature below h/2), jumps, has a kink at a node or a zero
        derivative, or an element has no length.

        Parameters
        ----------
        r
            The axis: a function of parameters (n,) that returns positions (2, n).
        s
            Increasing parameters of the nodes, shape (n,), n >= 2; not necessarily arc lengths.
        height
            Height of the section: a number, or a function of parameters ``s`` (n,) that returns
            heights (n,), with kinks at nodes only.
        dr
            Derivative of ``r``; by default the complex step where ``r`` allows it, else
            differences.

        Examples
        --------
        >>> arc = MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
        ...                           np.linspace(0, np.pi, 9), height=0.1)
        >>> bool(abs(arc.lengths.sum() - np.pi) < 1e-12)
        True
        """
        s = require_finite("s", s, (None,))
        t = _chain("s", s)
        what = "of parameters (n,) that returns positions (2, n)"
        require_function("r", r, what)
        if dr is None:
            dr = derivative_of(r, s[0], s[-1])
        curve = Curve(r, require_function("dr", dr, what), (s[0], s[-1]))
        p, tangent, lengths, turning, bent = curve.elements(s)
        largest, heights, taper = heights_of(height, s, t)
        # the curvature of each sixteenth of an element times half the height there
        h = (largest + 0.0 * lengths if heights is None else np.max(heights, axis=0)).repeat(16)
        k = int(np.argmax(bent * h))
        refuse(bent[k] * h[k] >= 2.0, "the curve folds near s = {:.6g}: its radius of curvature, "
               "{:.6g}, is below half the height, {:.6g}",
               np.interp(k / 16.0, np.arange(len(s)), s), 1.0 / (bent[k] or np.inf), h[k] / 2,
               error=MeshError)
        return cls._from_nodes(p, t, tangent, lengths, (largest, heights, taper), s.copy(), curve,
                               turning)

    @classmethod
    def from_points(cls, points: ArrayLike | StrPath,
                    height: float | Callable[[Array], ArrayLike], elements: int | None = None,
                    noise: float = 0.0) -> "MeshBeam":
        """A beam whose axis is a cubic spline through points, as of a drawing or a measurement.

        Where a closed curve ends, weld the ends: ``scene.weld((beam, "left"), (beam, "right"))``.
        Raises MeshError if adjacent points coincide, or the axis bends too sharply: at a corner
        weld two beams, FileError if the file cannot be read. See P. Dierckx, Curve and Surface
        Fitting with Splines, 1993: ``scipy.interpolate.splprep``.

        Parameters
        ----------
        points
            Points along the axis, shape (n, 2), at least four for a cubic; or a text file with rows
            x, y.
        height
            As for :meth:`init_curve`; its parameter s is the length along the polygon of the
            points.
        elements
            Number of elements, of equal lengths; by default one between adjacent points.
        noise
            Root mean square distance between axis and points, for measured points: 1.4 times the
            standard deviation of each coordinate.

        Examples
        --------
        >>> angle = np.linspace(0, np.pi, 20)
        >>> arc = MeshBeam.from_points(np.column_stack([np.cos(angle), np.sin(angle)]),
        ...                            height=0.1, elements=8)
        >>> arc.nelements, float(arc.lengths.sum().round(4))
        (8, 3.1416)
        """
        curve, s = axis_of(points, elements, noise)
        with retold(MeshError, "the axis through the points: {error}. Give points in order along "
                    "the axis; measured points need {}, a corner two beams and a weld",
                    f"more than noise={noise:g}" if noise else "noise=", error=MeshError):
            return cls.init_curve(curve, s, height, curve.derivative())

    @classmethod
    def _from_nodes(cls, p, t, tangent, lengths, heights, s, curve=None, turning=None):
        made, (height, heights, taper) = object.__new__(cls), heights
        one_line = tangent.shape[1] == 1
        zero, size = np.zeros(p.shape), require_moderate("the nodes", p)
        tangent = tangent + zero
        # without __post_init__, which checks the shapes and numbers of given arrays
        vars(made).update(
            doflocs=p, t=t, _boundaries=default_tags(p, t), _subdomains=None, height=height,
            p_X=tangent, lengths=lengths, s=s, curve=curve,
            p_Y=np.array([0.0 - tangent[1], tangent[0]]), heights=heights, taper=taper,
            p_XY=zero if turning is None else turning)
        least, most, noise = lengths.min(), lengths.max(), 8 * EPS * size
        if curve is None:
            # the round-off of the nodes' positions is no difference in length
            vars(made)["is_straight"] = True
            if one_line:  # lines of a graph have directions and lengths of their own
                vars(made)["is_uniform"] = heights is None and bool(
                    most - least <= 1e-13 * most + noise)
            for array in (p, t, tangent, lengths, made.p_Y, zero, s):  # they need no copies
                array.flags.writeable = False
        if curve is not None or heights is not None or least <= 2.0 * noise or not least * height:
            made._check()
        Immutable._freeze(made)
        return made

    @classmethod
    def init_refdom(cls) -> "MeshBeam":
        return cls.init_line([0.0, 1.0], height=1.0, origin=(0.0, 0.5))

    def __post_init__(self):
        p = require_finite("the nodes", self.doflocs, (2, None))
        require_moderate("the nodes", p)
        if type(self.t) is not np.ndarray or self.t.dtype != np.int32:
            t = require_finite("t", self.t)
            refuse((t != np.floor(t)).any() or (abs(t) > 2**31 - 1).any(), "t must contain node "
                   "numbers, got {!r}", self.t, error=MeshError)
        shape = np.shape(self.t)
        refuse(len(shape) != 2 or shape[0] != 2 or shape[1] == 0, "t of a MeshBeam has shape "
               "(2, n), got {}; for quads use mesh.to_meshquad()", shape, error=MeshError)
        super().__post_init__()
        # Basis.refinterp makes meshes without a height
        refuse(self.height is None, "height must be a number, got None: use MeshBeam.init_line; "
               "for a picture of a Basis quad = mesh.to_meshquad() and "
               "quad.plot(basis.probes(quad.p) @ y), not basis.plot", error=MeshError)
        self.height = require_positive("height", self.height)
        t = self.t
        refuse((t[1] != t[0] + 1).any() or (t[0, 1:] <= t[0, :-1]).any(), "nodes are numbered "
               "along the axis: t[0] increases, and t[1] = t[0] + 1", error=MeshError)
        odd = np.setxor1d(t, np.arange(p.shape[1]))
        refuse_any(odd >= odd[:1], "node {} of {} is only in {}: every node is part of an element",
                   odd, p.shape[1], np.where(np.isin(odd, t), "t", "the nodes"), error=MeshError)
        refuse(self.p_X is None, "p_X is missing: use MeshBeam.init_line or init_curve",
               error=MeshError)
        for name, wanted in (("p_X", p.shape), ("p_Y", p.shape), ("p_XY", p.shape),
                             ("lengths", shape[1:]), ("heights", (4, shape[1]))):
            value = getattr(self, name)
            if value is not None or name not in ("p_XY", "heights"):
                found = require_finite(name, value, wanted)
                if found is not value:
                    setattr(self, name, found)
        refuse(self.heights is not None and np.any(self.heights <= 0.0), "heights must be "
               "positive, got {!r}", self.heights, error=MeshError)
        require_option("interpolation of the sections", self.sections, SECTIONS)
        refuse(self.p_XY is None and self.sections != "linear", "p_XY is missing: use "
               "MeshBeam.init_line or init_curve", error=MeshError)
        self._check()

    def _check(self):
        """Raise MeshError where an element has no length, or the body folds."""
        p, t = self.doflocs, self.t
        chord = np.hypot(*(p[:, t[1]] - p[:, t[0]]))
        refuse_any((chord <= 4 * EPS * np.abs(p).max()) | (self.lengths <= 0.0), "element {k} from "
                   "{} to {} has no length", *p[:, t].swapaxes(0, 1), error=MeshError)
        MappingBeam(self).check()  # before its arrays are copied: not the mapping that is kept

    def with_sections(self, sections: str) -> "MeshBeam":
        """The mesh with section directors interpolated "linear", "cubic", ... along the axis.

        The names are those of :data:`skfem_ancf.mesh.mapping.SECTIONS`. From "quintic" on
        the axis is interpolated with the same degree; below it is cubic. A ``Beam`` chooses the
        interpolation of its element, which represents a curved reference configuration exactly. For
        straight beams all are the same.
        """
        require_option("interpolation of the sections", sections, SECTIONS)
        if sections == self.sections:
            return self
        return replace(self, sections=sections)

    def replace(self, **changes: Any) -> "MeshBeam":
        """The mesh with another ``height``, a number or a function, or without its ``curve``.

        Positions, tangents and lengths depend on each other: to change them use :meth:`init_line`,
        :meth:`init_curve`, :meth:`refined`, :meth:`translated`, :meth:`rotated` or :meth:`scaled`.
        Raises NameUnknown for another attribute.

        Examples
        --------
        >>> MeshBeam.init_line([0, 1], height=0.1).replace(height=0.2).height
        0.2
        """
        for name in changes:
            require_option("attribute that may be replaced alone", name, ("height", "curve"))
        if "height" in changes:
            names = ("height", "heights", "taper")
            changes |= zip(names, self._heights_of(changes["height"]))
        return replace(self, **changes)

    def _heights_of(self, height):
        return heights_of(height, self.parameters, self.t)

    def node_height(self, node: int) -> float:
        """Height of the section at a node."""
        if self.heights is None:
            return self.height
        end = int(node in self.t[1])
        return float(self.heights[3 * end, np.nonzero(self.t[end] == node)[0][0]])

    @property
    def parameters(self) -> Array:
        """Parameter of each node on the axis, (nvertices,): ``s``, or the length from the start."""
        if self.s is not None:
            return self.s
        out = np.zeros(self.p.shape[1])
        gaps = np.hypot(*np.diff(self.p))
        gaps[self.t[0]] = self.lengths
        out[1:] = np.cumsum(gaps)
        return out

    def __getstate__(self):
        return picklable({field.name: getattr(self, field.name) for field in fields(self)})

    # topology

    @cached_property
    def _own_mapping(self):
        # with the mesh itself, its memory would wait for a garbage collection
        twin = object.__new__(type(self))
        vars(twin).update(vars(self))
        return MappingBeam(twin)

    def _mapping(self):
        return self._own_mapping

    def params(self) -> Array:
        """Length of each element."""
        return self.lengths

    def param(self) -> float:
        """Length of the longest element."""
        return float(np.max(self.lengths))

    @cached_property
    def is_straight(self) -> bool:
        """True if every element is straight with sections normal to it."""
        p, d = self.doflocs, self.p_X
        chord = (p[:, self.t[1]] - p[:, self.t[0]]) / self.lengths
        tol = 1e-12 + 8 * EPS * np.abs(p).max() / self.lengths.min()
        off = np.concatenate([(d[:, self.t] - chord[:, None]).reshape(2, -1),
                              self.p_Y - np.array([-d[1], d[0]])], axis=1)
        return bool(np.abs(off).max() <= tol)

    @cached_property
    def is_uniform(self) -> bool:
        """True if one table serves all elements: straight, of equal length, height and direction.
        Their chains have equal lengths, too."""
        if not self.is_straight or self.heights is not None:
            return False
        # the round-off of the nodes' positions is no difference in length
        noise = 8 * EPS * np.abs(self.doflocs).max()
        L, turn = self.lengths, np.abs(self.p_X - self.p_X[:, :1]).max()
        if np.ptp(L) > 1e-13 * L.max() + noise or turn > 1e-12 + noise / L.min():
            return False
        chains = self.chain_lengths
        return self.is_chain or bool(np.ptp(chains) <= 1e-12 * chains.max())

    @property
    def is_chain(self) -> bool:
        """True if each element begins at the end of the previous one."""
        return bool(self.t.shape[1] == self.doflocs.shape[1] - 1)

    @property
    def chain_lengths(self) -> Array:
        """Length of the chain of each element, shape (nelements,)."""
        if self.is_chain:
            return np.full(self.t.shape[1], self.lengths.sum())
        return np.bincount(self.chains, self.lengths)[self.chains]

    @cached_property
    def chains(self) -> Array:
        """Number of the chain of each element, shape (nelements,)."""
        return np.cumsum(np.append(False, self.t[0, 1:] != self.t[1, :-1]))

    def element_finder(self, mapping: Any = None) -> Callable[..., Array]:
        """A function from coordinates x, y to elements, with MeshError outside the body.
        ``mapping`` is not used."""
        find = Finder(self)
        return lambda *x: find.inside(
            require_finite("the points", x, (2, None)))[0].astype(np.int32)

    # refinement

    def _uniform(self):  # scikit-fem's finder of elements on surfaces calls it
        return halved(self, np.arange(self.nelements))

    def refined(self, times_or_ix: Any = 1) -> "MeshBeam":
        """A finer mesh with the same named boundaries and subdomains; new nodes are on the curve.

        Parameters
        ----------
        times_or_ix
            The number of uniform refinements, or the elements to halve.
        """
        if isinstance(times_or_ix, (int, np.integer)) and not isinstance(times_or_ix, bool):
            most = int(np.log2(MAX_ELEMENTS / self.nelements))
            return super().refined(require_integer(
                "the number of refinements", times_or_ix, 0, max(most, 0),
                f"a mesh of {MAX_ELEMENTS} elements at most"))
        require_unmasked("times_or_ix", times_or_ix)
        return halved(self, np.unique(self.normalize_elements(times_or_ix)))

    def graded(self, at: Any = ("left",), size: float | None = None,
               growth: float = 0.5) -> "MeshBeam":
        """A mesh refined near sections, to resolve boundary layers at supports and loads.

        Elements are halved until those within 1.5 heights of the sections are not longer than
        ``size``, and the others not longer than ``growth`` times their distance from there. Raises
        MeshError if a section is not known, or a point is far from the beam.

        Parameters
        ----------
        at
            Sections: "left", "right", or points (x, y) of the axis; one, several, or an array of
            points, shape (n, 2).
        size
            Element length at the sections; a quarter of the height by default.
        growth
            Ratio of element length to distance, positive.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import MeshBeam
        >>> MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1).graded("left").nelements
        23
        """
        size = 0.25 * self.height if size is None else require_positive("size", size)
        growth = require_positive("growth", growth)
        refuse(3.0 * self.height / size > MAX_ELEMENTS, "size = {:g} is too small for a height of "
               "{:g}", size, self.height)
        at = points_of_rows(at)
        if isinstance(at, str) or is_point(at) or not isinstance(at, (tuple, list, set, frozenset)):
            at = [at]
        refuse(not at, "at names no section: give 'left', 'right', or a point of the axis")
        places, mesh = np.array([as_point(place, self) for place in at]), self
        self.element_finder()(*places.T)
        while True:
            X = np.array([np.linspace(0, 1, 5), np.full(5, 0.5)])
            x = mesh._mapping().F(X)
            far = np.min(np.hypot(*(x[..., None] - places.T[:, None, None])), axis=(1, 2))
            allowed = np.maximum(size, growth * (far - 1.5 * self.height))
            marked = np.nonzero(mesh.lengths > allowed * (1 + 1e-9))[0]
            if len(marked) == 0:
                return mesh
            mesh = mesh.refined(marked)

    def restrict(self, elements: Any, return_mapping: bool = False, skip_boundaries: bool = False,
                 skip_subdomains: bool = False) -> Any:
        """The mesh of some elements, with the numbering along the axis.

        Parameters
        ----------
        elements
            Numbers of elements, shape (k,), a mask, the name of a subdomain, or a function of the
            points.
        return_mapping, skip_boundaries, skip_subdomains
            Also return the numbers of the remaining nodes, shape (n,); drop the names.
        """
        require_unmasked("elements", elements)
        elements = np.unique(self.normalize_elements(elements))
        refuse(not len(elements), "a mesh needs at least one element, got none", error=MeshError)
        nodes, t = np.unique(self.t[:, elements], return_inverse=True)
        kept = {**dict.fromkeys(NODAL, nodes), "lengths": elements, "heights": elements}
        changes: dict[str, Any] = {name: getattr(self, name)[..., some] for name, some
                                   in kept.items() if getattr(self, name) is not None}
        changes.update(t=t.reshape(2, -1).astype(np.int32), _boundaries=None, _subdomains=None)
        m = replace(self, **changes)
        if self._subdomains is not None and not skip_subdomains:
            m._subdomains = {name: np.nonzero(np.isin(elements, e))[0].astype(np.int32)
                             for name, e in self._subdomains.items()}
        if self._boundaries is not None and not skip_boundaries:
            facets = np.full(self.nfacets, -1, dtype=np.int32)
            facets[self.t2f[:, elements].ravel()] = m.t2f.ravel()
            tags = {}
            for name, f in self._boundaries.items():
                keep = facets[np.asarray(f)] >= 0
                new = facets[np.asarray(f)[keep]]
                if getattr(f, "ori", None) is not None:  # a cut section has one side left
                    new = OrientedBoundary(new, np.where(m.f2t[1, new] < 0, 0, f.ori[keep]))
                tags[name] = new
            m._boundaries = tags
        m._freeze()
        return (m, nodes) if return_mapping else m

    # rigid motion and scale

    def _moved(self, rotation, shift, scale=1.0):
        curve = None if self.curve is None else self.curve.moved(scale * rotation, shift)
        return replace(self, doflocs=scale * rotation @ self.p + shift[:, None],
                       p_X=rotation @ self.p_X, p_Y=rotation @ self.p_Y, curve=curve,
                       p_XY=None if self.p_XY is None else rotation @ self.p_XY / scale,
                       lengths=scale * self.lengths, height=scale * self.height,
                       heights=None if self.heights is None else scale * self.heights,
                       taper=None if self.taper is None else partial(scaled, self.taper, scale))

    def translated(self, diffs: ArrayLike) -> "MeshBeam":
        """The mesh translated by a vector, shape (2,)."""
        return self._moved(np.eye(2), require_finite("the shift", diffs, (2,)))

    def rotated(self, angle: float, about: ArrayLike = (0.0, 0.0)) -> "MeshBeam":
        """The mesh rotated about a point.

        Parameters
        ----------
        angle, about
            In radians, counterclockwise, at most 2 pi in magnitude; the point, shape (2,).
        """
        angle, about = _radians(angle), require_finite("about", about, (2,))
        c, s = np.cos(angle), np.sin(angle)
        Q = np.array([[c, -s], [s, c]])
        return self._moved(Q, about - Q @ about)

    def scaled(self, factors: ArrayLike) -> "MeshBeam":
        """The mesh and its height scaled by a positive number, or several equal ones (n,)."""
        f = np.unique(require_finite("factors", factors))
        refuse(len(f) != 1 or f[0] <= 0, "a beam is scaled by one positive factor, got {!r}",
               factors, error=MeshError)
        return self._moved(np.eye(2), np.zeros(2), f[0])

    # pictures and files

    def to_meshquad(self, nx: int = 8, ny: int = 4) -> MeshQuad:
        """A ``skfem.MeshQuad`` of the reference configuration.

        Parameters
        ----------
        nx, ny
            Quads along and across each element.
        """
        nx, ny = (require_integer(name, n, 1, MAX_SUBDIVISION) for name, n in (("nx", nx),
                                                                             ("ny", ny)))
        quad = MeshQuad.init_tensor(np.linspace(0, 1, nx + 1), np.linspace(0, 1, ny + 1))
        number = np.arange(quad.p.shape[1] * self.nelements).reshape(self.nelements, -1)
        left, right = (np.nonzero(quad.p[0] == end)[0] for end in (0.0, 1.0))
        joined = 1 + np.nonzero(self.t[1, :-1] == self.t[0, 1:])[0]
        number[joined[:, None], left] = number[joined[:, None] - 1, right]
        kept, number = np.unique(number, return_inverse=True)
        t = number.reshape(self.nelements, -1)[:, quad.t[::-1]].transpose(1, 0, 2)
        return MeshQuad(self._mapping().F(quad.p).reshape(2, -1)[:, kept], t.reshape(4, -1))

    def draw(self, visuals: str = "matplotlib", **kwargs: Any) -> Any:
        """Draw the outline of the elements.

        Parameters
        ----------
        visuals, **kwargs
            Name of a module of ``skfem.visuals``; arguments of :meth:`skfem.Mesh.draw`.
        """
        return self._outline().draw(visuals, **kwargs)

    def _repr_svg_(self):
        return self._outline()._repr_svg_()

    def _outline(self):
        return self.to_meshquad(1 if self.is_straight and self.heights is None else 8, 1)

    def __repr__(self):
        kind = "straight" if self.is_straight else "curved"
        height = f"{self.height:.6g}" if self.heights is None else (
            f"{np.min(self.heights):.6g} to {self.height:.6g}")
        return (super().__repr__() + f"\n  Height, length: {height}, "
                f"{self.lengths.sum():.6g} ({kind})")

    def save_npz(self, filename: StrPath) -> None:
        """Save all but the functions ``curve`` and ``taper``, for :meth:`load_npz`."""
        path = require_path("filename", filename)
        path = path if path.suffix == ".npz" else path.with_name(f"{path.name}.npz")
        content = {name: getattr(self, name) for name in (*NEEDED, *OPTIONAL, "kind")
                   if getattr(self, name) is not None}
        for name, facets in (self.boundaries or {}).items():
            content[f"b_{name}"] = facets
            if getattr(facets, "ori", None) is not None:
                content[f"o_{name}"] = facets.ori
        content |= {f"s_{name}": elements for name, elements in (self.subdomains or {}).items()}
        with retold(OSError, "cannot write {!r}: {error}", str(path), error=FileError):
            archive.write(path, content)

    @classmethod
    def load_npz(cls, filename: StrPath) -> "MeshBeam":
        """Load a mesh saved by :meth:`save_npz`, without executing anything in the file.

        Raises
        ------
        FileError, MeshError
            If the file cannot be read, or contains no beam.
        """
        kinds = {of.kind: of for of in (*MeshBeam.__subclasses__(), MeshBeam) if is_builtin(of)}
        kinds[cls.kind], path = cls, require_path("filename", filename)
        try:
            data = archive.read(path)
            missing = sorted(set(NEEDED) - data.keys())
            refuse(missing, "{} are missing", missing, error=MeshError)
            kind = require_option("kind of mesh", str(data.get("kind", cls.kind)), kinds)
            tags = {name[2:]: OrientedBoundary(facets, data[f"o_{name[2:]}"])
                    if f"o_{name[2:]}" in data else facets
                    for name, facets in data.items() if name.startswith("b_")}
            parts = {name[2:]: elements for name, elements in data.items()
                     if name.startswith("s_")}
            return kinds[kind](
                data["doflocs"], data["t"], tags or None, parts or None,
                height=float(data["height"]), sections=str(data["sections"]),
                **{name: data[name] for name in ("p_X", "p_Y", "lengths", *OPTIONAL)
                   if name in data})
        except OSError as error:
            raise FileError(f"cannot read {str(path)!r}: {error}") from error
        except Exception as error:  # whatever is in the file
            why = error if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            raise MeshError(f"{str(path)!r} contains no beam: {why}") from error

    def save(self, filename: StrPath, point_data: dict[str, Any] | None = None,
             cell_data: dict[str, Any] | None = None, **kwargs: Any) -> None:
        """Save the mesh as ``.npz``, or the quads of :meth:`to_meshquad` in a format of meshio.

        Parameters
        ----------
        filename, point_data, cell_data, **kwargs
            File name, whose suffix is the format; the others as for ``skfem.MeshQuad.save``.
        """
        path = require_path("filename", filename)
        if path.suffix == ".npz":
            require_options(f"save({path.name!r})", kwargs, ("filename",))
            return self.save_npz(path)
        import meshio

        refuse(not path.suffix, "the file name {!r} has no suffix, as .npz or .vtu", str(path),
               error=FileError)
        kinds = OSError, meshio.ReadError, meshio.WriteError, SystemExit
        with retold(kinds, "cannot write {!r}: {error}", str(path), error=FileError), (
                contextlib.nullcontext(path) if path.suffix in IN_PARTS else archive.replacing(path)
                ) as new:
            self.to_meshquad().save(new, point_data, cell_data, **kwargs)

    @classmethod
    def load(cls, filename: StrPath, out: Any = None, **kwargs: Any) -> "MeshBeam":
        """Load a mesh that :meth:`save` wrote as ``.npz``.

        Parameters
        ----------
        filename, out, **kwargs
            The file; the others, of ``skfem.Mesh.load``, are ignored.
        """
        path = require_path("filename", filename)
        require_options("load", kwargs, ("filename",))
        if path.suffix == ".npz":
            return cls.load_npz(path)
        raise MeshError(f"cannot read a beam from {path.name!r}: give a .npz file of mesh.save()")


def reach(meshes: Sequence[MeshBeam]) -> float:
    """The size of a scene, to which tolerances of positions are relative: the diagonal of the
    bounding box of all nodes, but at least the longest line (a curled line may be straightened) and
    at most the total length of all lines."""
    if len(meshes) == 1 and meshes[0].is_chain:
        return float(meshes[0].lengths.sum())
    total = float(sum(mesh.lengths.sum() for mesh in meshes))
    longest = max([float(mesh.chain_lengths.max()) for mesh in meshes])
    low = np.min([mesh.p.min(axis=1) for mesh in meshes], axis=0)
    high = np.max([mesh.p.max(axis=1) for mesh in meshes], axis=0)
    return min(total, max(longest, float(np.hypot(*(high - low)))))


def _chain(name, x):
    """Left and right nodes of elements between increasing parameters x."""
    refuse(len(x) < 2, "a beam needs at least two nodes, got {}", len(x), error=MeshError)
    refuse_any(x[1:] <= x[:-1], "{} must increase along the axis: element {k} from {:.9g} to "
               "{:.9g} has no length", name, x[:-1], x[1:], error=MeshError)
    nodes = np.arange(len(x), dtype=np.int32)
    return np.array([nodes[:-1], nodes[1:]])


def _radians(angle):
    """An angle as a float; InputError if it is likely to be in degrees."""
    angle = require_finite_scalar("angle", angle)
    refuse(abs(angle) > 2.0 * np.pi * (1 + 1e-12), "an angle is in radians, at most 2 pi, got "
           "{!r}: for degrees np.deg2rad({:g})", angle, angle)
    return angle
