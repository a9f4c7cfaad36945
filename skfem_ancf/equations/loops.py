"""Large parts of compiled code behind addresses: kernels, force elements, contact, laws."""

from functools import cache
from typing import Annotated, Any

import numpy as np

from ..actions.contact.kernels import of_contacts
from ..actions.contact.tables import ContactTables, Question
from ..actions.forces.kernels import Kinds, of_kinds
from ..beam.kernels.law import point_of
from ..beam.kernels.strain import (EIGENSTRAIN, EIGENSTRAIN_MEAN, EIGENSTRAIN_TANGENT, FORCE, GIVEN,
                                   GRADIENTS, LINEARISED, MEAN, STRESS, TANGENT, UNSYMMETRIC,
                                   VISCOUS, evaluate)
from ..beam.kernels.tables import StrainTables
from ..beam.strain_energy import FlatBody
from ..core.code_cache import NotCompiled
from ..core.jit import MADE, address, caller, compiled, reader
from ..core.origin import ours
from ..core.source import F1, F3, source
from ..core.words import Words
from .tables import Equations

_STRAIN = StrainTables, int, F1, F1, F1, F1, F1, F1, int
_KINDS = Annotated[Kinds, MADE], int, F1, F1, float, F1
_CONTACTS = ContactTables, Annotated[Question, MADE], F1, F1, F1
_LAW = F1, F3, F3
_read = reader(StrainTables)
_call_strain, _call_law = caller(*_STRAIN), caller(*_LAW)
_call_kinds, _call_contacts = caller(*_KINDS), caller(*_CONTACTS)


def tables_of(body, k):
    return _read(body.packs[k])


@source
def _run(t, what, u, v, f, given, out, flat, ld):
    _call_strain(t.address, (t, np.int64(what), u, v, f, given, out, flat, ld))


def run_force(t, u, f):
    _run(t, FORCE, u, u, f, u[:0], u[:0], u[:0], 0)


def run_stress(t, u, out):
    _run(t, STRESS, u, u, u[:0], u[:0], out, u[:0], 0)


def run_linearised(t, u, du, given, out):
    _run(t, LINEARISED, u, du, u[:0], given, out, u[:0], 0)


def run_mean(t, u, v, f):
    _run(t, MEAN, u, v, f, u[:0], u[:0], u[:0], 0)


def run_mixed(t, u, given, out, f):
    _run(t, FORCE, u, u, f, given, out, u[:0], 0)


def run_mean_mixed(t, u, v, given, out, f):
    _run(t, MEAN, u, v, f, given, out, u[:0], 0)


def run_given(t, u, given, f):
    _run(t, GIVEN, u, u, f, given, u[:0], u[:0], 0)


def run_viscous(t, u, v, f):
    _run(t, VISCOUS, u, v, f, u[:0], u[:0], u[:0], 0)


def run_tangent(t, u, given, out, f, flat, ld):
    _run(t, TANGENT, u, u, f, given, out, flat, ld)


def run_gradients(t, u, out):
    _run(t, GRADIENTS, u, u, u[:0], u[:0], out, u[:0], 0)


def run_unsymmetric(t, u, v, flat, ld):
    _run(t, UNSYMMETRIC, u, v, u[:0], u[:0], u[:0], flat, ld)


def run_eigen_force(t, u, given, f):
    _run(t, EIGENSTRAIN, u, u, f, given, u[:0], u[:0], 0)


def run_eigen_mean(t, u, v, given, f):
    _run(t, EIGENSTRAIN_MEAN, u, v, f, given, u[:0], u[:0], 0)


def run_eigen_tangent(t, u, given, flat, ld):
    _run(t, EIGENSTRAIN_TANGENT, u, u, u[:0], given, u[:0], flat, ld)


def evaluate_points(law, strain, out):
    _call_law(law.address, (law.constants, strain, out))


def custom_evaluate(handle, strain, out):
    out[:] = np.nan  # never called: such scenes run in NumPy


def run_kinds(tables, what, y, w, factor, out):
    if tables.number > 0:
        kinds = Kinds(tables.number, tables.ends, tables.numbers)
        _call_kinds(tables.address, (kinds, what, y, w, factor, out))


def run_contacts(tables, asked, u, v, out):
    _call_contacts(tables.address, (tables, asked, u, v, out))


#: Separately compiled functions, with annotations of their arguments.
PARTS = {"StrainTables": (evaluate, _STRAIN), "elements": (of_kinds, _KINDS),
         "contacts": (of_contacts, _CONTACTS)}


@cache
def part(name: str) -> int:
    """The address of one of :data:`PARTS`."""
    return address(*PARTS[name])


@cache
def law(function: Any) -> int:
    """The address of a material law; laws outside of the package are not cached on disk."""
    return address(_of_points(compiled(function)), _LAW,
                   f"_{function.__module__}_{function.__qualname__}", ours(function))


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


def flat(plain: Equations) -> tuple[Equations, list[Words]]:
    """The equations for compiled code, and the objects that must live as long."""
    words: list[Words] = []
    forces, loads = plain.forces, plain.loads
    body = _flat_body(plain.body, words)
    if forces.contacts.number > 0:
        forces = forces._replace(contacts=forces.contacts._replace(address=part("contacts")))
    if forces.number > 0:
        forces = forces._replace(address=part("elements"))
    if len(loads.eigenstrains):
        loads = loads._replace(eigenstrained=_flat_body(loads.eigenstrained, words))
    viscous, copies = (body if x is plain.body else _flat_body(x, words)
                       for x in (plain.viscous, plain.copies))
    return plain._replace(body=body, viscous=viscous, copies=copies, forces=forces,
                          loads=loads), words


def _flat_body(body, words):
    found = [Words(_with_addresses(t)) for t in body.packs]
    words += found
    return FlatBody(np.array([x.address for x in found], dtype=np.int64), body.table)


def _with_addresses(t):
    t, function = t._replace(address=part("StrainTables")), point_of(t.law)
    if function is None:
        return t
    try:
        return t._replace(law=t.law._replace(address=law(function)))
    except Exception as error:
        name = f"{function.__module__}.{function.__qualname__}"
        raise NotCompiled(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error
