"""Random static scenes: each ends in an equilibrium, which is checked, or in an error of ours.

    python benchmarks/fuzz.py --scenes 2000 --seed 1
    python benchmarks/fuzz.py --scenes 1 --seed 1 --first 1234 --show   # one of them, as a script

A scene is drawn as the text of a script (:func:`draw`), which is what is run and what is shown
where something is wrong. The equilibrium is checked by an evaluation of its own
(:class:`Body`): the strains by scikit-fem's ``Basis``, the cable by monomials, their derivatives
by the complex step. Where the formulation is "continuum", scikit-fem assembles the textbook's form
as well. Its stability is checked by the dense eigenvalues of the derivative of that residual.

Ends with 1 if an end is neither of the two, and says which scenes they were.
"""

import argparse
import collections
import math
import signal
import sys
import time
import warnings

import numpy as np
from scipy.linalg import null_space
from skfem import Basis, asm

from skfem_ancf import AncfError, forms
from skfem_ancf.actions.contact.contacts import SEEN
from skfem_ancf.elements import ELEMENTS

FORMULATIONS = ("assumed", "continuum", "ecm", "strain-split")
HEADER = '''import numpy as np
from skfem_ancf import *
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.actions.forces import point
class Slider(ForceElement):
    def __init__(self, k, most, beam):
        self.k, self.most, self.beam = k, most, beam
    def bind(self, layout):
        self.at = point(layout, self.beam, "right")
        return [self.at]
    def start(self):
        return self.at.start
    def evaluate(self, x, v, t, history, dt):
        d = x[0] - history
        F = self.k * d * np.minimum(1.0, self.most / np.maximum(self.k * np.sqrt(d @ d), 1e-300))
        return -F[None], x[0] - F / self.k
'''
LOADS = tuple(f"scene.{name}(" for name in (
    "point_force", "gravity", "traction", "moment", "pressure", "line_load"))


# drawing


class Dice:
    """Draws from a random generator. The tests draw from Hypothesis by the same three methods."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def integer(self, low, high):
        """An integer from low to high, both included."""
        return int(self.rng.integers(low, high + 1))

    def number(self, low, high):
        """A number between two bounds, to three digits: scripts stay short."""
        return float(f"{self.rng.uniform(low, high):.3g}")

    def choice(self, items):
        """One of the items, which may be repeated for weight."""
        return items[int(self.rng.integers(len(items)))]


def _mesh(dice, most, origin):
    """The text of a mesh that starts at ``origin``, its length and its height."""
    kind = dice.choice(("line", "line", "graded", "arc", "wave"))
    n, L = dice.integer(2, most), dice.number(0.5, 2.0)
    slenderness = dice.choice((5, 20, 100, 1000))
    if dice.integer(0, 9) == 0:
        n = 1
    h, angle = float(f"{L / slenderness:.3g}"), dice.choice((0.0, 0.0, dice.number(-3, 3)))
    if kind in ("line", "graded"):
        x = (f"np.linspace(0, {L}, {n + 1})" if kind == "line" else
             f"{L} * np.linspace(0, 1, {n + 1})**{dice.choice((1.5, 2.0))}")
        return (f"MeshBeam.init_line({x}, {h}, origin={origin}, angle={angle})", L, h)
    if kind == "arc":
        R = float(f"{L / dice.number(0.3, 2.5):.3g}")
        r = f"{R} * np.sin(s / {R}), {R} - {R} * np.cos(s / {R})"
    else:
        r = f"s, {float(f'{0.1 * L:.3g}')} * np.sin({float(f'{3 / L:.3g}')} * s)"
    return (f"MeshBeam.init_curve(lambda s: np.array([{r}]),\n    np.linspace(0, {L}, {n + 1}), "
            f"{h}).rotated({angle}).translated({origin})", L, h)


def _beam(dice, k, most, origin, E):
    """Lines of a beam, its length, and its bending stiffness."""
    mesh, L, h = _mesh(dice, most, origin)
    if dice.integer(0, 3) == 0:
        element = f"ElementBeamCable({dice.choice((3, 5, 7, 9, 13))})"
    else:
        name = dice.choice([n for n in ELEMENTS if most <= 4 or n not in
                            ("ancf-7", "ancf-8", "ancf-9", "ancf-10", "cubic-6")])
        element = f"ELEMENTS[{name!r}]()"
    law = dice.choice(("StVenantKirchhoff",) * 3 + ("NeoHookean",))
    formulation = dice.choice(("assumed", "assumed") + FORMULATIONS)
    if law == "NeoHookean" and formulation in ("ecm", "strain-split") and dice.integer(0, 9):
        formulation = "assumed"
    E, nu = E * dice.choice((1, 1, 10)), dice.choice((0.0, 0.3, 0.3, 0.45, -0.2))
    plane = dice.choice(("stress", "stress", "strain"))
    lines = [f"mesh{k} = {mesh}",
             f"material{k} = " + _with_history(dice, law, formulation, E, h / L, (
                 f"E={E}, nu={nu}, density=1.0, plane={plane!r}")),
             f"beam{k} = Beam(mesh{k}, {element}, material{k}, 0.1, {formulation!r}, "
             f"name='b{k}', compiled=COMPILED)"]
    return lines, L, E * 0.1 * h**3 / 12.0


def _with_history(dice, law, formulation, E, slope, numbers):
    """The text of a law, perhaps of one with a history: one that answers at once as it does, or
    one that yields; ``slope`` is the size of strains in bending."""
    elastic, kind = f"{law}({numbers})", dice.integer(0, 7)
    if law != "StVenantKirchhoff" or formulation != "assumed" or kind > 2:
        return elastic
    if kind == 0:
        return f"Prony({elastic}, [0.3], [1e9])"  # at once, on paths too
    y = float(f"{E * min(0.03, slope * 10.0 ** dice.number(-1, 0.3)):.3g}")
    hardening = dice.choice((0.01 * E, 1e-3 * E, 0.1 * E, f"Voce({y}, 20.0, {1e-3 * E})",
                             f"[(0, {y}), (0.002, {1.2 * y}), (0.01, {1.3 * y})]"))
    return (f"ElasticPlastic({numbers}, yield_stress={y}, hardening={hardening}, "
            f"kinematic={dice.choice((0.0, 1e-3, 0.1)) * E})")


def _supports(dice, n):
    """Lines that hold the first beam, and perhaps the last."""
    last, out = f"beam{n - 1}", []
    far = f"tuple(mesh{n - 1}.p[:, -1])"
    kind = dice.choice(("clamp", "clamp", "clamp free", "pin", "both", "all"))
    if kind.startswith("clamp") or kind == "both":
        free = kind == "clamp free" or dice.integer(0, 2) == 0
        out.append(f"scene.clamp('left', beam=beam0, thickness={'free' if free else 'fixed'!r})")
    elif kind == "all":
        out.append("scene.fix('left', beam=beam0)")
    else:
        out.append("scene.pin('left', beam=beam0)")
        if dice.integer(0, 5):
            out.append(f"scene.pin('right', beam={last})")
        else:
            out.append(f"scene.fix('right', ['r^2'], beam={last})")
    if kind == "both":
        out.append(dice.choice((
            f"scene.clamp('right', beam={last})",
            f"scene.fix('right', ['r^1'], displacement={dice.number(-0.1, 0.1)}, beam={last})",
            f"scene.joint('line', at={far}, direction=(1, {dice.number(-1, 1)}), beam={last})",
            f"scene.joint('circle', at={far}, center=(0.3, {dice.number(2, 4)}), beam={last})",
            f"scene.joint('angle', at='right', angle=lambda t: {dice.number(-1, 1)} * t, "
            f"beam={last})",
            f"scene.joint('position', at={far}, beam={last},\n    r=lambda t, p={far}: "
            f"(p[0] + {dice.number(-0.1, 0.1)} * t, p[1] + {dice.number(-0.2, 0.2)} * t))",
            f"scene.joint('plane', at='right', beam={last})")))
    return out


def _loads(dice, n, size, wild):
    """Lines of one to three loads; ``size`` is E I / L^2 of the softest beam."""
    out = []
    for _ in range(dice.integer(1, 3)):
        k = dice.integer(0, n - 1)
        P = size * 10.0 ** dice.number(-2, 1) * dice.choice((1.0, -1.0)) * (30.0 if wild else 1.0)
        P = float(f"{P:.3g}")
        a = dice.number(-3.2, 3.2)
        force = f"({P} * np.cos({a}), {P} * np.sin({a}))"
        at = f"tuple(mesh{k}.p[:, {dice.choice((-1, -1, 1))}])"
        kind = dice.choice(("point", "point", "point", "gravity", "traction", "moment", "pressure"))
        L = f"mesh{k}.lengths.sum()"
        out.append({
            "point": f"scene.point_force({force}, at={at}, beam=beam{k})",
            "gravity": f"scene.gravity(np.array({force}) / beam{k}.total_mass, beam=beam{k})",
            "traction": f"scene.traction('top', np.array({force}) / (0.1 * {L}), beam=beam{k})",
            "moment": f"scene.moment('right', {P} * {L}, beam=beam{k})",
            "pressure": f"scene.pressure('top', {P} / (0.1 * {L}), beam=beam{k})"}[kind])
    return out


def draw_leaves(dice):
    """The script of beams that lie on each other, or a gap apart, and are pressed together."""
    n, y, lines = dice.choice((2, 2, 3)), 0.0, []
    E = dice.choice((1e3, 1e6, 2e11))
    heights = [dice.choice((0.01, 0.02, 0.05)) for _ in range(n)]
    for k, h in enumerate(heights):
        y -= 0.5 * (h + heights[k - 1]) + h * dice.choice((0.0, 0.0, 0.001, 0.1)) if k else 0.0
        element = dice.choice(("ElementBeamCable(3)", "ElementBeamCable(5)", "ElementBeamANCF(2)",
                               "ElementBeamANCFCubic(1)"))
        law = "StVenantKirchhoff" if "Cable" in element else dice.choice(
            ("StVenantKirchhoff", "NeoHookean"))
        lines += [f"mesh{k} = MeshBeam.init_line(np.linspace(0, {dice.number(0.5, 1.0)}, "
                  f"{dice.integer(4, 10)}), {h}, origin=(0.0, {y}))",
                  f"beam{k} = Beam(mesh{k}, {element}, {law}({E}, {dice.choice((0.0, 0.3))}, 1), "
                  f"0.1, name='b{k}', compiled=COMPILED)"]
    lines.append(f"scene = Scene({', '.join(f'beam{k}' for k in range(n))})")
    lines += [f"scene.clamp('left', beam=beam{k}, thickness='free')" for k in range(n)]
    lines.append(f"scene.contact('all', friction={dice.choice((0.0, 0.0, 0.1, 0.3, 0.8))})")
    P = float(f"{dice.number(0.02, 1.0) * E * 0.1 * min(heights) ** 3 / 4:.3g}")
    lines.append(dice.choice((f"scene.point_force((0.0, {-P}), at='right', beam=beam0)",
                              f"scene.line_load((0.0, {-2 * P}), beam=beam0)")))
    options = {}
    if dice.integer(0, 1):  # bent to and fro, so that leaves slide and go back
        path = f"lambda t: np.interp(t, [0, 1, 2], [0, 1, {dice.number(-0.5, 1)}])"
        lines[-1] = f"{lines[-1][:-1]}, amplitude={path})"
        options = {"increments": dice.integer(1, 5), "min_step": 0.02}
    return "\n".join([*lines, f"options = {options}", ""])


def draw_pressed(dice):
    """The script of a beam that is pressed on an obstacle and dragged along it, and back."""
    E, L, h = dice.choice((1e3, 1e6, 2e11)), dice.number(0.5, 2.0), dice.choice((0.02, 0.05))
    gap, R = h * dice.choice((0.0, 0.001, 0.1)), dice.number(0.05, 0.5)
    element = dice.choice(("ElementBeamCable(3)", "ElementBeamCable(5)", "ElementBeamANCF(2)",
                           "ElementBeamANCFCubic(1)"))
    material = dice.choice((f"StVenantKirchhoff({E}, 0.3, 1)", f"NeoHookean({E}, 0.3, 1)",
                            f"ElasticPlastic({E}, 0.3, {0.2 * h / L * E}, {0.1 * E}, "
                            "density=1)"))
    if "Cable" in element or "Plastic" in material:
        material = material.replace("NeoHookean", "StVenantKirchhoff")
        element = element.replace("Cubic(1)", "Cubic(2)")
    shape = dice.choice((f"Line((0.0, {-0.5 * h - gap}), (0.0, 1.0))",
                         f"Circle(({dice.number(0.6, 0.95) * L}, {-0.5 * h - gap - R}), {R})"))
    P = float(f"{dice.number(0.05, 1.0) * E * 0.1 * h**3 / 4 / L**2:.3g}")
    lines = [f"path = lambda t: np.interp(t, [0, 1, 2], [0, 1, {dice.number(-1, 1)}])",
             f"mesh0 = MeshBeam.init_line(np.linspace(0, {L}, {dice.integer(4, 10)}), {h})",
             f"beam0 = Beam(mesh0, {element}, {material}, 0.1, name='b0', compiled=COMPILED)",
             "scene = Scene(beam0).clamp('left', thickness='free')",
             f"scene.obstacle({shape}, friction={dice.choice((0.0, 0.1, 0.5, 1.0))})",
             dice.choice((f"scene.point_force((0.0, {-P}), at='right')",
                          f"scene.line_load((0.0, {-2 * P / L}))")),
             f"scene.point_force(({dice.number(-20, 20) * P}, 0.0), at='right', amplitude=path)"]
    options = {"increments": dice.integer(1, 5), "min_step": 0.02}
    return "\n".join([*lines, f"options = {options}", ""])


def draw(dice):
    """The script of a scene: it makes ``scene`` and ``options``; COMPILED is given to it."""
    n = dice.choice((1,) * 6 + (2,) * 3 + (3,))
    most = dice.choice((8, 8, 4)) if n == 1 else 4
    lines, origin, EI, E = [], "(0.0, 0.0)", [], dice.choice((1e3, 1e6, 2e11))
    for k in range(n):
        beam, L, stiffness = _beam(dice, k, most, origin, E)
        lines += beam
        EI.append(stiffness / L**2)
        origin = f"tuple(mesh{k}.p[:, -1])"
    lines.append(f"scene = Scene({', '.join(f'beam{k}' for k in range(n))})")
    for k in range(n - 1):
        lines.append(f"scene.joint('weld', beams=(beam{k}, beam{k + 1}), at=('right', 'left'))"
                     if dice.integer(0, 2) else
                     f"scene.joint('hinge', beams=(beam{k}, beam{k + 1}), "
                     f"at=tuple(mesh{k}.p[:, -1]))")
    lines += _supports(dice, n)
    lines += _loads(dice, n, min(EI), wild=dice.integer(0, 19) == 0)
    options = {"method": "newton"} if dice.integer(0, 7) == 0 else {}
    if dice.integer(0, 7) == 0:
        options["first_step"] = 0.25
    if (kind := dice.integer(0, 9)) > 7:
        return draw_leaves(dice) if kind == 9 else draw_pressed(dice)
    if dice.integer(0, 9) == 0:
        lines.append(f"scene.add(Slider({min(EI)}, {dice.number(0.01, 0.5) * min(EI)}, "
                     f"'b{n - 1}'))")
    if any("Plastic" in line or "Slider" in line for line in lines):  # on a path, and back
        options = {"increments": dice.integer(1, 5), "min_step": 0.02}
        lines.insert(0, f"path = lambda t: np.interp(t, [0, 1, 2], [0, 1, {dice.number(-1, 1)}])")
        lines = [line[:-1] + ", amplitude=path)" if line.startswith(LOADS) else line
                 for line in lines]
    return "\n".join(lines + [f"options = {options}", ""])


# an evaluation of its own


class Body:
    """Internal force of a beam at coordinate displacements (..., N), real or complex.

    Where the strain is sampled is asked of the formulation's terms; the strain itself is that of
    scikit-fem's fields. The stabilisation, whose matrix is constant, is the formulation's own.
    """

    def __init__(self, beam, past=None):
        #: history variables (k, elements, points) of a material that yields
        self.past = past
        self.beam, self.nb = beam, beam.nd // 2
        t = beam.mesh.t
        self.dofs = np.concatenate([t[0][:, None] * self.nb + np.arange(self.nb),
                                    t[1][:, None] * self.nb + np.arange(self.nb)], axis=1)
        self.q0 = (beam.q0 - np.tile(np.append(beam.mesh.p[:, 0], np.zeros(beam.nd - 2)),
                                     len(beam.q0) // beam.nd))
        self.constant = (beam.formulation.stabilisation(
            beam.mesh, beam.element, beam.material, beam.width)
            if beam.has_sections or (self.nb == 2 and beam.formulation.name == "assumed") else None)
        if not beam.has_sections:
            self._cable()
        else:
            self.terms = [self._term(t) for t in beam.formulation.terms(beam.element,
                                                                       beam.material)]

    def _gradients(self, X, W):
        basis = Basis(self.beam.mesh, self.beam.basis.elem, quadrature=(X, W))
        # of the first component of the vector element: the scalar functions
        grad = np.array([basis.basis[k][0].grad[0] for k in range(0, basis.Nbfun, 2)])
        frame = self.beam.mesh.mapping().frame(X)
        return np.einsum("kjep,jJep->Jepk", grad, frame)

    def _term(self, term):
        eta = term.section_nodes
        tables = []
        for name in ("xx", "yy", "xy"):
            xi = term.nodes(name)
            X = np.array([np.repeat(xi, len(eta)), np.tile(eta, len(xi))])
            tables.append((self._gradients(X, np.ones(X.shape[1])), _between(term, name)))
        X, W = term.quadrature
        dV = self.beam.width * W * self.beam.mesh.mapping().detDF(X)
        return term.law, tables, dV

    def _cable(self):
        """r' and r'' at the points by monomials whose values at the ends are the coordinates."""
        beam, m = self.beam, self.nb
        n = 2 * m - 2 + (m > 2 and beam.mesh.nelements == 1)
        n = n if beam.formulation.name == "assumed" else 2 * m
        x, w = np.polynomial.legendre.leggauss(n)
        if beam.formulation.name == "assumed" and m == 2:  # exact for cubics, soft in the middle
            middle = min(100.0 * (beam.mesh.height / beam.mesh.lengths.sum())**2, 4.0 / 9.0)
            x = np.array([-1.0, 0.0, 1.0]) / math.sqrt(3.0 * (1.0 - middle))
            w = np.array([1.0 - middle, 2.0 * middle, 1.0 - middle])
        first, second = [], []
        for L in beam.mesh.lengths:
            c = 2.0 / L  # from 0 to L the monomials are too much alike
            ends = np.array([[c**d * math.perm(j, d) * s**(j - d) if j >= d else 0.0
                              for j in range(2 * m)] for s in (-1.0, 1.0) for d in range(m)])
            inverse = np.linalg.inv(ends)
            for out, d in ((first, 1), (second, 2)):
                powers = np.array([c**d * math.perm(j, d) * x**max(j - d, 0) if j >= d else 0.0 * x
                                   for j in range(2 * m)]).T
                out.append(powers @ inverse)
        self.G = np.array(first), np.array(second)
        self.w = 0.5 * w * beam.mesh.lengths[:, None]
        E = beam.material.E / (1 if beam.material.plane == "stress" else 1 - beam.material.nu**2)
        A = beam.width * beam.mesh.height
        self.EA, self.EI = E * A, E * A * beam.mesh.height**2 / 12

    def _elements(self, v):
        return v.reshape(v.shape[:-1] + (-1, 2))[..., self.dofs, :]

    def force(self, u):
        """(..., N)."""
        out = np.zeros_like(u)
        q = self._elements(self.q0 + u)
        f = self._cable_force(q) if not self.beam.has_sections else self._body_force(q)
        if self.constant is not None:
            du = self._elements(u)
            f = f + np.einsum("eab,...eb->...ea", np.broadcast_to(
                self.constant, (len(self.dofs),) + self.constant.shape[1:]),
                du.reshape(du.shape[:-2] + (-1,))).reshape(f.shape)
        rows = out.reshape(out.shape[:-1] + (-1, 2))
        for e, dofs in enumerate(self.dofs):
            rows[..., dofs, :] += f[..., e, :, :]
        return out

    def _strains(self, tables, q):
        """Strains (3, ...) and derivatives of the position that they are made of."""
        strain, F = [], []
        for name, (T, matrix) in zip(("xx", "yy", "xy"), tables):
            rx, ry = (np.einsum("epk,...eki->...epi", T[J], q, optimize=True) for J in (0, 1))
            a, b = {"xx": (rx, rx), "yy": (ry, ry), "xy": (rx, ry)}[name]
            value = np.sum(a * b, axis=-1)
            value = value if name == "xy" else 0.5 * (value - 1.0)
            strain.append(value if matrix is None else value @ matrix.T)
            F.append((rx, ry))
        return np.array(strain), F

    def _body_force(self, q):
        total = 0.0
        for law, tables, dV in self.terms:
            strain, F = self._strains(tables, q)
            if self.past is not None:
                flow = self._flow() / law.scale.reshape(3, 1, 1)
                strain = strain - flow.reshape(3, *(1,) * (strain.ndim - 3), *flow.shape[1:])
            S = law.stress(strain) * dV
            for name, (T, matrix), (rx, ry), s in zip(("xx", "yy", "xy"), tables, F, S):
                s = (s if matrix is None else s @ matrix)[..., None]
                if name == "xy":
                    total = total + np.einsum("epk,...epi->...eki", T[0], s * ry, optimize=True)
                    total = total + np.einsum("epk,...epi->...eki", T[1], s * rx, optimize=True)
                else:
                    J, r = (0, rx) if name == "xx" else (1, ry)
                    total = total + np.einsum("epk,...epi->...eki", T[J], s * r, optimize=True)
        return total

    def _flow(self):
        """Plastic strain; in plane strain that across the plane is an elastic strain, too."""
        flow, m = self.past[:3].copy(), self.beam.material
        if m.plane == "strain":
            flow[:2] -= m.nu * (flow[0] + flow[1])
        return flow

    def _fibres(self, n):
        """Distances from the axis, and shares of the area."""
        x, w = np.polynomial.legendre.leggauss(n)
        return 0.5 * self.beam.mesh.height * x, 0.5 * w

    def strain(self, u):
        """Of a material that yields, at its points: (3, ...), of a cable along the fibres."""
        q = self._elements(self.q0 + u)
        if self.beam.has_sections:
            (law, tables, _), = self.terms
            return law.scale.reshape(3, 1, 1) * self._strains(tables, q)[0]
        (_, _, s, kappa), (_, _, s0, kappa0) = map(self._curvature, (q, self._elements(self.q0)))
        y, _ = self._fibres(self.past[0].size // s.size)
        return ((np.sqrt(s) - np.sqrt(s0))[..., None] - (kappa - kappa0)[..., None] * y).reshape(
            len(s), -1)

    def _curvature(self, q):
        a, b = (np.einsum("epk,...eki->...epi", G, q) for G in self.G)
        s = np.sum(a * a, axis=-1)
        return a, b, s, (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]) / s

    def _cable_force(self, q):
        a, b, s, kappa = self._curvature(q)
        _, _, s0, kappa0 = self._curvature(self._elements(self.q0))
        N = self.EA * (np.sqrt(s) - np.sqrt(s0)) * self.w
        M = self.EI * (kappa - kappa0) * self.w
        if self.past is not None:
            flow = self._flow()[0].reshape(*s0.shape, -1)
            y, w = self._fibres(flow.shape[-1])
            N = N - self.EA * (flow @ w) * self.w
            M = M + self.EA * (flow @ (w * y)) * self.w
        turned_a, turned_b = (np.stack([-x[..., 1], x[..., 0]], -1) for x in (a, b))
        along = (N / np.sqrt(s))[..., None] * a + (M / s)[..., None] * (
            -turned_b - 2.0 * kappa[..., None] * a)
        return (np.einsum("epk,...epi->...eki", self.G[0], along)
                + np.einsum("epk,...epi->...eki", self.G[1], (M / s)[..., None] * turned_a))


def _between(term, name):
    """Matrix from samples of a strain to the points of a term; None for the identity."""
    x, (eta, _) = term.axis[0], term.section
    if name not in term.samples and term.section_samples is None:
        return None
    V = np.polynomial.legendre.legvander
    at, n = 2.0 * np.asarray(term.nodes(name)) - 1.0, len(term.nodes(name)) - 1
    along = V(2.0 * np.asarray(x) - 1.0, n) @ np.linalg.inv(V(at, n))
    return np.kron(along, term.section_samples[1] if term.section_samples else np.eye(len(eta)))


def internal_force(bodies, system, u):
    """Of a scene, (..., N)."""
    return np.concatenate([b.force(u[..., s]) for b, s in zip(bodies, system.slices)], axis=-1)


def external_force(system, u, t=None):
    out = np.zeros(system.N, dtype=u.dtype)
    for load in system.loads:
        s = system.of(load)
        out[s] += load.factor(t) * load.force(u[s])
    return out


def past_of(state, number):
    """History variables of a beam that yields, (k, elements, points); None for other beams."""
    beam = state.system.beams[number]
    past = state._equations.histories.past(beam)
    if past is None or not hasattr(beam.material, "yield_stress"):
        return None
    n = beam.material.number + (3 if beam.has_sections else 1)
    return past.history.reshape(n, -1, beam.mesh.nelements)[:-3 if beam.has_sections else -1
                                                            ].transpose(0, 2, 1)


def time_of(state):
    """The time, or in statics the load factor."""
    return state.load if state.t is None else state.t


def tangent(bodies, state):
    """The derivative of the residual, dense, by the complex step; of the joints by differences."""
    system, N, step = state.system, state.system.N, 1e-30
    K = np.imag(internal_force(bodies, system, state.u + 1j * step * np.eye(N))).T / step
    for j in range(N) if not all(load.constant for load in system.loads) else ():
        K[:, j] -= np.imag(external_force(system, state.u + 1j * step * np.eye(N)[j],
                                          state.t)) / step
    if system.constraints.joints:
        h = 1e-3 * system.size
        for j in range(N):
            a, b = (state.multipliers @ system.constraints.full_jacobian(
                state.u + x * np.eye(N)[j], time_of(state)) for x in (-h, h))
            K[:, j] += (b - a) / (2 * h)  # exact: the joints are quadratic at most
    return K


# checks


class Wrong(Exception):
    """An equilibrium that is none, or that is not what it says."""


def check(scene, state, before=None, tol=1e-5):
    """The verdict of the dense eigenvalues; raises Wrong. ``before`` is the last state."""
    system, u = state.system, state.u
    if not np.all(np.isfinite(u)) or not state.converged:
        raise Wrong("it says that it has converged, and it has not")
    bodies = [Body(b, past_of(state, k)) for k, b in enumerate(system.beams)]
    for k, (body, s) in enumerate(zip(bodies, system.slices)):
        if body.past is not None:
            check_flow(body, u[s], None if before is None else past_of(before, k))
    force = internal_force(bodies, system, u)
    for body, s in zip(bodies, system.slices):  # the textbook, as scikit-fem assembles it
        beam = body.beam
        if beam.formulation.name == "continuum" and beam.has_sections:
            f = asm(forms.textbook.internal_force(beam.material, beam.width,
                                                  beam.material.shear_factor(beam.element)),
                    beam.basis, r=beam.q0 + u[s])
            if np.max(np.abs(f - force[s])) > 1e-8 * np.max(np.abs(f)) + 1e-10 * beam.material.E \
                    * beam.width * beam.mesh.height:
                raise Wrong("the textbook's form gives another force")
    external, now = external_force(system, u, state.t) * state.load, time_of(state)
    forces = state._equations.forces
    touching = bool(forces.changing or forces.contacts.obstacles)
    if forces.changing:
        check_contact(system, state, force)
    if forces.contacts.obstacles:
        check_pressed(system, state, before, force)
    if touching:
        force = state.internal_force
    for item in forces.remembering if not touching else ():
        (link,), one = item.links, item.element
        x = link(u)[None]
        F = one.evaluate(x, 0.0 * x, now, item.history, 0.0)[0][0]
        if np.hypot(*F) > one.most * (1.0 + 1e-9):
            raise Wrong("a slider holds more than it can")
        force = force - np.bincount(link.dofs.ravel(), (link.weights * F[:, None] + 0.0 * link.dofs
                                                        ).ravel(), system.N)
    R = external - force - state.multipliers @ system.constraints.full_jacobian(u, now)
    K = tangent(bodies, state)
    scale = 1.0 / np.maximum(np.abs(np.diag(K)), 1e-300)
    free = system.constraints.free
    rho = np.sqrt(np.sum((R**2 * scale)[free]))
    size = np.sqrt(max(np.sum(force**2 * scale), np.sum(external**2 * scale)))
    if rho > tol * size + 100.0 * system.scales.force_noise:
        raise Wrong(f"the residual is {rho / size:.3g} of the forces")
    gap = np.max(np.abs(system.constraints.constraint(u, now)), initial=0.0)
    if gap > 1e-9 * system.size:
        raise Wrong(f"a joint is open by {gap:.3g}")
    held = u[system.constraints.fixed] - system.constraints.values(state.load, state.t)
    if np.max(np.abs(held), initial=0.0) > 1e-12 * system.size:
        raise Wrong("a support is not where it should be")
    return ("in contact" if touching else "with a slider" if forces.remembering else
            _stability(system, state, K, scale))


def check_flow(body, u, before):
    """Stress on or within the yield surface, flow along its normal, hardening as it says."""
    m, past, strain = body.beam.material, body.past, body.strain(u)
    flow, back, p = past[:3], past[3:6], past[6]
    h, y = m.hardening, m.yield_stress
    y = (np.interp(p, *h.T) if isinstance(h, np.ndarray) else y + h * p if isinstance(h, float) else
         y + h.saturation * (1.0 - np.exp(-h.rate * p)) + h.linear * p)
    change = past - (0.0 * past if before is None else before)
    if not body.beam.has_sections:
        E = m.E / (1.0 if m.plane == "stress" else 1.0 - m.nu**2)
        x, normal, K = E * (strain - flow[0]) - back[0], None, m.kinematic
        size, normal = np.abs(x), np.sign(x)[None]
        flow, back, change_of = flow[:1], back[:1] - K * flow[:1], change[:1]
        if m.plane == "strain":
            return
    else:
        z = flow[0] + flow[1]  # minus the plastic strain across the plane
        e = strain - flow
        C = m.E / ((1.0 + m.nu) * (1.0 - 2.0 * m.nu)) * np.array(
            [[1 - m.nu, m.nu, m.nu], [m.nu, 1 - m.nu, m.nu], [m.nu, m.nu, 1 - m.nu]])
        G = m.E / (2.0 + 2.0 * m.nu)
        if m.plane == "stress":
            S = np.array([(e[0] + m.nu * e[1]), (e[1] + m.nu * e[0]), 0.0 * z]) * m.E / (
                1.0 - m.nu**2)
            b = np.array([back[0], back[1], 0.0 * z])
            found = np.array([2.0 * back[0] - back[1], 2.0 * back[1] - back[0], 6.0 * back[2]]) / 3
        else:
            S = np.einsum("ij,j...->i...", C, np.array([e[0], e[1], z]))
            b = np.array([back[0], back[1], -back[0] - back[1]])
            found = np.array([back[0], back[1], 2.0 * back[2]])
        x, shear = S - b, G * e[2] - back[2]
        x = x - x.mean(axis=0)
        size = np.sqrt(1.5 * np.sum(x * x, axis=0) + 3.0 * shear**2)
        normal = 1.5 * np.array([x[0], x[1], 2.0 * shear]) / np.where(size > 0.0, size, 1.0)
        back, change_of = found - 2.0 / 3.0 * m.kinematic * flow, change[:3]
    tiny = 1e-8 * (m.yield_stress + m.E * np.abs(strain).max())
    if np.any(size > y + tiny):
        raise Wrong(f"the stress is {np.max(size / y):.6g} times the yield stress")
    if np.any(np.abs(back) > tiny):
        raise Wrong("the back stress is not that of the plastic strain")
    flows = change[6] > 1e-9 * (m.yield_stress / m.E)
    if np.any(change[6] < -1e-14) or np.any(np.abs(size - y)[flows] > tiny):
        raise Wrong("a point flows and is not on the yield surface")
    if before is not None and np.any(np.abs(change_of - change[6] * normal) > 1e-7 * (
            np.abs(strain).max())):
        raise Wrong("plastic strain does not grow along the normal of the yield surface")


def check_contact(system, state, internal):
    """Contact of the beams: its resultants, which are those of all forces, gaps and friction."""
    both = state.contact()
    if len(both) == 0:
        return
    size, friction = np.max(np.abs(both.force)), max(one.friction for one, _ in
                                                     state._equations.forces.changing)
    if np.any(both.pressure < 0.0) or np.max(np.abs(both.total)) > 1e-9 * size:
        raise Wrong("bodies pull each other, or actio is not reactio")
    faces, most = faces_of(state), max(np.max(beam.mesh.lengths) for beam in system.beams)
    for k, (beam, s) in enumerate(zip(system.beams, system.slices)):
        force = (state.internal_force[s] - internal[s]).reshape(-1, beam.nd // 2, 2)[:, 0]
        # the last is round-off of places on a body that is as wide as high
        if np.max(np.abs(force.sum(axis=0) + state.contact(on=k).total)) > (
                1e-6 * size + 1e-12 * np.abs(internal).max()
                + 1e-16 * beam.material.E * beam.width * system.size):
            raise Wrong(f"the nodal forces of contact on beam {k} are not those of its points")
    for k in range(len(faces)):
        on = state.contact(on=k)
        others = np.hstack(np.delete(faces, k, axis=0).reshape(-1, 2, 4000))
        for x, gap in zip(on.points.T, on.gap):
            least = np.min(np.hypot(*(others - x[:, None])))
            # faces go on by a hundredth of an element beyond their ends
            if abs(least - abs(gap)) > 0.011 * most + 0.01 * system.beams[k].mesh.height:
                raise Wrong(f"a gap is {gap:.3g}, and the nearest surface {least:.3g} away")
        normal = on.pressure.max() if len(on) else 0.0
        if friction == 0.0 and normal and np.any(on.sticking):
            raise Wrong("points stick without friction")
    (element, at), = state._equations.forces.changing
    check_cone(element.look(state.u[at].reshape(-1, 2), 1.0, element.history), faces, friction)


def faces_of(state):
    """Points of both faces of straight beams, (k, 2, 2, 2000)."""
    out = []
    for k, beam in enumerate(state.system.beams):
        x = np.linspace(0.0, beam.mesh.lengths.sum(), 2000)
        h, y = 0.5 * beam.mesh.height, beam.mesh.p[1, 0]
        out.append(np.stack([state.position(np.array([x, 0 * x + y + side * h]), k)
                             for side in (-1, 1)], axis=1))
    return np.array(out)


def check_cone(found, faces, friction):
    """Forces between members against the cone of friction, about faces (k, 2, 2, m)."""
    _, touched, force, _, _, sticks, _, other = found
    N, T, seen = normal_and_tangential(force, touched, faces[other])
    most, tiny = friction * N, 1e-5 * N + 1e-8 * np.abs(force).max()
    if np.any((N < 0.0)[seen]) or np.any((np.abs(T) > most + tiny)[seen]):
        raise Wrong("a force between members is outside the cone of friction")
    if np.any((np.abs(T) < most * (1.0 - SEEN) - tiny)[seen & ~sticks]):
        raise Wrong("a point slips on a member, and friction is not at its limit")


def normal_and_tangential(force, touched, faces):
    """Parts of forces (2, n) along the outward normal and the tangent of what they touch, at points
    (2, n) on one of its two faces (n, 2, 2, m), and whether these are not at an end."""
    N, T, seen = np.zeros(len(touched.T)), np.zeros(len(touched.T)), np.zeros(len(touched.T), bool)
    for k, (F, y, both) in enumerate(zip(force.T, touched.T, faces)):
        distance = np.hypot(*(both - y[:, None, None]))
        face, i = np.unravel_index(np.argmin(distance), distance.shape)
        seen[k] = 20 <= i < distance.shape[1] - 20
        if seen[k]:
            slope = np.gradient(both[:, face, i - 3:i + 4], axis=1)[:, 2:5]
            s = slope[:, 1] @ (y - both[:, face, i]) / (slope[:, 1] @ slope[:, 1])
            way = slope[:, 1] + 0.5 * s * (slope[:, 2] - slope[:, 0])
            way = way / np.hypot(*way)
            N[k], T[k] = (2 * face - 1) * (way[0] * F[1] - way[1] * F[0]), way @ F
    return N, T, seen


def check_pressed(system, state, before, internal):
    """Contact with an obstacle: gaps, the cone of friction, and sliding against its force."""
    one, on = state._equations.forces.contacts.obstacles[0], state.contact()
    if not len(on):
        return
    force = (state.internal_force - internal).reshape(-1, system.beams[0].nd // 2, 2)[:, 0]
    size = np.abs(on.force).max()
    if np.max(np.abs(force.sum(axis=0) + on.total)) > 1e-6 * size + 1e-9 * np.abs(internal).max():
        raise Wrong("the nodal forces of contact are not those of its points")
    if hasattr(one.shape, "center"):
        normal = on.points - one.shape.center[:, None]
        gap = np.hypot(*normal) - one.shape.radius
        normal = normal / np.hypot(*normal)
    else:
        normal = np.array([[0.0], [1.0]]) + 0.0 * on.points
        gap = on.points[1] - one.shape.point[1]
    if np.max(np.abs(gap - on.gap)) > 1e-9 * system.size:
        raise Wrong("a gap is not the distance from the obstacle")
    N = np.sum(on.force * normal, axis=0)
    T = on.force[1] * normal[0] - on.force[0] * normal[1]
    most, tiny = one.friction * N, 1e-7 * size
    if np.any(N < -tiny) or np.any(np.abs(T) > most * (1.0 + 1e-7) + tiny):
        raise Wrong("a force of contact is outside the cone of friction")
    slips = ~np.asarray(on.sticking, bool) & (N > 1e-3 * N.max())
    # round-off of positions, about 1e-14 of the size, on springs that have hardened
    if one.friction and np.any(np.abs(np.abs(T) - most)[slips] > 1e-4 * most.max()):
        raise Wrong("a point slips, and friction is not at its limit")


def verdict_of(system, state, K, scale):
    """What the dense eigenvalues say, whether K is symmetric, and the lowest of them."""
    free = np.nonzero(system.constraints.free)[0]
    d = np.sqrt(scale[free])
    A = d[:, None] * K[np.ix_(free, free)] * d
    symmetric = np.abs(A - A.T).max(initial=0.0) < 1e-8 * np.abs(A).max(initial=1.0)
    if system.constraints.m:
        Z = null_space(system.constraints.full_jacobian(state.u, time_of(state))[:, free] * d)
        A = Z.T @ A @ Z
    values = np.linalg.eigvalsh(0.5 * (A + A.T))
    # the diagonal is 1; bending of a slender beam is small beside it
    zero = 3e-14 * len(values) * np.abs(values).max(initial=0.0)
    verdict = ("singular" if np.any(np.abs(values) <= zero) else
               "unstable" if np.any(values < 0) else "stable")
    return verdict, symmetric, values[:3]


def _stability(system, state, K, scale):
    """The verdict of the eigenvalues, after a comparison with what the state says."""
    verdict, symmetric, lowest = verdict_of(system, state, K, scale)
    said = getattr(state, "stability", None)
    if not symmetric:
        return f"follower, {said or 'no verdict'}"
    if said is not None and verdict != "singular" and said != verdict:
        raise Wrong(f"stability {said!r}, by dense eigenvalues {verdict!r}: the lowest of the "
                    f"scaled tangent are {lowest}")
    return verdict


class TooLong(Exception):
    """More than the seconds that a scene may take."""


def _alarm(*_):
    raise TooLong


def build(script, compiled=True):
    """The scene and the options that a script makes."""
    space = {"COMPILED": compiled}
    exec(compile(HEADER + script, "<scene>", "exec"), space)
    return space["scene"], space["options"]


def solve(script, compiled):
    """(scene, the last state, and the one before on a path, or None, the error's name)."""
    try:
        scene, options = build(script, compiled)
        if "increments" in options:
            history = scene.run([1.0, 2.0], **options)
            return scene, (history.state(-1), history.state(-2)), ""
        return scene, (scene.solve_static(**options),), ""
    except AncfError as error:
        return None, None, type(error).__name__


def run(script, compare=False, seconds=120):
    """How a scene ends: (outcome, what is wrong with it or "")."""
    known = signal.signal(signal.SIGVTALRM, _alarm)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            _own_warnings()
            scene, state, error = solve(script, True)
            outcome = error or check(scene, *state)
            if compare:
                return outcome, _compared(script, state, error)
            return outcome, ""
    except Wrong as wrong:
        return "WRONG", str(wrong)
    except TooLong:
        return "TOO LONG", f"more than {seconds} s of the processor"
    except Exception as error:  # whatever it is, it is not ours
        return "FOREIGN", f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, known)


def _own_warnings():
    """Warnings of the package are no errors here."""
    from skfem_ancf.core import errors
    for kind in vars(errors).values():
        if isinstance(kind, type) and issubclass(kind, Warning):
            warnings.simplefilter("ignore", kind)


def _compared(script, state, error):
    """What is wrong with the same scene without compiled kernels."""
    scene, plain, plain_error = solve(script, False)
    if plain_error != error:
        if plain is not None:
            check(scene, *plain)
        # Newton's method alone finds by chance, or not, how a pendulum hangs: see SupportError
        chance = "ConvergenceError" in (error, plain_error) or (
            "'newton'" in script and "SupportError" in (error, plain_error))
        return "" if chance else (
            f"compiled: {error or 'solved'}, in NumPy: {plain_error or 'solved'}")
    if plain is None:
        return ""
    check(scene, *plain)
    plain, state = plain[0], state[0]
    M, both = scene.system.mass.tocsc(), np.stack([plain.u - state.u, state.u], axis=1)
    # of the displacement: sixth derivatives are known to fewer digits, and move the axis little
    apart, size = np.sqrt(np.sum(both * (M @ both), axis=0))
    gap = apart / max(size, 1e-300)
    if gap > 1e-6 and np.max(np.abs(plain.u - state.u)) > 1e-9 * scene.system.size:
        # an equilibrium each, as checked: which one is decided by round-off where several are near
        return "" if gap > 1e-3 else f"compiled and NumPy differ by {gap:.3g}"
    return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--compare", type=int, default=8, help="one in how many in NumPy as well")
    parser.add_argument("--show", action="store_true", help="print every script")
    arguments = parser.parse_args()
    from tqdm import tqdm

    run(draw(Dice((arguments.seed, 0))), seconds=1000)  # Numba compiles
    ends, bad, begin = collections.Counter(), [], time.time()
    bar = tqdm(range(arguments.first, arguments.first + arguments.scenes), mininterval=2.0)
    for number in bar:
        script = draw(Dice((arguments.seed, number)))
        if arguments.show:
            print(script)
        outcome, wrong = run(script, number % arguments.compare == 0)
        ends[outcome] += 1
        if wrong:
            bad.append((number, outcome, wrong, script))
            bar.write(f"# scene {number}: {outcome}: {wrong}")
    print(f"{sum(ends.values())} scenes of seed {arguments.seed} in {time.time() - begin:.0f} s")
    for outcome, n in ends.most_common():
        print(f"{n:6}  {outcome}")
    for number, outcome, wrong, script in bad[:20]:
        print(f"\n# scene {number} of seed {arguments.seed}: {outcome}: {wrong}\n{HEADER}"
              f"COMPILED = True\n{script}end = scene.run([1, 2], **options) if 'increments' in "
              "options else scene.solve_static(**options)")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
