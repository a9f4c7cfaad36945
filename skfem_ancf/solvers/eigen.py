"""Natural frequencies about a state, and linear buckling loads."""

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigs, eigsh

from ..beam.kernels.kernel import ElementsWithHistory
from ..core.band import fix
from ..core import (NO_FACTORS, Array, ConvergenceError, ModelWarning, SupportError, refuse,
                    require_integer, retold, warn)
from ..equations.matrices import Inverse, StrainTangent
from ..equations.rank import is_symmetric
from ..equations.system import System
from ..results.modes import ROUND_OFF, Buckling, Modes
from ..results.state import State
from .increment import Route
from .newton import Search, Steps
from .iteration import LoadStepFailed

DENSE = 600  # largest number of free DOFs for the dense solver
WINDOW = 1e-8  # smallest relative eigenvalue that is taken from an inverse
ORTHOGONAL = 1e-5  # scalar product of orthogonal shapes of unit mass
UNREFINED = 1e-7  # error up to which Lanczos uses an inverse without refinement
LANCZOS = 1e-10  # its tolerance
SAME = 1e-6  # relative distance of equal eigenvalues
UNSTRESSED = 1e-9  # relative force of springs at rest that is round-off
SMALL = 1e-4  # relative displacement for difference quotients of domain tangents
ASIDE = 1e-5  # relative displacement for a test of one-sided springs
STIFFER = 0.1  # relative change of stiffness, or of stress by yielding, that is not neglected
TURNING = 1e-2  # squared ratio of angular velocity to frequency that gives a warning
REAL = 1e-7  # relative imaginary part of a real eigenvalue


def modes(system: System, state: State, k: int) -> Modes:
    """The k lowest natural frequencies about a state (smallest real part of ``lambda``)."""
    # The eigenvalues of ``K x = lambda M x`` are the largest of ``(K + s M)^-1 M`` with a small
    # shift s. Solutions are refined by strains, and eigenvalues are quotients of sums of squared
    # strains: low (bending) frequencies are accurate although the highest eigenvalues are ``(L /
    # h)^4`` times larger. Without a potential they may be complex. Points that touch with friction
    # stick, also if they slip.
    system = system.after(state.memory).sticking()
    tangent = StrainTangent(system, state.u, state.load, state.t, state.multipliers)
    n, m = tangent.size
    if m and n <= DENSE:
        R = scipy.linalg.qr(tangent.J.toarray().T, mode="r")[0]
        refuse(np.min(np.abs(np.diag(R))) < 1e-12 * np.max(np.abs(R)),
               "the joints are dependent in this state", error=SupportError)
    M = _free_mass(system, tangent)
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
    """The k lowest angular frequencies (k,) and shapes (k, N) at rest, without rigid motions."""
    rigid = len(system.constraints.free_rigid_motions())
    found = modes(system, State(system, np.zeros(system.N), load=0.0), rigid + k)
    return found.frequencies[rigid:], found.shapes[rigid:]


def improved(system: System, shapes: Array) -> Array:
    """Frequencies (k,) at rest near those of approximate shapes (k, N), the lowest first."""
    # By two steps of subspace iteration.
    state = State(system, np.zeros(system.N), load=0.0)
    tangent = StrainTangent(system, state.u, 0.0, None, state.multipliers)
    M, X = _free_mass(system, tangent), shapes[:, tangent.free].T
    shift = _shift(tangent, state)
    tangent.balance(M, shift)
    inverse = Inverse(tangent, M, shift)
    for _ in range(2):
        values, X = _polished(tangent, M, inverse, X)
    return np.sign(values) * np.sqrt(np.abs(values))


def _warn_of_turning(state, values, rigid):
    """Give a ModelWarning if the state rotates at a speed comparable with a frequency."""
    system, speeds = state.system, [0.0]
    for member, s in zip(system.members, system.slices) if np.any(state.v) else ():
        # the mass-weighted angular velocity of a beam or body
        B, v = np.zeros((system.N, 3)), np.zeros(system.N)
        x, y = state.q[s].reshape(-1, 2).T
        B[s], v[s] = member.rigid_motions(), state.v[s]
        B[s, 2] = np.column_stack([-y, x]).ravel()
        MB = np.column_stack([system.mass.multiply(b) for b in B.T])
        speeds.append(abs(np.linalg.solve(B.T @ MB, MB.T @ v)[2]))
    speed = max(speeds)
    values = values[values > max(rigid, TURNING * speed**2)]  # of vibrations
    if values.size and speed**2 > TURNING * values.min():
        warn(f"the state rotates at {speed:.3g} rad/s, and modes neglect centrifugal and Coriolis "
             "forces, which change the square of a frequency by about the square of that speed. "
             "Use the state at rest in a rotating frame with the centrifugal force "
             "(docs/modes.md, Rotating beams)", ModelWarning)


def _free_mass(system, tangent):
    """The mass matrix of the free DOFs, sparse."""
    M = system.mass.tocsc().T  # symmetric: CSC to CSR without conversion
    return M[tangent.free][:, tangent.free] if len(tangent.free) < system.N else M


def _shift(tangent, state):
    """A shift s for which K + s M is positive definite between free DOFs."""
    shift = tangent.system.scales.bending_eigenvalue
    for _ in range(80):
        try:
            if _negative(tangent, state, shift) == 0:
                return shift
        except NO_FACTORS:
            pass
        shift *= 4.0
    raise SupportError("the joints are dependent in this state")


def _negative(tangent, state, shift):
    """Number of negative eigenvalues of K + shift M between free DOFs."""
    system = tangent.system
    if system.solver.condensed is not None:
        return tangent.condense(system.solver.condensed, shift).inertia().negative
    system.assemble(state.u, state.load, t=state.t)
    system.K.combine(1.0, system.K, shift, system.mass)
    if shift < 0.0 and not system.solver.coupled:  # mostly indefinite: no factors needed
        fix(system.K, system.constraints.fixed)
        return (system.K if system.symmetric else system.K.symmetric_part()).negative()
    system.solver.factorize(state.u, state._time, state.multipliers)
    return system.solver.inertia().negative


def _dense(tangent, M, k, shift):
    """The k lowest modes by dense eigenvalues of the inverse, in windows of its precision."""
    inverse, L = Inverse(tangent, M, shift), scipy.linalg.cholesky(M.toarray(), lower=True)
    X, values = np.zeros((len(L), 0)), np.zeros(0)
    while len(values) < k:
        MX = M @ X
        Y = inverse.solve(L - MX @ (X.T @ L))  # M-orthogonal to the known modes
        Y -= X @ (MX.T @ Y)
        T = L.T @ Y
        theta, V = scipy.linalg.eigh(0.5 * (T + T.T))
        seen = np.abs(theta) > WINDOW * np.abs(theta).max()
        theta, V = theta[seen], V[:, seen]
        lowest = np.argsort(1.0 / theta)[:k - len(values)]
        found, quotients = _quotients(tangent, M, (Y @ V / theta)[:, lowest])
        # round-off may reproduce known modes
        new = np.max(np.abs(MX.T @ found), axis=0, initial=0.0) < ORTHOGONAL
        refuse(not np.any(new), "only {} modes of so slender a beam exceed round-off, k = {} were "
               "requested", len(values), k)
        X = np.column_stack([X, found[:, new]])
        values = np.append(values, quotients[new])
    order = np.argsort(values)
    return values[order], X[:, order]


def _sparse(tangent, state, M, k, shift):
    """The k lowest modes by Lanczos on the inverse, and one step of subspace iteration."""
    # Lanczos may miss some of equal frequencies: they are counted, and the missing ones computed.
    inverse, rng = Inverse(tangent, M, shift), np.random.default_rng(0)
    start = inverse.solve(rng.standard_normal(M.shape[0]))
    apply = inverse.once if inverse.left < UNREFINED else inverse.solve
    values, X = _polished(tangent, M, inverse, _lanczos(M, k, shift, apply, start))
    while True:
        below = values[-1] - SAME * max(abs(values[-1]), shift)
        try:  # the number below the largest one found, by Sylvester's law of inertia
            missing = _negative(tangent, state, -below) - int(np.sum(values < below))
        except NO_FACTORS:
            missing = 1
        if missing <= 0:
            break

        def others(b, X=X, theta=1.0 / (values + shift)):
            return apply(b) - X @ (theta * (X.T @ b))

        start = others(rng.standard_normal(M.shape[0]))
        more = np.column_stack([X, _lanczos(M, min(missing, k), shift, others, start)])
        before, (values, X) = values, _polished(tangent, M, inverse, more)
        values, X = values[:k], X[:, :k]
        if not np.any(values < before - SAME * np.maximum(np.abs(before), shift)):
            break  # the count was round-off
    return values, X


def _lanczos(M, k, shift, apply, start):
    """The k lowest shapes, as columns; ``apply`` is the inverse of ``K + shift M``."""
    try:
        return eigsh(M, k=k, M=M, sigma=-shift, v0=start, tol=LANCZOS,
                     OPinv=LinearOperator(M.shape, apply, dtype=float))[1]
    except ArpackNoConvergence as failure:
        raise ConvergenceError(f"Lanczos found {len(failure.eigenvalues)} of {k} modes; try "
                               "another number") from None


def _quotients(tangent, M, X):
    """Columns X of unit modal mass, and their Rayleigh quotients."""
    X = X / np.sqrt(np.sum(X * (M @ X), axis=0))
    return X, tangent.energies(X)


def _polished(tangent, M, inverse, X):
    """Sorted eigenvalues and columns X after a step of subspace iteration."""
    MX = M @ X
    Y = inverse.solve(MX)
    theta, V = scipy.linalg.eigh(MX.T @ Y, X.T @ MX)
    X, values = _quotients(tangent, M, Y @ V / theta)
    order = np.argsort(values)
    return values[order], X[:, order]


def _unsymmetric(tangent, M, k, shift, small):
    """The k lowest modes of an unsymmetric K: complex values, shapes (n, k)."""
    inverse, n = Inverse(tangent, M, shift), M.shape[0]
    if small:
        theta, X = scipy.linalg.eig(inverse.solve(M.toarray()))
    else:
        start = np.random.default_rng(0).standard_normal(n)
        theta, X = eigs(LinearOperator(M.shape, lambda x: inverse.solve(M @ x), dtype=float),
                        k=min(k + 2, n - 2), v0=inverse.solve(start))
    seen = np.abs(theta) > WINDOW * np.abs(theta).max()
    refuse(np.sum(seen) < k, "only {} modes under follower loads exceed round-off, k = {} were "
           "requested", int(np.sum(seen)), k)
    values, X = 1.0 / theta[seen] - shift, X[:, seen]
    real = np.abs(values.imag) <= REAL * np.abs(values)
    values[real] = values[real].real
    order = np.lexsort((values.imag, values.real))[:k]
    values, X = values[order], X[:, order]
    if not np.any(values.imag):
        X = _real(X)
    return values, X / np.sqrt(np.sum(X.conj() * (M @ X), axis=0).real)


def buckling(system: System, k: int, state: State | None = None) -> Buckling:
    """The k lowest positive load factors of linear buckling."""
    # ``(K_0 + factor K_s) phi = 0``, with the geometric stiffness K_s of the linear stress under
    # full load, including support displacements and load stiffness. Factors with a prebuckling
    # strain of order one are omitted; without a potential, only real factors (divergence) are
    # found. With a state, whose loads are constant, K_0 is its tangent; otherwise that of the state
    # without loads, in which prestressed springs and energies that are not scaled may push.
    system.constraints.require_supports()
    state = state or _prestressed(system)
    system = system.after(system.histories.of_state(state))
    tangent, loads, du, stress, multipliers = _linear_response(system, state)
    n, m = tangent.size
    k = _count(k, n - m)
    Ks = loads.geometric(stress, multipliers, 1.0)
    for domain in system.domains:  # the derivative of its tangent along the response
        s, (i, j) = system.of(domain), domain.pattern
        h = SMALL * domain.size / max(np.max(np.abs(du[s])), np.finfo(float).tiny)
        change = (domain.stiffness(h * du[s]) - domain.stiffness(-h * du[s])) / (2.0 * h)
        K = sparse.csr_matrix((change, (s.start + i, s.start + j)), shape=(system.N, system.N))
        Ks = Ks + K[tangent.free][:, tangent.free]
    refuse(not Ks.nnz or not abs(Ks).max() > 0.0,
           "no positive load factor: the loads do not stress the beam")
    symmetric = is_symmetric(Ks, system.constraints.coordinate_sizes[tangent.free])
    theta, X = _buckled(tangent, Ks, k, symmetric)
    # mean prebuckling strain at the load factor 1
    strain = np.sqrt(max(float(du @ tangent.internal(stress)), 0.0)) * np.finfo(float).eps
    good = theta < -strain / system.scales.strain_noise
    refuse(not np.any(good), "no positive load factor: these loads stiffen the beam" if symmetric
           else "no real positive load factor: these follower loads have no potential, and no "
           "neighbouring equilibrium exists. Check for flutter with scene.modes(k, state) about "
           "states under load: modes.flutter is True beyond the critical load")
    factors = -1.0 / theta[good]
    order = np.argsort(factors)[:k]
    before = 0.0 * du if state is None else state.u
    at = before + factors[order[0]] * du
    system.forces.contacts.require_free(at, "buckling()",
                                        "continuation(): it touches before it buckles")
    _require_same_springs(system, before, at)
    _say_yielding(system, before, factors[order[0]] * du)
    if not symmetric:
        _require_no_flutter(system, tangent, Ks, factors[order[0]])
    shapes = np.zeros((len(order), system.N))
    shapes[:, tangent.free] = X[:, good].T[order]
    return Buckling(factors[order], shapes, not symmetric)


def _linear_response(system, state):
    """Tangents with the loads before, and with those of the system; the response to these."""
    if state is None:
        zero, none = np.zeros(system.N), np.zeros(system.constraints.m)
        tangent = StrainTangent(system, zero, 0.0, None, none)
        return tangent, tangent, *tangent.response()
    refuse(not np.array_equal(state.system.constraints.fixed, system.constraints.fixed),
           "the state has other supports than the scene: buckling() adds loads to those of the "
           "state, and supports and joints stay")
    refuse(state.stability == "unstable", "the state is unstable: its own loads are beyond the "
           "buckling load" if state.load else "the scene is unstable before there is any load: "
           "what load factors do not scale is beyond the buckling load")
    tangent = StrainTangent(state.system.after(state.memory), state.u, state.load, state.t,
                            state.multipliers)
    loads = StrainTangent(system, state.u, 0.0, None, state.multipliers)
    return tangent, loads, *tangent.response(system.external_force(state.u))


def _prestressed(system):
    """The equilibrium without loads if force elements push then, or None."""
    zero, c = np.zeros(system.N), system.constraints
    if not len(system.forces.elements):
        return None
    push = np.abs(system.internal_force(zero, 0.0, 0.0) * c.mask).max()
    springs = abs(system.element_stiffness())
    if push <= UNSTRESSED * (springs.max() if springs.nnz else 0.0) * system.size:
        return None
    refuse(c.moves or c.drives, "springs or energies push before there is any load, and supports "
           "move: buckling() starts from the equilibrium without loads, and knows one of them. Use "
           "state.stability of scene.solve_static(stable=False), or scene.modes(k, state)")
    search = Search(system, None, None, Steps("newton", 1e-8, 30, 1.0, 1e-4), False, False)
    search.route = Route(zero, loads=(0.0, 0.0), times=(0.0, 0.0))
    with retold(LoadStepFailed, "no equilibrium without loads was found for what springs and "
                "energies push then: {error}. Give buckling() a state"):
        found = search.load_steps("newton")
    return State(system, found.u, 0.0, found.force, multipliers=found.multipliers)


def _require_same_springs(system, before, u):
    """Raise InputError for one-sided springs at the buckling state u; warn of changed stiffness."""
    if not len(system.forces.elements):
        return
    kick = ASIDE * np.random.default_rng(0).uniform(-1.0, 1.0, system.N) * system.constraints.mask
    kick *= system.constraints.coordinate_sizes
    tables, forces = system.backend.tables.plain.forces, system.forces
    rest, here, up, down = (
        np.array([np.linalg.norm(D[numbers], 2) for numbers in forces.blocks])
        for x in (before, u, u + kick, u - kick)
        for D in [forces.stiffness(tables, 0.0, x, 0.0 * x, 0.0)])
    refuse(np.any(np.abs(up - down) > STIFFER * np.maximum(up, down)), "at the buckling load "
           "springs or foundations are stiffer to one side than to the other, such as ropes and "
           "one-sided foundations: buckling() needs one stiffness. Use scene.continuation() with a "
           "small force to either side, or remove loose elements")
    if np.any(np.abs(here - rest) > STIFFER * np.maximum(here, rest)):
        warn("springs become stiffer or softer before buckling, but buckling() uses their "
             "stiffness without load: check state.stability of scene.solve_static()", ModelWarning)


def _say_yielding(system, before, du):
    """Warn of materials with a history that are not elastic up to the linear response du."""
    for beam, s in zip(system.beams, system.slices):
        for e in system.histories.kernel(beam).elements:
            if isinstance(e, ElementsWithHistory):
                E, up, down = (e.strain_at((before + x * SMALL * du)[s]) for x in (0.0, 1.0, -1.0))
                E += (up - down) / (2.0 * SMALL)
                S, elastic = (x.evaluate(E, 0.0)[0] for x in (e, e.elastic_from(before[s])))
                if np.max(np.abs(S - elastic)) > STIFFER * np.max(np.abs(elastic)):
                    warn(f"{beam!r} yields before the buckling load, which is that of its elastic "
                         "stiffness: bifurcations of scene.continuation() have the load of what "
                         "yields", ModelWarning)
                    return


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
        except ArpackNoConvergence as failure:  # fewer negative ones exist
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
    """Raise InputError if linear theory predicts flutter below a load factor."""
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
            except ConvergenceError:  # a critical point to round-off
                continue
            refuse(np.any(values.imag), "flutter occurs before buckling at the factor {:.6g}, for "
                   "example at {:.3g} times these follower loads: use scene.modes(k, state) about "
                   "states under load, and their modes.flutter", factor, part)
    finally:
        tangent.S = S


def _real(X):
    """Rotate complex columns so that the largest entry is real."""
    X = X * np.exp(-1j * np.angle(X[np.argmax(np.abs(X), axis=0), np.arange(X.shape[1])]))
    return X.real


def _count(k, n):
    refuse(n == 0, "there are no modes: supports and joints fix all degrees of freedom")
    return require_integer("the number of modes", k, 1, n)
