"""The text of a law in Python: its operations on a strain, followed once and differentiated.

A law is called with arrays of symbols in place of numbers, as NumPy allows for arrays of objects.
What it does to them is written down as a text, see :mod:`skfem_ancf.core.source`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.source import lanes, source

if TYPE_CHECKING:
    from ..core.types import Array, Law


class NotFollowed(Exception):
    """Why a law has no text."""


def _binary(operation: str, turned: bool = False) -> Any:
    def method(self, other):
        other = self.graph.number(other)
        return self.graph.symbol(operation, *((other, self) if turned else (self, other)))

    return method


def _unary(operation: str) -> Any:
    def method(self: Symbol) -> Symbol:
        return self.graph.symbol(operation, self)

    return method


def _power(a: Any, b: Any) -> Any:
    """Whole powers as products: quicker, and exact for negative numbers."""
    n = b if isinstance(b, (int, float)) else getattr(b, "value", None)
    if n is None or n != int(n) or not 0 <= n <= 8:
        return a.graph.symbol("**", a, a.graph.number(b))
    out = a.graph.number(1.0)
    for _ in range(int(n)):
        out = out * a
    return out


class Symbol:
    """A number that depends on a strain: the name of an operation and what it takes.

    Parameters
    ----------
    graph
        Where equal symbols are one.
    operation, arguments
        "strain" and a component, "number" and its value, or an operation of :data:`TEXTS` and
        other symbols.
    """

    __slots__ = "arguments", "graph", "operation"

    def __init__(self, graph: Graph, operation: str, arguments: tuple[Any, ...]) -> None:
        self.graph, self.operation, self.arguments = graph, operation, arguments

    @property
    def value(self) -> float | None:
        """That of a number, else None."""
        return self.arguments[0] if self.operation == "number" else None

    def __bool__(self):
        raise NotFollowed("it compares strains")

    def __lt__(self, other: Any) -> bool:
        return bool(self)

    __le__ = __gt__ = __ge__ = __lt__
    def __float__(self):
        raise NotFollowed("it makes numbers of strains, as arrays of a given type do: "
                          "np.zeros_like(strain) takes what the strain is made of")

    __complex__ = __int__ = __float__
    __add__, __radd__ = _binary("+"), _binary("+", True)
    __sub__, __rsub__ = _binary("-"), _binary("-", True)
    __mul__, __rmul__ = _binary("*"), _binary("*", True)
    __truediv__, __rtruediv__ = _binary("/"), _binary("/", True)
    __pow__, __rpow__ = _power, _binary("**", True)
    __neg__, __abs__ = _unary("negative"), _unary("absolute")

    def __pos__(self) -> Symbol:
        return self


class Graph:
    """The symbols of a law; equal ones are one."""

    def __init__(self) -> None:
        self._known: dict[tuple[Any, ...], Symbol] = {}

    def symbol(self, operation: str, *arguments: Any) -> Symbol:
        """The symbol of an operation, simplified where a number is 0 or 1.

        Parameters
        ----------
        operation, *arguments
            As for :class:`Symbol`.
        """
        simple = self._simplified(operation, arguments)
        if simple is not None:
            return simple
        key = operation, *(id(x) if isinstance(x, Symbol) else x for x in arguments)
        if key not in self._known:
            self._known[key] = Symbol(self, operation, arguments)
        return self._known[key]

    def number(self, x: Any) -> Symbol:
        """The symbol of a number; symbols are left as they are."""
        if isinstance(x, Symbol):
            return x
        if isinstance(x, complex) or not np.isscalar(x):
            raise NotFollowed(f"it combines strains with {x!r}")
        return self.symbol("number", float(np.real(x)))

    def _simplified(self, operation, arguments):
        if operation in ("number", "strain"):
            return None
        values = [x.value for x in arguments]
        if None not in values:
            with np.errstate(all="ignore"):
                return self.number(float(eval(TEXTS[operation].format(*values), {"np": np})))
        a, b = (*arguments, None)[:2]
        x, y = (*values, None)[:2]
        if operation == "+" and (x == 0.0 or y == 0.0):
            return b if x == 0.0 else a
        if operation == "-" and y == 0.0:
            return a
        if operation == "*" and (x in (0.0, 1.0) or y in (0.0, 1.0)):
            return self.number(0.0) if 0.0 in (x, y) else b if x == 1.0 else a
        if operation in ("/", "**") and y == 1.0:
            return a
        return None


#: Text of each operation.
TEXTS = {"+": "({} + {})", "-": "({} - {})", "*": "({} * {})", "/": "({} / {})",
         "**": "({} ** {})", "negative": "(-{})", "absolute": "np.abs({})",
         **{name: f"np.{name}({{}})" for name in (
             "sqrt", "exp", "log", "log1p", "expm1", "sin", "cos", "tan", "sinh", "cosh", "tanh",
             "arcsin", "arccos", "arctan", "arcsinh", "sign")}}
#: Derivative of the functions of one argument, by the argument and the value.
DERIVATIVES: dict[str, Callable[[Any, Any], Any]] = {
    "negative": lambda x, f: -1.0, "absolute": lambda x, f: x.sign(), "sign": lambda x, f: 0.0,
    "sqrt": lambda x, f: 0.5 / f, "exp": lambda x, f: f, "log": lambda x, f: 1.0 / x,
    "log1p": lambda x, f: 1.0 / (1.0 + x), "expm1": lambda x, f: f + 1.0,
    "sin": lambda x, f: x.cos(), "cos": lambda x, f: -x.sin(), "tan": lambda x, f: 1.0 + f * f,
    "sinh": lambda x, f: x.cosh(), "cosh": lambda x, f: x.sinh(),
    "tanh": lambda x, f: 1.0 - f * f, "arcsin": lambda x, f: 1.0 / (1.0 - x * x).sqrt(),
    "arccos": lambda x, f: -1.0 / (1.0 - x * x).sqrt(),
    "arctan": lambda x, f: 1.0 / (1.0 + x * x), "arcsinh": lambda x, f: 1.0 / (1.0 + x * x).sqrt(),
}


for _name in DERIVATIVES:  # what NumPy calls for arrays of objects
    setattr(Symbol, _name, _unary(_name))


def derivative(f: Any, x: Symbol, known: dict[int, Symbol]) -> Symbol:
    """The derivative of a symbol by another.

    Parameters
    ----------
    f, x
        The symbols.
    known
        Derivatives by x, by the id of their symbol; added to.
    """
    if id(f) in known:
        return known[id(f)]
    number = f.graph.number
    if f.operation in ("number", "strain"):
        out = number(float(f is x))
    else:
        parts = [derivative(a, x, known) for a in f.arguments]
        a, da, b, db = f.arguments[0], parts[0], f.arguments[-1], parts[-1]
        if f.operation == "+" or f.operation == "-":
            out = da + db if f.operation == "+" else da - db
        elif f.operation == "*":
            out = da * b + a * db
        elif f.operation == "/":
            out = (da - f * db) / b
        elif f.operation == "**":
            out = b * a ** (b - 1.0) * da
            if db.value != 0.0:
                out = out + f * a.log() * db
        else:
            out = number(DERIVATIVES[f.operation](a, f)) * da
    known[id(f)] = out
    return out


class Followed(NamedTuple):
    """A law as a text of numbers."""

    text: Callable[[Array, Array, Array], None]
    constants: Array


def follow(law: Law) -> Followed:
    """The text of a law.

    Parameters
    ----------
    law
        With ``energy``, ``stress`` and ``moduli`` of strains (3, ...).

    Raises
    ------
    NotFollowed
        If the law does other than arithmetic and functions of NumPy on the components of the
        strain, or if what it does to symbols is not what it does to numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf.materials import Material
    >>> from skfem_ancf.materials.followed import follow
    >>> class Fibres(Material):
    ...     def energy(self, strain):
    ...         return 0.5 * self.E * np.sum(strain**2, axis=0)
    ...     def stress(self, strain):
    ...         return self.E * strain
    >>> text, constants = follow(Fibres(2.0, 0.0))
    >>> out = np.empty((9, 1, 1))
    >>> text(constants, np.zeros((3, 1, 1)), out)
    >>> out[:, 0, 0].tolist()
    [2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0]
    """
    try:
        followed = _followed(law)
    except RecursionError as error:
        raise NotFollowed("it does too much one after the other") from error
    _require_same(law, followed)
    return followed


def _followed(law):
    graph = Graph()
    strain = np.array([graph.symbol("strain", c) for c in range(3)], dtype=object)
    energy = _components(law.energy, strain, 1, graph)
    stress = _components(law.stress, strain, 3, graph)
    known: list[dict[int, Symbol]] = [{}, {}, {}]
    moduli = [derivative(s, x, known[d]) for s in stress for d, x in enumerate(strain)]
    numbers: dict[float, int] = {}
    parts = [_statements(found, numbers) for found in (energy, stress, moduli)]
    return Followed(_text(_HEAD.format(*("".join(lines) for lines in parts))),
                    np.array(list(numbers) or [0.0]))


_HEAD = """
def text(constants, strain, out):
    for p in lanes(strain.shape[1]):
        for e in lanes(strain.shape[2]):
            e0, e1, e2 = strain[0, p, e], strain[1, p, e], strain[2, p, e]
            if len(out) == 1:
{}            elif len(out) == 3:
{}            else:
{}"""


def _components(function, strain, number, graph):
    """What a law makes of the symbols, so many."""
    try:
        found = np.asarray(function(strain.reshape(3, 1, 1)), dtype=object)
    except NotFollowed:
        raise
    except Exception as error:
        raise NotFollowed(f"it takes no symbols: {error}") from error
    if found.size != number:
        raise NotFollowed(f"it gives an array of shape {found.shape} for one strain")
    return [graph.number(x) for x in found.ravel()]


def _statements(outputs, numbers):
    """Lines that write the outputs, each symbol once."""
    names: dict[int, str] = {}
    lines: list[str] = []

    def name(f):
        if id(f) not in names:
            if f.operation == "strain":
                names[id(f)] = f"e{f.arguments[0]}"
            elif f.operation == "number":
                names[id(f)] = f"constants[{numbers.setdefault(f.value, len(numbers))}]"
            else:
                text = TEXTS[f.operation].format(*map(name, f.arguments))
                names[id(f)] = f"v{len(lines)}"
                lines.append(f"                {names[id(f)]} = {text}\n")
        return names[id(f)]

    found = [name(f) for f in outputs]
    return lines + [f"                out[{k}, p, e] = {x}\n" for k, x in enumerate(found)]


@lru_cache(64)
def _text(code):
    """The function of a text: one for laws that differ by numbers only."""
    names: dict[str, Any] = {"np": np, "lanes": lanes, "__name__": "a_law_followed"}
    exec(code, names)  # noqa: S102
    return source(names["text"])


def _require_same(law, followed):
    """Compare with the law in Python, at strains small and large."""
    for size in (1e-6, 1e-3, 0.1):
        strain = size * np.random.default_rng(0).uniform(-1.0, 1.0, (3, 4, 2))
        with np.errstate(all="ignore"):
            for function, number in ((law.energy, 1), (law.stress, 3), (law.moduli, 9)):
                out = np.empty((number, 4, 2))
                followed.text(followed.constants, strain, out)
                wanted = np.reshape(function(strain), out.shape)
                if not np.allclose(out, wanted, rtol=1e-9, atol=1e-9 * np.nanmax(np.abs(wanted)),
                                   equal_nan=True):
                    raise NotFollowed(f"its {function.__name__} is not what it is for symbols"
                                      if number < 9 else
                                      "its moduli are not the derivative of its stress")
