"""Single operations: assembling the tangent, one iteration, compiling, and cost against size."""

import sys

import numpy as np
from skfem import asm

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff, forms)

from .ours import CODE, scene
from .problems import PROBLEMS
from .runs import COLUMNS, alone, clock
from .stock import TEXTBOOK

ORDER = 3


def seconds(function, least=0.1, most=200):
    """Median time of a call after a warm-up."""
    start = clock()
    function()
    first = max(clock() - start, 1e-7)
    if first > 2.0:
        return first
    times = []
    for _ in range(int(np.clip(least / first, 3, most))):
        start = clock()
        function()
        times.append(clock() - start)
    return float(np.median(times))


def row(case, code, variant, n, dofs, value, about, error="", note="", **more):
    """A row of the CSV file for one operation."""
    out = dict.fromkeys(COLUMNS, "")
    out.update(case=case, code=code, variant=variant, elements=n, dofs=dofs, seconds=value,
               error=error, note=note, versions=about[0], machine=about[1], **more)
    return out


def bent(s):
    """Displacements of a beam about as large as those of 5.2, so that no term vanishes."""
    beam = s.beams[0]
    X = beam.q0.reshape(-1, beam.nd)[:, 0]
    u = np.zeros((len(X), beam.nd))
    u[:, 1], u[:, 3] = -0.5 * X**2, -X
    return u.ravel()


def tangents(sizes, about, watch):
    """The tangent of the same integral on ElementBeamANCF(3), assembled three ways."""
    rows = []
    for n in watch(sizes, "tangent"):
        s = scene(PROBLEMS["5.2"], ElementBeamANCF(ORDER), n, "continuum")
        beam, system, u = s.beams[0], s.system, bent(s)
        q, k_s = beam.q0 + u, beam.material.shear_factor(beam.element)
        pairs = forms.textbook.tangent(beam.material, beam.width, k_s)
        batched = forms.tangent(beam.material, beam.width, k_s)
        exact = asm(pairs, beam.basis, r=q)
        system.assemble(u)
        fused = system.K.tocsc()
        scale = abs(exact).max()
        for code, variant, function, K in (
                (TEXTBOOK, "BilinearForm by pairs", lambda: asm(pairs, beam.basis, r=q), exact),
                (CODE, "batched form", lambda: asm(batched, beam.basis, r=q),
                 asm(batched, beam.basis, r=q)),
                (CODE, "fused with the force", lambda: system.assemble(u), fused)):
            rows.append(row("tangent", code, variant, n, s.N, seconds(function), about,
                            float(abs(K - exact).max() / scale)))
    return rows


def iteration(about, watch):
    """One static iteration on 16 elements, N = 3, beside a batched matrix product."""
    rows, n = [], 16
    for formulation in watch(("assumed", "continuum"), "iteration"):
        s = scene(PROBLEMS["5.2"], ElementBeamANCF(ORDER), n, formulation)
        system, u = s.system, bent(s)
        residual = system.external_force(u) * system.constraints.mask
        points = s.beams[0].kernel.points_number

        def step(u=u, system=system, residual=residual):
            _, stresses = system.assemble(u)
            system.solver.factorize(u)
            du, _ = system.solver.solve(residual, np.zeros(0))
            system.linearised_stress(u, stresses, du)

        state = s.solve_static()
        solve = seconds(s.solve_static)
        rows.append(row("iteration", CODE, f"ancf {ORDER}, {formulation}: solve_static over its "
                        "iterations", n, s.N, solve / state.iterations, about,
                        iterations=state.iterations))
        rows.append(row("iteration", CODE, f"ancf {ORDER}, {formulation}: assemble, factorise, "
                        "solve, carry", n, s.N, seconds(step), about))
        A, B = np.random.default_rng(0).normal(size=(2, n * points, 20, 20))
        rows.append(row("iteration", "NumPy", f"{n} x {points} products of 20 x 20 by 20 x 20", n,
                        "", seconds(lambda A=A, B=B: A @ B), about))
    return rows + own_energies(n, about)


#: What a new process does that has no compiled code on disk.
SCENE = """
import numpy as np
from skfem_ancf import *
beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamANCF(3),
            StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
scene = Scene(beam).clamp("left").gravity((0, -9.81))
"""
COMPILED = {"imports": ["-c", SCENE], "statics": ["-c", SCENE + "scene.solve_static()"],
            "time steps": ["-c", SCENE + "scene.integrate(0.1, 0.01, 'energy-momentum')"],
            "everything": ["-m", "skfem_ancf", "compile"]}


def compiling(names, about, watch):
    """Processor time of new processes that compile what they need, imports included."""
    return [row("compiling", CODE, name, "", "", alone([sys.executable, *COMPILED[name]],
                                                       SKFEM_ANCF_COMPILED="1"), about)
            for name in watch(names, "compiling")]


def bedding(r, F, X, t):
    return 5e5 * ((r - X)**2).sum(axis=0)


def bedding_of_a_point(r, F, X, t):
    return 5e5 * ((r[0] - X[0])**2 + (r[1] - X[1])**2)


def own_energies(n, about):
    """Force and tangent of a beam alone, and with a bedding by an energy of one's own."""
    unit = 1e6 * np.diag([1.0, 1.0, 0, 0, 0, 0])[:, :, None, None]
    given = bedding, lambda r, F, X, t: (1e6 * (r - X), 0 * F), lambda r, F, X, t: unit
    kinds = {"": (), ", bedding by psi": (bedding,), ", with its derivatives": given}
    try:
        from numba import njit
        kinds[", by psi compiled"] = (njit(bedding_of_a_point),)
    except ImportError:
        pass
    rows = []
    for name, functions in kinds.items():
        s = scene(PROBLEMS["5.2"], ElementBeamANCF(ORDER), n, "assumed")
        if functions:
            s.energy(*functions, scaled=False)
        u = bent(s)
        rows.append(row("iteration", CODE, f"ancf {ORDER}, assumed: force and tangent{name}", n,
                        s.N, seconds(lambda s=s, u=u: s.system.assemble(u)), about))
    return rows


def long_beam(element, n):
    """A beam over supports 1 m apart: elements and condition stay as they are while it grows."""
    mesh = MeshBeam.init_line(0.05 * np.arange(n + 1.0), height=0.01)
    beam = Beam(mesh, element, StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
    s = Scene(beam).clamp("left").gravity((0, -9.81))
    if n < 20:
        return s
    return s.pin(lambda x: (np.abs(x[1]) < 1e-6) & (x[0] > 0.5)
                 & (np.abs(x[0] - np.round(x[0])) < 1e-3))


SCALED = {"cable 3, assumed": lambda n: long_beam(ElementBeamCable(3), n),
          "ancf 3, assumed": lambda n: long_beam(ElementBeamANCF(3), n),
          "cubic 2, assumed": lambda n: long_beam(ElementBeamANCFCubic(2), n)}


def scaling(sizes, about, watch, memory):
    """One linear system of a longer and longer beam: time, and peak memory of a process alone."""
    rows = []
    for variant, build in SCALED.items():
        for n in watch(sizes, "scaling"):
            start = clock()
            s = build(n)
            s.system.K, s.beams[0].kernel
            setup = clock() - start
            s.solve_linear()
            rows.append(row("scaling", CODE, variant, n, s.N, seconds(s.solve_linear), about,
                            iterations=1, peak_mb=memory.peak(variant, n), setup_seconds=setup))
    return rows
