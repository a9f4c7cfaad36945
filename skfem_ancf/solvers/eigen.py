"""Natural frequencies about a state, and linear buckling loads."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, eigsh

from ..core.band import fix
from ..core.errors import (ConvergenceError, InputError, ModelWarning, SupportError,
                           require_integer, warn)
from ..core.linalg import NO_FACTORS
from ..core.types import Array
from ..equations.strain_tangent import Inverse, StrainTangent, is_symmetric
from ..equations.system import System
from ..results.modes import ROUND_OFF, Buckling, Modes
from ..results.state import State

DENSE = 600  # free coordinates up to which the dense solver is used
WINDOW = 1e-8  # smallest over largest eigenvalue of an inverse that is taken from it
ORTHOGONAL = 1e-5  # scalar product of two shapes of unit mass
UNREFINED = 1e-7  # error of an inverse that Lanczos takes as it is
LANCZOS = 1e-10  # its tolerance
SAME = 1e-6  # relative distance of eigenvalues that are the same
UNSTRESSED = 1e-9  # force of springs at rest, over their stiffness times the size, of round-off
SMALL = 1e-4  # displacement over the size by which tangents of domains are differences
ASIDE = 1e-5  # motion that shows on which sides springs push, over the size
STIFFER = 0.1  # relative change of their stiffness that is not left out
TURNING = 1e-2  # square of the angular velocity over that of a frequency
REAL = 1e-7  # imaginary over absolute value of an eigenvalue that counts as real


def modes(system: System, state: State, k: int) -> Modes:
    """The k lowest natural frequencies about a state, with the smallest real part of ``lambda``.

    The eigenvalues of ``K x = lambda M x`` are found as ``1 / (lambda + s)``, the largest first, s
    a small shift: of ``(K + s M)^-1 M``, with solutions refined by strains instead of assembled
    stiffnesses, and at last as quotients of sums of squares of strains. So the low ones, of
    bending, are accurate although the largest are ``(L / h)^4`` times as large. With loads that
    have no potential K is not symmetric, and its eigenvalues may be complex.
    """
    with system.forces.contacts.lent(state.memory):
        return _modes(system, state, k)


def _modes(system, state, k):
    tangent = StrainTangent(system, state.u, state.load, state.t, state.multipliers)
    if tangent.size[0] <= DENSE:
        tangent.require_independent()
    M = _free_mass(system, tangent)
    n, m = tangent.size
    k = _count(k, n - m)
    shift, small = _shift(tangent, state), n <= DENSE or 2 * k > n - m
    tangent.balance(M, shift)
    if tangent.symmetric and not small:
        values, X = _sparse(tangent, state, M, k, shift)
    elif tangent.symmetric:
        values, X = _dense(tangent, M, k, shift)
    else:
        values, X = _unsymmetric(tangent, M, k, shift, small)
    shapes = np.zeros((k, system.N), dtype=X.dtype)
    shapes[:, tangent.free] = X.T
    frequencies = np.sqrt(values) if np.any(values.imag) else (
        np.sign(values.real) * np.sqrt(np.abs(values.real)))
    _warn_of_turning(state, np.abs(values), ROUND_OFF**2 * system.scales.bending_eigenvalue)
    return Modes(frequencies, shapes, state, values.astype(complex))


def rest_modes(system: System, k: int) -> tuple[Array, Array]:
    """The k lowest angular frequencies (k,) and shapes (k, N) about the reference configuration.

    Rigid motions are left out.
    """
    rigid = len(system.constraints.free_rigid_motions())
    found = modes(system, State(system, np.zeros(system.N), load=0.0), rigid + k)
    return found.frequencies[rigid:], found.shapes[rigid:]


def _warn_of_turning(state, values, rigid):
    """Give a ModelWarning if the state turns not much slower than it vibrates."""
    speed = _angular_velocity(state) if np.any(state.v) else 0.0
    values = values[values > max(rigid, TURNING * speed**2)]  # of vibrations
    if values.size and speed**2 > TURNING * values.min():
        warn(f"the state turns by {speed:.3g} rad/s, and modes know its stiffness alone: "
                      "centrifugal and Coriolis forces are missing, which change the square of a "
                      "frequency by about the square of that; take the state at rest in a frame "
                      "that turns, with the centrifugal force (docs/modes.md, Rotating beams)",
                      ModelWarning)


def _angular_velocity(state):
    """The largest one of a beam or body, in the mean of its mass."""
    system, speeds = state.system, []
    for member, s in zip(system.members, system.slices):
        B, v = np.zeros((system.N, 3)), np.zeros(system.N)
        x, y = state.q[s].reshape(-1, 2).T
        B[s], v[s] = member.rigid_motions(), state.v[s]
        B[s, 2] = np.column_stack([-y, x]).ravel()
        MB = np.column_stack([system.mass.multiply(b) for b in B.T])
        speeds.append(abs(np.linalg.solve(B.T @ MB, MB.T @ v)[2]))
    return max(speeds)


def _free_mass(system, tangent):
    """The mass matrix between the free coordinates, sparse."""
    M = system.mass.tocsc().T  # it is symmetric: in rows, as it is
    return M[tangent.free][:, tangent.free] if len(tangent.free) < system.N else M


def _shift(tangent, state):
    """A number s for which K + s M is positive definite between the free coordinates."""
    shift = tangent.system.scales.bending_eigenvalue
    for _ in range(80):
        try:
            if _negative(tangent, state, shift) == 0:
                return shift
        except NO_FACTORS:
            pass
        shift *= 4.0
    raise SupportError("the joints are not independent in this state")


def _negative(tangent, state, shift):
    """How many eigenvalues of K + shift M between the free coordinates are negative."""
    system = tangent.system
    if system.solver.condensed is not None:
        return tangent.condense(system.solver.condensed, shift).inertia().negative
    system.assemble(state.u, state.load, t=state.t)
    system.K.combine(1.0, system.K, shift, system.mass)
    if shift < 0.0 and not system.solver.coupled:  # as a rule indefinite: without factors
        fix(system.K.band, system.constraints.fixed)
        return (system.K if system.symmetric else system.K.symmetric_part()).negative()
    system.solver.factorize(state.u, state.load if state.t is None else state.t, state.multipliers)
    return system.solver.inertia().negative


def _dense(tangent, M, k, shift):
    """The k lowest by all eigenvalues of the inverse, so many at once as it has digits for."""
    inverse, L = Inverse(tangent, M, shift), scipy.linalg.cholesky(M.toarray(), lower=True)
    X, values = np.zeros((len(L), 0)), np.zeros(0)
    while len(values) < k:
        MX = M @ X
        Y = inverse.solve(L - MX @ (X.T @ L))  # of what is left, M-orthogonal to those known
        Y -= X @ (MX.T @ Y)
        T = L.T @ Y
        theta, V = scipy.linalg.eigh(0.5 * (T + T.T))
        seen = np.abs(theta) > WINDOW * np.abs(theta).max()
        theta, V = theta[seen], V[:, seen]
        lowest = np.argsort(1.0 / theta)[:k - len(values)]
        found, quotients = _quotients(tangent, M, (Y @ V / theta)[:, lowest])
        # a rounded window shows those known once more
        new = np.max(np.abs(MX.T @ found), axis=0, initial=0.0) < ORTHOGONAL
        if not np.any(new):
            raise InputError(f"{len(values)} modes of so slender a beam can be told from "
                             f"round-off, k = {k} were asked for")
        X = np.column_stack([X, found[:, new]])
        values = np.append(values, quotients[new])
    order = np.argsort(values)
    return values[order], X[:, order]


def _sparse(tangent, state, M, k, shift):
    """The k lowest by Lanczos on the inverse, which need not be refined where it is good.

    An error of a shape is squared in its quotient, after a step of subspace iteration. Of equal
    frequencies Lanczos may miss some: they are counted, and looked for beside those that are known.
    """
    inverse, rng = Inverse(tangent, M, shift), np.random.default_rng(0)
    start = inverse.solve(rng.standard_normal(M.shape[0]))
    apply = inverse.once if inverse.left < UNREFINED else inverse.solve
    values, X = _polished(tangent, M, inverse, _lanczos(M, k, shift, apply, start))
    while missing := _missing(tangent, state, shift, values):

        def others(b, X=X, theta=1.0 / (values + shift)):
            return apply(b) - X @ (theta * (X.T @ b))

        start = others(rng.standard_normal(M.shape[0]))
        more = np.column_stack([X, _lanczos(M, min(missing, k), shift, others, start)])
        before, (values, X) = values, _polished(tangent, M, inverse, more)
        values, X = values[:k], X[:, :k]
        if not np.any(values < before - SAME * np.maximum(np.abs(before), shift)):
            break  # what was counted was round-off
    return values, X


def _lanczos(M, k, shift, apply, start):
    """The k lowest shapes, as columns; ``apply`` is the inverse of ``K + shift M``."""
    try:
        return eigsh(M, k=k, M=M, sigma=-shift, v0=start, tol=LANCZOS,
                     OPinv=LinearOperator(M.shape, apply, dtype=float))[1]
    except ArpackNoConvergence as failure:
        raise ConvergenceError(f"of {k} modes Lanczos found {len(failure.eigenvalues)}; ask for "
                               "another number") from None


def _missing(tangent, state, shift, values):
    """How many eigenvalues below the largest of those found are not among them.

    By Sylvester's law of inertia; 1 where there are no factors to tell.
    """
    below = values[-1] - SAME * max(abs(values[-1]), shift)
    try:
        number = _negative(tangent, state, -below)
    except NO_FACTORS:
        return 1
    return max(number - int(np.sum(values < below)), 0)


def _quotients(tangent, M, X):
    """Columns X of unit modal mass, and their Rayleigh quotients."""
    X = X / np.sqrt(np.sum(X * (M @ X), axis=0))
    return X, tangent.energies(X)


def _polished(tangent, M, inverse, X):
    """Eigenvalues and columns X after a step of subspace iteration, the lowest first."""
    MX = M @ X
    Y = inverse.solve(MX)
    theta, V = scipy.linalg.eigh(MX.T @ Y, X.T @ MX)
    X, values = _quotients(tangent, M, Y @ V / theta)
    order = np.argsort(values)
    return values[order], X[:, order]


def _unsymmetric(tangent, M, k, shift, small):
    """The k lowest where K is not symmetric: complex values, shapes (n, k)."""
    inverse, n = Inverse(tangent, M, shift), M.shape[0]
    if small:
        theta, X = scipy.linalg.eig(inverse.solve(M.toarray()))
    else:
        start = np.random.default_rng(0).standard_normal(n)
        theta, X = eigs(LinearOperator(M.shape, lambda x: inverse.solve(M @ x), dtype=float),
                        k=min(k + 2, n - 2), v0=inverse.solve(start))
    seen = np.abs(theta) > WINDOW * np.abs(theta).max()
    if np.sum(seen) < k:
        raise InputError(f"under loads that follow the body {int(np.sum(seen))} modes can be "
                         f"told from round-off, k = {k} were asked for")
    values, X = 1.0 / theta[seen] - shift, X[:, seen]
    real = np.abs(values.imag) <= REAL * np.abs(values)
    values[real] = values[real].real
    order = np.lexsort((values.imag, values.real))[:k]
    values, X = values[order], X[:, order]
    if not np.any(values.imag):
        X = _real(X)
    return values, X / np.sqrt(np.sum(X.conj() * (M @ X), axis=0).real)


def buckling(system: System, k: int) -> Buckling:
    """The k lowest positive load factors of linear buckling.

    ``(K_0 + factor K_s) phi = 0``, K_s the geometric part for the stress that the full load, moved
    supports included, causes in the stress-free geometry, less the stiffness of the loads. Factors
    at which the mean strain before buckling is not below one are left out. With loads that have no
    potential K_s is not symmetric, and only real factors, of divergence, are found.

    Raises InputError if the loads do not buckle the beam, it touches an obstacle before, springs
    are tight before any load, or push or pull on one side only of where it buckles.
    """
    system.constraints.require_supports()
    zero, none = np.zeros(system.N), np.zeros(system.constraints.m)
    _require_unstressed(system, zero)
    tangent = StrainTangent(system, zero, 0.0, None, none)
    n, m = tangent.size
    k = _count(k, n - m)
    du, stress, multipliers = tangent.response()
    Ks = tangent.geometric(stress, multipliers, 1.0) + _geometric_of_domains(system, tangent, du)
    if not Ks.nnz or not abs(Ks).max() > 0.0:
        raise InputError("no positive load factor: the loads do not stress the beam")
    symmetric = is_symmetric(Ks, system.constraints.coordinate_sizes[tangent.free])
    theta, X = _buckled(tangent, Ks, k, symmetric)
    # mean strain before buckling over that of the strain energy of a strain of one
    strain = np.sqrt(max(float(du @ tangent.internal(stress)), 0.0)) * np.finfo(float).eps
    good = theta < -strain / system.scales.strain_noise
    if not np.any(good):
        raise InputError("no positive load factor: these loads pull the beam straight"
                         if symmetric else _FLUTTER)
    factors = -1.0 / theta[good]
    order = np.argsort(factors)[:k]
    system.forces.contacts.require_free(factors[order[0]] * du, "buckling()",
                                        "continuation(): it touches before it buckles")
    _require_same_springs(system, factors[order[0]] * du)
    if not symmetric:
        _require_no_flutter(system, tangent, Ks, factors[order[0]])
    shapes = np.zeros((len(order), system.N))
    shapes[:, tangent.free] = X[:, good].T[order]
    return Buckling(factors[order], shapes, not symmetric)


def _geometric_of_domains(system, tangent, du):
    """How tangents of domains change along a displacement (N,), between free coordinates."""
    K = sparse.csr_matrix((system.N, system.N))
    for domain in system.domains:
        s = system.of(domain)
        h = SMALL * domain.size / max(np.max(np.abs(du[s])), np.finfo(float).tiny)
        i, j = domain.pattern
        change = (domain.stiffness(h * du[s]) - domain.stiffness(-h * du[s])) / (2.0 * h)
        K = K + sparse.csr_matrix((change, (s.start + i, s.start + j)), shape=K.shape)
    return K[tangent.free][:, tangent.free]


def _require_unstressed(system, zero):
    """Raise InputError where force elements push before there is any load."""
    if not len(system.forces.elements):
        return
    push = np.abs(system.internal_force(zero, 0.0, 0.0) * system.constraints.mask).max()
    held = abs(system.stiffness_at_rest())
    if push > UNSTRESSED * (held.max() if held.nnz else 0.0) * system.size:
        raise InputError(
            "springs push before there is any load: buckling() starts from the reference "
            "configuration and scales all that stresses it. state.stability of "
            "scene.solve_static(stable=False), and scene.modes(k, state), tell under "
            "which loads the tightened scene holds")


def _require_same_springs(system, u):
    """Raise InputError where springs give way to one side only of the buckling state u.

    A small motion there and back tells. Warns where they are not as stiff as without load.
    """
    if not len(system.forces.elements):
        return
    kick = ASIDE * np.random.default_rng(0).uniform(-1.0, 1.0, system.N) * system.constraints.mask
    kick *= system.constraints.coordinate_sizes
    rest, here, up, down = (system.forces.firmnesses(system.backend.tables.plain.forces, x)
                            for x in (np.zeros(system.N), u, u + kick, u - kick))
    if np.any(np.abs(up - down) > STIFFER * np.maximum(up, down)):
        raise InputError(
            "where it buckles, springs or foundations are stiffer to one side than to the other, "
            "as ropes and one-sided foundations: buckling() knows one stiffness for both. Take "
            "scene.continuation() with a small force to either side, or leave out what comes loose")
    if np.any(np.abs(here - rest) > STIFFER * np.maximum(here, rest)):
        warn("springs become stiffer or softer before it buckles, and buckling() knows "
                      "their stiffness without load alone: state.stability of scene.solve_static() "
                      "tells under which loads it holds", ModelWarning)


_FLUTTER = (
    "no real positive load factor at which a neighbouring equilibrium appears: these loads follow "
    "the body and have no potential. It may flutter: look at scene.modes(k, state) about "
    "states under load, beyond the critical load modes.flutter is True")


def _buckled(tangent, Ks, k, symmetric):
    """The lowest real eigenvalues ``-1 / factor`` of ``K_s x = theta K_0 x``, and columns x."""
    inverse, n = Inverse(tangent), Ks.shape[0]

    def operator(f):
        return LinearOperator(Ks.shape, f, dtype=float)

    start = inverse.solve(Ks @ np.random.default_rng(0).standard_normal(n))
    if n <= (100 if symmetric else DENSE) or 2 * k > n - tangent.size[1]:
        theta, X = scipy.linalg.eig(inverse.solve(np.eye(n)) @ Ks)
    elif symmetric:
        try:
            _, X = eigsh(Ks, k=k, M=operator(tangent.multiply), Minv=operator(inverse.solve),
                         which="SA", v0=start, maxiter=200)
        except ArpackNoConvergence as failure:  # there are not as many negative ones
            X = failure.eigenvectors
            if not X.shape[1]:
                return np.zeros(0), X
        Y = inverse.solve(Ks @ X)
        theta, V = scipy.linalg.eigh(Y.T @ (Ks @ Y), Y.T @ (Ks @ X))
        X = Y @ V
    else:
        theta, X = eigs(operator(lambda x: inverse.solve(Ks @ x)), k=k + 2, which="SR", v0=start)
    real = symmetric | (np.abs(theta.imag) <= REAL * np.abs(theta))
    return theta[real].real, _real(X[:, real])


def _require_no_flutter(system, tangent, Ks, factor):
    """Raise InputError if oscillations grow below a load factor, as far as linear theory says."""
    if any(layer.density is None for beam in system.beams for layer in beam.across.layers):
        return
    if any(domain.mass is None for domain in system.domains):
        return
    M, S = _free_mass(system, tangent), tangent.S
    k, small = min(8, tangent.size[0] - tangent.size[1]), tangent.size[0] <= DENSE
    shift = system.scales.bending_eigenvalue
    try:
        for part in factor * 0.5 ** np.arange(20, 0, -1):
            tangent.S = S + part * Ks
            try:
                values, _ = _unsymmetric(tangent, M, k, shift, small)
            except ConvergenceError:  # critical to round-off just there
                continue
            if np.any(values.imag):
                raise InputError(
                    f"it flutters before it buckles at the factor {factor:.6g}, for example at "
                    f"{part:.3g} times these loads, which follow the body: look at "
                    "scene.modes(k, state) about states under load, beyond the critical load "
                    "modes.flutter is True")
    finally:
        tangent.S = S


def _real(X):
    """Columns X turned in the complex plane so that their largest entry is real."""
    X = X * np.exp(-1j * np.angle(X[np.argmax(np.abs(X), axis=0), np.arange(X.shape[1])]))
    return X.real


def _count(k, n):
    if n == 0:
        raise InputError("there are no modes, as supports and joints hold all coordinates: leave "
                         "some of them free")
    return require_integer("the number of modes", k, 1, n)
