"""Bad arguments end in the package's own errors: never in foreign ones, a hang or a wrong number.

Run as a script it prints a table of how many do.
"""

import contextlib
import re
import signal
import sys
import threading
import warnings
from collections import Counter

import pytest
from public_calls import BAD, CALLS, FILES, load, taken

from skfem_ancf import AncfError
from skfem_ancf.errors import CallError

SECONDS = 5.0  # that a call with a bad argument may take on a loaded machine


class Hang(BaseException):
    """A call takes too long."""


@contextlib.contextmanager
def limit(seconds):
    """Raise Hang after some seconds, where the system can."""
    main = threading.current_thread() is threading.main_thread()
    if not (main and hasattr(signal, "setitimer")):
        yield
        return

    def stop(*_):
        raise Hang

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def outcome(function, arguments):
    """What a call ends in: "own", "accepted", "foreign" or "hang", and the error."""
    try:
        with limit(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("error")
            function(**arguments)
    except Hang:
        return "hang", None
    except AncfError as error:
        return "own", error
    except Exception as error:
        return "foreign", error
    return "accepted", None


def tries(entry):
    """The outcomes of all bad values for all arguments: (argument, label, outcome, error)."""
    for argument in entry.kinds:
        for label, value in BAD.items():
            yield argument, label, *outcome(entry.function, {**entry.valid, argument: value})


def verdict(entry, argument, label, kind, error):
    """What is wrong with an outcome, or None."""
    right = taken(entry, argument)
    if kind == "hang":
        return "takes too long"
    if kind == "foreign":
        return f"raises {type(error).__name__}: {str(error)[:150]}"
    if kind == "accepted":
        return None if label in right else "is accepted"
    return None


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """What is written goes into a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("entry", CALLS, ids=lambda entry: entry.name)
def test_bad_arguments(entry):
    kind, error = outcome(entry.function, entry.valid)
    assert kind == "accepted", f"the valid call fails: {error!r}"
    wrong = [f"{argument}={label} {what}" for argument, label, kind, error in tries(entry)
             if (what := verdict(entry, argument, label, kind, error))]
    assert not wrong, f"{entry.name}:\n" + "\n".join(wrong)


@pytest.mark.parametrize("entry", [c for c in CALLS if c.kinds and c.function is not load],
                         ids=lambda entry: entry.name)
def test_wrong_calls_list_the_arguments(entry):
    kind, error = outcome(entry.function, {**entry.valid, "nonsense": 1})
    if "<lambda>" in str(error) or entry.name.startswith("Scene"):
        pytest.skip("the keyword does not get past the helper of the table")
    assert isinstance(error, CallError), repr(error)
    # options of the function around
    options = set(entry.kinds) - {"start", "adapt", "max_elements", "filename", "progress"}
    assert all(name in str(error) for name in options), str(error)


def test_files_that_are_no_mesh():
    for name in FILES:
        with pytest.raises(AncfError, match=re.escape(name)):
            load(name)


def main():
    """Print the counts."""
    total, lines = Counter(), []
    for entry in CALLS:
        kind, error = outcome(entry.function, entry.valid)
        if kind != "accepted":
            lines.append(f"INVALID {entry.name}: {kind} {error!r}")
            continue
        for argument, label, kind, error in tries(entry):
            what = verdict(entry, argument, label, kind, error)
            total["wrongly accepted" if what and kind == "accepted" else kind] += 1
            if what:
                lines.append(f"{entry.name}({argument}={label}) {what}")
    print("\n".join(lines))
    print(sum(len(c.kinds) for c in CALLS), "arguments,", sum(total.values()), "calls:",
          dict(total))


if __name__ == "__main__":
    sys.exit(main())
