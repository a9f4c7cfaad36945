"""Symbols of loads, supports, joints and springs in matplotlib pictures."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import Any

import numpy as np

from ..actions.loads import LineLoad, Load, TimedLoad
from ..actions.places import Vector
from ..actions.symbols import LOADS, Symbol
from ..beam.layout import Layout
from ..core import Array, refuse
from .scenery import INK, MUTED, rounded, unit_of_resultant

#: Colours of loads and of supports.
LOAD, HOLD = "#b3261e", "#1f5f8b"
#: Sizes of symbols relative to the picture: arrows, those of distributed loads, others.
ARROW, SPREAD, SIZE = 0.13, 0.07, 0.03
#: Kinds that are texts beside a body.
NOTES = "eigenstrain", "drag"


def symbols_of(state: Any, loads: bool, supports: bool, start: bool = False) -> list[Symbol]:
    """Symbols of the loads, and of all other items, of the scene of a state."""
    # With ``start`` loads have their full values, as before the solution; those that move or depend
    # on time are those at time 0, or at 1 if they vanish there.
    if not (loads or supports):
        return []
    system: Any = getattr(state, "system", None)
    refuse(getattr(system, "items", None) is None, "this state does not know the items of its "
           "scene, as it comes from another process or a file: draw them by scene.plot()")
    layout, found, t = Layout(*system.members), list[Symbol](), state.t
    for item in chain.from_iterable(one.expand(layout) for one in system.items):
        factor = 1.0
        if isinstance(item, (TimedLoad, LineLoad)) and not start:
            item = item._with(_time=1.0 if t is None else t)
        if isinstance(item, Load):
            factor = item.factor(t) * (state.load if item.scaled and not start else 1.0)
        found += [s._replace(value=s.value * factor) if s.kind in LOADS else s
                  for s in item.symbols(layout)]
    return [s for s in found if (loads if s.kind in LOADS else supports)]


def unit_of_load(symbol: Symbol, units: tuple[str, str] | None) -> str:
    """The unit of a force, per length or area where it is distributed, or moment; "" if unknown."""
    if units is None or symbol.kind not in ("force", "moment"):
        return ""
    unit = unit_of_resultant("N" if symbol.kind == "force" else "M", units)
    return unit + f"/{units[1]}" * (symbol.per > 0) + "²" * (symbol.per == 2)


class Sketch:
    """Draws symbols on Axes ``ax``; the gid of each artist is the kind of its symbol. ``u`` (N,) is
    the drawn displacement, ``points`` (n, 2) are drawn points of the bodies."""

    def __init__(self, ax: Any, u: Array, points: Array,
                 units: tuple[str, str] | None = None) -> None:
        self.ax, self.u, self.points, self.units = ax, u, points, units
        self.size = float(np.max(np.ptp(points, axis=0)))
        #: Where arrows and texts are.
        self.taken = np.full((1, 2), np.inf)

    def draw(self, symbols: Iterable[Symbol]) -> None:
        """Draw symbols: one for all supports of a place, one for all weights of a gravity."""
        one: dict[Any, Symbol] = {}
        for number, s in enumerate(symbols):
            key: Any = number
            if s.kind == "weight":
                key = s.kind, *s.direction[0], s.value
            elif s.kind in ("support", "joint", "eigenstrain"):
                key = s.kind, *(np.round(s.at[0].start / self.size, 6) + 0.0)
            before = one.get(key)
            if s.kind == "support" and before is not None:
                s = max(before, s, key=_ends)._replace(text=f"{before.text} {s.text}")
            elif s.kind == "eigenstrain" and s.value:
                texts = [] if before is None else before.text.split(", ")
                texts.append(s.text + (f"{s.value:.6g}" if s.show else ""))
                s = s._replace(text=", ".join(dict.fromkeys(texts)), show=False)
            one[key] = s if s.value or before is None else before
        largest = max((abs(s.value) for s in one.values() if s.kind == "force" and len(s.at) == 1),
                      default=0.0) or 1.0
        for s in sorted(one.values(), key=lambda s: s.kind in NOTES or len(s.at) > 1):
            if s.value or s.kind not in LOADS:
                getattr(self, "_" + s.kind.replace(" ", "_"))(
                    s, np.array([place(self.u) for place in s.at]), largest)

    def names(self, places: Iterable[tuple[str, Array]]) -> None:
        """Write names at positions (2,)."""
        for name, at in places:
            self._text(name, at, (1, -1), INK, "name", 10, style="italic")

    # loads

    def _force(self, s, at, largest):
        d = np.array(s.direction)
        for k, turn in enumerate(s.turn):
            now, start = (x @ [1, 1j] for x in (turn(self.u), turn.start))
            z = d[k] @ [1, 1j] * now / start * abs(start / now)
            d[k] = np.array([z.real, z.imag])
        length = np.sign(s.value) * self.size * (
            SPREAD if len(at) > 1 else ARROW * (0.5 + 0.5 * abs(s.value) / largest))
        tips, tails = at, at - length * d
        out = at + length * d
        if len(at) == 1 and self._room(out[0], self.points) > 1.2 * self._room(
                tails[0], self.points):
            tips, tails = out, at
        sizes, order = np.hypot(*d.T), np.argsort(np.abs(np.arange(len(at)) - len(at) // 2))
        clear = [i for i in order if self._room(tails[i], self.taken) > 0.1 * self.size]
        k = [*clear, *order][0] if np.ptp(sizes) < 1e-9 else int(np.argmax(sizes))
        for tip, tail in zip(tips, tails):
            if np.hypot(*(tip - tail)) > 0.005 * self.size:
                self._arrow(tail, tip, kind=s.kind)
        if len(at) > 1:
            self._line(tails, s.kind, LOAD, 0.8)
            self.taken = np.vstack([self.taken, 0.5 * (tails[1:] + tails[:-1])])
        if s.show:
            free, other = (tips[0], tails[0]) if tips is out else (tails[k], tips[k])
            self._text(self._value(s), free,
                       free - other, LOAD, s.kind)

    def _value(self, s):
        """Text and value, with the unit of a force or moment."""
        unit = unit_of_load(s, self.units)
        return s.text + (rounded(abs(s.value), unit) if unit else f"{abs(s.value):.6g}")

    def _weight(self, s, at, largest):
        """One arrow to the right of the picture for all members of one gravity."""
        foot = np.max(self.points, axis=0) + [0.2 * self.size, 0.0]
        tip = foot + ARROW * self.size * np.array(s.direction[0]) * np.sign(s.value)
        self._arrow(foot, tip, kind=s.kind, color=MUTED)
        self._text(s.text + rounded(abs(s.value), ""), tip, tip - foot, MUTED, s.kind)

    def _moment(self, s, at, largest, color=LOAD):
        angle = np.sign(s.value) * np.linspace(-0.75 * np.pi, 0.75 * np.pi, 40)
        arc = at[0] + 1.5 * SIZE * self.size * np.column_stack([np.cos(angle), np.sin(angle)])
        self._arrow(*arc, kind=s.kind, color=color)
        self._beside(s.text or self._value(s), at[0], color, s.kind)

    def _eigenstrain(self, s, at, largest):
        self._beside(s.text, at[0], LOAD, s.kind)

    def _beside(self, text, at, color, kind):
        """Write in a corner about a position, far from bodies and other texts."""
        r = 1.1 * SIZE * self.size

        def room(one):
            far, away = one
            box = self._box(text, at + far * r * np.array(away), away)
            return min(1.0, *(round(self._room(point, others) / r, 3) for point in box
                              for others in (self.points, self.taken)))

        far, away = max([(k, (x, y)) for k in (1, 2, 3) for y in (1, -1) for x in (1, -1)],
                        key=room)
        self._text(text, at + far * r * np.array(away), away, color, kind)

    def _box(self, text, at, away):
        x, y = np.array(away) / (np.hypot(*away) or 1.0)
        width = (0.5 + 0.4 * len(text)) * (np.sign(x) if abs(x) > 0.4 else 0.0)
        return at + self.size * SIZE * np.outer([0.0, 0.5, 1.0], [width, y])

    def _room(self, point, others):
        return float(np.min(np.hypot(*(others - point).T)))

    # supports and joints

    def _support(self, s, at, largest):
        held, base, r = set(s.text.split()), at[0], SIZE * self.size
        single, (x, y) = {"x", "y"} - held, s.direction[0]
        if len(single) == 2:
            return self._mark("s", base, s.kind)
        if single or "angle" not in held:  # upright, or sideways where only x is held
            x, y = (0.0, 1.0 if y > 0.7 else -1.0) if "y" in held else (1.0 if x > 0.7 else -1.0, 0)
        d, across = np.array([x, y]), np.array([-y, x])
        wide = max(1.2 * r, 1.3 * self._half(base, across) * ("angle" in held))
        if "angle" not in held:
            base = base + 1.5 * r * d
            self._line([at[0], base + 0.8 * r * across, base - 0.8 * r * across, at[0]], s.kind)
        elif single:
            self._line([base - wide * across, base + wide * across], s.kind)
        self._ground(base + 0.4 * r * d * len(single), d, wide, s.kind)

    def _ground(self, foot, d, wide, kind):
        """A line across d with hatching behind it."""
        across, r = np.array([-d[1], d[0]]), SIZE * self.size
        self._line([foot - wide * across, foot + wide * across], kind)
        for k in np.linspace(-wide, wide - 0.4 * r, max(6, round(2 * wide / r))):
            at = foot + k * across
            self._line([at, at + 0.45 * r * (d - across)], kind, HOLD, 0.8)

    def _half(self, p, across):
        """Half the drawn height of the section at a point."""
        off = self.points - p
        near = np.abs(off @ [-across[1], across[0]]) < 0.002 * self.size
        far = np.abs(off[near] @ across)
        half = float(np.max(far[far < 0.2 * self.size], initial=0.0))
        return half if half < 0.15 * self.size else 0.0  # along a body

    def _joint(self, s, at, largest):
        self._mark("o" if s.text == "hinge" else "s", at[0], s.kind)

    def _slider(self, s, at, largest):
        d, r = np.array(s.direction[0]), SIZE * self.size
        for side in (-0.6, 0.6):
            foot = at[0] + side * r * np.array([-d[1], d[0]])
            self._line([foot - 1.5 * r * d, foot + 1.5 * r * d], s.kind)
        self._mark("o", at[0], s.kind)

    def _spring(self, s, at, largest):
        a, b = at
        along, r = b - a, 0.5 * SIZE * self.size
        length = np.hypot(*along)
        if length > 0:
            across = np.array([-along[1], along[0]]) / length
            x = np.array([0, 0.2, *np.linspace(0.25, 0.75, 8), 0.8, 1])
            y = np.array([0, 0, *np.tile([1, -1], 4), 0, 0])
            self._line(a + np.outer(x, along) + r * np.outer(y, across), s.kind)
            for place, end, way in zip(s.at, at, (-along, along)):
                if not place.dofs.size:
                    self._ground(end, way / length, 1.2 * r, s.kind)
            if s.text:
                self._text(s.text, 0.5 * (a + b) + r * across, across, HOLD, s.kind)

    def _foundation(self, s, at, largest):
        foot = at[0] + 2 * SIZE * self.size * np.array(s.direction[0])
        self._spring(s._replace(at=(s.at[0], Vector(foot)), text=""), [at[0], foot], largest)
        if s.text:
            self._text(s.text, foot, s.direction[0], HOLD, s.kind, 8)

    def _torsional_spring(self, s, at, largest):
        angle = np.linspace(0, 4 * np.pi, 60)
        spiral = SIZE * self.size * angle / angle[-1] * [np.cos(angle), np.sin(angle)]
        self._line(at[0] + spiral.T, s.kind)
        self._beside(s.text, at[0], HOLD, s.kind)

    def _mass(self, s, at, largest):
        self._mark("o", at[0], s.kind, INK)
        self._beside(f"{s.text}{s.value:.6g}", at[0], INK, s.kind)

    def _motor(self, s, at, largest):
        self._moment(s._replace(text="angle(t)"), at, largest, HOLD)

    def _drag(self, s, at, largest):
        self._beside(s.text, at[0], HOLD, s.kind)

    def _control(self, s, at, largest):
        self._mark("D", at[0], s.kind)
        self._beside(s.text, at[0], HOLD, s.kind)

    # artists

    def _arrow(self, *points, kind, color=LOAD):
        from matplotlib.patches import FancyArrowPatch
        from matplotlib.path import Path

        self.ax.add_patch(FancyArrowPatch(
            path=Path(points), arrowstyle="-|>", mutation_scale=9, color=color, lw=1.2, zorder=5,
            gid=kind))
        self.ax.update_datalim(points)
        self.taken = np.vstack([self.taken, points, 0.5 * np.add(points[0], points[-1])])

    def _line(self, points, kind, color=HOLD, lw=1.2):
        self.ax.plot(*np.transpose(points), color=color, lw=lw, zorder=4, gid=kind,
                     solid_capstyle="round")

    def _mark(self, marker, at, kind, face="white"):
        self.ax.plot(*at, marker, mfc=face, mec=HOLD, ms=6, mew=1.2, zorder=6, gid=kind)

    def _text(self, text, at, away, color, kind, far=4, **options):
        from matplotlib.patheffects import withStroke

        x, y = np.array(away) / (np.hypot(*away) or 1.0)
        box = self._box(text, at, away)
        self.ax.update_datalim(box)
        self.taken = np.vstack([self.taken, box])
        self.ax.annotate(
            text, at, (far * x, far * y), textcoords="offset points", fontsize=8, color=color,
            gid=kind, zorder=7, path_effects=[withStroke(linewidth=2, foreground="white")],
            ha="left" if x > 0.4 else "right" if x < -0.4 else "center",
            va="bottom" if y > 0.4 else "top" if y < -0.4 else "center", **options)


def _ends(s):
    """Of two supports the one with a known outward direction."""
    return tuple(s.direction[0]) != (0.0, -1.0)
