"""What an entry calls, compiled as one with it.

Numba optimises a function, and makes machine code of it, by itself and again within each function
that calls it, at every level: most of the time that compiling took. Texts are typed one by one, as
Numba does, but share the module of the entry, which is optimised once.
"""

from __future__ import annotations

from functools import cached_property
from itertools import count
from typing import Any, NamedTuple

from llvmlite.binding import (Linkage, Visibility, create_pass_builder,
                              create_pipeline_tuning_options, parse_assembly)
from llvmlite.ir import Ret
from numba import types
from numba.core import compiler, config
from numba.core.codegen import JITCodeLibrary
from numba.core.errors import NumbaError
from numba.core.registry import cpu_target
from numba.core.imputils import lower_builtin, lower_constant
from numba.extending import models, register_model, typeof_impl

from . import nothing_collected
from .convention import TextCallConv, is_known
from .lowering import TextType
from .passes import TextCompiler
from .views import has_arrays


#: Modules whose texts are compiled for size: their loops take less time than what they call; and
#: texts of others.
BRIEF = {"forces.texts", "kernels.section.section_gradients", "statics.iteration"} | {
    f"forces.contact_texts.{name}" for name in (
        "_carry", "_keep_work", "_near", "_of_group", "_reach_on", "_stride", "distances",
        "levers", "press", "resist", "stick")}


class _Library(JITCodeLibrary):
    """That of an entry, in which nobody else calls its texts: LLVM sees all that they are given."""

    def _optimize_functions(self, module):
        """Not one by one, since all are once they are together."""

    def _optimize_final_module(self):
        """As Numba, but loops are not unrolled: in small scenes they run a few times."""
        for function in self._final_module.functions:
            if function.visibility is Visibility.hidden:
                function.linkage = Linkage.internal
        for sums in (False, True):
            options = create_pipeline_tuning_options(config.OPT)
            options.loop_vectorization, options.loop_unrolling = config.LOOP_VECTORIZE, False
            options.slp_vectorization = sums and config.SLP_VECTORIZE
            builder = create_pass_builder(self._codegen._tm, options)
            passes = builder.getModulePassManager()
            passes.add_refprune_pass()
            passes.run(self._final_module, builder)


class _Part:
    """What a text puts into the library of an entry, for other entries that call it too."""

    def __init__(self, library, brief, counts):
        self._library, self._brief, self.counts = library, brief, counts
        self.modules, self.linked, self.calls, self.fails = [], [], {}, False

    def __getattr__(self, name):
        return getattr(self._library, name)

    def add_ir_module(self, module):
        functions = [x for x in module.functions if not x.is_declaration]
        ends = (block.terminator for function in functions for block in function.blocks)
        self.fails = any(isinstance(x, Ret) and getattr(x.return_value, "constant", 1) != 0
                         for x in ends)
        if self._brief:
            for function in functions:
                function.attributes.add("optsize")
        read = parse_assembly(str(module))
        read.name = module.name
        read.verify()
        for function in functions:
            read.get_function(function.name).visibility = Visibility.hidden
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

    @property
    def counts(self):
        """True if owners of arrays are counted in what is being lowered, as in an entry itself."""
        return not self.parts or self.parts[-1].counts

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
    """A text for types of arguments: its signature, and what Numba and the linker know it by.

    One that is called in another library has no part.
    """

    signature: Any
    key: object
    part: _Part | None = None
    symbol: str = ""
    counts: bool = False


class Shared(NamedTuple):
    """Where a text is for some types: its group, its name for the linker, and what it returns."""

    group: str
    symbol: str
    returns: types.Type


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
        :class:`~.flags.TextFlags`, those tried first where owners of arrays are not counted.
    """

    def __init__(self, function, flags):
        self.function, self.flags, self.made = function, flags, {}
        self.number = next(_numbers)
        self.shared, self._called = {}, {}

    def of(self, args):
        """Signature and key for types of arguments, in the entry that is being compiled."""
        entry = _OPEN[-1]
        made = self._of(args, entry)
        lent = made.counts or "borrowed" in self.function.__code__.co_names
        if lent or not entry.counts or not has_arrays(made.signature.return_type):
            return made
        return self._counted.of(args)

    @cached_property
    def _counted(self):
        """The same for those who count the owners of arrays that it gives back."""
        return Text(self.function, self.flags[-1:])

    def _of(self, args, entry):
        if args in self.shared and self.shared[args].group != entry.group:
            if args not in self._called:
                self._called[args] = self._elsewhere(self.shared[args], args)
            return self._called[args]
        if entry.parts:
            entry.parts[-1].calls[self, args] = None
        if args in self.made:
            entry.take(self, args)
        else:
            self.made[args] = self._lowered(args, entry)
            entry.texts.add((self, args))
        return self.made[args]

    def _elsewhere(self, shared, args):
        key = object()
        _by_symbol(key, args, shared.symbol)
        return _Made(shared.returns(*args), key)

    def gives_owners(self, args):
        """True if arrays that it returns are the caller's from then on."""
        return args in self.made and self.made[args].counts

    def _lowered(self, args, entry):
        """Owners of arrays are counted only where a text gives away what it makes."""
        for flags in self.flags[:-1]:
            try:
                return self._compiled(args, entry, flags)
            except NumbaError:
                pass  # said again, if it was not for the owners
        return self._compiled(args, entry, self.flags[-1])

    def _compiled(self, args, entry, flags):
        module = str(self.function.__module__).partition(".")[2]  # None: made by exec
        brief = not BRIEF.isdisjoint((module, f"{module}.{self.function.__name__}"))
        part, key = _Part(entry.library, brief, flags.counts), object()
        entry.parts.append(part)
        try:
            made = compiler.compile_extra(_TYPING, cpu_target.target_context,
                                          self.function, args, None, flags, {},
                                          library=part, pipeline_class=TextCompiler)
        finally:
            entry.parts.pop()
        if is_known(made.fndesc.restype):
            _by_symbol(key, args, made.fndesc.mangled_name, part.fails)
        else:
            cpu_target.target_context.insert_user_function(key, made.fndesc)
        return _Made(made.signature, key, part, made.fndesc.mangled_name, flags.counts)


def _by_symbol(key, args, symbol, fails=True):
    """Let Numba know how to call a text."""
    def call(context, builder, signature, values):
        return TextCallConv(context).call(builder, symbol, signature, values, fails)

    cpu_target.target_context.insert_func_defn([(call, key, args)])


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
