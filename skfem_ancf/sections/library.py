"""Rolled and hollow sections by their standard names, with root radii and tapered flanges.

Sizes in millimetres are those of EN 10365 (IPE, HEA, HEB, UPN), EN 10056-1 (equal angles, L) and
EN 10055 (T). Radii of hollow sections are those of EN 10210-2 (hot finished) and EN 10219-2 (cold
formed), which set them for the calculation of properties.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.errors import InputError, NameUnknown
from ..core.types import Array
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

Shape = tuple[Callable[..., Array], tuple[float, ...], tuple[float, ...]]


def _arc(r, d):
    """Distance from a side to a rounded corner of radius r, at d from the other side."""
    return r - np.sqrt(np.maximum(r * r - np.clip(r - d, 0.0, r) ** 2, 0.0))


def _i_width(h, b, tw, tf, r, y):
    y = np.minimum(y, h - y)
    return np.where(y < tf, b, tw + 2.0 * _arc(r, y - tf))


def _flange(b, tw, tf, r1, r2, slope, at):
    """Ends and centres of both roundings of a flange with a sloping inner face, and that face.

    ``tf`` is the thickness at a distance ``at`` from the web's outer face.
    """
    c = np.sqrt(1.0 + slope**2)
    root = tf + slope * (at - tw - r1) + r1 * c  # heights of the centres of the roundings
    tip = tf + slope * (at - b + r2) - r2 * c
    return root, root - r1 / c, tip + r2 / c, tip


def _u_width(h, b, tw, tf, r1, r2, slope, at, y):
    y = np.minimum(y, h - y)
    root, low, high, tip = _flange(b, tw, tf, r1, r2, slope, at)
    face = at + (tf - y) / slope
    return np.select([y < tip, y < high, y < low], [b, b - _arc(r2, r2 + tip - y), face],
                     tw + _arc(r1, r1 + y - root))


def _t_width(h, b, t, slope, y):
    """The flange at the top; flange and web taper by the slope."""
    z, half = h - y, 0.5 * t + slope * (0.5 * h - (h - y))
    root, low, high, tip = _flange(0.5 * b, 0.5 * t + slope * (0.5 * h - t), t, t, 0.5 * t, slope,
                                   0.25 * b)
    face = 0.25 * b + (t - z) / slope
    web = np.minimum(half, half - 0.25 * t + np.sqrt(np.maximum(
        (0.25 * t) ** 2 - np.maximum(0.25 * t - y, 0.0) ** 2, 0.0)))
    return 2.0 * np.select([z < tip, z < high, z < low],
                           [0.5 * b, 0.5 * b - _arc(0.5 * t, 0.5 * t + tip - z), face],
                           web + _arc(t, t + z - root))


def _l_width(a, t, r, y):
    """One leg upright, the other at the bottom."""
    tip = 0.5 * r
    return np.where(y < t, a - _arc(tip, t - y), t + _arc(r, y - t) - _arc(tip, a - y))


def _box_width(h, b, t, outer, inner, y):
    y = np.minimum(y, h - y)
    hole = np.where(y > t, b - 2.0 * t - 2.0 * _arc(inner, y - t), 0.0)
    return b - 2.0 * _arc(outer, y) - hole


def _tube_width(h, t, y):
    outer, inner = 0.5 * h, 0.5 * h - t
    x = y - outer
    return 2.0 * (np.sqrt(np.maximum(outer**2 - x * x, 0.0))
                  - np.sqrt(np.maximum(inner**2 - x * x, 0.0)))


def _rows(text):
    return {row.split()[0]: tuple(map(float, row.split()[1:])) for row in text.split(";")}


def _symmetric(h, *cuts):
    return (0.0, *cuts, *(h - cut for cut in reversed(cuts)), h)


def _found(series, number, rows):
    if number not in rows:
        raise NameUnknown("profile", f"{series} {number}", [f"{series} {one}" for one in rows])
    return rows[number]


@lru_cache(64)
def shape_of(name: str) -> Shape:
    """Width as a function of sizes and height, the sizes, and where it is not smooth, in mm.

    Raises
    ------
    NameUnknown
        If the series or the size is not known.
    """
    match = re.fullmatch(r"\s*([A-Za-z]+)\s*([\d.,\sx×X*]+?)\s*", name)
    series = match.group(1).upper() if match else name
    number = re.sub(r"[\s×X*]+", "x", match.group(2).replace(",", ".")) if match else ""
    if series in ("HEA", "HEB", "IPE"):
        h, b, tw, tf, r = _found(series, number, _rows(I_SHAPES[series]))
        return _i_width, (h, b, tw, tf, r), _symmetric(h, tf, tf + r)
    if series == "UPN":
        h, b, tw, tf, r1, r2 = _found(series, number, _rows(U_SHAPES))
        slope, at = (0.08, 0.5 * b) if h <= 300 else (0.05, 0.5 * (b + tw))
        root, low, high, tip = _flange(b, tw, tf, r1, r2, slope, at)
        return _u_width, (h, b, tw, tf, r1, r2, slope, at), _symmetric(h, tip, high, low, root)
    if series == "T":
        t, = _found(series, number, _rows(T_SHAPES))
        h = float(number)
        root, low, high, tip = _flange(0.5 * h, 0.5 * t + 0.02 * (0.5 * h - t), t, t, 0.5 * t, 0.02,
                                       0.25 * h)
        return _t_width, (h, h, t, 0.02), (0.0, 0.25 * t, h - root, h - low, h - high, h - tip, h)
    sizes = [float(x) for x in number.split("x")] if number else []
    if series == "L" and len(sizes) in (2, 3) and sizes[0] == sizes[-2]:
        r, = _found(series, f"{sizes[0]:g}x{sizes[-1]:g}", _rows(L_SHAPES))
        a, t = sizes[0], sizes[-1]
        return _l_width, (a, t, r), (0.0, t - 0.5 * r, t, t + r, a - 0.5 * r, a)
    if series in ("RHS", "SHS", "CFRHS", "CFSHS") and len(sizes) in (2, 3):
        h, b, t = sizes[0], sizes[-2], sizes[-1]
        times = 1.5 if series[0] != "C" else 2.0 if t <= 6.0 else 2.5 if t <= 10.0 else 3.0
        if 2.0 * times * t >= min(h, b):
            raise InputError(f"{name!r} has no hole, or no straight sides: a wall of {t:g} is too "
                             f"thick for {h:g} x {b:g}")
        outer, inner = times * t, t if times == 1.5 else (times - 1.0) * t
        return _box_width, (h, b, t, outer, inner), _symmetric(h, *sorted({t, outer, t + inner}))
    if series in ("CHS", "CFCHS") and len(sizes) == 2:
        h, t = sizes
        if 2.0 * t >= h:
            raise InputError(f"{name!r} has no hole: its wall is {t:g}")
        return _tube_width, (h, t), _symmetric(h, t)
    raise NameUnknown("profile", name, [
        "IPE 200", "HEA 200", "HEB 200", "UPN 200", "L 50x50x5", "T 50", "RHS 100x50x4",
        "SHS 100x5", "CHS 60.3x3.2", "CFRHS 100x50x4", "CFSHS 100x5", "CFCHS 60.3x3.2"])


def _width(width, sizes, h, scale, eta):
    return width(*sizes, h * np.asarray(eta)) / scale


def pieces_of(name: str, unit: str) -> tuple[float, list[tuple[float, float, Any]]]:
    """Height in a unit of length; begin, end and width of intervals from bottom to top."""
    width, sizes, cuts = shape_of(name)
    h, scale = sizes[0], 1000.0 * LENGTHS[unit]
    pieces = []
    for low, high in pairwise(cuts):
        of: Any = partial(_width, width, sizes, h, scale)
        values = of((low + (high - low) * np.array([0.1, 0.5, 0.9])) / h)
        one = float(values[0])
        if np.ptp(values) <= 1e-12 * one:  # constant
            of = one
        if high - low > 1e-9 * h:
            pieces.append((low / h, high / h, of))
    return h / scale, pieces
