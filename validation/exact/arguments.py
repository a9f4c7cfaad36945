"""What the arguments of reference solutions are checked by."""

from skfem_ancf.core.errors import InputError


def choose(kind, name, table):
    if name not in table:
        raise InputError(f"unknown {kind} {name!r}; known: " + ", ".join(map(repr, table)))
    return table[name]


def count_of(n, least=1):
    if int(n) != n or n < least:
        raise InputError(f"n must be a whole number from {least} up, got {n!r}")
    return int(n)
