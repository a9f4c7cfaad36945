"""Large parts of compiled code, each behind an address: kernels, force elements, contact, laws."""

from functools import cache
from typing import Annotated, Any

import numpy as np

from ..actions.forces.contact_texts import ContactTables, Question, of_contacts
from ..actions.forces.texts import Kinds, of_kinds
from ..beam.kernels.law import text_of
from ..beam.kernels.strain import evaluate
from ..beam.kernels.tables import StrainTables
from ..beam.strain_energy import FlatBody
from ..core.code_cache import NotCompiled
from ..core.jit import MADE, address, caller, reader
from ..core.origin import ours
from ..core.source import F1, F3
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


def run(t, what, u, v, f, given, out, flat, ld):
    _call_strain(t.address, (t, what, u, v, f, given, out, flat, ld))


def run_text(law, strain, out):
    _call_law(law.address, (law.constants, strain, out))


def own_evaluate(handle, strain, out):
    out[:] = np.nan  # scenes with such laws run in NumPy


def run_kinds(tables, what, y, w, factor, out):
    if tables.number > 0:
        kinds = Kinds(tables.number, tables.ends, tables.numbers)
        _call_kinds(tables.address, (kinds, what, y, w, factor, out))


def run_contacts(tables, asked, u, v, out):
    _call_contacts(tables.address, (tables, asked, u, v, out))


#: What is compiled by itself: a function, and the annotations of its arguments.
PARTS = {"StrainTables": (evaluate, _STRAIN), "elements": (of_kinds, _KINDS),
         "contacts": (of_contacts, _CONTACTS)}


@cache
def part(name: str) -> int:
    """The address of one of :data:`PARTS`."""
    return address(*PARTS[name])


@cache
def law(function: Any) -> int:
    """The address of a material law; one of another package is compiled in each process."""
    return address(function, _LAW, f"_{function.__module__}", ours(function))


def flat(plain: Equations) -> tuple[Equations, list[Words]]:
    """The equations as compiled code takes them, and what has to live as long as they do."""
    words: list[Words] = []
    forces, loads = plain.forces, plain.loads
    body = _flat_body(plain.body, words)
    if forces.contacts.number > 0:
        forces = forces._replace(contacts=forces.contacts._replace(address=part("contacts")))
    if forces.number > 0:
        forces = forces._replace(address=part("elements"))
    if len(loads.pushes):
        loads = loads._replace(pushed=_flat_body(loads.pushed, words))
    viscous, copies = (body if x is plain.body else _flat_body(x, words)
                       for x in (plain.viscous, plain.copies))
    return plain._replace(body=body, viscous=viscous, copies=copies, forces=forces,
                          loads=loads), words


def _flat_body(body, words):
    found = [Words(_with_addresses(t)) for t in body.packs]
    words += found
    return FlatBody(np.array([x.address for x in found], dtype=np.int64), body.table)


def _with_addresses(t):
    t, function = t._replace(address=part("StrainTables")), text_of(t.law)
    if function is None:
        return t
    try:
        return t._replace(law=t.law._replace(address=law(function)))
    except Exception as error:
        name = f"{function.__module__}.{function.__qualname__}"
        raise NotCompiled(f"{name} cannot be compiled: {str(error).splitlines()[0]}") from error
