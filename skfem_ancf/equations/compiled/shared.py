"""Texts that several entries call, compiled once: those of a group are a library of their own.

Entries call them by names that the linker is told once the group is there.
"""

from functools import cache
from types import FunctionType
from typing import Any, NamedTuple

from llvmlite.binding import add_symbol
from numba import types
from numba.extending import intrinsic

from ...core import band, callbacks as own
from ...beam import strain_energy as body
from ...actions import tables
from ...core.band import Band
from ...beam.strain_energy import FlatBody
from ...actions.forces import texts as forces
from ...actions.forces.contact_texts import ContactTables, Question
from ...actions.forces.texts import ForceTables
from ...core.source import F1, F2, I1
from ...actions.tables import JointTables, LoadTables
from . import address as address_of_group
from . import key
from .convention import TextCallConv
from .records import kind_of
from .together import Entry, Shared, Text
from .twin import entry_of, named, twin
from .words import hints, read


class ByValue(NamedTuple):
    """A class of named tuples that are given by value."""

    kind: type


class Call(NamedTuple):
    """A text, what its arguments are, and what it returns."""

    text: Any
    args: tuple
    returns: type = type(None)


_FROM_JOINTS = JointTables, F1, float, F1, F1, F1
GROUPS = {
    "common": (
        Call(body.evaluate_body, (FlatBody, int, F1, F1, F1, F1, F1, F1, int)),
        Call(tables.add_load_stiffness, (LoadTables, F1, float, float, F1, Band)),
        Call(tables.push, (LoadTables, int, F1, F1, F1, F1, F1, int)),
        Call(tables.constraint, (JointTables, F1, F1, float, F1, F1)),
        Call(tables.add_constraint_rate, _FROM_JOINTS),
        Call(tables.add_joint_force, _FROM_JOINTS),
        Call(tables.joint_directions, (JointTables, F1, float, F1, F2)),
        Call(forces.add_elastic_force, (ForceTables, float, float, F1, F1, F1)),
        Call(forces.add_element_tangent, (ForceTables, float, F1, Band)),
        Call(forces.element_stiffness, (ForceTables, float, F1, F1, float, F1)),
        Call(forces.add_contact, (ContactTables, ByValue(Question), F1, F1, F1)),
        Call(own.own_solve, (int, float, F1, F1, F1, F1, F1, F1), bool),
        Call(band.multiply, (Band, F1, F1)),
        Call(band.factorize, (Band,), bool),
        Call(band.solve, (Band, F1)),
        Call(band.dense_solve, (F2, F1), bool),
        Call(band.solve_dependent, (F2, F1), bool),
        Call(band.fix, (Band, I1))),
}


def _type(hint):
    """The type of an argument, or of what is returned."""
    if isinstance(hint, ByValue):
        return types.NamedTuple(list(map(kind_of, hints(hint.kind))), hint.kind)
    return kind_of(read(hint))


def _shared(group, call):
    symbol = f"{__package__}.{call.text.__name__}.{key()}"
    return tuple(map(_type, call.args)), Shared(group, symbol, _type(call.returns))


@cache
def _tell() -> None:
    """Tell the texts of groups where they are."""
    for group, calls in GROUPS.items():
        for call in calls:
            args, shared = _shared(group, call)
            twin(call.text).shared[args] = shared


def prepare(function: FunctionType) -> None:
    """Compile, or take from disk, the groups of all that a function calls.

    Parameters
    ----------
    function
        That will be an entry.
    """
    _tell()
    seen: set[Text] = set()
    left = [function]
    while left:
        one = left.pop()
        called = (one.__globals__.get(name) for name in one.__code__.co_names)
        new = {x for x in called if isinstance(x, Text)} - seen
        seen |= new
        left += [x.function for x in new]
    for group in sorted({x.group for text in seen for x in text.shared.values()}):
        address_of_group(group)


def _place(number):
    return place_of(number)  # noqa: F821


@cache
def _places(group):
    """What knows the places of a group's texts, by their numbers."""
    texts = [(twin(call.text), _shared(group, call)[0]) for call in GROUPS[group]]

    @intrinsic
    def place_of(typing, number):
        made = [text.of(args) for text, args in texts]

        def generate(context, builder, signature, args):
            number, found = args[0], args[0].type(0)
            for k, one in enumerate(made):
                function = TextCallConv(context).declared(
                    builder.module, one.symbol, one.signature.return_type, one.signature.args)
                found = builder.select(builder.icmp_signed("==", number, number.type(k)),
                                       builder.ptrtoint(function, number.type), found)
            return found

        return types.int64(types.int64), generate

    function = named(_place, {"place_of": place_of})
    function.__qualname__ = f"{function.__qualname__}_{group}"
    return entry_of(function, (types.int64,), type("Group", (Entry,), {"group": group}))


def address(group: str) -> int:
    """Of the first text of a group; the linker is told those of all."""
    place, _ = _places(group)
    for k, call in enumerate(GROUPS[group]):
        add_symbol(_shared(group, call)[1].symbol, place(k))
    return place(0)
