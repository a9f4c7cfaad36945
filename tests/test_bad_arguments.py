"""Bad arguments end in the package's own errors: never in foreign ones, a hang or a wrong number.

Run as a script it prints a table of how many do.
"""

import contextlib
import pickle
import re
import signal
import sys
import threading
import warnings
from collections import Counter

import numpy as np
import pytest
from public_calls import (BAD, CALLS, FILES, WORDS, beam, clamped, column, free, history, load,
                          loaded, path, state, taken)

from skfem import LinearForm

from skfem_ancf import (AncfError, ConvergenceError, ElementBeamANCF, MeshBeam, MissingExtra,
                        ModelWarning, NameUnknown, StVenantKirchhoff)
from skfem_ancf.core.errors import CallbackError, CallError

SECONDS = 5.0  # of the processor that a call with a bad argument may take


class Hang(BaseException):
    """A call takes too long."""


@contextlib.contextmanager
def limit(seconds):
    """Raise Hang after some seconds of the processor, where the system can."""
    main = threading.current_thread() is threading.main_thread()
    if not (main and hasattr(signal, "setitimer")):
        yield
        return

    def stop(*_):
        raise Hang

    timers = ((signal.SIGPROF, signal.ITIMER_PROF, seconds),  # at work, whatever else runs
              (signal.SIGALRM, signal.ITIMER_REAL, 12.0 * seconds))  # waiting for something
    before = [signal.signal(number, stop) for number, *_ in timers]
    for _, timer, length in timers:
        signal.setitimer(timer, length)
    try:
        yield
    finally:
        for (number, timer, _), handler in zip(timers, before):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)


def outcome(function, arguments):
    """What a call ends in: "own", "accepted", "foreign" or "hang", and the error."""
    try:
        with limit(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # complex made real, overflow
            warnings.filterwarnings("error", module="skfem_ancf")
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
    if isinstance(error, ModelWarning):
        return None  # the loads are beyond what the body can bear
    if kind == "foreign":
        return f"raises {type(error).__name__}: {str(error)[:150]}"
    if kind == "accepted":
        return None if label in right else "is accepted"
    said = rf"\b{re.escape(argument)}\b|{WORDS.get(argument, '(?!)')}"
    if not (re.search(said, str(error)) or isinstance(error, ConvergenceError)):
        return f"is not named: {error}"
    return None


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """What is written goes into a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("entry", CALLS, ids=lambda entry: entry.name)
def test_bad_arguments(entry):
    kind, error = outcome(entry.function, entry.valid)
    if isinstance(error, MissingExtra):
        pytest.skip(str(error))
    assert kind == "accepted", f"the valid call fails: {error!r}"
    wrong = [f"{argument}={label} {what}" for argument, label, kind, error in tries(entry)
             if (what := verdict(entry, argument, label, kind, error))]
    assert not wrong, f"{entry.name}:\n" + "\n".join(wrong)


@pytest.mark.parametrize("entry", [c for c in CALLS if c.kinds and c.function is not load],
                         ids=lambda entry: entry.name)
def test_unknown_arguments_are_named(entry):
    _kind, error = outcome(entry.function, {**entry.valid, "nonsense": 1})
    if "<lambda>" in str(error) or entry.name.startswith("Scene"):
        pytest.skip("the keyword does not get past the helper of the table")
    assert isinstance(error, (TypeError, NameUnknown)) and "nonsense" in str(error), repr(error)


def test_files_that_are_no_mesh():
    for name in FILES:
        with pytest.raises(AncfError, match=re.escape(name)):
            load(name)


# counts that would hang or fill the memory, and times without digits

@pytest.mark.parametrize("action, message", [
    (lambda: loaded().continuation(steps=10**30), "steps must be an integer from 1 to 1000000"),
    (lambda: state().save("s.vtu", subdivide=(10**9, 1)), "two positive integers up to 1000"),
    (lambda: state().plot("S_xx", subdivide=(1, 10**9)), "two positive integers up to 1000"),
    (lambda: loaded().integrate(t_end=1e30, dt=1e-3), "below the round-off of the times"),
    (lambda: loaded().integrate(t_end=1e8, dt=1e-3), r"1e\+11 steps .* more than 1e\+09"),
    (lambda: loaded().integrate(t_end=1e-320, dt=1e-3), "between 1e-100 and 1e100"),
    (lambda: loaded().integrate(t_end=1.0, dt=1e-320), "between 1e-100 and 1e100"),
    (lambda: loaded().integrate(t_end=1.0, dt="auto", rtol=1e-300), "at least 1e-12"),
    (lambda: loaded().solve_static(max_iterations=10**12), "from 1 to 10000"),
    (lambda: loaded().solve_static(adapt=1e-3, max_elements=10**30), "from 1 to 10000000"),
    (lambda: beam().mesh.refined(60), "from 0 to 23 .a mesh of 16777216 elements"),
    (lambda: beam().mesh.to_meshquad(10**9, 1), "nx must be an integer from 1 to 1000"),
    (lambda: ElementBeamANCF(10**6), "from 1 to 64"),
    (lambda: history().state(99), "k must be an integer from -3 to 2, got 99"),
    (lambda: path().state(-4), "k must be an integer from -3 to 2, got -4"),
    (lambda: clamped().modes(19), "from 1 to 18, got 19"),
    (lambda: column().buckling(0), "from 1 to 18, got 0"),
])
def test_bounds(action, message):
    with limit(SECONDS), pytest.raises(AncfError, match=message):
        action()


# functions of the caller's

def arc(r):
    return MeshBeam.init_curve(r, [0.0, 0.5, 1.0], height=0.1)


@pytest.mark.parametrize("action, message, cause", [
    (lambda: arc(lambda s: 1 / 0), r"r\(s\) raised ZeroDivisionError.*returns positions",
     ZeroDivisionError),
    (lambda: arc(lambda s: np.array([s, 0.0])), r"r\(s\) raised ValueError.*0 \* s \+ 1",
     ValueError),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: {}[t]).integrate(0.1, 0.1),
     r"amplitude\(t=.*\) raised KeyError", KeyError),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: "1").integrate(0.1, 0.1),
     r"amplitude\(t=.*\) must be a number, got '1'", None),
    (lambda: clamped().gravity((0, -1), amplitude=lambda t: None).integrate(0.1, 0.1),
     "got None; does the function return something", None),
    (lambda: clamped().traction("top", lambda x: x[2]), r"t\(x\) raised IndexError", IndexError),
    (lambda: clamped().traction("top", lambda x: "up"), r"t\(x\) must", None),
    (lambda: clamped().initial_velocity(lambda x: 1 / 0), r"v\(x\) raised", ZeroDivisionError),
    (lambda: loaded().continuation(until=lambda point: point.nothing),
     r"until\(point\) raised AttributeError", AttributeError),
    (lambda: loaded().continuation(until=lambda point: None), "must return True or False", None),
    (lambda: clamped().load(LinearForm(lambda v, w: w.r[0] * v[1])), r"uses w\.r.*w\.x",
     (KeyError, AttributeError)),
])
def test_functions_of_the_caller(action, message, cause):
    with pytest.raises(AncfError, match=message) as caught:
        action()
    if cause is not None:
        assert isinstance(caught.value.__cause__, cause)


def test_a_failing_amplitude_keeps_the_motion():
    scene = clamped().gravity((0, -1), amplitude=lambda t: 1.0 if t < 0.055 else 1 / 0)
    with pytest.raises(CallbackError, match="ZeroDivisionError") as caught:
        scene.integrate(t_end=0.1, dt=0.01, scheme="newmark")
    assert 2 <= len(caught.value.state) <= 6


def test_a_component_of_a_curve_may_be_constant():
    mesh = arc(lambda s: (2.0 * s, 0.5))
    assert np.allclose(mesh.p, [[0.0, 1.0, 2.0], [0.5, 0.5, 0.5]], rtol=0, atol=1e-12)
    assert np.allclose(mesh.lengths, 1.0, rtol=1e-10)


# messages

def test_the_nearest_name_is_suggested():
    for action, name in ((lambda: clamped().solve_static(method="Newtn"), "newton"),
                         (lambda: free().clamp("rigth"), "right"),
                         (lambda: free().fix("left", "r_Y0^3"), r"r_Y0\^2"),
                         (lambda: clamped().integrate(1.0, 0.1, scheme="newmrk"), "newmark"),
                         (lambda: state().plot("eps_xz"), "eps_x[xy]"),
                         (lambda: loaded().solve_static(toll=1e-3), "tol"),
                         (lambda: beam().replace(formulation="assumd"), "assumed"),
                         (lambda: free().joint("hing"), "hinge"),
                         (lambda: loaded().plan("statics"), "static"),
                         (lambda: StVenantKirchhoff(1.0, 0.3, plane="stres"), "stress")):
        with pytest.raises(AncfError, match=f"did you mean '{name}'"):
            action()


def test_errors_pickle():
    for error in (NameUnknown("scheme", "hhtt", ("hht",)), MissingExtra("tqdm", "progress"),
                  ConvergenceError("no"), CallError("no")):
        copy = pickle.loads(pickle.dumps(error))
        assert type(copy) is type(error) and str(copy) == str(error)


def test_messages_of_joints_and_supports():
    scene = free().pin("left")
    assert repr(scene.joint("plane", at="left")) == "<PlaneSection at 'left'>"
    assert repr(scene.joint("plane", at="right", name="end")) == "<PlaneSection end at 'right'>"
    with pytest.raises(AncfError, match="name of an end, as 'right', got 'rigth'"):
        clamped().point_force((0, -1), at="rigth")
    twice = clamped().clamp("left", thickness="free").gravity((0, -1))
    with pytest.warns(ModelWarning, match="repeat others.*PlaneSection of a clamp at 'left'"):
        twice.solve_static()


def test_a_missing_package_can_be_installed_from_a_clone_too():
    message = str(MissingExtra("tqdm", "progress"))
    assert 'pip install "skfem-ancf[progress]"' in message
    assert 'pip install ".[progress]"' in message


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
