"""What recovery, pictures and files read of a solution, be it one state or a motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from .beam import Beam
    from .rigid import RigidBody
    from ..core.types import Array


class Configuration(Protocol):
    """A deformed configuration; a :class:`~skfem_ancf.results.State` is one.

    Attributes
    ----------
    system
        The equations of the scene.
    beams, bodies
        The beams and the rigid bodies of the scene.
    u, v
        Displacement and velocity of the degrees of freedom, shape (N,).
    multipliers
        Lagrange multipliers of the joints, shape (m,).
    load
        Load factor.
    t
        Time, None in statics.
    acceleration
        Of the degrees of freedom, shape (N,), None in statics.
    base
        The configuration about which this one is linearised, or None.
    places
        The displacement (N,) as fields are evaluated at it: of a linear solution a
        :func:`~skfem_ancf.core.linear.step` from the base.
    from_rest
        True of a linear solution about the reference configuration without load.
    unit
        What factors of loads are times: of one from rest a step, else 1.
    actions
        Times and factors at which distributed loads act, see :mod:`skfem_ancf.recovery`.
    balance, resultants
        Functions: the forces in balance at the degrees of freedom, the section forces of a beam.
    """

    @property
    def system(self) -> Any: ...

    @property
    def u(self) -> Array: ...

    @property
    def v(self) -> Array: ...

    @property
    def multipliers(self) -> Array: ...

    @property
    def load(self) -> float: ...

    @property
    def t(self) -> float | None: ...

    @property
    def acceleration(self) -> Array | None: ...

    @property
    def base(self) -> Any: ...

    @property
    def places(self) -> Array: ...

    @property
    def from_rest(self) -> bool: ...

    @property
    def unit(self) -> Any: ...

    @property
    def actions(self) -> Any: ...

    @property
    def beams(self) -> Sequence[Beam]: ...

    @property
    def bodies(self) -> Sequence[RigidBody]: ...

    def u_of(self, beam: Any) -> Array:
        """Displacement of the degrees of freedom of one beam or rigid body."""

    def places_of(self, beam: Any) -> Array:
        """Those of :attr:`places` of one beam or rigid body."""

    def contact_memory(self) -> Any:
        """A context in which the obstacles have the memory of this configuration."""

    @property
    def balance(self) -> Callable[..., Any]: ...

    @property
    def resultants(self) -> Callable[..., Any]: ...


class Instants(Protocol):
    """Configurations over time; a :class:`~skfem_ancf.dynamics.History` is one.

    Attributes
    ----------
    t
        Times, shape (nt,).
    """

    @property
    def t(self) -> Array: ...

    @property
    def states(self) -> Callable[..., Iterator[Any]]: ...

    def __len__(self) -> int: ...

    def state(self, k: int) -> Any:
        """The configuration at one of the times."""
