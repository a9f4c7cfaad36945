"""The strain energy of the shear-rigid cable, with the interface of the kernel of a beam.

``U = 1/2 int E A eps^2 + E I (kappa - kappa_0)^2 ds`` with ``eps = |r'| - 1`` and the material
curvature ``kappa = r' x r'' / |r'|^2``, the rate at which the tangent turns along the stress-free
axis. Both are sampled at 2 m - 2 Gauss points of an axis of degree 2 m - 1; for the cubic axis
the mode of equal slopes that this leaves is stabilised.
"""

import numpy as np

from .errors import InputError
from .kernel import Chain, append_square_root, writable
from .quadrature import gauss

_J = np.array([[0.0, 1.0], [-1.0, 0.0]])  # a x b = a . _J b


def cross(a, b):
    """The out-of-plane component of a x b, along the last axis."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def turned(a):
    """a turned by -90 degrees, so that turned(b) is the derivative of a x b by a."""
    return np.stack([a[..., 1], -a[..., 0]], -1)


class CableEvaluation:
    """As :class:`~skfem_ancf.kernel.Evaluation`."""

    __slots__ = ("force", "tangent", "strains", "stresses", "_kernel", "_B", "_elements")

    def carry(self, du):
        """Normal force and moment, linearised; a list with one array (2, ne, np)."""
        d = self._kernel.strain_increment(self._B, du, self._elements)
        return [self.stresses[0] + self._kernel.stiffness[:, None, None] * d]


class CableKernel(Chain):
    """Energy, force and tangent of a cable.

    Parameters
    ----------
    mesh, element, material
        The body, an ``ElementBeamCable`` and a material, of which E and nu are used.
    width
        Width of the section.
    formulation
        "assumed" samples at 2 m - 2 Gauss points, any other at 2 m.
    """

    def __init__(self, mesh, element, material, width, formulation):
        super().__init__(mesh, element)
        if element.axis_degree > 5 and not mesh.is_straight:
            raise InputError(f"a cable of degree {element.axis_degree} needs a straight mesh: use "
                             "degree 5 on a curve")
        m = element.nodal_dofs
        E = material.E / (1.0 if material.plane == "stress" else 1.0 - material.nu**2)
        area = width * mesh.height
        self.stiffness = np.array([E * area, E * area * mesh.height**2 / 12.0])
        # 2 m - 2 points miss one mode of an element: for degree 3 it is stabilised, above it is
        # held where two elements meet
        n = 2 * m - 2 + (m > 2 and mesh.nelements == 1) if formulation.name == "assumed" else 2 * m
        xi, w = gauss(n)
        powers = np.tile(np.arange(m), 2)
        scale = mesh.lengths[:, None] ** powers
        same = mesh.is_uniform or np.ptp(mesh.lengths) <= 1e-13 * np.max(mesh.lengths)
        if same:
            scale = scale[:1]
        L = scale[:, 1] if m > 1 else mesh.lengths
        tables = [element.axis(xi, d).T for d in (1, 2)]
        self.G1 = tables[0] * scale[:, None, :] / L[:, None, None]
        self.G2 = tables[1] * scale[:, None, :] / L[:, None, None] ** 2
        self.w = w * L[:, None]
        self.points_number, self.shared = n, same
        mapping, X = mesh.mapping(), np.array([xi, 0.5 + 0.0 * xi])
        q0 = element.rigid(mesh)
        q0[0] = mesh.p - mesh.p.mean(axis=1, keepdims=True)
        q0 = np.ascontiguousarray(q0.transpose(2, 0, 1)).ravel()
        if mesh.is_straight:
            self.a0 = np.moveaxis(mapping.frame(X), 0, -1)[0]
            self.b0 = np.zeros_like(self.a0)
        else:
            q_e = self.gather(q0)
            self.a0, self.b0 = self.G1 @ q_e, self.G2 @ q_e
        self.a0, self.b0 = np.ascontiguousarray(self.a0), np.ascontiguousarray(self.b0)
        self.G1, self.G2 = np.ascontiguousarray(self.G1), np.ascontiguousarray(self.G2)
        self.s0 = np.sum(self.a0**2, axis=-1)
        self.kappa0 = cross(self.a0, self.b0) / self.s0
        self.volume = float(np.sum(self.w)) * (mesh.nelements if same else 1) * area
        self.constant = (formulation.stabilisation(mesh, element, material, width)
                         if m == 2 and formulation.name == "assumed" else None)

    def _packs(self):
        constant = np.zeros((0, 1, 1)) if self.constant is None else self.constant
        return [writable(self.G1, self.G2, self.a0, self.b0, self.s0, self.kappa0, self.w,
                         self.stiffness, constant, self.t[0].astype(np.int64)) + (self.nd,)]

    def _part(self, table, elements):
        return table[elements] if len(table) > 1 else table

    def _state(self, u_e, elements):
        """Derivatives a = r', b = r'' with their displacement parts, at the points."""
        p = self._part
        du1, du2 = p(self.G1, elements) @ u_e, p(self.G2, elements) @ u_e
        return p(self.a0, elements) + du1, p(self.b0, elements) + du2, du1

    def _strain(self, state, elements):
        a, b, du1 = state
        p = self._part
        s = np.sum(a * a, axis=-1)
        root, root0 = np.sqrt(s), np.sqrt(p(self.s0, elements))
        # (|a| - |a0|) without cancellation
        eps = np.sum((a + p(self.a0, elements)) * du1, axis=-1) / (root + root0)
        return np.array([eps, cross(a, b) / s - p(self.kappa0, elements)]), s

    def strain(self, u_e, elements=slice(None)):
        """Extension and change of curvature at the integration points, shape (2, ne, np)."""
        return self._strain(self._state(u_e, elements), elements)[0]

    @staticmethod
    def _rates(a, b, s, kappa):
        """Derivatives of eps by a, and of kappa by a and b, shape (ne, np, 2)."""
        e_a = a / np.sqrt(s)[..., None]
        k_a = (turned(b) - 2.0 * kappa[..., None] * a) / s[..., None]
        return e_a, k_a, -turned(a) / s[..., None]

    def strain_increment(self, rates, du, elements):
        """The strain's derivative in the direction du, (2, ne, np)."""
        e_a, k_a, k_b = rates
        d1, d2 = (self._part(G, elements) @ du for G in (self.G1, self.G2))
        return np.array([np.sum(e_a * d1, axis=-1),
                         np.sum(k_a * d1, axis=-1) + np.sum(k_b * d2, axis=-1)])

    def evaluate(self, u_e, elements=slice(None), tangent=True, carried=None, geometric=True):
        """As :meth:`skfem_ancf.kernel.Kernel.evaluate`."""
        p, out = self._part, CableEvaluation()
        G1, G2, w = p(self.G1, elements), p(self.G2, elements), p(self.w, elements)
        state = self._state(u_e, elements)
        a, b, _ = state
        strain, s = self._strain(state, elements)
        kappa = strain[1] + p(self.kappa0, elements)
        N, M = stress = self.stiffness[:, None, None] * strain
        e_a, k_a, k_b = rates = self._rates(a, b, s, kappa)
        out._kernel, out._B, out._elements = self, rates, elements
        out.strains, out.stresses = [strain], [stress]
        n, m = (w * N)[..., None], (w * M)[..., None]
        out.force = (G1.transpose(0, 2, 1) @ (n * e_a + m * k_a)
                     + G2.transpose(0, 2, 1) @ (m * k_b))
        out.tangent = None
        if tangent:
            B, CB = self._rows(G1, G2, w, rates)
            K = B.transpose(0, 2, 1) @ CB
            if geometric:
                K += self._geometric(carried[0] if carried else stress, a, b, s, kappa, G1, G2, w)
            out.tangent = K
        if self.constant is not None:
            constant = p(self.constant, elements)
            out.force = out.force + (constant @ u_e.reshape(len(u_e), -1, 1)).reshape(u_e.shape)
            if tangent:
                out.tangent += constant
        return out

    def factors(self, u_e, elements=slice(None)):
        """As :meth:`skfem_ancf.kernel.Kernel.factors`."""
        p = self._part
        G1, G2, w = p(self.G1, elements), p(self.G2, elements), p(self.w, elements)
        state = self._state(u_e, elements)
        strain, s = self._strain(state, elements)
        kappa = strain[1] + p(self.kappa0, elements)
        B, CB = ([part] for part in self._rows(G1, G2, w, self._rates(*state[:2], s, kappa)))
        N, M = w * self.stiffness[:, None, None] * strain
        stress = [np.stack([N, M], axis=2).reshape(len(u_e), -1)]
        if self.constant is not None:
            append_square_root(self.constant, u_e, elements, B, CB, stress)
        return tuple(np.concatenate(part, axis=1) for part in (B, CB, stress))

    def geometric(self, u_e, elements, stress):
        """As :meth:`skfem_ancf.kernel.Kernel.geometric`."""
        p = self._part
        G1, G2, w = p(self.G1, elements), p(self.G2, elements), p(self.w, elements)
        state = self._state(u_e, elements)
        strain, s = self._strain(state, elements)
        own = stress[:, :2 * w.shape[1]].reshape(len(u_e), -1, 2)
        return self._geometric(np.moveaxis(own, -1, 0) / w, *state[:2], s,
                               strain[1] + p(self.kappa0, elements), G1, G2, w)

    def _rows(self, G1, G2, w, rates):
        """The strains' derivatives B by the coordinates, and the weighted stiffnesses times B."""
        e_a, k_a, k_b = rates
        B = np.zeros(e_a.shape[:2] + (2, self.nd, 2))  # (ne, np, eps or kappa, nb, 2)
        B[:, :, 0] = G1[..., None] * e_a[:, :, None]
        B[:, :, 1] = G1[..., None] * k_a[:, :, None] + G2[..., None] * k_b[:, :, None]
        B = B.reshape(len(e_a), -1, 2 * self.nd)
        return B, (w[..., None] * self.stiffness).reshape(len(w), -1, 1) * B

    def _geometric(self, stress, a, b, s, kappa, G1, G2, w):
        """int N d^2 eps + M d^2 kappa."""
        N, M = (w * x for x in stress)
        root = np.sqrt(s)
        normal, c_a = turned(a) / root[..., None], turned(b)
        aa = (N / root)[..., None, None] * normal[..., :, None] * normal[..., None, :]
        mixed = c_a[..., :, None] * a[..., None, :]
        c = (kappa * s)[..., None, None]
        s2 = s[..., None, None]
        aa = aa + M[..., None, None] * (
            -2.0 / s2**2 * (mixed + np.swapaxes(mixed, -1, -2) + c * np.eye(2))
            + 8.0 * c / s2**3 * a[..., :, None] * a[..., None, :])
        outer = a[..., :, None] * turned(a)[..., None, :]
        ab = M[..., None, None] * (_J / s2 + 2.0 / s2**2 * outer)

        def block(G, T, H):
            """sum_p G[p, k] T[p, i, j] H[p, l] as (ne, 2 nb, 2 nb)."""
            TH = T[:, :, :, None, :] * H[:, :, None, :, None]  # (ne, np, 2, nb, 2)
            ne, n = TH.shape[:2]
            K = G.transpose(0, 2, 1) @ TH.reshape(ne, n, -1)  # (ne, nb, 2 * nb * 2)
            return K.reshape(ne, 2 * self.nd, 2 * self.nd)

        K = block(G1, ab, G2)
        return block(G1, aa, G1) + K + K.transpose(0, 2, 1)

    def element_energies(self, u_e, elements=slice(None)):
        """As :meth:`skfem_ancf.kernel.Kernel.element_energies`."""
        strain, _ = self._strain(self._state(u_e, elements), elements)
        density = 0.5 * np.tensordot(self.stiffness, strain**2, 1)
        return (np.sum(self._part(self.w, elements) * density, axis=1)
                + self.held_energies(u_e, elements))

    def strains(self, u):
        """What :meth:`mean_force` wants of the start of a step; None if it is not needed."""
        if self.compiled is not None:
            return None
        out = []
        for part in self.chunks():
            state = self._state(self.gather(u, part), part)
            out.append((state, *self._strain(state, part)))
        return out

    def mean_force(self, u0, u1, strains0):
        """A force whose work from u0 to u1 is the change of the energy, shape (N,).

        eps and kappa are not quadratic in the coordinates; their changes are still linear in the
        step: ``d eps = (a0 + a1) . da / (|a0| + |a1|)`` and, from ``s kappa = a x b``,
        ``mean(s) d kappa = d(a x b) - mean(kappa) ds``.
        """
        if self.compiled is not None:
            return self.compiled.mean_force(self.checked(u0), self.checked(u1))
        out = np.zeros(self.N)
        for part, (old, strain0, s0) in zip(self.chunks(), strains0):
            p = self._part
            u_e = self.gather(u1, part)
            new = self._state(u_e, part)
            strain1, s1 = self._strain(new, part)
            a, b = 0.5 * (old[0] + new[0]), 0.5 * (old[1] + new[1])
            N, M = self.stiffness[:, None, None] * 0.5 * (strain0 + strain1) * p(self.w, part)
            kappa = 0.5 * (strain0[1] + strain1[1]) + p(self.kappa0, part)
            s = 0.5 * (s0 + s1)[..., None]
            e_a = 2.0 * a / (np.sqrt(s0) + np.sqrt(s1))[..., None]
            k_a = (turned(b) - 2.0 * kappa[..., None] * a) / s
            force = (p(self.G1, part).transpose(0, 2, 1) @ (N[..., None] * e_a + M[..., None] * k_a)
                     + p(self.G2, part).transpose(0, 2, 1) @ (M[..., None] * -turned(a) / s))
            if self.constant is not None:
                middle = 0.5 * (u_e + self.gather(u0, part))
                force += (p(self.constant, part) @ middle.reshape(len(u_e), -1, 1)
                          ).reshape(u_e.shape)
            self.scatter(force, part, out)
        return out

    def inverted(self, u):
        """False: a cable has no section to turn inside out."""
        return False

    # fields

    def section(self, u, xi, tind, mesh, element):
        """Tangent, stretch and curvature at points xi of elements: for the fields of the body.

        Returns
        -------
        tangent, tangent0
            Unit tangents now and in the stress-free state, shape (2, ne, np).
        eps, kappa
            Extension and change of curvature, shape (ne, np).
        """
        t = self.t if tind is None else self.t[:, tind]
        L = (mesh.lengths if tind is None else mesh.lengths[tind])
        xi = np.broadcast_to(xi, (t.shape[1],) + np.shape(xi)[-1:])
        scale = L[:, None] ** np.tile(np.arange(element.nodal_dofs), 2)
        u_e = self.gather(u, slice(None) if tind is None else tind)
        G1, G2 = (np.moveaxis(element.axis(xi, d), 0, -1) * scale[:, None, :]
                  / L[:, None, None] ** d for d in (1, 2))
        q = element.rigid(mesh)
        q[0] = mesh.p
        q = np.moveaxis(q, -1, 0)
        q_e = np.concatenate([q[t[0]], q[t[1]]], axis=1)
        a0, b0 = G1 @ q_e, (0.0 if mesh.is_straight else 1.0) * (G2 @ q_e)
        a, b = a0 + G1 @ u_e, b0 + G2 @ u_e
        s0, s = np.sum(a0**2, axis=-1), np.sum(a**2, axis=-1)
        eps = np.sum((a + a0) * (a - a0), axis=-1) / (np.sqrt(s) + np.sqrt(s0))
        tangent, tangent0 = (np.moveaxis(x / np.sqrt(y)[..., None], -1, 0)
                             for x, y in ((a, s), (a0, s0)))
        return tangent, tangent0, eps, cross(a, b) / s - cross(a0, b0) / s0
