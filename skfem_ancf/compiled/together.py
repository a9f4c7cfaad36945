"""What an entry calls, compiled as one with it.

Numba optimises a function, and makes machine code of it, by itself and again within each function
that calls it, at every level: most of the time that compiling took. Texts are typed one by one, as
Numba does, but share the module of the entry, which is optimised once.
"""

from __future__ import annotations

import dis
from itertools import count, pairwise
from typing import Any, NamedTuple

from llvmlite.binding import (create_pass_builder, create_pipeline_tuning_options,
                              parse_assembly)
from numba import types
from numba.core import cgutils, compiler, config
from numba.core.codegen import JITCodeLibrary
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target
from numba.core.imputils import lower_builtin, lower_constant
from numba.extending import models, register_model, typeof_impl

from . import nothing_collected
from .passes import TextCompiler


#: Lines of texts that become part of their callers; of longer ones LLVM wants to know what they do
#: to what they are given, which it looks for only in what may not be left out.
SHORT = 800
#: Modules whose texts are compiled for size: their loops take less time than what they call; and
#: texts of others.
BRIEF = {"border", "forces.texts", "kernels.section.section_gradients", "statics.iteration"} | {
    f"forces.contact_texts.{name}" for name in (
        "_carry", "_keep_work", "_near", "_of_group", "_reach_on", "_stride", "distances",
        "levers", "press", "resist", "stick")}


class _Library(JITCodeLibrary):
    """That of an entry: what has become part of its callers may be left out.

    The linker leaves out what is not called yet: callers come first.
    """

    def __init__(self, codegen, name):
        super().__init__(codegen, name)
        self.modules = []

    def add_llvm_module(self, module):
        self.modules.append(module)

    def _optimize_final_module(self):
        """As Numba, but loops are not unrolled: in small scenes they run a few times."""
        for sums in (False, True):
            options = create_pipeline_tuning_options(config.OPT)
            options.loop_vectorization, options.loop_unrolling = config.LOOP_VECTORIZE, False
            options.slp_vectorization = sums and config.SLP_VECTORIZE
            builder = create_pass_builder(self._codegen._tm, options)
            passes = builder.getModulePassManager()
            passes.add_refprune_pass()
            passes.run(self._final_module, builder)

    def finalize(self):
        while self.modules:
            super().add_llvm_module(self.modules.pop())
        super().finalize()


class _Part:
    """What a text puts into the library of an entry, for other entries that call it too."""

    def __init__(self, library, brief):
        self._library, self._brief = library, brief
        self.modules, self.linked, self.calls = [], [], {}

    def __getattr__(self, name):
        return getattr(self._library, name)

    def add_ir_module(self, module):
        functions = [x for x in module.functions if not x.is_declaration]
        if self._brief:
            for function in functions:
                function.attributes.add("optsize")
        text = str(module)
        read = parse_assembly(text)
        read.name = module.name
        read.verify()
        if text.count("\n") < SHORT:
            for function in functions:
                read.get_function(function.name).linkage = "linkonce_odr"
        self.modules.append(read)
        self._library.add_llvm_module(read.clone())

    def add_linking_library(self, library):
        self.linked.append(library)
        self._library.add_linking_library(library)


class _Open:
    """The library of an entry, texts that are in it, and those being lowered, innermost last.

    ``group`` is that of shared texts which it is made of; None for others.
    """

    def __init__(self, library, group):
        self.library, self.group, self.texts, self.parts = library, group, set(), []

    def take(self, text, args):
        """Put in what a text has put elsewhere, and what it calls."""
        if (text, args) in self.texts:
            return
        self.texts.add((text, args))
        part = text.made[args].part
        for call in part.calls:
            self.take(*call)
        for library in part.linked:
            self.library.add_linking_library(library)
        for module in part.modules:
            self.library.add_llvm_module(module.clone())


class _Typing:
    """Numba's context of types, which tries no function again for types that it knew before."""

    def __init__(self, context):
        self._context, self._found, self._functions = context, {}, {}

    def __getattr__(self, name):
        return getattr(self._context, name)

    def resolve_function_type(self, func, args, kws):
        """The signature of a call: Numba tries each of a function's templates until one fits."""
        function = self._function(func)
        if not isinstance(function, types.Function):
            return self._context.resolve_function_type(func, args, kws)
        key = function, tuple(args), tuple(dict(kws).items())
        signature, made = self._found.get(key, (None, None))
        # a template that was tried since, for other flags, may have made other code
        if signature is None or function.get_impl_key(signature) is not made:
            signature = self._context.resolve_function_type(func, args, kws)
            if signature is not None and signature.is_precise() and signature.recvr is None:
                self._found[key] = signature, function.get_impl_key(signature)
        return signature

    def _function(self, func):
        """What Numba knows a function by, an operator for instance."""
        if isinstance(func, types.Type | str):
            return func
        if func not in self._functions:
            self._functions[func] = self._context.resolve_value_type(func)
        return self._functions[func]


class _Made(NamedTuple):
    """A text for types of arguments: its signature, and what Numba knows it by.

    One that is called in another library has no part and no descriptor.
    """

    signature: Any
    key: object
    part: _Part | None = None
    descriptor: Any = None


class Shared(NamedTuple):
    """Where a text is for some types: its group, its name for the linker, and what it returns."""

    group: str
    symbol: str
    returns: types.Type


#: What texts take of NumPy, and of its arrays, without a need for another array.
_OF_NUMBERS = {"abs", "arctan2", "ceil", "floor", "hypot", "inf", "int64", "log1p", "maximum",
               "minimum", "nan", "sign", "sqrt"}
#: The entries that are being compiled, the innermost last.
_OPEN: list[_Open] = []
_TYPING = _Typing(cpu_target.typing_context)
_numbers = count()


class Text:
    """A function that compiled code calls: it becomes a part of each entry that does.

    Parameters
    ----------
    function
        A Python function.
    flags
        Two :class:`TextFlags`, with owners of arrays not counted and counted.
    """

    def __init__(self, function, flags):
        self.function, self.flags, self.made = function, flags, {}
        self.number = next(_numbers)
        self.shared, self._called = {}, {}

    def of(self, args):
        """Signature and key for types of arguments, in the entry that is being compiled."""
        entry = _OPEN[-1]
        if args in self.shared and self.shared[args].group != entry.group:
            if args not in self._called:
                self._called[args] = _by_symbol(self.shared[args], args)
            return self._called[args]
        if entry.parts:
            entry.parts[-1].calls[self, args] = None
        if args in self.made:
            entry.take(self, args)
        else:
            self.made[args] = self._lowered(args, entry)
            entry.texts.add((self, args))
        return self.made[args]

    def _lowered(self, args, entry):
        """Owners of arrays are counted only where one may be allocated, given back or boxed."""
        if not _makes_arrays(self.function):
            try:
                made = self._compiled(args, entry, False)
                if not _has_arrays(made.signature.return_type) or _gives_none(self.function):
                    return made
            except NumbaError:
                pass  # said again, if it was not for the owners
        return self._compiled(args, entry, True)

    def _compiled(self, args, entry, counts):
        module = str(self.function.__module__).partition(".")[2]  # None: made by exec
        brief = not BRIEF.isdisjoint((module, f"{module}.{self.function.__name__}"))
        part, key = _Part(entry.library, brief), object()
        entry.parts.append(part)
        try:
            made = compiler.compile_extra(_TYPING, cpu_target.target_context,
                                          self.function, args, None, self.flags[counts], {},
                                          library=part, pipeline_class=TextCompiler)
        finally:
            entry.parts.pop()
        cpu_target.target_context.insert_user_function(key, made.fndesc)
        return _Made(made.signature, key, part, made.fndesc)


def _by_symbol(shared, args):
    """A text that is compiled elsewhere."""
    def call(context, builder, signature, values):
        takes = signature.return_type, signature.args
        function = cgutils.get_or_insert_function(
            builder.module, context.call_conv.get_function_type(*takes), shared.symbol)
        status, value = context.call_conv.call_function(builder, function, *takes, values)
        with cgutils.if_unlikely(builder, status.is_error):
            context.call_conv.return_status_propagate(builder, status)
        return value

    key = object()
    cpu_target.target_context.insert_func_defn([(call, key, args)])
    return _Made(shared.returns(*args), key)


def _makes_arrays(function):
    """True if it calls functions of arrays, of NumPy or of Numba, which may make others."""
    given, code = function.__globals__, dis.get_instructions(function)
    of_numpy = {y.argval for x, y in pairwise(code)
                if x.opname == "LOAD_GLOBAL" and x.argval == "np"}
    return not of_numpy <= _OF_NUMBERS or any(
        isinstance(given.get(x), Dispatcher) for x in function.__code__.co_names)


def _gives_none(function):
    """True if the arrays that it returns are borrowed."""
    return "borrowed" in function.__code__.co_names


def _has_arrays(kind):
    if isinstance(kind, types.BaseTuple):
        return any(_has_arrays(x) for x in kind)
    return isinstance(kind, types.Array)


class TextType(types.Callable):
    """The type of a :class:`Text`."""

    def __init__(self, text):
        self.text = text
        super().__init__(f"text({text.function.__qualname__}, {text.number})")  # one by its name

    def get_call_type(self, context, args, kws):
        return self.text.of(tuple(types.unliteral(x) for x in args)).signature

    def get_call_signatures(self):
        return [], True

    def get_impl_key(self, sig):
        return self.text.of(sig.args).key


register_model(TextType)(models.OpaqueModel)


@typeof_impl.register(Text)
def _typeof(text, c):
    return TextType(text)


@lower_builtin("__array__", types.Array)
def _itself(context, builder, signature, args):
    """An array as an array. Numba looks for this at each access to one, each time everywhere."""
    return args[0]


@lower_constant(TextType)
def _constant(context, builder, kind, text):
    return context.get_dummy_value()


class Entry(compiler.Compiler):
    """The compiler of a function that Python, or another entry by its address, calls."""

    group: str | None = None

    def compile_extra(self, func):
        library = _Library(self.state.targetctx.codegen(), func.__qualname__)
        library.enable_object_caching()
        self.state.library = library
        _OPEN.append(_Open(library, self.group))
        try:
            with nothing_collected():
                return super().compile_extra(func)
        finally:
            _OPEN.pop()
