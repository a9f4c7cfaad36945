"""Rolled and hollow sections by their standard names, with root radii and tapered flanges. Sizes in
millimetres are those of EN 10365 (IPE, HEA, HEB, UPN), EN 10056-1 (equal angles, L) and EN 10055
(T). Radii of hollow sections are those of EN 10210-2 (hot finished) and EN 10219-2 (cold formed),
which set them for the calculation of properties."""

import re
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np

from ..core import NameUnknown, refuse, require_option
from ..materials.library import LENGTHS

#: Height, width, thickness of web and flange, root radius.
I_SHAPES = {
    "IPE": """80 80 46 3.8 5.2 5; 100 100 55 4.1 5.7 7; 120 120 64 4.4 6.3 7; 140 140 73 4.7 6.9 7;
160 160 82 5 7.4 9; 180 180 91 5.3 8 9; 200 200 100 5.6 8.5 12; 220 220 110 5.9 9.2 12;
240 240 120 6.2 9.8 15; 270 270 135 6.6 10.2 15; 300 300 150 7.1 10.7 15; 330 330 160 7.5 11.5 18;
360 360 170 8 12.7 18; 400 400 180 8.6 13.5 21; 450 450 190 9.4 14.6 21; 500 500 200 10.2 16 21;
550 550 210 11.1 17.2 24; 600 600 220 12 19 24""",
    "HEA": """100 96 100 5 8 12; 120 114 120 5 8 12; 140 133 140 5.5 8.5 12; 160 152 160 6 9 15;
180 171 180 6 9.5 15; 200 190 200 6.5 10 18; 220 210 220 7 11 18; 240 230 240 7.5 12 21;
260 250 260 7.5 12.5 24; 280 270 280 8 13 24; 300 290 300 8.5 14 27; 320 310 300 9 15.5 27;
340 330 300 9.5 16.5 27; 360 350 300 10 17.5 27; 400 390 300 11 19 27; 450 440 300 11.5 21 27;
500 490 300 12 23 27; 550 540 300 12.5 24 27; 600 590 300 13 25 27; 650 640 300 13.5 26 27;
700 690 300 14.5 27 27; 800 790 300 15 28 30; 900 890 300 16 30 30; 1000 990 300 16.5 31 30""",
    "HEB": """100 100 100 6 10 12; 120 120 120 6.5 11 12; 140 140 140 7 12 12; 160 160 160 8 13 15;
180 180 180 8.5 14 15; 200 200 200 9 15 18; 220 220 220 9.5 16 18; 240 240 240 10 17 21;
260 260 260 10 17.5 24; 280 280 280 10.5 18 24; 300 300 300 11 19 27; 320 320 300 11.5 20.5 27;
340 340 300 12 21.5 27; 360 360 300 12.5 22.5 27; 400 400 300 13.5 24 27; 450 450 300 14 26 27;
500 500 300 14.5 28 27; 550 550 300 15 29 27; 600 600 300 15.5 30 27; 650 650 300 16 31 27;
700 700 300 17 32 27; 800 800 300 17.5 33 30; 900 900 300 18.5 35 30; 1000 1000 300 19 36 30""",
}
#: Height, width, thickness of the web, and of a flange where it is measured; root and tip radius.
U_SHAPES = """
80 80 45 6 8 8 4; 100 100 50 6 8.5 8.5 4.5; 120 120 55 7 9 9 4.5; 140 140 60 7 10 10 5;
160 160 65 7.5 10.5 10.5 5.5; 180 180 70 8 11 11 5.5; 200 200 75 8.5 11.5 11.5 6;
220 220 80 9 12.5 12.5 6.5; 240 240 85 9.5 13 13 6.5; 260 260 90 10 14 14 7;
280 280 95 10 15 15 7.5; 300 300 100 10 16 16 8; 320 320 100 14 17.5 17.5 8.75;
350 350 100 14 16 16 8; 380 380 102 13.5 16 16 8; 400 400 110 14 18 18 9"""
#: Leg and thickness: root radius; the tips have half of it.
L_SHAPES = """
20x3 3.5; 25x3 3.5; 30x3 5; 35x4 5; 40x4 6; 45x4.5 7; 50x5 7; 60x6 8; 65x7 9; 70x7 9; 75x8 9;
80x8 10; 90x9 11; 100x10 12; 120x12 13; 130x12 14; 150x15 16; 180x18 18; 200x20 18"""
#: Height and width: thickness in the middle of flange and web, which is the root radius.
T_SHAPES = "30 4; 35 4.5; 40 5; 50 6; 60 7; 70 8; 80 9; 100 11; 120 13; 140 15"

#: Slopes of the faces of a T, and of the flanges of a UPN up to 300 and beyond.
T_SLOPE, U_SLOPE, LOW_U_SLOPE = 0.02, 0.08, 0.05
#: Relative length of what is no piece.
TINY = 1e-9

#: Height in mm, 2 if one half is given, and the outer and inner side, see :func:`_side`.
Shape = tuple[float, float, tuple[tuple[float, ...], ...], tuple[tuple[float, ...], ...]]


def _side(*corners):
    """A rising line through corners (x, y, radius), from which x = 0 to the last."""
    # Rows are the height where a piece begins, and x0, y0, slope and r of ``x = x0 + slope (y - y0)
    # + sign(r) sqrt(r^2 - (y - y0)^2)``.
    points, rows = np.array([corner[:2] for corner in corners]), [(-1.0, 0.0, 0.0, 0.0, 0.0)]
    begin, high = points[0], corners[-1][1]
    for k, (*_, r) in enumerate(corners[1:], 1):
        end = after = points[k]
        if r:  # an arc that touches both sides of the corner
            a, b = ((points[n] - end) / np.hypot(*(points[n] - end)) for n in (k - 1, k + 1))
            half = 0.5 * np.arccos(a @ b)
            centre = end + (a + b) / np.hypot(*(a + b)) * r / np.sin(half)
            end, after = (points[k] + r / np.tan(half) * side for side in (a, b))
        if (rise := end[1] - begin[1]) > TINY * high:
            rows.append((begin[1], *begin, (end[0] - begin[0]) / rise, 0.0))
        if r:
            rows.append((end[1], *centre, 0.0, r * np.sign(end[0] + after[0] - 2.0 * centre[0])))
        begin = after
    return tuple(tuple(map(float, row)) for row in (*rows, (high, 0.0, 0.0, 0.0, 0.0)))


def _box(h, b, t, outer, inner):
    """Both sides of the right half of a hollow section with rounded corners."""
    x, y = 0.5 * b - t, h - t
    return (_side((0, 0, 0), (0.5 * b, 0, outer), (0.5 * b, h, outer), (0, h, 0)),
            _side((0, t, 0), (x, t, inner), (x, y, inner), (0, y, 0)))


def _found(series, number, text):
    rows = {f"{series} {one}": tuple(map(float, row))
            for one, *row in map(str.split, text.split(";"))}
    return rows[require_option("profile", f"{series} {number}", rows)]


@lru_cache(64)
def shape_of(name: str) -> Shape:
    """The height and the sides of a profile, in mm; NameUnknown."""
    match = re.fullmatch(r"\s*([A-Za-z]+)\s*([\d.,\sx×X*]+?)\s*", name)
    series = match.group(1).upper() if match else name
    number = re.sub(r"[\s×X*]+", "x", match.group(2).replace(",", ".")) if match else ""
    solid: Any = _side((0, 0, 0), (0, 0, 0))
    if series in ("HEA", "HEB", "IPE"):
        h, b, tw, tf, r = _found(series, number, I_SHAPES[series])
        b, tw = 0.5 * b, 0.5 * tw
        return h, 2.0, _side((0, 0, 0), (b, 0, 0), (b, tf, 0), (tw, tf, r), (tw, h - tf, r),
                             (b, h - tf, 0), (b, h, 0)), solid
    if series == "UPN":
        h, b, tw, tf, r1, r2 = _found(series, number, U_SHAPES)
        # where the flange has its nominal thickness
        slope, at = (U_SLOPE, 0.5 * b) if h <= 300 else (LOW_U_SLOPE, 0.5 * (b + tw))
        tip, root = tf + slope * (at - b), tf + slope * (at - tw)
        return h, 1.0, _side((0, 0, 0), (b, 0, 0), (b, tip, r2), (tw, root, r1),
                             (tw, h - root, r1), (b, h - tip, r2), (b, h, 0)), solid
    if series == "T":  # flange at the top; it and the web are t thick in their middle
        t, = _found(series, number, T_SHAPES)
        h, s, b = float(number), T_SLOPE, 0.5 * float(number)
        x = (0.5 * t + s * (0.5 * h - t - 0.5 * s * b)) / (1.0 - s * s)
        under, out = h - t - s * (0.5 * b - x), h - t + 0.5 * s * b
        return h, 2.0, _side((0, 0, 0), (0.5 * t - 0.5 * s * h, 0, 0.25 * t), (x, under, t),
                             (b, out, 0.5 * t), (b, h, 0)), solid
    sizes = [float(x) for x in number.split("x")] if number else []
    if series == "L" and len(sizes) in (2, 3) and sizes[0] == sizes[-2]:
        r, = _found(series, f"{sizes[0]:g}x{sizes[-1]:g}", L_SHAPES)
        a, t = sizes[0], sizes[-1]
        return a, 1.0, _side((0, 0, 0), (a, 0, 0), (a, t, 0.5 * r), (t, t, r), (t, a, 0.5 * r),
                             (0, a, 0)), solid
    if series in ("RHS", "SHS", "CFRHS", "CFSHS") and len(sizes) in (2, 3):
        h, b, t = sizes[0], sizes[-2], sizes[-1]
        times = 1.5 if series[0] != "C" else 2.0 if t <= 6.0 else 2.5 if t <= 10.0 else 3.0
        refuse(2.0 * times * t >= min(h, b), "{!r} has no hole, or no straight sides: a wall of "
               "{:g} is too thick for {:g} x {:g}", name, t, h, b)
        return h, 2.0, *_box(h, b, t, times * t, t if times == 1.5 else (times - 1.0) * t)
    if series in ("CHS", "CFCHS") and len(sizes) == 2:
        h, t = sizes
        refuse(2.0 * t >= h, "{!r} has no hole: its wall is {:g}", name, t)
        return h, 2.0, *_box(h, h, t, 0.5 * h, 0.5 * h - t)
    raise NameUnknown("profile", name, [
        "IPE 200", "HEA 200", "HEB 200", "UPN 200", "L 50x50x5", "T 50", "RHS 100x50x4",
        "SHS 100x5", "CHS 60.3x3.2", "CFRHS 100x50x4", "CFSHS 100x5", "CFCHS 60.3x3.2"])


def _width(h, times, sides, eta):
    y, x = h * np.asarray(eta), []
    for side in sides:
        row = np.searchsorted(side[:, 0], y, "right") - 1
        x0, y0, slope, r = np.moveaxis(side[row, 1:], -1, 0)
        x.append(x0 + slope * (y - y0) + np.sign(r) * np.sqrt(np.maximum(r**2 - (y - y0)**2, 0.0)))
    return times * (x[0] - x[1])


def pieces_of(name: str, unit: str) -> tuple[float, list[tuple[float, float, Any]]]:
    """Height in a unit of length; begin, end and width of intervals from bottom to top."""
    h, times, *sides = shape_of(name)
    scale = 1000.0 * LENGTHS[unit]
    of: Any = partial(_width, h, times / scale, [np.array(side) for side in sides])
    pieces = []
    for low, high in pairwise(sorted({max(row[0], 0.0) for side in sides for row in side})):
        if high - low > TINY * h:
            values = of((low + (high - low) * np.array([0.1, 0.5, 0.9])) / h)
            one = float(values[0])
            constant = np.ptp(values) <= 1e-12 * one
            pieces.append((low / h, high / h, one if constant else of))
    return h / scale, pieces
