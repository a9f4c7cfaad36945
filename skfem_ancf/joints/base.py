"""What every joint shares: constraint equations on points and sections of beams."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

from ..errors import AncfError, InputError, require_finite, shown
from ..frozen import Sealable
from ..loads import require_entries
from ..places import is_point

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..scene import Scene
    from ..types import Array, Place, WhichBeam


class Vector:
    """A plane vector that depends affinely on the coordinates: ``start + u[dofs] @ weights``.

    The position of a material point and the direction of a section are such vectors.

    Parameters
    ----------
    start
        Its value in the stress-free state, shape (2,).
    dofs
        Numbers of the coordinates of both components, shape (2, n).
    weights
        Their weights, shape (n,).
    """

    def __init__(self, start: ArrayLike, dofs: Array, weights: Array) -> None:
        keep = np.abs(weights) > 1e-14 * np.max(np.abs(weights))
        self.start, self.dofs, self.weights = np.asarray(start), dofs[:, keep], weights[keep]

    def __call__(self, u: Array) -> Array:
        return self.start + u[self.dofs] @ self.weights

    def row(self, direction: ArrayLike, n: int) -> Array:
        """The derivative of ``direction . vector`` by the coordinates, as a dense row (n,).

        Parameters
        ----------
        direction
            Shape (2,).
        n
            Number of all coordinates.

        Returns
        -------
        ndarray
            Shape (n,).
        """
        out = np.zeros(n)
        np.add.at(out, self.dofs, np.outer(np.asarray(direction), self.weights))
        return out

    def entries(self, direction: ArrayLike) -> tuple[Array, Array]:
        """The derivative of ``direction . vector`` by the coordinates.

        Parameters
        ----------
        direction
            Shape (2,).

        Returns
        -------
        columns, values
            Shapes (k,).
        """
        return self.dofs.ravel(), np.outer(np.asarray(direction), self.weights).ravel()


def gradients(*equations: list) -> tuple[Array, Array, Array]:
    """The entries of a Jacobian that are not zero.

    Parameters
    ----------
    *equations
        For each a list of pairs, Vector and direction (2,), whose scalar products it sums.

    Returns
    -------
    rows, columns, values
        Shapes (k,).
    """
    none = np.zeros(0, dtype=int)
    rows, columns, values = [none], [none], [np.zeros(0)]
    for k, terms in enumerate(equations):
        for vector, direction in terms:
            found = vector.entries(direction)
            rows.append(np.full(len(found[0]), k))
            columns.append(found[0])
            values.append(found[1])
    i, j, v = map(np.concatenate, (rows, columns, values))
    keep = v != 0.0
    return i[keep], j[keep], v[keep]


def rotation(angle: float) -> Array:
    """The matrix that turns by ``angle``."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


class Joint(Sealable):
    """Constraint equations Phi(u, t) = 0 with Lagrange multipliers.

    A joint is bound to a scene by :meth:`bind`, which finds its points; from then on ``u`` is
    the displacement of all coordinates of the scene. The multipliers are the forces (or moment)
    that the joint exerts, in the order of :attr:`equations`.

    A joint of your own is a subclass that sets :attr:`equations` and defines :meth:`bind`,
    :meth:`value`, :meth:`jacobian` or :meth:`entries`, and :meth:`curvature` if it is not constant;
    :meth:`skfem_ancf.Scene.add` takes it. The scene keeps a copy and binds others: one to its own
    beams, and one to those of each finer mesh of ``solve_static(adapt=...)``.

    Attributes
    ----------
    equations : tuple of str
        What each equation holds.
    constant : bool
        The derivative of Phi depends neither on u nor on t. Where it does, Phi is at most
        quadratic in u: what :class:`~skfem_ancf.dynamics.EnergyMomentum` needs to be exact.
    moving : bool
        Phi depends on t.
    """

    equations: tuple[str, ...] = ()
    constant = True
    moving = False
    name: str | None = None

    def __init_subclass__(cls, **options: Any) -> None:
        """Of :meth:`jacobian` and :meth:`entries` the one that a class defines gives the other."""
        super().__init_subclass__(**options)
        if "jacobian" in vars(cls) and "entries" not in vars(cls):
            def entries(self: Joint, u: Array, t: float) -> tuple[Array, Array, Array]:
                J = cls.jacobian(self, u, t)
                rows, columns = np.nonzero(J)
                return rows, columns, J[rows, columns]

            cls.entries = entries  # type: ignore[method-assign]
        elif "entries" in vars(cls) and "jacobian" not in vars(cls):
            def jacobian(self: Joint, u: Array, t: float) -> Array:
                rows, columns, values = cls.entries(self, u, t)
                J = np.zeros((len(self.equations), len(u)))
                np.add.at(J, (rows, columns), values)
                return J

            cls.jacobian = jacobian  # type: ignore[method-assign]

    def bind(self, scene: Scene) -> None:
        """Find the points and sections in the scene's coordinates.

        Parameters
        ----------
        scene
            Has ``beam(which)``, the Beam meant by a Beam, a name, a number or None,
            ``offset(which)``, the number of its first coordinate, and ``N``.
        """
        raise NotImplementedError

    def value(self, u: Array, t: float) -> Array:
        """The equations Phi, which are zero where the joint is closed.

        Parameters
        ----------
        u
            Displacement of the scene's coordinates, shape (N,).
        t
            Time; in statics the load factor.

        Returns
        -------
        ndarray
            Shape (m,).
        """
        raise NotImplementedError

    def jacobian(self, u: Array, t: float) -> Array:
        """Derivative of Phi by u; by default that of :meth:`entries`.

        Parameters
        ----------
        u
            Displacement of the scene's coordinates, shape (N,).
        t
            Time; in statics the load factor.

        Returns
        -------
        ndarray
            Shape (m, N).
        """
        raise NotImplementedError("a joint defines jacobian(u, t) or entries(u, t)")

    def entries(self, u: Array, t: float) -> tuple[Array, Array, Array]:
        """The entries of :meth:`jacobian` that are not zero; those at one place add up.

        A joint that defines them costs what it holds, however many beams a scene has; else they
        are looked for in the dense rows.

        Parameters
        ----------
        u
            Displacement of the scene's coordinates, shape (N,).
        t
            Time; in statics the load factor.

        Returns
        -------
        rows, columns, values
            Shapes (k,).
        """
        raise NotImplementedError("a joint defines jacobian(u, t) or entries(u, t)")

    def curvature(self, u: Array, t: float,
                  multipliers: Array) -> tuple[Array, Array, Array] | None:
        """The sum over k of multipliers[k] d^2 Phi_k / du^2.

        Parameters
        ----------
        u
            Displacement of the scene's coordinates, shape (N,).
        t
            Time; in statics the load factor.
        multipliers
            Those of its equations, shape (m,).

        Returns
        -------
        rows, columns, values
            Shapes (k,); or None if the derivative of Phi is constant.
        """
        return None

    def offset(self, times: Array, N: int) -> Array:
        """Phi of the stress-free state at several times.

        A joint that moves may override it to ask for its motion only.

        Parameters
        ----------
        times
            Times, shape (n,).
        N
            Number of the scene's coordinates.

        Returns
        -------
        ndarray
            Shape (n, m).
        """
        zero = np.zeros(N)
        return np.array([self.value(zero, t) for t in times])

    def slope(self, times: Array, N: int) -> tuple[Array, Array]:
        """The derivative of Phi in the stress-free state at several times.

        Parameters
        ----------
        times
            Times, shape (n,).
        N
            Number of the scene's coordinates.

        Returns
        -------
        columns, values
            Shapes (k,) and (n, m, k): of the coordinates on which it depends.
        """
        zero = np.zeros(N)
        if self.moving and not self.constant:
            return np.arange(N), np.array([self.jacobian(zero, t) for t in times])
        rows, found, values = self.entries(zero, times[0])
        columns, where = np.unique(found, return_inverse=True)
        J = np.zeros((len(self.equations), len(columns)))
        np.add.at(J, (rows, where), values)
        return columns, np.broadcast_to(J, (len(times),) + J.shape)

    def __repr__(self) -> str:
        at = getattr(self, "at", None)
        if isinstance(at, tuple) and len(at) == 2 and at[0] is at[1]:  # given once for both beams
            at = at[0]
        parts = [type(self).__name__, self.name, None if at is None else f"at {shown(at)}"]
        return f"<{' '.join(part for part in parts if part)}>"


def bind_joint(joint: Joint, scene: Scene) -> Joint:
    """A copy of a joint, bound to a scene and tried there: what it returns fits the scene.

    Parameters
    ----------
    joint
        A :class:`Joint`, as it was given.
    scene
        The :class:`~skfem_ancf.Scene`.

    Raises
    ------
    InputError
        If the joint does not keep to the interface of :class:`Joint`.
    """
    # by which it is known again: in a bound copy, on another mesh, in another process
    vars(joint).setdefault("_key", uuid4().hex)
    bound = joint._unsealed()
    try:
        bound.bind(scene)
        bound._seal()
        if type(joint).__module__.rpartition(".")[0] != __package__:
            _try(bound, scene.N)
    except AncfError:
        raise
    except Exception as error:
        if type(joint).__module__.rpartition(".")[0] == __package__:
            raise
        raise InputError(  # it is the user's: it may raise anything
            f"{joint!r} fails in the stress-free state: {type(error).__name__}: {error}; a joint "
            "defines bind(scene), value(u, t), jacobian(u, t)") from error
    return bound


def _try(joint: Joint, n: int) -> None:
    m, zero = len(joint.equations), np.zeros(n)
    require_finite(f"value(u, t) of {joint!r}", joint.value(zero, 0.0), (m,))
    require_finite(f"jacobian(u, t) of {joint!r}", joint.jacobian(zero, 0.0), (m, n))
    found = joint.curvature(zero, 0.0, np.ones(m))
    if found is not None:
        require_entries(f"curvature of {joint!r}", *found, n)


def same_joint(a: Joint, b: Joint) -> bool:
    """True if both are the same joint, bound or not, to whatever mesh.

    Parameters
    ----------
    a, b
        Joints.
    """
    return a is b or (getattr(a, "_key", None) is not None
                      and getattr(a, "_key", None) == getattr(b, "_key", None))


def point(scene: Scene, beam: WhichBeam, at: ArrayLike) -> Vector:
    """The position of a material point, as a :class:`Vector`.

    Parameters
    ----------
    scene
        What :meth:`Joint.bind` was given.
    beam
        The beam, its name or its number.
    at
        The point: its place (x, y) in the stress-free body.
    """
    beam = scene.beam(beam)
    e, X = beam.locate(at)
    dofs, weights = beam.probe(at)
    start = beam.mesh.mapping().F(X[:, None], np.array([e]))[:, 0, 0]
    return Vector(start, dofs + scene.offset(beam), weights)


def section(scene: Scene, beam: WhichBeam, boundary: Place) -> tuple[Vector, Vector]:
    """Axis position and direction of a section, as two :class:`Vector`.

    Parameters
    ----------
    scene
        What :meth:`Joint.bind` was given.
    beam
        The beam, its name or its number.
    boundary
        A place that is one section.
    """
    beam = scene.beam(beam)
    node = beam.section_node(boundary)
    dofs, weights = beam.section_direction(node)
    direction = Vector(beam.q0_local[dofs] @ weights, dofs + scene.offset(beam), weights)
    first = scene.offset(beam) + node * beam.nd
    return (Vector(beam.mesh.p[:, node], np.array([[first], [first + 1]]), np.ones(1)), direction)


def pair(value: Any, what: str) -> tuple[Any, Any]:
    """A point as a pair: given once for both beams, or once for each.

    Parameters
    ----------
    value
        One point, or a tuple or list of two.
    what
        What it is, for the message where it is None.
    """
    if value is None:
        raise InputError(f"a joint needs {what}")
    if isinstance(value, (tuple, list)) and len(value) == 2 and not is_point(value):
        return tuple(value)
    return value, value


def both(beams: Any) -> tuple[Any, Any]:
    """The two beams of a joint."""
    if not isinstance(beams, (tuple, list)) or len(beams) != 2:
        raise InputError(f"beams must be two beams, by Beam, name or number, got {shown(beams)}")
    return tuple(beams)


def cross_terms(a: Vector, b: Vector, Q: Array) -> tuple[Array, Array, Array]:
    """Second derivative of ``a x (Q b)`` by the coordinates.

    Parameters
    ----------
    a, b
        Vectors.
    Q
        Matrix, shape (2, 2).

    Returns
    -------
    rows, columns, values
        Shapes (k,), of a symmetric matrix.
    """
    J = np.array([[0.0, 1.0], [-1.0, 0.0]]) @ Q  # a x c = a^T [[0, 1], [-1, 0]] c
    values = np.einsum("ij,k,l->ikjl", J, a.weights, b.weights)
    rows = np.broadcast_to(a.dofs[:, :, None, None], values.shape).ravel()
    cols = np.broadcast_to(b.dofs[None, None], values.shape).ravel()
    values = values.ravel()
    return np.append(rows, cols), np.append(cols, rows), np.append(values, values)
