"""What a beam's NumPy kernel hands over to."""

import numpy as np

from .beam import beam_carry, beam_force, beam_mean, beam_tables, beam_tangent
from .cable import cable_carry, cable_force, cable_mean, cable_tangent


class CompiledKernel:
    """The compiled functions of one beam, with the tables of its NumPy kernel.

    Parameters
    ----------
    packs
        The tables of each term of the strain energy, in the order that the functions take.
    cable
        Whether it is a cable.
    elements
        Number of elements.
    """

    def __init__(self, packs, cable, elements):
        self.packs = packs = packs if cable else [beam_tables(*pack) for pack in packs]
        self.cable = cable
        self.shapes = [(2, elements, pack[6].shape[1]) if cable else
                       (3, elements, pack[4].shape[1]) for pack in packs]
        self._force, self._tangent, self._carry, self._mean = (
            (cable_force, cable_tangent, cable_carry, cable_mean) if cable else
            (beam_force, beam_tangent, beam_carry, beam_mean))

    def assemble(self, u, K, start, force, carried, geometric):
        """Add force and tangent; see :meth:`skfem_ancf.kernel.Chain.assemble`."""
        stresses = [np.empty(shape) for shape in self.shapes]
        for k, (pack, S) in enumerate(zip(self.packs, stresses)):
            self._tangent(pack, u, force, geometric, carried[k] if carried else S,
                          carried is not None, S, K._flat, K._ld, start)
        return CompiledEvaluation(self, u, stresses)

    def force(self, u):
        """Internal force, shape (N,)."""
        out = np.zeros(u.size)
        for pack in self.packs:
            self._force(pack, u, out)
        return out

    def mean_force(self, u0, u1):
        """The force whose work from u0 to u1 is the change of the energy."""
        out = np.zeros(u0.size)
        for pack in self.packs:
            self._mean(pack, u0, u1, out)
        return out


class CompiledEvaluation:
    """What :meth:`CompiledKernel.assemble` found."""

    def __init__(self, compiled, u, stresses):
        self._compiled, self._u, self._stresses = compiled, u.copy(), stresses

    def carry(self, du):
        """The stresses, linearised, at ``u + du``: one array a term."""
        c, du = self._compiled, np.ascontiguousarray(du)
        carried = [np.empty_like(S) for S in self._stresses]
        for pack, S, out in zip(c.packs, self._stresses, carried):
            c._carry(pack, self._u, du, S, out)
        return carried
