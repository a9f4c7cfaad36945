"""Instructions of texts, as few as they need: the fewer there are, the fewer are to be optimised.

Numba keeps a variable on the stack, clears it where it ends, and copies an array there for each
look at its shape or one of its numbers. In texts a variable that is given once is the value that
it was given, and of an array they take what they ask for. Indices count from the begin, but in
texts of others. What is not said here is Numba's.
"""

from collections import Counter
from math import inf

from llvmlite import ir
from numba import types
from numba.core import analysis, cgutils, lowering
from numba.core.ir import Assign, Expr
from numba.np.arrayobj import load_item, store_item

from .flags import KnownOfOthers
from .views import part

#: Parts of pairs, by what Numba calls them, and of arrays, by their attributes.
_OF_PAIRS = {"pair_first": 0, "pair_second": 1}
_OF_ARRAYS = {"shape": "shape", "size": "nitems"}


class TextLower(lowering.Lower):
    """What turns a text into instructions."""

    def init(self):
        super().init()
        self._indices = {}

    def _find_singly_assigned_variable(self):
        """Those that need no place on the stack: given once, and before all that use them."""
        blocks = self.func_ir.blocks
        uses, dominators = analysis.compute_use_defs(blocks), analysis.compute_cfg_from_blocks(
            blocks).dominators()
        given = Counter(x.target.name for block in blocks.values()
                        for x in block.find_insts(Assign))
        first = {name: at for at, names in uses.defmap.items() for name in names}
        elsewhere = {name for at, names in uses.usemap.items() for name in names
                     if self._is_counted(name) or first.get(name, inf) >= at
                     or first[name] not in dominators[at]}
        self._singly_assigned_vars = {x for x, n in given.items() if n == 1} - elsewhere
        self._blk_local_varmap = {}

    def _is_counted(self, name):
        """True if it has arrays whose owners are counted."""
        return self.context.enable_nrt and self.context.data_model_manager[
            self.typeof(name)].contains_nrt_meminfo()

    def storevar(self, value, name, argidx=None):
        if self._is_counted(name):
            super().storevar(value, name, argidx)
        elif name in self._singly_assigned_vars:
            self._blk_local_varmap[name] = value
        else:
            self._alloca_var(name, self.typeof(name))
            self.builder.store(value, self.varmap[name])

    def delvar(self, name):
        if self._is_counted(name):
            super().delvar(name)

    def alloca_lltype(self, name, lltype, datamodel=None):
        return cgutils.alloca_once(self.builder, lltype, name=name)

    def loadvar(self, name):
        if name in self._indices:
            return self.context.make_tuple(self.builder, self.typeof(name), self._indices[name])
        return super().loadvar(name)

    def lower_inst(self, inst):
        """As Numba; the numbers of an index are kept as they are."""
        if isinstance(inst, Assign) and isinstance(inst.value, Expr):
            name, value = inst.target.name, inst.value
            if value.op == "build_tuple" and name in self._singly_assigned_vars and all(
                    isinstance(x, types.Integer) for x in self.typeof(name)):
                self._indices[name] = [
                    self.context.cast(self.builder, self.loadvar(x.name), self.typeof(x.name), to)
                    for x, to in zip(value.items, self.typeof(name))]
                return
        super().lower_inst(inst)

    def lower_expr(self, resty, expr):
        """Parts of pairs and of arrays."""
        if expr.op in _OF_PAIRS:
            return self.builder.extract_value(self.loadvar(expr.value.name), _OF_PAIRS[expr.op])
        if expr.op == "getattr" and expr.attr in _OF_ARRAYS:
            kind = self.typeof(expr.value.name)
            if isinstance(kind, types.Array):
                return part(self.context, self.builder, kind, self.loadvar(expr.value.name),
                            _OF_ARRAYS[expr.attr])
        return super().lower_expr(resty, expr)

    def lower_getitem(self, resty, expr, value, index, signature):
        """A number of an array."""
        place = self._place(value, index)
        if place is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        kind = self.typeof(value.name)
        found = load_item(self.context, self.builder, kind, place)
        return self.context.cast(self.builder, found, kind.dtype, resty)

    def lower_setitem(self, target_var, index_var, value_var, signature):
        """As :meth:`lower_getitem`."""
        given, kind = self.typeof(value_var.name), self.typeof(target_var.name)
        place = self._place(target_var, index_var) if isinstance(given, types.Number) else None
        if place is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        value = self.context.cast(self.builder, self.loadvar(value_var.name), given, kind.dtype)
        return store_item(self.context, self.builder, kind, value, place)

    def _place(self, array, index):
        """The address of a number; None if it is something else, or if bounds are checked."""
        kind, of = self.typeof(array.name), self.typeof(index.name)
        kinds = tuple(of) if isinstance(of, types.BaseTuple) else (of,)
        if (not isinstance(kind, types.Array) or len(kinds) != kind.ndim
                or not all(isinstance(x, types.Integer) for x in kinds)
                or self.context.enable_boundscheck):
            return None
        if index.name in self._indices:
            given = self._indices[index.name]
        else:
            given = self.loadvar(index.name)
            given = [given] if kinds == (of,) else cgutils.unpack_tuple(self.builder, given)
        given = [self.context.cast(self.builder, x, k, types.int64) for x, k in zip(given, kinds)]
        return _at(self.context, self.builder, kind, self.loadvar(array.name), given,
                   isinstance(self.flags, KnownOfOthers))


def _at(context, builder, kind, array, given, from_end):
    """The address of a number of an array; ``from_end`` if an index may be negative."""
    data, shape, strides = (part(context, builder, kind, array, name)
                            for name in ("data", "shape", "strides"))
    places = []
    for axis, at in enumerate(given):
        if from_end and not (isinstance(at, ir.Constant) and at.constant >= 0):
            length = builder.extract_value(shape, axis)
            negative = builder.icmp_signed("<", at, at.type(0))
            at = builder.select(negative, builder.add(at, length), at)
        places.append(at)
    if kind.layout == "A":
        offsets = [builder.mul(at, builder.extract_value(strides, axis))
                   for axis, at in enumerate(places)]
        total = offsets[0]
        for x in offsets[1:]:
            total = builder.add(total, x)
        return cgutils.pointer_add(builder, data, total)
    axes = range(1, kind.ndim) if kind.layout == "C" else range(kind.ndim - 2, -1, -1)
    total = places[0 if kind.layout == "C" else -1]
    for axis in axes:
        total = builder.add(builder.mul(total, builder.extract_value(shape, axis)), places[axis])
    return builder.gep(data, [total])
