"""The loops of texts, with the few instructions that they take.

Numba's ``range`` is an object with a step of any sign, and what iterates over it another: some
hundred and twenty instructions for each loop, a quarter of what there was to optimise.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.extending import models, register_model, type_callable

_NUMBER, _WORD = types.int64, ir.IntType(64)


def counted(*ends):
    """Numbers as of ``range``, one by one."""
    return range(*ends)


class Numbers(types.SimpleIterableType):
    """The type of numbers that follow one another: where they begin and end."""

    def __init__(self):
        super().__init__("numbers", Counter())


class Counter(types.SimpleIteratorType):
    """The type of what iterates over them: where the next one stands, and the end."""

    def __init__(self):
        super().__init__("counter", _NUMBER)


@register_model(Numbers)
class _Ends(models.StructModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("first", _NUMBER), ("last", _NUMBER)])


@register_model(Counter)
class _Next(models.StructModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, [("next", types.CPointer(_NUMBER)), ("last", _NUMBER)])


@type_callable(counted)
def _typed(context):
    def of(first, last=None, step=None):
        return Numbers() if step is None else types.range_state64_type

    return of


@lower_builtin(counted, types.Integer)
def _up_to(context, builder, signature, args):
    last = context.cast(builder, args[0], signature.args[0], _NUMBER)
    return cgutils.make_anonymous_struct(builder, [_WORD(0), last])


@lower_builtin(counted, types.Integer, types.Integer)
def _between(context, builder, signature, args):
    return cgutils.make_anonymous_struct(builder, [
        context.cast(builder, x, kind, _NUMBER) for x, kind in zip(args, signature.args)])


@lower_builtin(counted, types.Integer, types.Integer, types.Integer)
def _by_steps(context, builder, signature, args):
    takes = types.range_state64_type(_NUMBER, _NUMBER, _NUMBER)
    return context.get_function(range, takes)(builder, [
        context.cast(builder, x, kind, _NUMBER) for x, kind in zip(args, signature.args)])


@lower_builtin("getiter", Numbers)
def _begin(context, builder, signature, args):
    place = cgutils.alloca_once(builder, _WORD)
    builder.store(builder.extract_value(args[0], 0), place)
    return cgutils.make_anonymous_struct(builder, [place, builder.extract_value(args[0], 1)])


@lower_builtin("iternext", Counter)
def _next(context, builder, signature, args):
    place, last = cgutils.unpack_tuple(builder, args[0], 2)
    number = builder.load(place)
    builder.store(builder.add(number, _WORD(1)), place)
    return cgutils.make_anonymous_struct(builder, [
        number, builder.icmp_signed("<", number, last)])
