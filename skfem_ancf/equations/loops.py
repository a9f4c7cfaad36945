"""Large parts of compiled code behind addresses: kernels, force elements, contact, laws."""

from functools import cache, lru_cache
from typing import Annotated, Any

import numpy as np

from ..actions.contact.kernels import of_contacts
from ..actions.contact.tables import ContactTables, Question
from ..actions.forces.kernels import Kinds, of_kinds, turns_of
from ..beam.kernels import blocks, loops as kernels
from ..beam.kernels.compiled import CompiledTables, compiled_pattern, compiled_tables
from ..beam.kernels.law import LINEAR, point_of
from ..beam.strain_energy import FlatBody
from ..core.band import ADDRESSES
from ..core.code_cache import NotCompiled
from ..core.jit import MADE, address, caller, compiled, reader
from ..core.immutable import is_builtin
from ..core.loops import BANDS, STATIC
from ..core.source import F1, F2, F3
from ..core.words import Words
from .tables import Equations

_KINDS = Annotated[Kinds, MADE], int, F1, F1, float, F1
_CONTACTS = ContactTables, Annotated[Question, MADE], F1, F1, F1
_LAW = F1, F3, F3
_read, _call_law = reader(CompiledTables), caller(*_LAW)
_call_kinds, _call_contacts = caller(*_KINDS), caller(*_CONTACTS)


def tables_of(body, k):
    return _read(body.packs[k])


#: Compiled kernels of elements with their numbers, by the part that has them.
KERNELS: dict[str, dict[Any, int]] = {
    "StrainTables": {kernels.force: 0, kernels.linearised: 1, kernels.tangent: 2},
    "unsymmetric": {kernels.unsymmetric: 3}, "gradients": {kernels.gradients: 4},
    "eigenstrains": {kernels.eigen_mean: 5, kernels.eigen_tangent: 6},
    "laws": {blocks.put_law_stresses: 7, blocks.put_law_moduli: 8}}
_ARRAYS = {kernels.force: 5, kernels.linearised: 5, kernels.tangent: 5,
           kernels.unsymmetric: 3, kernels.gradients: 2, kernels.eigen_mean: 4,
           kernels.eigen_tangent: 3}
_BANDS = kernels.tangent, kernels.unsymmetric, kernels.eigen_tangent  # with ld
_HINTS = {kernel: (CompiledTables, *[F1] * n, *[int] * (kernel in _BANDS))
          for kernel, n in _ARRAYS.items()}
_HINTS[blocks.put_law_stresses] = CompiledTables, int, F2, F2, F2
_HINTS[blocks.put_law_moduli] = CompiledTables, int, F2, F2
#: Addresses of the loaded ones.
_ADDRESSES = np.zeros(len(_HINTS), np.int64)
(_call_force, _call_linearised, _call_tangent, _call_unsymmetric, _call_gradients,
 _call_eigen_mean, _call_eigen_tangent, _call_stresses, _call_moduli) = (
    caller(*hints) for hints in _HINTS.values())


def run_force(t, u, f):
    _call_force(t.kernels[0], (t, u, u[:0], u[:0], u[:0], f))


def run_stress(t, u, out):
    _call_force(t.kernels[0], (t, u, u[:0], u[:0], out, u[:0]))


def run_mixed(t, u, given, out, f):
    _call_force(t.kernels[0], (t, u, u[:0], given, out, f))


def run_given(t, u, given, f):
    _call_force(t.kernels[0], (t, u, u[:0], given, u[:0], f))


def run_mean(t, u, v, f):
    _call_force(t.kernels[0], (t, u, v, u[:0], u[:0], f))


def run_mean_mixed(t, u, v, given, out, f):
    _call_force(t.kernels[0], (t, u, v, given, out, f))


def run_linearised(t, u, du, given, out):
    _call_linearised(t.kernels[1], (t, u, du, given, out, u[:0]))


def run_viscous(t, u, v, f):
    _call_linearised(t.kernels[1], (t, u, v, u[:0], u[:0], f))


def run_tangent(t, u, given, out, f, flat, ld):
    _call_tangent(t.kernels[2], (t, u, given, out, f, flat, ld))


def run_unsymmetric(t, u, v, flat, ld):
    _call_unsymmetric(t.kernels[3], (t, u, v, flat, ld))


def run_gradients(t, u, out):
    _call_gradients(t.kernels[4], (t, u, out))


def run_eigen_force(t, u, given, f):
    if t.law.kind == LINEAR:
        _call_force(t.kernels[0], (t, u, u[:0], given, u[:0], f))
    else:
        _call_eigen_mean(t.kernels[5], (t, u, u, given, f))


def run_eigen_mean(t, u, v, given, f):
    if t.law.kind == LINEAR:
        _call_force(t.kernels[0], (t, u, v, given, u[:0], f))
    else:
        _call_eigen_mean(t.kernels[5], (t, u, v, given, f))


def run_eigen_tangent(t, u, given, flat, ld):
    _call_eigen_tangent(t.kernels[6], (t, u, given, flat, ld))


def run_accept(t, u, v, out):
    pass  # scenes of laws with a history run in NumPy


def run_put(t, given):
    pass  # as well


def law_stresses(t, first, E, change, T):
    _call_stresses(t.kernels[7], (t, first, E, change, T))


def law_moduli(t, first, E, H):
    _call_moduli(t.kernels[8], (t, first, E, H))


def evaluate_points(law, strain, out):
    _call_law(law.address, (law.constants, strain, out))


def custom_evaluate(handle, strain, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


def run_kinds(tables, what, y, w, factor, out):
    if tables.number > 0:
        kinds = Kinds(tables.number, tables.ends, tables.numbers, turns_of(tables))
        _call_kinds(tables.address, (kinds, what, y, w, factor, out))


def run_contacts(tables, asked, u, v, out):
    _call_contacts(tables.address, (tables, asked, u, v, out))


#: Other separately compiled functions, with annotations of their arguments.
PARTS = {"elements": (of_kinds, _KINDS), "contacts": (of_contacts, _CONTACTS)}


@cache
def part(name: str) -> int:
    """Compile or load a part; the address of one of :data:`PARTS`, else 0."""
    for kernel, k in KERNELS.get(name, {}).items():
        _ADDRESSES[k] = address(kernel, _HINTS[kernel])
    if name in ("band", "bands"):
        some = slice(STATIC) if name == "band" else slice(STATIC, None)
        ADDRESSES[some] = [address(*one) for one in list(BANDS.items())[some]]
    return address(*PARTS[name]) if name in PARTS else 0


@cache
def law(function: Any) -> int:
    """The address of a material law; laws outside of the package are not cached on disk."""
    return address(_of_points(compiled(function)), _LAW,
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
    forces, loads = _flat_forces(plain.forces), plain.loads
    body = _flat_body(plain.body, words)
    if len(loads.eigenstrains):
        loads = loads._replace(eigenstrained=_flat_body(loads.eigenstrained, words))
    viscous, copies = (body if x is plain.body else _flat_body(x, words)
                       for x in (plain.viscous, plain.copies))
    found = plain._replace(body=body, viscous=viscous, copies=copies, forces=forces, loads=loads,
                           factors=plain.K._replace(flat=np.empty(plain.K.flat.size)))
    return found, Words(found), words


def flat_after(flat: tuple[Equations, Words, list[Words]], plain: Equations
               ) -> tuple[Equations, Words, list[Words]]:
    """The same with the history of other equations."""
    found = flat[0]._replace(forces=_flat_forces(plain.forces), history=plain.history,
                             span=plain.span)
    return found, Words(found), flat[2]


def _flat_forces(forces):
    if forces.contacts.number > 0:
        forces = forces._replace(contacts=forces.contacts._replace(
            address=part("contacts")))
    return forces._replace(address=part("elements")) if forces.number > 0 else forces


def _flat_body(body, words):
    found = [Words(_compiled(t)) for t in body.packs]
    words += found
    return FlatBody(np.array([x.address for x in found], dtype=np.int64), body.table)


@lru_cache(64)
def _words_of(pattern):
    return Words(compiled_pattern(pattern))


def _compiled(t):
    t, function = compiled_tables(t, _ADDRESSES)._replace(
        pattern=_words_of(t.pattern)), point_of(t.law)
    if function is None:
        return t
    try:
        return t._replace(law=t.law._replace(address=law(function)))
    except Exception as error:
        name = f"{function.__module__}.{function.__qualname__}"
        raise NotCompiled(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error
