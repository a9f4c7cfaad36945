"""Short sums of arrays, by vectors.

LLVM's own vectors are of sixteen numbers and more in a loop of unknown length, and the columns of
a band are shorter: it would take them number by number.
"""

from contextlib import contextmanager

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.cgutils import unpack_tuple
from numba.extending import intrinsic

from .views import part

_REAL, _WORD, _PLACE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
#: Numbers of a vector, and bytes that they are aligned to: those of one of them.
WIDE, _ALIGNED = 4, 8
_VECTOR = ir.VectorType(_REAL, WIDE)
#: Numbers behind those asked for that a vector may reach.
MORE = WIDE - 1
_FUSED = ("contract",)


@intrinsic
def subtract(typing, y, to, x, of, n, c):
    """y[to + i] -= the sum of c[k] x[of[k] + i], for n numbers."""
    def generate(context, builder, signature, args):
        _, to, _, of, n, c = args
        ends = [_end(context, builder, y, args[0], to), *(
            _end(context, builder, x, args[2], at) for at in unpack_tuple(builder, of))]
        c = unpack_tuple(builder, c)
        wide = [_wide(builder, one) for one in c]
        for i, kind in _all(builder, n):
            _write(builder, i, ends, wide if kind == _VECTOR else c, _subtracted)
        return context.get_dummy_value()

    return types.void(y, types.int64, x, of, types.int64, c), generate


@intrinsic
def products(typing, x, at, n, y, of):
    """The sum of x[at + i] y[of[k] + i] for n numbers, for each k."""
    found = types.UniTuple(types.float64, len(of))

    def generate(context, builder, signature, args):
        _, at, n, _, of = args
        ends = [_end(context, builder, x, args[0], at), *(
            _end(context, builder, y, args[3], k) for k in unpack_tuple(builder, of))]
        sums = [cgutils.alloca_once_value(builder, _wide(builder, _REAL(0.0))) for _ in ends[1:]]
        for i, kind in _all(builder, n):
            factor, *columns = _read(builder, i, ends, kind)
            for place, values in zip(sums, columns):
                if kind == _REAL:
                    place = builder.gep(builder.bitcast(place, _REAL.as_pointer()), [_PLACE(0)])
                product = builder.fmul(factor, values, flags=_FUSED)
                builder.store(builder.fadd(builder.load(place), product, flags=_FUSED), place)
        return cgutils.pack_array(builder, [_sum(builder, builder.load(place)) for place in sums])

    return found(x, types.int64, types.int64, y, of), generate


@intrinsic
def subtract_columns(typing, y, to, n, of, c):
    """y[to + i] -= the sum of c[k] y[of[k] + i], for n numbers and up to :data:`MORE` behind."""
    def generate(context, builder, signature, args):
        ends = [_end(context, builder, y, args[0], at)
                for at in (args[1], *unpack_tuple(builder, args[3]))]
        factors = [_wide(builder, x) for x in unpack_tuple(builder, args[4])]
        with _vectors(builder, args[2]) as i:
            _write(builder, i, ends, factors, _subtracted)
        return context.get_dummy_value()

    return types.void(y, types.int64, types.int64, of, c), generate


@intrinsic
def eliminate(typing, y, back, to, n, of, c):
    """y[to + i] -= the sum of c[k] y[back + of[k]] y[of[k] + i], for n numbers and up to MORE.

    And y[back + to + i] likewise, by c[k] y[of[k]]; if ``back`` is None, the former by these.
    """
    def generate(context, builder, signature, args):
        _, distance, to, n, of, c = args
        ends = [_end(context, builder, y, args[0], at) for at in (to, *unpack_tuple(builder, of))]
        halves = [ends]
        if back != types.none:
            halves.append([builder.gep(end, [distance]) for end in ends])
        for half, other in zip(halves, halves[::-1]):
            factors = [_wide(builder, builder.fmul(x, builder.load(end)))
                       for x, end in zip(unpack_tuple(builder, c), other[1:])]
            with _vectors(builder, n) as i:
                _write(builder, i, half, factors, _subtracted)
        return context.get_dummy_value()

    return types.void(y, back, types.int64, types.int64, of, c), generate


@intrinsic
def scale(typing, y, back, to, n, c):
    """y[to + i] *= c, for n numbers and up to MORE behind; and y[back + to + i] if not None."""
    def generate(context, builder, signature, args):
        _, distance, to, n, c = args
        end, c = _end(context, builder, y, args[0], to), _wide(builder, c)
        for one in [end] if back == types.none else [end, builder.gep(end, [distance])]:
            with _vectors(builder, n) as i:
                _write(builder, i, [one], [c], lambda builder, values, c: builder.fmul(*values, *c))
        return context.get_dummy_value()

    return types.void(y, back, types.int64, types.int64, types.float64), generate


def _end(context, builder, kind, array, at):
    """The address of a number of an array."""
    return builder.gep(part(context, builder, kind, array, "data"), [at])


def _wide(builder, c):
    """A vector of equal numbers."""
    wide = ir.Constant(_VECTOR, ir.Undefined)
    for k in range(WIDE):
        wide = builder.insert_element(wide, c, _PLACE(k))
    return wide


def _sum(builder, wide):
    """Of the numbers of a vector."""
    low, high = (builder.fadd(*(builder.extract_element(wide, _PLACE(k)) for k in pair))
                 for pair in ((0, 1), (2, 3)))
    return builder.fadd(low, high)


@contextmanager
def _vectors(builder, n):
    """A loop over n numbers, vector by vector."""
    with cgutils.for_range_slice(builder, _WORD(0), n, _WORD(WIDE)) as (i, _):
        yield i


def _all(builder, n):
    """Code for n numbers: vectors, then the others one by one; where they are, and what.

    Of these there is no loop, since LLVM would make one of vectors of it.
    """
    whole = builder.and_(n, _WORD(-WIDE))
    with _vectors(builder, whole) as i:
        yield i, _VECTOR
    for k in range(MORE):
        at = builder.add(whole, _WORD(k))
        with builder.if_then(builder.icmp_signed("<", at, n)):
            yield at, _REAL


def _read(builder, i, ends, kind):
    """Numbers, i of them behind each of some places."""
    values = [builder.load(builder.bitcast(builder.gep(end, [i]), kind.as_pointer()))
              for end in ends]
    for x in values:
        x.align = _ALIGNED
    return values


def _write(builder, i, ends, factors, value):
    """Replace those behind the first place by what follows from all."""
    kind = factors[0].type
    found = value(builder, _read(builder, i, ends, kind), factors)
    place = builder.bitcast(builder.gep(ends[0], [i]), kind.as_pointer())
    builder.store(found, place).align = _ALIGNED


def _subtracted(builder, values, factors):
    y, *columns = values
    for x, c in zip(columns, factors):
        y = builder.fsub(y, builder.fmul(c, x, flags=_FUSED), flags=_FUSED)
    return y
