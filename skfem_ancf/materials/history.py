"""Materials whose stress depends on the path of the strain."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core import (Array, ConvergenceError, InputError, Law, ask, rebuilt, refuse, require_integer,
                    require_positive, require_slope)
from .base import LinearLaw, Material, hooke, stress_rates
from .pointwise import MODULI, python

#: Points across a section without a word from the user: the moment of an ideally plastic rectangle
#: is right to 1 %; 20 points give 0.4 %, 10 points 1.5 %.
ACROSS = 14
#: Newton corrections of the lateral strain of a fibre; lateral stress over the largest that is
#: left, and that which may be if it does not decrease.
LATERAL, CLOSE, ROUGH = 50, 1e-13, 1e-8
#: Strain and time at which derivatives of a user-defined law are tested.
SMALL, SPAN = 1e-3, 1.0


#: Names of the functions of a point and of a fibre, and of the methods that they stand for.
POINT = "point", "stored", "evaluate", "stress", "moduli", "energy"
FIBRE = "fibre", "fibre_stored", "axial", "axial_energy"
NO_VARIABLES: Mapping[str, int] = {}


class AtRest(LinearLaw):
    """The moduli of a material with a history at zero strain, for what knows no history.
    ``material`` is the material, ``scale`` (3,) the factors of strain and stress for shear."""

    def __init__(self, material: "HistoryMaterial", k_s: float) -> None:
        self.material, self.scale = material, np.array([1.0, 1.0, np.sqrt(k_s)])
        super().__init__(material.elastic * np.outer(self.scale, self.scale))


class HistoryMaterial(Material):
    """A material with history variables: plastic or viscoelastic, for example.

    History variables are numbers at each integration point, zero at rest. They are a value that
    goes in and comes out: a law changes nothing in itself. A subclass defines :attr:`variables` and
    :meth:`stress`, which run in NumPy; or :attr:`variables`, the static methods :attr:`point` and
    :attr:`stored`, and :attr:`constants`, which are compiled. A subclass that overrides a method of
    such a law runs in NumPy.

    Strain (eps_xx, eps_yy, 2 eps_xy) and stress (S_xx, S_yy, S_xy) are those of
    :class:`~skfem_ancf.materials.base.Material`, shape (3, ...). E and nu are those of small
    strains at rest.

    Parameters
    ----------
    points
        Number of points across a section or layer. The default of 14 gives the moment of an ideally
        plastic rectangle to 1 %, 20 to 0.4 %.
    E, nu, density, plane, shear_correction, thermal_expansion, strength
        Those of :class:`~skfem_ancf.materials.base.Material`; E is a number.

    Other Parameters
    ----------------
    strain
        Shape (3, ...).
    history
        Variables at the start of the increment, shape (k, ...).
    stress
        That at the strain with this history, shape (3, ...).
    dt
        Time of the increment; 0 at once.

    Examples
    --------
    A bar that is damaged by its largest stretch:

    >>> import numpy as np
    >>> from skfem_ancf.materials import HistoryMaterial
    >>> class Damaged(HistoryMaterial):
    ...     variables = {"largest": 1}
    ...
    ...     def stress(self, strain, history, dt):
    ...         largest = np.maximum(history, strain[:1])
    ...         return (1.0 - largest) * np.tensordot(self.elastic, strain, 1), largest
    >>> law = Damaged(E=1.0, nu=0.0)
    >>> stress, history = law.stress(np.array([0.5, 0.0, 0.0]), np.zeros(1), 0.0)
    >>> stress.tolist(), history.tolist()
    ([0.25, 0.0, 0.0], [0.5])
    """

    #: Names of the history variables, with their numbers of components.
    variables: Mapping[str, int] = NO_VARIABLES
    #: ``point(constants, strain, history, dt, stress, moduli, after)`` writes stress, (D_11, D_12,
    #: D_13, D_22, D_23, D_33) and history at the end, row by row. As in
    #: :class:`~skfem_ancf.materials.PointwiseMaterial`, rows are arrays in NumPy and numbers in
    #: compiled code. ``stored(constants, strain, history)`` returns the stored energy per volume.
    point: Any = None
    stored: Any = None
    #: The same of fibres, with one strain, stress and modulus; without these, fibres of a cable
    #: run in NumPy.
    fibre: Any = None
    fibre_stored: Any = None

    def __init__(self, E: float, nu: float, density: float | None = None, plane: str = "stress",
                 shear_correction: str | float = "auto", thermal_expansion: float = 0.0,
                 points: int = ACROSS,
                 strength: float | tuple[float, float] | None = None) -> None:
        refuse(callable(E), "{} has a history and takes a number for E: use Section.layers",
               type(self).__name__)
        super().__init__(E, nu, density, plane, shear_correction, thermal_expansion, strength)
        self.points = require_integer("points", points, 2, 200)

    def replace(self, **changes: Any) -> Material:
        return rebuilt(self, changes, ("E", "nu", "density", "plane", "shear_correction",
                                       "thermal_expansion", "points", "strength"))

    @property
    def number(self) -> int:
        """Number of history variables of a point."""
        return sum(self.variables.values())

    @property
    def elastic(self) -> Array:
        """Moduli at rest, (3, 3): those of E and nu."""
        return hooke(self.E, self.nu, self.plane)

    def functions(self, fibre: bool) -> tuple[Any, Any]:
        """:attr:`point` and :attr:`stored`, or :attr:`fibre` and :attr:`fibre_stored`; None where a
        subclass overrides what these are for."""
        point, stored, *others = FIBRE if fibre else POINT
        mro = type(self).__mro__
        first = [next(k for k, one in enumerate(mro) if name in vars(one))
                 for name in (point, *others)]
        return (None, None) if min(first) < first[0] else (
            getattr(self, point), getattr(self, stored))

    def rows(self, name: str) -> slice:
        """The rows of a variable in a history."""
        first = 0
        for other, n in self.variables.items():
            if other == name:
                return slice(first, first + n)
            first += n
        raise InputError(f"{type(self).__name__} has the history variables "
                         f"{', '.join(self.variables)}, not {name!r}")

    # what a law defines

    @property
    def constants(self) -> Array:
        """Constants that :attr:`point` and the others take, shape (k,)."""
        raise NotImplementedError(f"{type(self).__name__} has a method point and no constants")

    def stress(self, strain: Array, history: Array, dt: float  # type: ignore[override]
               ) -> tuple[Array, Array]:
        """The stress (3, ...), and the history at the end of the increment, (k, ...). At the strain
        at which a history was found, a further increment of ``dt = 0`` must give the same
        stress."""
        if self.point is None:
            raise NotImplementedError(
                f"{type(self).__name__} must define stress(strain, history, dt)")
        S, _, after = self.evaluate(strain, history, dt)
        return S, after

    def moduli(self, strain: Array, history: Array, dt: float) -> Array:  # type: ignore[override]
        """Derivative (3, 3, ...) of the stress by the strain; by default by complex steps.
        Iterations take it as symmetric."""
        if self.point is not None:
            return self.evaluate(strain, history, dt)[1]
        return stress_rates(lambda E: self.stress(E, history, dt)[0], strain)

    def evaluate(self, strain: Array, history: Array, dt: float) -> tuple[Array, Array, Array]:
        """Stress, moduli and history; to be overridden where they are found together."""
        if self.point is not None:
            S, D, after = self._at_points(self.point, strain, history, dt)
            return S, D[list(MODULI)].reshape(3, *S.shape), after
        S, after = self.stress(strain, history, dt)
        return S, self.moduli(strain, history, dt), after

    def _at_points(self, function, strain, history, dt):
        """Stress, moduli and history of a function of a point, in NumPy."""
        strain, history, n = np.asarray(strain, float), np.asarray(history, float), len(strain)
        S, D = np.empty(strain.shape), np.empty((n * (n + 1) // 2, *strain.shape[1:]))
        after = np.empty((self.number, *strain.shape[1:]))
        python(function)(self.constants, strain, history, dt, S, D, after)
        return S, D, after

    def energy(self, strain: Array, history: Array) -> Array:  # type: ignore[override]
        """Energy per volume that unloading would give back, or that is stored, shape (...). By
        default that of the stress in the elastic law. What else work has done is dissipated."""
        if self.stored is not None:
            return python(self.stored)(self.constants, strain, history)
        S = self.stress(strain, history, 0.0)[0]
        return 0.5 * np.sum(S * np.tensordot(np.linalg.inv(self.elastic), S, 1), axis=0)

    def outputs(self, strain: Array, history: Array, stress: Array) -> dict[str, Array]:
        """Fields by name, (...): by default the history variables of one component."""
        return {name: history[self.rows(name)][0] for name, n in self.variables.items() if n == 1}

    def out_of_plane(self, strain: Array, history: Array, stress: Array) -> tuple[Array, Array]:
        """Strain and stress normal to the plane, by default of Hooke's law."""
        both = self.nu * (stress[0] + stress[1])
        return (-both / self.E, 0.0 * both) if self.plane == "stress" else (0.0 * both, both)

    # fibres of a cable

    def axial(self, strain: Array, history: Array, dt: float) -> tuple[Array, Array, Array]:
        """Stress S_xx (...), its derivative, and history of fibres with S_yy = S_xy = 0. ``strain``
        (...) is that along the fibre. By default the lateral strain is found by Newton's method;
        ConvergenceError if it is not found, upon which solvers cut their step."""
        if self.fibre is not None:
            S, D, after = self._at_points(self.fibre, np.asarray(strain)[None], history, dt)
            return S[0], D[0], after
        E = np.zeros((3, *np.shape(strain)))
        E[0], E[1] = strain, -self.lateral_ratio * strain
        left = np.inf
        for _ in range(LATERAL):
            S, D, after = self.evaluate(E, history, dt)
            before, left = left, float(np.max(np.abs(S[1:])))
            size = float(np.max(np.abs(S))) + CLOSE * self.E
            if left <= CLOSE * size or 0.5 * before < left <= ROUGH * size:  # round-off
                break
            E[1:] -= self._by_lateral(D, S[1:], S, strain)
        else:
            raise self._lost(S, strain)
        side = self._by_lateral(D, D[1:, 0], S, strain)
        return S[0], D[0, 0] - np.sum(D[0, 1:] * side, axis=0), after

    def _by_lateral(self, D, x, S, strain):
        """Lateral moduli^-1 x, (2, ...)."""
        try:
            found = np.linalg.solve(np.moveaxis(D[1:, 1:], (0, 1), (-2, -1)),
                                    np.moveaxis(x, 0, -1)[..., None])
        except np.linalg.LinAlgError:
            raise self._lost(S, strain) from None
        return np.moveaxis(found[..., 0], -1, 0)

    def _lost(self, S, strain):
        """The ConvergenceError about the fibre with the largest lateral stress."""
        left = np.abs(S[1:]).max(axis=0)
        worst = np.argmax(np.where(np.isfinite(left), left, np.inf))
        return ConvergenceError(
            f"the lateral strain of a fibre of {self!r} was not found in {LATERAL} corrections: at "
            f"the strain {np.ravel(strain)[worst]:.3g} a lateral stress of "
            f"{np.ravel(left)[worst]:.3g} is left. Its stress may jump there, or its moduli may "
            "be wrong; smaller increments may help, or an axial(strain, history, dt) of its own")

    def axial_energy(self, strain: Array, history: Array) -> Array:
        """As :meth:`energy` for fibres with S_yy = S_xy = 0."""
        if self.fibre_stored is not None:
            return python(self.fibre_stored)(self.constants, np.asarray(strain)[None], history)
        return 0.5 * self.axial(strain, history, 0.0)[0] ** 2 / self.axial_modulus

    # for what knows no history

    def law(self, k_s: float = 1.0) -> Law:
        return AtRest(self, require_positive("k_s", k_s))

    @property
    def is_hooke(self) -> bool:
        """True: a cable has the axial law of the fibres."""
        self._require_consistent()
        return True

    def shear_factor(self, element: Any) -> float:
        self._require_consistent()
        return super().shear_factor(element)

    def _require_consistent(self):
        if not hasattr(self, "_consistent"):
            kind = type(self).__name__
            known = isinstance(self.variables, Mapping) and all(
                isinstance(n, (int, np.integer)) and n > 0 for n in self.variables.values())
            refuse(not known, 'variables of {} are names and numbers of components, as {{"damage": '
                   '1}}, got {!r}', kind, self.variables)
            E, d = np.array([[1.3], [-0.7], [0.9]]), np.array([[0.3], [0.7], [-0.6]])
            E, d, zero = SMALL * E, 1e-4 * SMALL * d, np.zeros((self.number, 1))
            what = f"stress(strain, history, dt) of {kind}"
            history = zero.copy()
            answer = ask(what, self.stress, E, history, SPAN)
            refuse(not isinstance(answer, tuple) or len(answer) != 2, "{} must return a pair, the "
                   "stress and the history at the end, got {!r}", what, answer)
            S, after = answer
            refuse(np.shape(S) != E.shape or np.shape(after) != zero.shape, "stress of {} must "
                   "return the shapes of strain and history, {} and {}, got {} and {}", kind,
                   E.shape, zero.shape, np.shape(S), np.shape(after))
            refuse(np.any(history != zero), "{} changes the history that it is given: return a new "
                   "array, which solvers take when an increment has succeeded", what)
            refuse(not (np.isfinite(S).all() and np.isfinite(after).all()),
                   "{} must return finite numbers, got {!r} and {!r}", what, S, after)
            D = ask(f"moduli(strain, history, dt) of {kind}", self.moduli, E, zero, SPAN)
            require_slope(f"moduli(strain, history, dt) of {kind}", "stress(strain, history, dt)",
                          lambda s: self.stress(E + s * d, zero, SPAN)[0],
                          np.einsum("ij...,j...->i...", D, d))
            again = self.stress(E, np.asarray(after), 0.0)[0]
            refuse(not np.allclose(again, S, rtol=0.0, atol=1e-6 * np.max(np.abs(S))), "{} must "
                   "give the same stress again, in a further increment of dt = 0 from the history "
                   "that it returned: {!r}, then {!r}", what, np.ravel(S), np.ravel(again))
            self._consistent = True
