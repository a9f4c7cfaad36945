"""The equations for compiled code, and material laws, which it calls by address."""

from functools import cache, lru_cache
from typing import Any

import numpy as np

from ..beam.kernels.compiled import CompiledTables, compiled_pattern, compiled_tables
from ..beam.kernels.tables import point_of
from ..beam.strain_energy import FlatBody
from ..core.code_cache import NotCompiled
from ..core import F1, F3, Packed, is_builtin
from ..core.jit import address, caller, compiled, reader
from ..actions.contact.pairs import Candidates, PairTables
from ..actions.contact.tables import Pair
from .tables import Equations

_read, _call_law = reader(CompiledTables), caller(F1, F3, F3)
_read_pairs, _read_pair, _read_found = map(reader, (PairTables, Pair, Candidates))


def tables_of(body, k):
    return _read(body.packs[k])


def pair_tables(tables, k):
    return _read_pairs(tables.pairs[k])


def pair_of(tables, k):
    return _read_pair(tables.pairs[k])


def candidates_of(t):
    return _read_found(t.found[0])


def evaluate_points(law, strain, out):
    _call_law(law.address, (law.constants, strain, out))


def custom_evaluate(handle, strain, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


@lru_cache(64)
def _words_of(pattern):
    return Packed(compiled_pattern(pattern))


@cache
def law(function: Any) -> int:
    """The address of a material law; laws outside of the package are not cached on disk."""
    return address(_of_points(compiled(function)), (F1, F3, F3),
                   f"_{function.__module__}_{function.__qualname__}", is_builtin(function))


def _of_points(point):
    """Energies, stresses or moduli (by ``len(out)``) of a pointwise function at all points."""
    def of_points(constants, strain, out):
        for p in range(strain.shape[1]):
            for e in range(strain.shape[2]):
                W, S, D = point(constants, strain[0, p, e], strain[1, p, e], strain[2, p, e])
                if len(out) == 1:
                    out[0, p, e] = W
                elif len(out) == 3:
                    out[0, p, e], out[1, p, e], out[2, p, e] = S
                else:
                    out[0, p, e], out[4, p, e], out[8, p, e] = D[0], D[3], D[5]
                    out[1, p, e] = out[3, p, e] = D[1]
                    out[2, p, e] = out[6, p, e] = D[2]
                    out[5, p, e] = out[7, p, e] = D[4]

    return of_points


def flat(plain: Equations) -> tuple[Equations, Packed, list[Packed]]:
    """The equations for compiled code, their words, and those that must live as long."""
    words: list[Packed] = []
    loads = plain.loads
    body = _flat_body(plain.body, words)
    if len(loads.eigenstrains):
        loads = loads._replace(eigenstrained=_flat_body(loads.eigenstrained, words))
    viscous, copies = (body if x is plain.body else _flat_body(x, words)
                       for x in (plain.viscous, plain.copies))
    found = plain._replace(body=body, viscous=viscous, copies=copies, loads=loads,
                           forces=_flat_forces(plain.forces, words),
                           factors=plain.K._replace(flat=np.empty(plain.K.flat.size)))
    return found, Packed(found), words


def flat_after(flat: tuple[Equations, Packed, list[Packed]], plain: Equations
               ) -> tuple[Equations, Packed, list[Packed]]:
    """The same with the history of other equations."""
    words = list(flat[2])
    found = flat[0]._replace(forces=_flat_forces(plain.forces, words), history=plain.history,
                             span=plain.span)
    return found, Packed(found), words


def _flat_forces(forces, words):
    def flat(tables):
        found = list(map(Packed, tables.pairs))
        words.extend(found)
        return tables._replace(pairs=np.array([x.address for x in found], dtype=np.int64))

    if forces.contacts.number:
        forces = forces._replace(contacts=flat(forces.contacts))
    return flat(forces) if forces.paired else forces


def _flat_body(body, words):
    found = [Packed(_compiled(t)) for t in body.packs]
    words += found
    return Packed(FlatBody(np.array([x.address for x in found], dtype=np.int64), body.table))


def _compiled(t):
    t, function = compiled_tables(t)._replace(
        pattern=_words_of(t.pattern)), point_of(t.law)
    if function is None:
        return t
    try:
        return t._replace(law=t.law._replace(address=law(function)))
    except Exception as error:
        name = f"{function.__module__}.{function.__qualname__}"
        raise NotCompiled(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error
