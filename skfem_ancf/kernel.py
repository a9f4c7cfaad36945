"""The fused evaluation of strain energy, internal force and tangent.

The weak forms of :mod:`skfem_ancf.forms` say what is computed; this module computes the same for
all elements of a beam at once, from tables of the derivatives of the local functions in the
beam's own frame. Straight elements of one length share one table.

Everything is a function of the displacement ``u = q - q0`` of the coordinates: the gradient is
``r_X = e_1 + G u``, and ``eps_xx = (e_1 + G u / 2) . G u`` has no cancellation where displacements
are small, nor far from the origin.
"""

from dataclasses import dataclass

import numpy as np

from .errors import InputError
from .materials import LinearLaw
from .quadrature import tensor
from .switch import compiled_off

#: Elements evaluated together; keeps the work arrays in cache and the memory bounded.
CHUNK = 1024


def writable(*arrays):
    """The arrays, contiguous and writable: Numba takes those that are not for other types."""
    return tuple(np.require(a, requirements=["C", "W"]) for a in arrays)


def beam_gradients(mesh, element, X, tind=None):
    """Derivatives of the local functions along the axis and across the section.

    Parameters
    ----------
    mesh, element
        A MeshBeam and a scalar beam element.
    X
        Reference points, shape (2, npoints).
    tind
        Elements, or None for all.

    Returns
    -------
    G : ndarray
        Shape (2, nelements, npoints, 2 nodal_dofs).
    frame : ndarray
        The beam's frame, transposed to (2, nelements, npoints, 2): e_1 and e_2.
    """
    mapping = mesh.mapping()
    frame = mapping.frame(X, tind)
    grad = np.array([element.gbasis(mapping, X, i, tind)[0].grad
                     for i in range(2 * element.nodal_dofs)])
    G = np.einsum("jkep,ijep->kepi", frame, grad, optimize=True)
    # the positions of both nodes together are a translation: exactly, or round-off resists it
    G[..., element.nodal_dofs] = -G[..., 0]
    return np.ascontiguousarray(G), np.ascontiguousarray(np.moveaxis(frame, 0, -1))


class Evaluation:
    """What one evaluation found: element forces and tangents, and what :meth:`carry` needs."""

    __slots__ = ("force", "tangent", "strains", "stresses", "_gradients", "_tables")

    def carry(self, du):
        """Stresses S + D B du for element displacement increments du (ne, nb, 2), by term."""
        out = []
        for t, g, eps, S in zip(self._tables, self._gradients, self.strains, self.stresses):
            d = t.strain_increment(g, du)
            out.append(S + (np.tensordot(t.law.D, d, 1) if isinstance(t.law, LinearLaw) else
                            np.einsum("abep,bep->aep", t.law.moduli(eps), d)))
        return out


@dataclass
class _Rows:
    """Where one strain component is sampled, and how it gets to the integration points."""

    x: object  # rows of the table of d/dX, None if not needed
    y: object
    matrix: object  # (integration points, samples), None for the identity


class TermTables:
    """The tables of one :class:`~skfem_ancf.formulations.Term` on a mesh and element."""

    def __init__(self, mesh, element, term, width):
        self.law = term.law
        self.nb = 2 * element.nodal_dofs
        xi_x = np.unique(np.concatenate([term.nodes("xx"), term.nodes("xy")]))
        xi_y = np.unique(np.concatenate([term.nodes("yy"), term.nodes("xy")]))
        eta = term.section_nodes
        self.section_points = len(term.section[0])
        ns = len(eta)
        same = mesh.is_uniform
        tind = np.array([0]) if same else None
        self.shared = same

        def table(xi, k):
            X, _ = tensor((xi, np.ones(len(xi))), (eta, np.ones(ns)))
            G, frame = beam_gradients(mesh, element, X, tind)
            return np.ascontiguousarray(G[k]), np.ascontiguousarray(frame[k])

        self.Gx, self.e1 = table(xi_x, 0)
        self.Gy, self.e2 = table(xi_y, 1)

        def rows(of, xi):
            if len(of) == len(xi):
                return slice(None)
            return (np.searchsorted(xi, of)[:, None] * ns + np.arange(ns)).ravel()

        def component(name):
            return _Rows(rows(term.nodes(name), xi_x) if name != "yy" else None,
                         rows(term.nodes(name), xi_y) if name != "xx" else None,
                         term.matrix(name))

        self.xx, self.yy, self.xy = map(component, ("xx", "yy", "xy"))
        self.interpolation = [
            np.eye(len(of)) if matrix is None else matrix for matrix, of in (
                (term.interpolation(c, term.axis[0]) if term.section_samples is None else
                 term.matrix(c), term.axis[0]) for c in ("xx", "yy", "xy"))]
        X, W = term.quadrature
        self.points = X
        self.w = width * W * mesh.mapping().detDF(X, tind)
        if same:
            self._pairs = self._pair_tables()

    def pack(self, constant, left, nd):
        """The tables in the order that :mod:`skfem_ancf.compiled` takes."""
        n = [self.Gx.shape[1], self.Gy.shape[1]]
        where = [np.arange(size, dtype=np.int64)[rows] for rows, size in (
            (self.xx.x, n[0]), (self.yy.y, n[1]), (self.xy.x, n[0]), (self.xy.y, n[1]))]
        return writable(self.Gx, self.Gy, self.e1, self.e2, self.w, self.law.D, *where,
                        *self.interpolation, constant, left) + (nd,)

    def _pair_tables(self):
        """G_a G_b of each sample, for the geometric part of the tangent, (samples, nb^2)."""
        def pairs(A, B):
            return (A[0][:, :, None] * B[0][:, None, :]).reshape(A.shape[1], -1)

        shear = pairs(self.Gx[:, self.xy.x], self.Gy[:, self.xy.y])
        nb = self.nb
        shear = shear.reshape(-1, nb, nb)
        shear = (shear + shear.transpose(0, 2, 1)).reshape(len(shear), -1)
        return np.concatenate([pairs(self.Gx[:, self.xx.x], self.Gx[:, self.xx.x]),
                               pairs(self.Gy[:, self.yy.y], self.Gy[:, self.yy.y]), shear])

    def part(self, elements):
        """The same tables for a slice of the elements."""
        if self.shared:
            return self
        other = object.__new__(TermTables)
        other.__dict__.update(self.__dict__)
        other.Gx, other.Gy, other.w = self.Gx[elements], self.Gy[elements], self.w[elements]
        other.e1, other.e2 = self.e1[elements], self.e2[elements]
        return other

    # strain

    def gradients(self, u):
        """Displacement gradients and position gradients of element displacements (ne, nb, 2)."""
        ux, uy = self.Gx @ u, self.Gy @ u
        return ux, uy, self.e1 + ux, self.e2 + uy

    @staticmethod
    def _to_points(rows, values):
        return values if rows.matrix is None else values @ rows.matrix.T

    @staticmethod
    def _to_samples(rows, values):
        return values if rows.matrix is None else values @ rows.matrix

    def strain(self, gradients):
        """(eps_xx, eps_yy, 2 eps_xy) at the integration points, shape (3, ne, np)."""
        ux, uy, rx, ry = gradients
        xx = 0.5 * np.einsum("epi,epi->ep", rx[:, self.xx.x] + self.e1[:, self.xx.x],
                             ux[:, self.xx.x])
        yy = 0.5 * np.einsum("epi,epi->ep", ry[:, self.yy.y] + self.e2[:, self.yy.y],
                             uy[:, self.yy.y])
        xy = (np.einsum("epi,epi->ep", rx[:, self.xy.x], uy[:, self.xy.y])
              + np.einsum("epi,epi->ep", ux[:, self.xy.x],
                          np.broadcast_to(self.e2[:, self.xy.y], ux[:, self.xy.x].shape)))
        return np.array([self._to_points(self.xx, xx), self._to_points(self.yy, yy),
                         self._to_points(self.xy, xy)])

    def strain_increment(self, gradients, du):
        """The strain's derivative in the direction du, at given gradients; (3, ne, np)."""
        _, _, rx, ry = gradients
        dx, dy = self.Gx @ du, self.Gy @ du
        xx = np.einsum("epi,epi->ep", rx[:, self.xx.x], dx[:, self.xx.x])
        yy = np.einsum("epi,epi->ep", ry[:, self.yy.y], dy[:, self.yy.y])
        xy = (np.einsum("epi,epi->ep", rx[:, self.xy.x], dy[:, self.xy.y])
              + np.einsum("epi,epi->ep", ry[:, self.xy.y], dx[:, self.xy.x]))
        return np.array([self._to_points(self.xx, xx), self._to_points(self.yy, yy),
                         self._to_points(self.xy, xy)])

    def inverted(self, gradients):
        """True if the body is turned inside out at a sample: det F is not positive."""
        _, _, rx, ry = gradients
        rx, ry = rx[:, self.xy.x], ry[:, self.xy.y]
        return not np.all(rx[..., 0] * ry[..., 1] > rx[..., 1] * ry[..., 0])

    def shortest(self, u):
        """Smallest stretch of the fibres along the axis, where eps_xx is sampled."""
        rx = (self.e1 + self.Gx @ u)[:, self.xx.x]
        return np.sqrt(np.min(np.sum(rx * rx, axis=-1)))

    # force and tangent

    def force(self, gradients, stress):
        """Element forces B^T (w S), shape (ne, nb, 2)."""
        _, _, rx, ry = gradients
        sxx, syy, sxy = (self._to_samples(rows, self.w * s)[..., None]
                         for rows, s in zip((self.xx, self.yy, self.xy), stress))
        Tx, Ty = np.zeros_like(rx), np.zeros_like(ry)
        Tx[:, self.xx.x] = sxx * rx[:, self.xx.x]
        Ty[:, self.yy.y] = syy * ry[:, self.yy.y]
        Tx[:, self.xy.x] += sxy * ry[:, self.xy.y]
        Ty[:, self.xy.y] += sxy * rx[:, self.xy.x]
        return (self.Gx.transpose(0, 2, 1) @ Tx) + (self.Gy.transpose(0, 2, 1) @ Ty)

    def strain_matrix(self, gradients):
        """B: the derivative of the strain by the coordinates, shape (ne, 3, np, 2 nb)."""
        _, _, rx, ry = gradients
        ne, nb = len(rx), self.nb
        B = np.empty((ne, 3, self.w.shape[1], 2 * nb))

        def fill(k, rows, value):
            value = value.reshape(ne, -1, 2 * nb)
            B[:, k] = value if rows.matrix is None else rows.matrix @ value

        fill(0, self.xx, self.Gx[:, self.xx.x, :, None] * rx[:, self.xx.x, None, :])
        fill(1, self.yy, self.Gy[:, self.yy.y, :, None] * ry[:, self.yy.y, None, :])
        shear = self.Gx[:, self.xy.x, :, None] * ry[:, self.xy.y, None, :]
        shear += self.Gy[:, self.xy.y, :, None] * rx[:, self.xy.x, None, :]
        fill(2, self.xy, shear)
        return B

    def material_tangent(self, gradients, strain):
        """int B^T D B, shape (ne, 2 nb, 2 nb)."""
        B = self.strain_matrix(gradients)
        ne, _, n, m = B.shape
        if isinstance(self.law, LinearLaw):
            DB = (self.law.D @ B.reshape(ne, 3, n * m)).reshape(B.shape)
        else:
            DB = np.einsum("abep,ebpk->eapk", self.law.moduli(strain), B, optimize=True)
        DB *= self.w[:, None, :, None]
        return B.reshape(ne, 3 * n, m).transpose(0, 2, 1) @ DB.reshape(ne, 3 * n, m)

    def geometric_tangent(self, stress):
        """The part of the tangent that is linear in the stress, for one component: (ne, nb, nb)."""
        xx, yy, xy = (self._to_samples(rows, self.w * s)
                      for rows, s in zip((self.xx, self.yy, self.xy), stress))
        nb = self.nb
        if self.shared:
            return (np.concatenate([xx, yy, xy], axis=1) @ self._pairs).reshape(-1, nb, nb)
        Gx, Gy = self.Gx[:, self.xx.x], self.Gy[:, self.yy.y]
        K = Gx.transpose(0, 2, 1) @ (xx[..., None] * Gx)
        K += Gy.transpose(0, 2, 1) @ (yy[..., None] * Gy)
        shear = self.Gx[:, self.xy.x].transpose(0, 2, 1) @ (xy[..., None] * self.Gy[:, self.xy.y])
        return K + shear + shear.transpose(0, 2, 1)


class Assembly:
    """What :meth:`Chain.assemble` found, chunk by chunk."""

    def __init__(self, kernel, parts):
        self._kernel, self._parts = kernel, parts

    def carry(self, du):
        """Stresses at ``u + du``, linearised, one list a chunk."""
        return [e.carry(self._kernel.gather(du, part)) for part, e in self._parts]


class Chain:
    """Elements of a chain of nodes: gathering, scattering, and the loop over chunks.

    Attributes
    ----------
    compiled
        The same compiled by Numba, or None where it is not installed or does not apply.
    """

    compiled = None

    def __init__(self, mesh, element):
        self.nd = 2 * element.nodal_dofs
        self.t = mesh.t
        self.N = self.nd * mesh.p.shape[1]

    def gather(self, u, elements=slice(None)):
        """Element values (ne, nb, 2) of a coordinate vector (N,)."""
        nodes = u.reshape(-1, self.nd)
        t = self.t[:, elements]
        return np.concatenate([nodes[t[0]], nodes[t[1]]], axis=1).reshape(t.shape[1], self.nd, 2)

    def scatter(self, force, elements=slice(None), out=None):
        """Add element vectors (ne, nb, 2) into a coordinate vector (N,)."""
        out = np.zeros(self.N, dtype=force.dtype) if out is None else out
        nodes, t = out.reshape(-1, self.nd), self.t[:, elements]
        parts = force.reshape(t.shape[1], 2, self.nd)
        nodes[t[0]] += parts[:, 0]  # a node is the left end of one element at most
        nodes[t[1]] += parts[:, 1]
        return out

    def held_energies(self, u_e, elements=slice(None)):
        """The part of the stabilisation, (ne,)."""
        if self.constant is None:
            return np.zeros(len(u_e))
        constant = self.constant[elements] if len(self.constant) > 1 else self.constant
        v = u_e.reshape(len(u_e), -1, 1)
        return 0.5 * np.sum(v * (constant @ v), axis=(1, 2))

    def checked(self, u):
        """A coordinate vector as compiled code takes it: float64, (N,), contiguous, writeable.

        Complex numbers stay: NumPy takes them.

        Raises
        ------
        InputError
            If it is of another shape: compiled code would read other memory.
        """
        if u.shape != (self.N,):
            raise InputError(f"this beam has {self.N} coordinates: their displacement is of shape "
                             f"({self.N},), got {u.shape}; the state of another mesh?")
        if u.dtype == np.float64 and u.flags.c_contiguous and u.flags.writeable:
            return u
        return u if u.dtype == np.complex128 else np.array(u, dtype=np.float64)

    def chunks(self):
        """Slices of the elements that are evaluated together."""
        return [slice(k, k + CHUNK) for k in range(0, self.t.shape[1], CHUNK)]

    def compile(self):
        """Use Numba from now on, if it is there and has what this kernel needs."""
        packs = self._packs()
        if packs is None or compiled_off() is not None:
            return
        from .compiled import CompiledKernel

        self.compiled = CompiledKernel(packs, len(packs[0]) == 11, self.t.shape[1])

    def _packs(self):
        """The tables of each term for the compiled functions, or None."""
        return None

    def assemble(self, u, K, start, force, carried=None, geometric=True):
        """Add the tangent to a band matrix and the internal force to a vector.

        Parameters
        ----------
        u
            Coordinate displacement, shape (N,).
        K
            A :class:`~skfem_ancf.linalg.BandMatrix`, and ``start`` the row of the first
            coordinate in it.
        force
            Shape (N,); added to.
        carried
            What :meth:`Assembly.carry` returned, for the geometric part.
        geometric
            Include the geometric part.

        Returns
        -------
        Assembly
            With ``carry(du)``.
        """
        u = self.checked(u)
        if self.compiled is not None and K.symmetric:
            return self.compiled.assemble(u, K, start, force, carried, geometric)
        parts = []
        for k, part in enumerate(self.chunks()):
            e = self.evaluate(self.gather(u, part), part, geometric=geometric,
                              carried=None if carried is None else carried[k])
            self.scatter(e.force, part, force)
            K.add_elements(e.tangent, start, self.nd, self.t[0, part])
            parts.append((part, e))
        return Assembly(self, parts)

    def force(self, u):
        """Internal force of a coordinate displacement (N,), shape (N,)."""
        u = self.checked(u)
        if self.compiled is not None and u.dtype == np.float64:
            return self.compiled.force(u)
        out = np.zeros(self.N, dtype=u.dtype)
        for part in self.chunks():
            self.scatter(self.evaluate(self.gather(u, part), part, tangent=False).force, part, out)
        return out

    def energy(self, u):
        """Strain energy of a coordinate displacement (N,)."""
        return np.sum(self.energies(u))

    def energies(self, u):
        """Strain energy of each element, shape (ne,)."""
        return np.concatenate([self.element_energies(self.gather(u, part), part)
                               for part in self.chunks()])

    def forces(self, u):
        """Element forces (ne, nb, 2) of a coordinate displacement (N,)."""
        return np.concatenate([self.evaluate(self.gather(u, part), part, tangent=False).force
                               for part in self.chunks()])

    def tangents(self, u, **options):
        """Element tangents (ne, 2 nb, 2 nb) of a coordinate displacement (N,)."""
        return np.concatenate([self.evaluate(self.gather(u, part), part, **options).tangent
                               for part in self.chunks()])


class Kernel(Chain):
    """Energy, force and tangent of the strain energy of one beam.

    Parameters
    ----------
    mesh, element, material
        The body, a scalar beam element and a material.
    width
        Width of the section.
    formulation
        A :class:`~skfem_ancf.formulations.Formulation`.
    """

    def __init__(self, mesh, element, material, width, formulation):
        super().__init__(mesh, element)
        self.tables = [TermTables(mesh, element, term, width)
                       for term in formulation.terms(element, material)]
        self.constant = formulation.stabilisation(mesh, element, material, width)

    def _packs(self):
        if not all(isinstance(t.law, LinearLaw) for t in self.tables):
            return None
        none = np.zeros((0, 1, 1))
        constant = none if self.constant is None else self.constant
        left = self.t[0].astype(np.int64)
        return [t.pack(none if k else constant, left, self.nd)
                for k, t in enumerate(self.tables)]

    @property
    def shared(self):
        """One table serves all elements."""
        return self.tables[0].shared

    @property
    def points_number(self):
        """Integration points of an element."""
        return sum(t.w.shape[1] for t in self.tables)

    @property
    def section_points(self):
        """Integration points across the section, of the first term."""
        return self.tables[0].section_points

    def inverted(self, u):
        """True if the body is turned inside out somewhere: no deformation of a real one."""
        return any(t.inverted(t.gradients(self.gather(u, part))) for part in self.chunks()
                   for t in (self.tables[0].part(part),))

    @property
    def volume(self):
        """Volume of the body, by the rule of the first term."""
        t = self.tables[0]
        return float(np.sum(t.w)) * (self.t.shape[1] if t.shared else 1)

    def evaluate(self, u_e, elements=slice(None), tangent=True, carried=None, geometric=True):
        """Element forces and, if asked for, tangents.

        Parameters
        ----------
        u_e
            Element displacements, shape (ne, nb, 2).
        elements
            The slice of elements these are.
        tangent
            Compute the tangent.
        carried
            Stresses (3, ne, np), one array a term, to use in the geometric part in place of the
            stress of the strain: the mixed integration point iteration.
        geometric
            Include the geometric part.
        """
        out = Evaluation()
        out._tables = [t.part(elements) for t in self.tables]
        out._gradients = [t.gradients(u_e) for t in out._tables]
        out.strains = [t.strain(g) for t, g in zip(out._tables, out._gradients)]
        out.stresses = [t.law.stress(e) for t, e in zip(out._tables, out.strains)]
        out.force = sum(t.force(g, s) for t, g, s in zip(out._tables, out._gradients, out.stresses))
        if self.constant is not None:
            constant = self.constant[elements] if len(self.constant) > 1 else self.constant
            out.force += (constant @ u_e.reshape(len(u_e), -1, 1)).reshape(u_e.shape)
        out.tangent = None
        if tangent:
            K = sum(t.material_tangent(g, e)
                    for t, g, e in zip(out._tables, out._gradients, out.strains))
            if geometric:
                Kg = sum(t.geometric_tangent(s)
                         for t, s in zip(out._tables, carried or out.stresses))
                ne, nb = Kg.shape[:2]
                blocks = K.reshape(ne, nb, 2, nb, 2)
                blocks[:, :, 0, :, 0] += Kg
                blocks[:, :, 1, :, 1] += Kg
            if self.constant is not None:
                K += constant
            out.tangent = K
        return out

    def factors(self, u_e, elements=slice(None)):
        """The material part of the element tangents as ``B^T (C B)``: in B nothing cancels.

        Parameters
        ----------
        u_e, elements
            As in :meth:`evaluate`.

        Returns
        -------
        B, CB
            The strains' derivatives at all integration points, and the weighted moduli times
            them, shape (ne, m, 2 nb); what is stabilised is a strain too.
        stress
            Weighted stresses, shape (ne, m): ``B^T stress`` is the internal force.
        """
        ne, nb = u_e.shape[:2]
        B, CB, stress = [], [], []
        for t in (t.part(elements) for t in self.tables):
            gradients = t.gradients(u_e)
            strain = t.strain(gradients)
            rows = t.strain_matrix(gradients)
            B.append(rows.reshape(ne, -1, 2 * nb))
            CB.append(np.einsum("abep,ebpk->eapk", t.law.moduli(strain) * t.w, rows, optimize=True
                                ).reshape(ne, -1, 2 * nb))
            stress.append((t.w * t.law.stress(strain)).transpose(1, 0, 2).reshape(ne, -1))
        if self.constant is not None:
            append_square_root(self.constant, u_e, elements, B, CB, stress)
        return tuple(np.concatenate(part, axis=1) for part in (B, CB, stress))

    def geometric(self, u_e, elements, stress):
        """The geometric part (ne, 2 nb, 2 nb) of the element tangents for weighted stresses."""
        ne, nb = u_e.shape[:2]
        S, first = np.zeros((ne, 2 * nb, 2 * nb)), 0
        blocks = S.reshape(ne, nb, 2, nb, 2)
        for t in (t.part(elements) for t in self.tables):
            n = t.w.shape[1]
            own = stress[:, first:first + 3 * n].reshape(ne, 3, n).transpose(1, 0, 2) / t.w
            first += 3 * n
            part = t.geometric_tangent(own)
            for i in range(2):
                blocks[:, :, i, :, i] += part
        return S

    def element_energies(self, u_e, elements=slice(None)):
        """Strain energies (ne,) of element displacements (ne, nb, 2)."""
        total = self.held_energies(u_e, elements)
        for t in (t.part(elements) for t in self.tables):
            total = total + np.sum(t.w * t.law.energy(t.strain(t.gradients(u_e))), axis=1)
        return total

    def strains(self, u):
        """Strains of every term, one list a chunk of elements; None if they are not needed."""
        if self.compiled is not None:
            return None
        return [[t.strain(t.gradients(self.gather(u, part)))
                 for t in (t.part(part) for t in self.tables)] for part in self.chunks()]

    def mean_force(self, u0, u1, strains0):
        """B(middle)^T S with S . (eps_1 - eps_0) the change of the energy, shape (N,).

        ``strains0`` is :meth:`strains` of u0.
        """
        if self.compiled is not None:
            return self.compiled.mean_force(self.checked(u0), self.checked(u1))
        out = np.zeros(self.N)
        for part, known in zip(self.chunks(), strains0):
            a, b = self.gather(u0, part), self.gather(u1, part)
            middle = 0.5 * (a + b)
            total = 0.0
            for t, eps0 in zip((t.part(part) for t in self.tables), known):
                stress = mean_stress(t.law, eps0, t.strain(t.gradients(b)))
                total = total + t.force(t.gradients(middle), stress)
            if self.constant is not None:
                constant = self.constant[part] if len(self.constant) > 1 else self.constant
                total += (constant @ middle.reshape(len(middle), -1, 1)).reshape(middle.shape)
            self.scatter(total, part, out)
        return out


def append_square_root(K, u_e, elements, B, CB, stress):
    """Rows R with R^T R = K, a constant and semidefinite element stiffness, and R u."""
    K = K[elements] if len(K) > 1 else K
    values, V = np.linalg.eigh(K)
    keep = np.max(values / values[:, -1:], axis=0) > 1e-12
    R = (np.sqrt(values[:, None, keep]) * V[:, :, keep]).transpose(0, 2, 1)
    R = np.broadcast_to(R, (len(u_e),) + R.shape[1:])
    B.append(R)
    CB.append(R)
    stress.append((R @ u_e.reshape(len(u_e), -1, 1))[..., 0])


def mean_stress(law, eps0, eps1):
    """A stress whose product with ``eps1 - eps0`` is the change of the law's energy.

    The mean of both stresses for a linear law, else the discrete gradient of Gonzalez (2000).
    """
    middle = law.stress(0.5 * (eps0 + eps1))
    if isinstance(law, LinearLaw):
        return middle
    d = eps1 - eps0
    size = np.sum(d * d, axis=0)
    missing = law.energy(eps1) - law.energy(eps0) - np.sum(middle * d, axis=0)
    return middle + np.where(size > 1e-24, missing / np.maximum(size, 1e-24), 0.0) * d
