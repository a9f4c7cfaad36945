"""The command ``python -m skfem_ancf compile``: compile everything beforehand, once."""

import sys

from .equations.compile import compile_all

if __name__ == "__main__":
    if sys.argv[1:] != ["compile"]:
        raise SystemExit("usage: python -m skfem_ancf compile\n"
                         "compiles everything and keeps it on disk; needs the extra 'fast'")
    compile_all()
