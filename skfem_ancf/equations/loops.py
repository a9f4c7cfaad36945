"""Large parts of compiled code behind addresses: kernels, force elements, contact, laws."""

from functools import cache, lru_cache
from typing import Any

import numpy as np

from ..beam.kernels.compiled import CompiledTables, compiled_pattern, compiled_tables
from ..beam.kernels.law import LINEAR, point_of
from ..beam.kernels.loops import (eigen_mean, eigen_tangent, force, gradients, linearised, tangent,
                                  unsymmetric)
from ..beam.strain_energy import FlatBody
from ..core.code_cache import NotCompiled
from ..core.immutable import is_builtin
from ..core.jit import address, caller, compiled, reader
from ..core.source import F1, F3
from ..core.words import Words
from .tables import Equations

_read, _call_law = reader(CompiledTables), caller(F1, F3, F3)


def tables_of(body, k):
    return _read(body.packs[k])


def run_force(t, u, f):
    force(t, u, u[:0], u[:0], u[:0], f)


def run_stress(t, u, out):
    force(t, u, u[:0], u[:0], out, u[:0])


def run_mixed(t, u, given, out, f):
    force(t, u, u[:0], given, out, f)


def run_given(t, u, given, f):
    force(t, u, u[:0], given, u[:0], f)


def run_mean(t, u, v, f):
    force(t, u, v, u[:0], u[:0], f)


def run_mean_mixed(t, u, v, given, out, f):
    force(t, u, v, given, out, f)


def run_linearised(t, u, du, given, out):
    linearised(t, u, du, given, out, u[:0])


def run_viscous(t, u, v, f):
    linearised(t, u, v, u[:0], u[:0], f)


def run_tangent(t, u, given, out, f, flat, ld):
    tangent(t, u, given, out, f, flat, ld)


def run_unsymmetric(t, u, v, flat, ld):
    unsymmetric(t, u, v, flat, ld)


def run_gradients(t, u, out):
    gradients(t, u, out)


def run_eigen_force(t, u, given, f):
    if t.law.kind == LINEAR:
        force(t, u, u[:0], given, u[:0], f)
    else:
        eigen_mean(t, u, u, given, f)


def run_eigen_mean(t, u, v, given, f):
    if t.law.kind == LINEAR:
        force(t, u, v, given, u[:0], f)
    else:
        eigen_mean(t, u, v, given, f)


def run_eigen_tangent(t, u, given, flat, ld):
    eigen_tangent(t, u, given, flat, ld)


def run_accept(t, u, v, out):
    pass  # scenes of laws with a history run in NumPy


def run_put(t, given):
    pass  # as well


def evaluate_points(law, strain, out):
    _call_law(law.address, (law.constants, strain, out))


def custom_evaluate(handle, strain, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


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


def flat(plain: Equations) -> tuple[Equations, Words, list[Words]]:
    """The equations for compiled code, their words, and those that must live as long."""
    words: list[Words] = []
    loads = plain.loads
    body = _flat_body(plain.body, words)
    if len(loads.eigenstrains):
        loads = loads._replace(eigenstrained=_flat_body(loads.eigenstrained, words))
    viscous, copies = (body if x is plain.body else _flat_body(x, words)
                       for x in (plain.viscous, plain.copies))
    found = plain._replace(body=body, viscous=viscous, copies=copies, loads=loads,
                           factors=plain.K._replace(flat=np.empty(plain.K.flat.size)))
    return found, Words(found), words


def flat_after(flat: tuple[Equations, Words, list[Words]], plain: Equations
               ) -> tuple[Equations, Words, list[Words]]:
    """The same with the history of other equations."""
    found = flat[0]._replace(forces=plain.forces, history=plain.history, span=plain.span)
    return found, Words(found), flat[2]


def _flat_body(body, words):
    found = [Words(_compiled(t)) for t in body.packs]
    words += found
    return FlatBody(np.array([x.address for x in found], dtype=np.int64), body.table)


@lru_cache(64)
def _words_of(pattern):
    return Words(compiled_pattern(pattern))


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
