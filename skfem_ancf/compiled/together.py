"""What an entry calls, compiled as one with it.

Numba optimises a function, and makes machine code of it, by itself and again within each function
that calls it, at every level: most of the time that compiling took. Texts are typed one by one, as
Numba does, but share the module of the entry, which is optimised once.
"""

from __future__ import annotations

from itertools import count
from typing import Any, NamedTuple

from numba import types
from numba.core import compiler
from numba.core.registry import cpu_target
from numba.core.imputils import lower_constant
from numba.extending import models, register_model, typeof_impl

class _Part:
    """What a text puts into the library of an entry, for other entries that call it too."""

    def __init__(self, library):
        self._library, self.modules, self.linked, self.calls = library, [], [], {}

    def __getattr__(self, name):
        return getattr(self._library, name)

    def add_ir_module(self, module):
        self.modules.append(module)
        self._library.add_ir_module(module)

    def add_linking_library(self, library):
        self.linked.append(library)
        self._library.add_linking_library(library)


class _Open:
    """The library of an entry, texts that are in it, and those being lowered, innermost last."""

    def __init__(self, library):
        self.library, self.texts, self.parts = library, set(), []

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
            self.library.add_ir_module(module)


class _Made(NamedTuple):
    """A text for types of arguments: its signature, and what Numba knows it by."""

    signature: Any
    key: object
    part: _Part


#: The entries that are being compiled, the innermost last.
_OPEN: list[_Open] = []
_numbers = count()


class Text:
    """A function that compiled code calls: it becomes a part of each entry that does.

    Parameters
    ----------
    function, options
        A Python function, and Numba's options.
    """

    def __init__(self, function, options):
        self.function, self.options, self.made = function, options, {}
        self.number = next(_numbers)

    def of(self, args):
        """Signature and key for types of arguments, in the entry that is being compiled."""
        entry = _OPEN[-1]
        if entry.parts:
            entry.parts[-1].calls[self, args] = None
        if args in self.made:
            entry.take(self, args)
        else:
            self.made[args] = self._lowered(args, entry)
            entry.texts.add((self, args))
        return self.made[args]

    def _lowered(self, args, entry):
        flags, part, key = compiler.Flags(), _Part(entry.library), object()
        cpu_target.options.parse_as_flags(flags, {"nopython": True, **self.options})
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        entry.parts.append(part)
        try:
            made = compiler.compile_extra(cpu_target.typing_context, cpu_target.target_context,
                                          self.function, args, None, flags, {}, library=part)
        finally:
            entry.parts.pop()
        cpu_target.target_context.insert_user_function(key, made.fndesc)
        return _Made(made.signature, key, part)


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


@lower_constant(TextType)
def _constant(context, builder, kind, text):
    return context.get_dummy_value()


class Entry(compiler.Compiler):
    """The compiler of a function that Python, or another entry by its address, calls."""

    def compile_extra(self, func):
        library = self.state.targetctx.codegen().create_library(func.__qualname__)
        library.enable_object_caching()
        self.state.library = library
        _OPEN.append(_Open(library))
        try:
            return super().compile_extra(func)
        finally:
            _OPEN.pop()
