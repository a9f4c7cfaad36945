"""The equations for compiled code, and material laws, which it calls by address."""

from functools import cache, lru_cache
from typing import Any

import numpy as np

from ..actions.tables import MATERIALS
from ..beam.kernels.compiled import (CompiledTables, compiled_pattern, compiled_tables,
                                     memory_of)
from ..beam.kernels.tables import HISTORY, points_of
from ..beam.strain_energy import FlatBody
from ..core.code_cache import NotCompiled
from ..core import F1, F3, Packed, is_builtin
from ..core.jit import address, caller, compiled, reader
from ..actions.contact.pairs import Candidates, PairTables
from ..actions.contact.tables import Pair
from ..materials.pointwise import MODULI
from .tables import Equations

_read, _call_law = reader(CompiledTables), caller(F1, F3, F3)
_call_history = caller(F1, F3, F3, float, F3, F3)
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


def evaluate_history(law, strain, history, dt, out, after):
    _call_history(law.address, (law.constants, strain, history, dt, out, after))


def custom_evaluate(handle, strain, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


@lru_cache(64)
def _words_of(pattern):
    return Packed(compiled_pattern(pattern))


@cache
def law(point: Any, *stored: Any) -> int:
    """The address of a material law; laws outside of the package are not cached on disk."""
    # ``stored`` is the stored energy of a law with a history.
    of = (_of_increments if stored else _of_points)(*map(compiled, (point, *stored)))
    takes = (F1, F3, F3, float, F3, F3) if stored else (F1, F3, F3)
    return address(of, takes, f"_{point.__module__}_{point.__qualname__}", is_builtin(point))


def _of_points(point):
    """Energies, stresses, moduli, or stresses and moduli (by ``len(out)``), at all points."""
    def of_points(constants, strain, out):
        for p in range(strain.shape[1]):
            for e in range(strain.shape[2]):
                W, S, D = point(constants, strain[0, p, e], strain[1, p, e], strain[2, p, e])
                if len(out) == 1:
                    out[0, p, e] = W
                if len(out) == 3 or len(out) == 12:
                    out[0, p, e], out[1, p, e], out[2, p, e] = S
                if len(out) >= 9:
                    x = out[len(out) - 9:]
                    x[0, p, e], x[4, p, e], x[8, p, e] = D[0], D[3], D[5]
                    x[1, p, e] = x[3, p, e] = D[1]
                    x[2, p, e] = x[6, p, e] = D[2]
                    x[5, p, e] = x[7, p, e] = D[4]

    return of_points


def _of_increments(point, stored):
    """Stresses, moduli and history, or energies, at all points."""
    def of_increments(constants, strain, history, dt, out, after):
        n = len(strain)
        x, S, D = np.empty(n), np.empty(n), np.empty(n * (n + 1) // 2)
        h, end = np.empty(len(history)), np.empty(len(history))
        for p in range(strain.shape[1]):
            for e in range(strain.shape[2]):
                for k in range(n):
                    x[k] = strain[k, p, e]
                for k in range(len(h)):
                    h[k] = history[k, p, e]
                if len(out) == 1:
                    out[0, p, e] = stored(constants, x, h)
                    continue
                point(constants, x, h, dt, S, D, end)
                for k in range(n):
                    out[k, p, e] = S[k]
                for k in range(n * n):
                    out[n + k, p, e] = D[MODULI[k]]
                for k in range(len(h)):
                    after[k, p, e] = end[k]

    return of_increments


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
    words, old = list(flat[2]), flat[0]
    found = old._replace(forces=_flat_forces(plain.forces, words), history=plain.history,
                         span=plain.span)
    if plain.lasting >= MATERIALS:
        body, loads = _with_memory(old.body, plain.body, words), old.loads
        if len(loads.eigenstrains):
            loads = loads._replace(eigenstrained=_with_memory(
                loads.eigenstrained, plain.loads.eigenstrained, words))
        found = found._replace(
            body=body, viscous=body if plain.viscous is plain.body else old.viscous, copies=body,
            loads=loads)
    return found, Packed(found), words


def _with_memory(flat, body, words):
    """The words of a body whose elements have another history."""
    known, tables = {x.address: x for x in words}, []
    for place, e in zip(flat.of.packs, body.elements):
        one = known[place]
        if e.t.law.kind == HISTORY:
            one = Packed(one.of._replace(memory=memory_of(e)))
            words.append(one)
        tables.append(one)
    return Packed(FlatBody(_addresses(tables), flat.of.table))


def _flat_forces(forces, words):
    def flat(tables):
        found = list(map(Packed, tables.pairs))
        words.extend(found)
        return tables._replace(pairs=_addresses(found))

    if forces.contacts.number:
        forces = forces._replace(contacts=flat(forces.contacts))
    return flat(forces) if forces.paired else forces


def _flat_body(body, words):
    found = [Packed(_compiled(t)) for t in body.packs]
    words += found
    if any(t.law.kind == HISTORY for t in body.packs):
        return _with_memory(Packed(FlatBody(_addresses(found), body.table)), body, words)
    return Packed(FlatBody(_addresses(found), body.table))


def _addresses(words):
    return np.array([x.address for x in words], dtype=np.int64)


def _compiled(t):
    functions = points_of(t)
    t = compiled_tables(t)._replace(pattern=_words_of(t.pattern))
    if not functions or functions[0] is None:
        return t
    try:
        return t._replace(law=t.law._replace(address=law(*functions)))
    except Exception as error:
        name = f"{functions[0].__module__}.{functions[0].__qualname__}"
        raise NotCompiled(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error
