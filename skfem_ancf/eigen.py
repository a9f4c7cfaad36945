"""Natural frequencies about a state, and linear buckling loads."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from .errors import InputError, SupportError
from .results import State

DENSE = 600  # free coordinates up to which the dense solver is used


@dataclass
class Modes:
    """Natural frequencies and shapes, the lowest first.

    Attributes
    ----------
    frequencies
        Angular frequencies in rad/s, shape (k,); imaginary parts of unstable motions as
        negative numbers.
    shapes
        Displacements of the coordinates, shape (k, N), of unit modal mass.
    state
        The state about which the beam vibrates.
    """

    frequencies: np.ndarray
    shapes: np.ndarray
    state: State

    def mode(self, i, amplitude):
        """The state displaced by ``amplitude`` times shape ``i``, to plot or save."""
        return State(self.state.system, self.state.u + amplitude * self.shapes[i],
                     load=self.state.load, message=f"mode {i}")


@dataclass
class Buckling:
    """Load factors at which the stress-free state loses stability, the lowest first.

    Attributes
    ----------
    factors
        Multiples of the loads of the scene, shape (k,).
    shapes
        Displacements of the coordinates, shape (k, N).
    """

    factors: np.ndarray
    shapes: np.ndarray


def modes(system, state, k):
    """The k lowest natural frequencies about a state, prestress and joints included.

    Raises
    ------
    InputError
        If k is out of range.
    """
    t = state.load if state.t is None else state.t
    system.assemble(state.u, state.load, t=state.t)
    K, M = system.K.tocsc() + system.curvature(state.u, t, state.multipliers), system.mass.tocsc()
    J = system.jacobian(state.u, t)
    values, shapes = _lowest(K, M, J, system.free, k)
    return Modes(np.sign(values) * np.sqrt(np.abs(values)), shapes, state)


def buckling(system, k):
    """The k lowest positive load factors of linear buckling.

    ``(K_0 + factor K_s) phi = 0``, K_s the geometric part for the stress that the full load, moved
    supports included, causes in the stress-free geometry, less the stiffness of the loads. Factors
    at which the mean strain before buckling is not below one are left out.

    Raises
    ------
    InputError
        If k is out of range or the loads do not buckle the beam.
    """
    system.require_supports()
    zero, none = np.zeros(system.N), np.zeros(system.m)
    _, evaluations = system.assemble(zero, 0.0)
    K0 = system.K.tocsc()
    system.factorize(zero, 0.0, none)
    du0 = np.zeros(system.N)
    du0[system.fixed] = system.values(1.0)
    du, multipliers = system.solve(system.external_force(zero) - K0 @ du0,
                                   -system.constraint(du0, 1.0))
    du += du0
    carried = system.stress_step(evaluations, du)
    system.assemble(zero, 1.0, carried)
    Ks = system.K.tocsc() + system.curvature(zero, 0.0, multipliers) - K0
    J = system.jacobian(zero, 0.0)
    # K_s phi = -1/factor K_0 phi: the most negative ones
    free = np.nonzero(system.free)[0]
    Z = _null_space(J[:, free])
    if Z is None and len(free) > DENSE:
        lu = splu(K0[free][:, free].tocsc())
        A = K0[free][:, free]
        theta, X = eigsh(Ks[free][:, free], k=_count(k, len(free)), M=A, which="SA",
                         Minv=LinearOperator(A.shape, lu.solve))
    else:
        A, B = (_reduced(S, free, Z) for S in (Ks, K0))
        theta, X = scipy.linalg.eigh(A, B, subset_by_index=[0, _count(k, len(A)) - 1])
        X = X if Z is None else Z @ X
    # square roots of the energies of the strain before buckling and of a strain of one
    smallest = np.sqrt(max(du @ (K0 @ du), 0.0)) * np.finfo(float).eps / system.stiffness_scale
    good = theta < -smallest
    if not np.any(good):
        raise InputError("no positive load factor: these loads pull the beam straight")
    order = np.argsort(-1.0 / theta[good])
    shapes = np.zeros((int(good.sum()), system.N))
    shapes[:, free] = X[:, good].T[order]
    return Buckling((-1.0 / theta[good])[order], shapes)


def _count(k, n):
    if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or not 1 <= k <= n:
        raise InputError(f"the number of modes must be an integer from 1 to {n}, got {k!r}")
    return int(k)


def _null_space(J):
    if not len(J):
        return None
    q, r = scipy.linalg.qr(J.T)
    if np.min(np.abs(np.diag(r))) < 1e-12 * np.max(np.abs(r)):
        raise SupportError("the joints are not independent in this state")
    return q[:, len(J):]


def _reduced(S, free, Z):
    A = S[free][:, free].toarray()
    A = A if Z is None else Z.T @ A @ Z
    return 0.5 * (A + A.T)


def _lowest(K, M, J, free, k):
    """The k lowest eigenvalues of K x = w M x on the free coordinates and J x = 0."""
    free = np.nonzero(free)[0]
    n = len(free) - len(J)
    k = _count(k, n)
    if n <= DENSE or k > n // 2:
        Z = _null_space(J[:, free])
        values, X = scipy.linalg.eigh(_reduced(K, free, Z), _reduced(M, free, Z),
                                      subset_by_index=[0, k - 1])
        X = X if Z is None else Z @ X
    else:
        A, B = K[free][:, free], M[free][:, free]
        # below the lowest eigenvalue of a stable state, so that rigid motions are no trouble
        shift = -1e-6 * abs(A.diagonal() / B.diagonal()).min()
        Jf = sparse.csr_matrix(J[:, free])
        lu = splu(sparse.bmat([[A - shift * B, Jf.T], [Jf, None]], format="csc")
                  if len(J) else (A - shift * B).tocsc())
        rest = np.zeros(len(J))

        def inverse(b):
            return lu.solve(np.append(b, rest))[:len(free)]

        start = inverse(B @ np.ones(len(free)))
        values, X = eigsh(A, k=k, M=B, sigma=shift, v0=start,
                          OPinv=LinearOperator(A.shape, inverse))
    order = np.argsort(values)
    shapes = np.zeros((k, K.shape[0]))
    shapes[:, free] = X.T[order]
    return values[order], shapes
