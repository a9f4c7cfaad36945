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
    load
        Load factor.
    t
        Time, None in statics.
    resultants
        A function: the section forces of a beam.
    """

    @property
    def system(self) -> Any: ...

    @property
    def u(self) -> Array: ...

    @property
    def v(self) -> Array: ...

    @property
    def load(self) -> float: ...

    @property
    def t(self) -> float | None: ...

    @property
    def beams(self) -> Sequence[Beam]: ...

    @property
    def bodies(self) -> Sequence[RigidBody]: ...

    def u_of(self, beam: Any) -> Array:
        """Displacement of the degrees of freedom of one beam or rigid body."""

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
