"""Instructions of texts, as few as they need: the fewer there are, the fewer are to be optimised.

Numba keeps a variable on the stack, clears it where it ends, and copies an array there for each
look at its shape or one of its numbers. In texts a variable that is given once is the value that
it was given, and of an array they take what they ask for. Indices count from the begin, but in
texts of others. An array that a text makes lives until the text returns, so that none of its
variables counts owners. What is not said here is Numba's.
"""

from collections import Counter
from math import inf
from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import analysis, cgutils, lowering
from numba.core.errors import LoweringError
from numba.core.ir import Arg, Assign, Expr, Return
from numba.np.arrayobj import load_item, store_item

from .convention import TextCallConv, is_known
from .flags import KnownOfOthers
from .views import array_at, borrowed, has_arrays, owners, part, room, shaped, without_owner

#: Parts of pairs, by what Numba calls them, and of arrays, by their attributes.
_OF_PAIRS = {"pair_first": 0, "pair_second": 1}
_OF_ARRAYS = {"shape": "shape", "size": "nitems"}
#: What gives arrays of others: of those that it is given, or on the stack.
_VIEWS = room, shaped, borrowed
_POINTER = ir.IntType(8).as_pointer()


class TextType(types.Callable):
    """The type of a :class:`~skfem_ancf.equations.compiled.together.Text`."""

    def __init__(self, text):
        self.text = text
        super().__init__(f"text({text.function.__qualname__}, {text.number})")  # one by its name

    def get_call_type(self, context, args, kws):
        return self.text.of(tuple(types.unliteral(x) for x in args)).signature

    def get_call_signatures(self):
        return [], True

    def get_impl_key(self, sig):
        return self.text.of(sig.args).key


class _Part(NamedTuple):
    """Where a slice begins and ends; None where nothing is said."""

    first: Any
    last: Any


class TextLower(lowering.Lower):
    """What turns a text into instructions."""

    def init(self):
        super().init()
        self._indices, self._slices, self._held, self._returns = {}, {}, [], []
        self._known = is_known(self.fndesc.restype)
        self._convention = TextCallConv(self.context) if self._known else self.context.call_conv

    @property
    def call_conv(self):
        return self._convention

    def setup_function(self, fndesc):
        if not self._known:
            return super().setup_function(fndesc)
        self.function = self._convention.declared(
            self.module, fndesc.mangled_name, fndesc.restype, fndesc.argtypes)
        self._convention.decorate_function(self.function, fndesc.args, fndesc.argtypes)
        self.entry_block = self.function.append_basic_block("entry")
        self.builder = ir.IRBuilder(self.entry_block)
        self.call_helper = self._convention.init_call_helper(self.builder)
        return None

    # variables

    def _find_singly_assigned_variable(self):
        """Those that need no place on the stack: given once, and before all that use them."""
        blocks = self.func_ir.blocks
        uses, flow = analysis.compute_use_defs(blocks), analysis.compute_cfg_from_blocks(blocks)
        dominators = flow.dominators()
        given = Counter(x.target.name for block in blocks.values()
                        for x in block.find_insts(Assign))
        first = {name: at for at, names in uses.defmap.items() for name in names}
        elsewhere = {name for at, names in uses.usemap.items() for name in names
                     if self._is_counted(name) or first.get(name, inf) >= at
                     or first[name] not in dominators[at]}
        self._singly_assigned_vars = {x for x, n in given.items() if n == 1} - elsewhere
        self._blk_local_varmap = {}
        self._repeated = {id(blocks[at]) for loop in flow.loops().values() for at in loop.body}

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

    # indices, of which nothing is made where their parts are enough

    def lower_inst(self, inst):
        """As Numba; an index is kept in its parts."""
        if isinstance(inst, Assign) and isinstance(inst.value, Expr) and self._keeps(inst):
            return
        super().lower_inst(inst)
        if isinstance(inst, Return):
            self._returns.append(self.builder.block.terminator)

    def _keeps(self, inst):
        """True if it is an index, which is kept from now on."""
        name, expr = inst.target.name, inst.value
        if name not in self._singly_assigned_vars:
            return False
        if expr.op == "build_tuple":
            items = [x.name for x in expr.items]
            if any(x not in self._slices and not isinstance(self.typeof(x), types.Integer)
                   for x in items):
                return False
            self._indices[name] = [self._slices.get(x) or self._number(x) for x in items]
        elif expr.op == "call" and len(expr.args) == 2 and getattr(
                self.typeof(expr.func.name), "typing_key", None) is slice:
            self._slices[name] = _Part(*(
                None if isinstance(self.typeof(x.name), types.NoneType) else self._number(x.name)
                for x in expr.args))
        else:
            return False
        return True

    def _number(self, name):
        return self.context.cast(self.builder, self.loadvar(name), self.typeof(name), types.int64)

    def loadvar(self, name):
        if name in self._indices:
            kind = self.typeof(name)
            return self.context.make_tuple(self.builder, kind, [
                self._made(x, of) if isinstance(x, _Part)
                else self.context.cast(self.builder, x, types.int64, of)
                for x, of in zip(self._indices[name], kind)])
        if name in self._slices:
            return self._made(self._slices[name], self.typeof(name))
        return super().loadvar(name)

    def _made(self, bounds, kind):
        """A slice as Numba has it."""
        found = self.context.make_helper(self.builder, kind)
        word = found.step.type
        found.start = word(0) if bounds.first is None else bounds.first
        found.stop = word(2**63 - 1) if bounds.last is None else bounds.last
        found.step = word(1)
        return found._getvalue()

    # numbers and parts of arrays

    def lower_getitem(self, resty, expr, value, index, signature):
        """A number of an array, or a part in one piece."""
        found, kind = self._place(value, index), self.typeof(value.name)
        if found is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        pointer, shape = found
        if shape:
            of = kind.copy(ndim=len(shape))
            given = array_at(self.context, self.builder, of, pointer, shape)
        else:
            of, given = kind.dtype, load_item(self.context, self.builder, kind, pointer)
        return self.context.cast(self.builder, given, of, resty)

    def lower_setitem(self, target_var, index_var, value_var, signature):
        """A number into such a place, or everywhere in a part."""
        given, kind = self.typeof(value_var.name), self.typeof(target_var.name)
        found = self._place(target_var, index_var) if isinstance(given, types.Number) else None
        if found is None:
            return super().lower_setitem(target_var, index_var, value_var, signature)
        pointer, shape = found
        context, builder = self.context, self.builder
        number = context.cast(builder, self.loadvar(value_var.name), given, kind.dtype)
        if not shape:
            return store_item(context, builder, kind, number, pointer)
        count = shape[0]
        for n in shape[1:]:
            count = builder.mul(count, n)
        with cgutils.for_range(builder, count) as loop:
            store_item(context, builder, kind, number, builder.gep(pointer, [loop.index]))
        return None

    def _place(self, array, index):
        """Address and shape of what an index says; None if it is none of this, or is checked."""
        kind, of, name = self.typeof(array.name), self.typeof(index.name), index.name
        if not isinstance(kind, types.Array) or self.context.enable_boundscheck:
            return None
        if name in self._indices or name in self._slices:
            parts = self._indices.get(name) or [self._slices[name]]
        elif isinstance(of, types.Integer):
            parts = [self._number(name)]
        elif isinstance(of, types.BaseTuple) and all(isinstance(x, types.Integer) for x in of):
            parts = [self.context.cast(self.builder, x, k, types.int64) for x, k in zip(
                cgutils.unpack_tuple(self.builder, self.loadvar(name)), of)]
        else:
            return None
        whole = len(parts) == kind.ndim and not isinstance(parts[-1], _Part)
        if not whole and (kind.layout != "C" or self._is_counted(array.name)) or any(
                isinstance(x, _Part) for x in parts[:-1]):
            return None
        return _at(self.context, self.builder, kind, self.loadvar(array.name), parts,
                   isinstance(self.flags, KnownOfOthers))

    # parts of pairs and of arrays; calls

    def lower_expr(self, resty, expr):
        if expr.op in _OF_PAIRS:
            return self.builder.extract_value(self.loadvar(expr.value.name), _OF_PAIRS[expr.op])
        if expr.op == "getattr" and expr.attr in _OF_ARRAYS:
            kind = self.typeof(expr.value.name)
            if isinstance(kind, types.Array):
                return part(self.context, self.builder, kind, self.loadvar(expr.value.name),
                            _OF_ARRAYS[expr.attr])
        return super().lower_expr(resty, expr)

    def lower_call(self, resty, expr):
        """As Numba; arrays that a call makes are the text's, until it returns."""
        found = super().lower_call(resty, expr)
        if self.context.enable_nrt or not self._makes_arrays(expr):
            return found
        for owner in owners(self.context, self.builder, resty, found):
            self._hold(owner)
        return without_owner(self.context, self.builder, resty, found)

    def _makes_arrays(self, call):
        kind = self.typeof(call.func.name)
        if isinstance(kind, TextType):
            return kind.text.gives_owners(self.fndesc.calltypes[call].args)
        called = getattr(kind, "typing_key", None)
        return not (isinstance(kind, types.NamedTupleClass) or called in _VIEWS
                    or called is np.dot and len(call.args) == 3)

    def _hold(self, owner):
        if id(self._cur_ir_block) in self._repeated:
            raise LoweringError("arrays are made in a loop", loc=self.loc)
        if has_arrays(self.fndesc.restype):
            raise LoweringError("arrays are made and given away", loc=self.loc)
        place = cgutils.alloca_once(self.builder, _POINTER)
        self.builder.store(owner, place)
        self._held.append(place)

    def lower_assign(self, ty, inst):
        """As Numba; arrays that are given are the caller's."""
        found = super().lower_assign(ty, inst)
        if isinstance(inst.value, Arg) and not self.context.enable_nrt and not self._known:
            return without_owner(self.context, self.builder, ty, found)
        return found

    def post_lower(self):
        """Give back the arrays that were made."""
        super().post_lower()
        if not self._held:
            return
        function = cgutils.get_or_insert_function(
            self.module, ir.FunctionType(ir.VoidType(), [_POINTER]), "NRT_decref")
        for end in self._returns:
            self.builder.position_before(end)
            for place in self._held:
                self.builder.call(function, [self.builder.load(place)])


def _at(context, builder, kind, array, parts, from_end):
    """Address and shape of a part of an array: numbers, and at the end there may be a slice.

    They may be counted from the end of an axis where ``from_end`` is true.
    """
    data, shape, strides = (part(context, builder, kind, array, name)
                            for name in ("data", "shape", "strides"))
    shape = cgutils.unpack_tuple(builder, shape)
    places, rest = [], shape[len(parts):]
    for at, length in zip(parts, shape):
        if isinstance(at, _Part):
            at, last = (_clipped(builder, x, length, end, from_end)
                        for x, end in zip(at, (length.type(0), length)))
            count = builder.sub(last, at)
            rest.insert(0, _larger(builder, count, count.type(0)))
        elif from_end:
            at = _from_end(builder, at, length)
        places.append(at)
    if kind.layout == "A":
        offsets = [builder.mul(at, builder.extract_value(strides, axis))
                   for axis, at in enumerate(places)]
        total = offsets[0]
        for x in offsets[1:]:
            total = builder.add(total, x)
        return cgutils.pointer_add(builder, data, total), rest
    if kind.layout == "F":
        places, shape = places[::-1], shape[::-1]
    total = places[0]
    for at, length in zip(places[1:], shape[1:]):
        total = builder.add(builder.mul(total, length), at)
    for length in shape[len(places):]:
        total = builder.mul(total, length)
    return builder.gep(data, [total]), rest


def _from_end(builder, at, length):
    """A place that may be counted from the end."""
    if isinstance(at, ir.Constant) and at.constant >= 0:
        return at
    return builder.select(builder.icmp_signed("<", at, at.type(0)), builder.add(at, length), at)


def _clipped(builder, at, length, otherwise, from_end):
    """Where a slice begins or ends."""
    if at is None:
        return otherwise
    if from_end:
        at = _larger(builder, _from_end(builder, at, length), at.type(0))
    return builder.select(builder.icmp_signed("<", at, length), at, length)


def _larger(builder, a, b):
    return builder.select(builder.icmp_signed(">", a, b), a, b)
