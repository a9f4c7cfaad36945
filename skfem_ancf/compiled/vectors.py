"""Short sums of arrays, by vectors.

LLVM's own vectors are of sixteen numbers and more in a loop of unknown length, and the columns of
a band are shorter: it would take them number by number.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from .views import part

_REAL, _WORD, _PLACE = ir.DoubleType(), ir.IntType(64), ir.IntType(32)
#: Numbers of a vector, and bytes that they are aligned to: those of one of them.
WIDE, _ALIGNED = 4, 8
_VECTOR = ir.VectorType(_REAL, WIDE)


@intrinsic
def subtract(typing, y, to, x, of, n, c):
    """y[to + i] -= c x[of + i] for n numbers."""
    def generate(context, builder, signature, args):
        _, to, _, of, n, c = args
        ends = [builder.gep(part(context, builder, kind, array, "data"), [at])
                for kind, array, at in ((y, args[0], to), (x, args[2], of))]
        wide = ir.Constant(_VECTOR, ir.Undefined)
        for k in range(WIDE):
            wide = builder.insert_element(wide, c, ir.Constant(_PLACE, k))
        whole = builder.and_(n, ir.Constant(_WORD, -WIDE))
        for first, last, step, factor, kind in (
                (ir.Constant(_WORD, 0), whole, WIDE, wide, _VECTOR), (whole, n, 1, c, _REAL)):
            with cgutils.for_range_slice(builder, first, last, ir.Constant(_WORD, step)) as (i, _):
                _subtract(builder, [builder.bitcast(builder.gep(end, [i]), kind.as_pointer())
                                    for end in ends], factor)
        return context.get_dummy_value()

    return types.void(y, types.int64, x, types.int64, types.int64, types.float64), generate


def _subtract(builder, places, factor):
    """One number, or one vector of them."""
    y, x = (builder.load(place) for place in places)
    y.align = x.align = _ALIGNED
    product = builder.fmul(factor, x, flags=("contract",))
    builder.store(builder.fsub(y, product, flags=("contract",)), places[0]).align = _ALIGNED
