"""Load cases, combinations with factors, and envelopes."""

from collections.abc import Callable, Iterator, Mapping
from copy import copy
from typing import Any, NamedTuple

import numpy as np

from ..actions.loads import Load
from ..beam import WhichBeam, select_beam
from ..core import (AncfError, Array, InputError, refuse, require_finite_scalar,
                    require_function, require_like, require_option, shown)
from ..results.output import supports_of
from ..results.state import State
from .scene import Scene

#: Part of the length of a beam beside a jump at which an envelope is evaluated.
BESIDE = 1e-9


class Envelope(NamedTuple):
    """Least and greatest section forces of one beam over combinations.

    Attributes
    ----------
    s, x
        Arc length (n,) and position (2, n) of sections on the reference axis.
    least, greatest
        Arrays (n,) by "N", "Q" and "M".
    by
        For each of them the names of the combinations of least and greatest value, (2, n).
    """

    s: Array
    x: Array
    least: dict[str, Array]
    greatest: dict[str, Array]
    by: dict[str, Array]

    def __str__(self) -> str:
        """The extremes of each section force, where they are, and by which combination."""
        lines = []
        for name in self.least:
            for k, (what, values, of) in enumerate((("least", self.least, np.argmin),
                                                    ("greatest", self.greatest, np.argmax))):
                at = int(of(values[name]))
                s = self.s[at] if self.s[at] > 10.0 * BESIDE * self.s[-1] else 0.0
                lines.append(f"{what} {name} {values[name][at]:.4g} at s = {s:.4g} by "
                             f"{str(self.by[name][k, at])!r}")
        return "\n".join(lines)


class LoadCases(Mapping):
    """Load cases of a scene and their combinations, solved when asked for.

    A mapping from the names of combinations to their States. ``print`` it for a table of all, with
    the extremes over them.

    Parameters
    ----------
    scene
        The :class:`~skfem_ancf.Scene` with its supports, and the loads that always act.
    cases
        A function for each name, which adds the loads of the case to the scene that it gets.
    combinations
        For each name the factors of its cases by name; by default each case alone.
    linear
        Solve for small displacements; False for equilibria under the factored loads, which do not
        superpose.

    Examples
    --------
    >>> from skfem_ancf import Frame, LoadCases, StVenantKirchhoff
    >>> girder = Frame.from_lines([(0, 0), (4, 0)], [(0, 1)], height=0.2, width=0.1,
    ...                           material=StVenantKirchhoff.named("S235"))
    >>> cases = LoadCases(girder.pin(0).hold(1, "y"), {
    ...     "self": lambda scene: scene.gravity((0, -9.81)),
    ...     "live": lambda scene: scene.line_load((0, -1e4))},
    ...     {"1.35 self + 1.5 live": {"self": 1.35, "live": 1.5}, "self": {"self": 1.0}})
    >>> round(float(cases["1.35 self + 1.5 live"].resultants((2, 0)).M), -1)  # 15000 and 2079 N/m
    34160.0
    """

    def __init__(self, scene: Scene, cases: Mapping[str, Callable[[Any], Any]],
                 combinations: Mapping[str, Mapping[str, float]] | None = None, *,
                 linear: bool = True) -> None:
        require_like("scene", scene, "Scene", "solve_static", "loads")
        self.scene, self.linear = scene, linear
        self.cases = {}
        for name, add in dict(cases).items():
            require_function(f"load case {name!r}", add, "that adds loads to a scene, as lambda "
                             "scene: scene.line_load((0, -1e3))")
            other = copy(scene)
            add(other)
            self.cases[name] = entries = other._entries[len(scene._entries):]
            extra = [one for entry in entries for one in entry.bound if not isinstance(one, Load)]
            if extra or not entries or other._fixed != scene._fixed:
                raise InputError(f"load case {name!r} must add loads, and adds "
                                 f"{shown(extra[0]) if extra else 'none'}")
        if combinations is None:
            combinations = {name: {name: 1.0} for name in self.cases}
        self.combinations = {}
        for name, factors in dict(combinations).items():
            refuse(not isinstance(factors, Mapping), "combination {!r} must have factors of cases "
                   "by name, as {{'self': 1.35}}, got {!r}", name, factors)
            for case in factors:
                require_option("load case", case, self.cases)
            self.combinations[name] = {case: require_finite_scalar(f"factor of {case!r}", factor)
                                       for case, factor in factors.items()}
        refuse(not self.combinations, "there is no load case: give functions by "
               "name, as {'snow': lambda scene: scene.line_load((0, -1e3))}")
        self._states: dict[str, State] = {}

    def factored(self, name: str) -> Scene:
        """The scene of a combination, with its factors on the loads.

        Parameters
        ----------
        name
            The name of the combination.
        """
        require_option("combination", name, self.combinations)
        scene = copy(self.scene)
        added = [entry._replace(given=entry.given.times(factor) if isinstance(entry.given, Load)
                                else entry.given,
                                bound=tuple(one.times(factor) for one in entry.bound))
                 for case, factor in self.combinations[name].items() if factor
                 for entry in self.cases[case]]
        scene._entries = (*scene._entries, *added)
        return scene

    def __getitem__(self, name: str) -> State:
        if name not in self._states:
            scene = self.factored(name)
            try:
                self._states[name] = scene.solve_linear() if self.linear else scene.solve_static()
            except AncfError as error:
                error.args = (f"combination {name!r}: {error}", *error.args[1:])
                raise
        return self._states[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.combinations)

    def __len__(self) -> int:
        return len(self.combinations)

    def envelope(self, beam: WhichBeam = None, sections: int = 33) -> Envelope:
        """Least and greatest section forces along a beam, and the combinations that cause them.

        Parameters
        ----------
        beam
            Beam, name or number; None for the only one.
        sections
            Number of sections in each element; jumps of each combination are added.
        """
        b = select_beam(self.scene.beams, beam)
        found = [state.resultants(beam=b, sections=sections) for state in self.values()]
        s = np.unique(np.concatenate([r.s for r in found]))
        s = np.repeat(s, 2) + np.tile([-1.0, 1.0], len(s)) * BESIDE * s[-1]
        s = s[1:-1]  # both sides of each section, but for the ends
        x = np.array([np.interp(s, found[0].s, one) for one in found[0].x])
        least, greatest, by, names = {}, {}, {}, np.array(list(self))
        for name in "NQM":
            values = np.array([np.interp(s, r.s, getattr(r, name)) for r in found])
            least[name], greatest[name] = values.min(axis=0), values.max(axis=0)
            by[name] = names[[values.argmin(axis=0), values.argmax(axis=0)]]
        return Envelope(s, x, least, greatest, by)

    def reactions(self) -> dict[str, dict[str, Array]]:
        """Reactions of all combinations by the place of each support: along x, y, and moment, (3,).
        The names "least" and "greatest" have the extremes of each component."""
        found: dict[str, dict[str, Array]] = {}
        for name, state in self.items():
            for place, force in supports_of(state):
                found.setdefault(place, {})[name] = np.array(force, dtype=float)
        for rows in found.values():
            every = np.array(list(rows.values()))
            rows |= {"least": every.min(axis=0), "greatest": every.max(axis=0)}
        return found

    def table(self) -> list[dict[str, Any]]:
        """Extremes of each combination, a row each, and of all in the last: for
        ``pandas.DataFrame``. Columns are the largest displacement and utilisation, and least and
        greatest N, Q and M over all beams."""
        rows = []
        for name, state in self.items():
            row: dict[str, Any] = {"combination": name}
            for column in ("displacement", "utilisation"):
                try:
                    row[column] = state.extremes(column, 1)[0].value
                except InputError:
                    continue  # no strength
            every = [state.resultants(beam=b, sections=33) for b in state.beams]
            for force in "NQM" if every else "":
                values = np.concatenate([getattr(r, force) for r in every])
                row |= {f"least {force}": float(values.min()),
                        f"greatest {force}": float(values.max())}
            rows.append(row)
        last = {column: (min if column.startswith("least") else max)(row[column] for row in rows)
                for column in list(rows[0])[1:]}
        return [*rows, {"combination": "envelope", **last}]

    def __str__(self) -> str:
        rows = self.table()
        cells = [list(rows[0])] + [[row["combination"], *(f"{value:.4g}" for value in list(
            row.values())[1:])] for row in rows]
        widths = [max(map(len, column)) for column in zip(*cells)]
        units = [] if self.scene._units is None else [f"in {', '.join(self.scene._units)}"]
        return "\n".join(["  ".join([row[0].ljust(widths[0]), *(
            cell.rjust(width) for cell, width in zip(row[1:], widths[1:]))])
            for row in cells] + units)

    def __repr__(self) -> str:
        return (f"<LoadCases {', '.join(self.cases)} in {len(self)} combinations, "
                f"{'linear' if self.linear else 'nonlinear'}>")
