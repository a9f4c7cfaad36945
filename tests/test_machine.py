"""Where texts run: in NumPy or compiled, by the size of the task; and the same either way."""

import ast
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFHermite, ElementBeamCable,
                        EnergyMomentum, MeshBeam, Scene, StVenantKirchhoff)
from skfem_ancf.equations import compiled, backend as machine
from skfem_ancf.core.errors import CompilationWarning
from skfem_ancf.core.source import lanes, primitive, source
from skfem_ancf.core.switch import expecting

ROOT = Path(__file__).parent.parent

SCRIPT = """
import sys
import numpy as np
from skfem_ancf import *
beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamANCF(3),
            StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
state = Scene(beam).clamp("left").gravity((0, -9.81)).solve_static()
print(state.displacement((1, 0)).tolist(), "numba" in sys.modules)
"""
TIP = (-0.74, -0.90)


def run(code, tmp_path, errors=False, **env):
    """Standard output of a new process, with an empty folder for compiled code."""
    import os

    variables = {k: v for k, v in os.environ.items() if not k.startswith(("SKFEM", "NUMBA"))}
    variables.update(NUMBA_CACHE_DIR=str(tmp_path / "numba"), PYTHONPATH=str(ROOT), **env)
    done = subprocess.run([sys.executable, "-c", code], env=variables, check=True,
                          capture_output=True, text=True)
    return done.stderr if errors else done.stdout


def scene(element=None, flag=True):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01),
                element or ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01,
                compiled=flag)
    return Scene(beam).clamp("left").gravity((0, -1.0))


def test_a_first_solution_imports_no_compiler(tmp_path):
    tip, imported = run(SCRIPT, tmp_path).strip().rsplit(" ", 1)
    assert imported == "False"
    np.testing.assert_allclose(eval(tip), TIP, atol=0.01)


@pytest.fixture
def auto(needs_compiled, monkeypatch):
    """The default rules, nothing loaded, nothing on disk."""
    from skfem_ancf.core.switch import VARIABLE

    monkeypatch.delenv(VARIABLE, raising=False)
    loads, known, before, address = [], set(), compiled.KNOWN, compiled.address

    def load(text, args):
        loads.append(text.__name__)
        compiled.LOADED[text.__name__] = lambda equations, *rest: text(
            plain, *(getattr(x, "of", x) for x in rest))
        return compiled.LOADED[text.__name__]

    def found(part):
        known.add(part)
        return address(part)

    s = scene()
    plain = s.system.machine.tables.plain
    monkeypatch.setattr(compiled, "LOADED", {})
    monkeypatch.setattr(compiled, "KNOWN", known)
    monkeypatch.setattr(compiled, "load", load)
    monkeypatch.setattr(compiled, "address", found)
    monkeypatch.setattr(compiled, "on_disk", lambda *names: not names)
    yield s, loads
    before.update(known)


#: Of a motion of 1000 steps.
STEPS = dict(t_end=1.0, dt=1e-3)


def test_small_tasks_run_in_numpy_however_many(auto):
    s, loads = auto
    for _ in range(40):
        s.solve_static()
    s.integrate(0.05, 1e-3)
    assert not loads
    assert "would take about" not in s.plan()["compiled loop"].reason
    assert "NumPy takes about" in s.plan()["compiled loop"].reason


def test_a_long_motion_is_compiled_at_its_start_which_is_said(auto, capsys):
    s, loads = auto
    assert s.plan("dynamic")["compiled loop"].status == "computed"
    assert s.plan()["compiled loop"].status == "skipped"
    s.integrate(**STEPS, t_eval=[1.0])
    assert loads == ["steps"]
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("skfem_ancf: compiling once, about 12 s, kept in ")
    assert said[-1].endswith("100%") and len(said) == 5  # one for each part, and the steps
    assert s.plan("dynamic")["compiled loop"].reason.endswith("compiled code is loaded")
    s.system.internal_force(np.full(s.layout.N, 1e-3))  # as energies of the motion ask for them
    assert loads == ["steps", "evaluate"]


def test_what_lies_on_disk_is_loaded_for_tasks_longer_than_loading(auto, monkeypatch, capsys):
    s, loads = auto
    monkeypatch.setattr(compiled, "on_disk", lambda *names: True)
    s.solve_static()
    s.integrate(0.1, 1e-3)
    assert not loads
    s.integrate(0.4, 1e-3)
    assert loads == ["steps"] and not capsys.readouterr().err


def test_members_and_steps_count(auto, monkeypatch):
    """A sweep, a path and a motion of automatic steps are as large as what they repeat."""
    from skfem_ancf import sweep
    from skfem_ancf.core.switch import expected

    s, loads = auto
    seen = []
    sweep(lambda x: s, {"x": np.arange(7)}, lambda s: seen.append(expected()) or 0.0)
    assert seen == [7.0] * 7 and expected() == 1.0
    monkeypatch.setattr(compiled, "on_disk", lambda *names: True)
    with expecting(1000):
        s.solve_static()
    assert loads == ["equilibrium"]
    small = scene()
    assert not small.system.machine._missing("equilibrium")  # and so it is used at once
    assert small.plan()["compiled loop"].reason.endswith("compiled code is loaded")


def test_no_clock_decides(auto, monkeypatch):
    """The same blocks of steps, and the same way, on a machine that is a thousand times slower."""
    import itertools
    import time

    def blocks():
        taken, steps = [], s.system.machine.of

        def of(text):
            function = steps(text)
            return lambda *args: taken.append(text.__name__) or function(*args)

        with monkeypatch.context() as patch:
            patch.setattr(s.system.machine, "of", of)
            s.integrate(0.2, 1e-3)
        return taken

    s, loads = auto
    usual = blocks()
    clock = itertools.count()
    for name in "perf_counter", "monotonic", "process_time", "time":
        monkeypatch.setattr(time, name, lambda: 1000.0 * next(clock))
    assert blocks() == usual and not loads


def test_a_folder_that_cannot_be_written_is_said_once(auto, monkeypatch, tmp_path):
    s, loads = auto
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
    for function in compiled.folder, compiled.can_keep, compiled._warn_of:
        function.cache_clear()
    try:
        with pytest.warns(CompilationWarning, match="each process compiles anew.*NUMBA_CACHE_DIR"):
            s.integrate(**STEPS, t_eval=[1.0])
        assert not loads  # it would not pay
        assert machine.Machine(s.system).choose("steps").way == "plain"
    finally:
        for function in compiled.folder, compiled.can_keep, compiled._warn_of:
            function.cache_clear()


def test_everything_is_compiled_beforehand(needs_compiled, monkeypatch):
    from skfem_ancf.equations.compiled.__main__ import main
    from skfem_ancf.core.switch import VARIABLE

    monkeypatch.setenv(VARIABLE, "1")
    main()
    assert compiled.KNOWN == set(compiled.ADDRESSES)
    assert {"evaluate", "equilibrium", "steps"} <= set(compiled.LOADED)
    assert compiled.on_disk(*machine.COMPILING)
    assert compiled.KNOWN | {"evaluate", "equilibrium", "steps"} == set(machine.COMPILING)


def test_a_numba_that_is_too_old_is_left_out(tmp_path):
    """In a process of its own, as ours has it imported."""
    pytest.importorskip("numba")
    old = ("import numba; numba.version_info = numba.version_info._replace(short=(0, 61)); "
           "numba.__version__ = '0.61.2'\n")
    shown = "print(Scene(beam).clamp('left').plan()['compiled loop'].reason)"
    said = run(old + SCRIPT + shown, tmp_path, SKFEM_ANCF_COMPILED="1").splitlines()
    np.testing.assert_allclose(eval(said[0].rsplit(" ", 1)[0]), TIP, atol=0.01)
    assert "Numba cannot be used: version 0.61.2 is older than 0.62" in said[1]


def test_code_of_two_versions_of_numba_is_kept_side_by_side(needs_compiled, monkeypatch):
    from skfem_ancf.equations.compiled.twin import named

    names = set()
    for number in ("0.62.0", "0.68.1"):
        compiled.key.cache_clear()
        monkeypatch.setattr(compiled, "version", lambda name, number=number: number)
        names.add(named(run).__qualname__)
    compiled.key.cache_clear()
    assert len(names) == 2


def test_kernels_that_a_scene_has_not_are_not_compiled():
    assert scene().system.machine.tables.parts == ["common", "StrainTables"]
    cable = scene(ElementBeamCable(3))
    assert cable.system.machine.tables.parts == ["common", "StrainTables"]
    cable.spring(1.0, between=((1.0, 0.0), ("ground", (1.0, 1.0))))
    assert cable.system.machine.tables.parts == ["common", "StrainTables", "elements"]
    assert set(compiled.ADDRESSES) <= set(machine.COMPILING)
    assert machine.compiling(["steps", "StrainTables"]) > machine.compiling(["steps"]) > 0.0


def test_a_broken_numba_costs_nothing_but_speed(auto, monkeypatch):
    s, _ = auto
    monkeypatch.setattr(compiled, "PROBLEMS", [])

    def address(part):
        raise ImportError("made for another NumPy")

    monkeypatch.setattr(compiled, "address", address)
    with expecting(1000):
        assert s.solve_static().converged
    assert "another NumPy" in s.plan()["compiled loop"].reason


@pytest.mark.parametrize("what", ["load", "address"])
def test_what_cannot_be_compiled_runs_in_numpy(what, auto, monkeypatch, caplog):
    """A Numba that is not as those that are known: said once, and nothing is lost."""
    s, _ = auto
    monkeypatch.setattr(compiled, "PROBLEMS", [])

    def fail(*args):
        raise AttributeError("Numba has changed")

    monkeypatch.setattr(compiled, what, fail)
    with expecting(1000):
        for _ in range(2):
            assert s.solve_static().converged
    said = [r.message for r in caplog.records if "runs in NumPy" in r.message]
    assert len(said) == 1 and "Numba has changed" in said[0]
    assert "Numba has changed" in s.plan()["compiled loop"].reason


def test_one_signature_for_every_scene(needs_compiled, monkeypatch):
    from skfem_ancf.equations.compiled.twin import type_of

    def recorded(name, function):
        def run(*args):
            types.setdefault(name, set()).add(tuple(type_of(x) for x in args))
            return function(*args)

        return run

    types = {}
    scene().solve_static(), scene().integrate(1e-3, 1e-3)  # compiled
    monkeypatch.setattr(compiled, "LOADED", {name: recorded(name, function) for name, function
                                             in compiled.LOADED.items()})
    two = scene()
    two = Scene(*two.beams, Beam(MeshBeam.init_line([0.0, 1.0], 0.1), ElementBeamCable(3),
                                 StVenantKirchhoff(1e6, 0.3, 1e3), width=0.1))
    for s in (scene(), scene(ElementBeamCable(5)), scene(ElementBeamCable(13)),
              scene(ElementBeamANCFHermite(2, 7)), two.clamp("left", 0).clamp("left", 1),
              scene().pressure("top", 0.1), scene().moment("right", 1e-3)):
        s.solve_static(), s.integrate(1e-3, 1e-3), s.integrate(1e-3, 1e-3, EnergyMomentum())
    s.system.internal_force(np.zeros(s.system.N))
    assert set(types) == {"equilibrium", "steps", "evaluate"}
    assert all(len(found) == 1 for found in types.values())


@pytest.mark.parametrize("damage", ["empty", "noise", "a file in the way"])
def test_a_cache_that_cannot_be_used_costs_time_only(damage, tmp_path, needs_compiled):
    """The twin of a small text, with what Numba has kept of it spoilt between two processes."""
    code = """
import numpy as np, sys
sys.path.insert(0, {folder!r})
from small import double
from skfem_ancf.equations.compiled.twin import compile_for
y = np.zeros(3)
compile_for(double, (np.ones(3), y))(np.ones(3), y)
print(y.tolist())
"""
    (tmp_path / "small.py").write_text(
        "from skfem_ancf.core.source import lanes, source\n\n\n@source\ndef double(x, y):\n"
        "    for i in lanes(x.size):\n        y[i] = 2.0 * x[i]\n")
    code = code.format(folder=str(tmp_path))
    folder = tmp_path / "numba"
    if damage == "a file in the way":
        folder.write_text("")
    else:
        assert run(code, tmp_path).strip() == "[2.0, 2.0, 2.0]"
        kept = [p for p in folder.rglob("*") if p.is_file() and "double" in p.name]
        assert kept
        for path in kept:
            path.write_bytes(b"" if damage == "empty" else b"\x80 no code")
    assert run(code, tmp_path).strip() == "[2.0, 2.0, 2.0]"


def test_code_that_is_not_that_of_its_index_is_compiled_anew(tmp_path, needs_compiled):
    """Two functions of the same arguments, whose files are swapped."""
    code = f"""
import numpy as np, sys
sys.path.insert(0, {str(tmp_path)!r})
from small import cube, double
from skfem_ancf.equations.compiled.twin import compile_for
for text in cube, double:
    y = np.zeros(3)
    compile_for(text, (np.ones(3), y))(np.full(3, 4.0), y)
    print(y.tolist())
"""
    (tmp_path / "small.py").write_text(
        "from skfem_ancf.core.source import lanes, source\n\n\n"
        "@source\ndef cube(x, y):\n    for i in lanes(x.size):\n        y[i] = x[i]**3\n\n\n"
        "@source\ndef double(x, y):\n    for i in lanes(x.size):\n        y[i] = 2.0 * x[i]\n")
    expected = ["[64.0, 64.0, 64.0]", "[8.0, 8.0, 8.0]"]
    assert run(code, tmp_path).splitlines() == expected
    one, other = (next((tmp_path / "numba").rglob(f"*{name}*.nbc")) for name in ("cube", "double"))
    a, b = one.read_bytes(), other.read_bytes()
    one.write_bytes(b), other.write_bytes(a)
    assert run(code, tmp_path).splitlines() == expected
    assert one.read_bytes() != b
    kept = one.stat().st_mtime_ns
    assert run(code, tmp_path).splitlines() == expected and one.stat().st_mtime_ns == kept


def test_a_folder_in_which_nothing_can_be_kept_is_said_in_a_warning(tmp_path, needs_compiled):
    """In a process of its own: where it is, and what to set."""
    (tmp_path / "numba").write_text("")
    code = ("from skfem_ancf.equations import compiled; compiled.note('steps'); "
            "compiled.note('equilibrium')")
    said = run(code, tmp_path, errors=True)
    assert said.count("each process compiles anew") == 1
    assert str(tmp_path / "numba") in said and "NUMBA_CACHE_DIR" in said


def test_texts_and_twins(needs_compiled):
    """What a text calls is compiled with it: texts, inner ones too, and twins of primitives."""
    from skfem_ancf.equations.compiled.twin import compile_for

    x, y, z = np.arange(4.0), np.zeros(4), np.zeros(4)
    total_of_squares(x, y)
    compile_for(total_of_squares, (x, z))(x, z)
    assert y.tolist() == z.tolist() == [14.0, 15.0, 18.0, 23.0]
    assert primitive("factors")(lambda: None).twin == "factors"


def test_what_two_entries_call_is_lowered_once(needs_compiled, monkeypatch):
    from skfem_ancf.equations.compiled import together, twin

    lowered = []
    compile_extra = together.compiler.compile_extra
    monkeypatch.setattr(together.compiler, "compile_extra", lambda *args, **options: (
        lowered.append(args[2].__name__), compile_extra(*args, **options))[1])
    monkeypatch.setattr(twin, "_kept_on_disk", lambda function, compiled: compiled())
    x, y, z = np.arange(4.0), np.zeros(4), np.zeros(4)
    twin.compile_for(sum_of_cubes, (x, y))(x, y)
    twin.compile_for(cubes_of_cubes, (x, z))(x, z)
    assert y[0] == 36.0 and z.tolist() == [0.0, 1.0, 512.0, 19683.0]
    assert [name for name in lowered if name == "cube"] == ["cube"]


@pytest.mark.parametrize("order", ["C", "F", "A"])
def test_single_numbers_of_arrays_are_read_and_written_as_by_numpy(needs_compiled, order):
    """From either end, of any layout and kind of number; as in other code of Numba."""
    from numba import njit

    from skfem_ancf.equations.compiled.twin import compile_for

    def given():
        a = np.arange(48.0).reshape(4, 6, 2)[:, :3] if order == "A" else np.array(
            np.arange(24.0).reshape(4, 3, 2), order=order)
        return a, np.array([3, -1, 0, 2]), np.zeros(8), np.zeros(4, dtype=bool)

    expected = given()
    exchange(*expected)
    for run in (compile_for(exchange, given()), compile_for(exchange_within, given()),
                njit(exchange)):
        found = given()
        run(*found)
        for x, y in zip(found, expected):
            assert x.tolist() == y.tolist()


@pytest.mark.parametrize("first, last", [(0, 2), (1, 3), (-2, 9), (3, 1), (-9, -1), (7, 9)])
def test_parts_of_arrays_are_those_of_numpy(needs_compiled, first, last):
    """Rows and slices of every end, as places to read and to fill."""
    from skfem_ancf.equations.compiled.twin import compile_for

    found, expected = np.zeros(12), np.zeros(12)
    A = np.arange(60.0).reshape(3, 5, 4)
    parts(A.copy(), first, last, expected)
    compile_for(parts, (A, first, last, found))(A, first, last, found)
    assert found.tolist() == expected.tolist() and expected.any()


def test_arrays_that_texts_make_live_as_long_as_they_are_used(needs_compiled):
    """Those made in loops and given back, and views of them; none is left."""
    from numba.core.runtime import _nrt_python as memory, rtsys

    from skfem_ancf.equations.compiled.twin import compile_for

    x, found, expected = np.arange(1.0, 4.0), np.zeros(3), np.zeros(3)
    makes(x, expected)
    run = compile_for(makes, (x, found))
    memory.memsys_enable_stats()
    before = rtsys.get_allocation_stats()
    run(x, found)
    after = rtsys.get_allocation_stats()
    memory.memsys_disable_stats()
    assert found.tolist() == expected.tolist() == [44.0, 36.0, 18.0]
    assert after.alloc - before.alloc == after.free - before.free > 10


@pytest.mark.parametrize("first, last", [(0, 4), (2, 4), (4, 2), (-2, 1), (3, 3)])
def test_loops_run_as_in_python(needs_compiled, first, last):
    """Loops of one end and of two, by steps, in lanes, and those in others that are left."""
    from skfem_ancf.equations.compiled.twin import compile_for

    found, expected = np.zeros(5), np.zeros(5)
    loops(first, last, expected)
    compile_for(loops, (first, last, found))(first, last, found)
    assert found.tolist() == expected.tolist() and (last <= 0 or expected[0] > 0.0)


@source
def parts(A, first, last, out):
    row, some, rest = A[-1, 2], A[1, first:last], A[first:]
    out[0], out[1], out[2] = row[0] + row[-1], some.shape[0], rest.shape[0]
    out[3] = A[0, 1, 1:last].sum() + A[0, 1, :first].sum() + A[1:, first:, 1:2].sum()
    out[4:last], A[2, first:last] = 5.0, 1.0
    A[0] = 2.0
    last = 1  # what a slice was made of may change
    out[first:][:1] = 7.0
    out[10], out[11] = A.sum(), some.sum() + last


@source
def makes(x, out):
    before = np.zeros(3)
    for k in range(4):
        A = np.ones((2, 3))
        A[1] = 5.0 + k
        row, junk = row_of(A, 1), np.zeros(3)
        out[0] += row[0] + before[0] + junk[1]
        before = row
    B = np.ones((2, 3))
    B[1] = 3.0
    out[1], out[2] = twice(twice(row_of(B, 1)))[1] * x[2], twice(twice(x))[2] + twice(x)[2]


@source
def row_of(A, k):
    return A[k]


@source
def twice(x):
    y = np.empty(x.size)
    for i in range(x.size):
        y[i] = 2.0 * x[i]
    return y


@source
def loops(first, last, out):
    for i in range(last):
        out[0] += 1.0 + i
    for i in range(first, last):
        for k in range(5):
            if k > 2:
                break
            out[1] += 10.0 * i + k
    for i in range(last, first, -2):
        out[2] += 1.0 + i
    for i in range(first, last, 2):
        out[3] += 1.0 + i
    for i in lanes(3, 5):
        out[i] += 100.0


def test_shared_texts_are_found_by_their_types(needs_compiled):
    """Each text of a group is called with the types that the group says."""
    from skfem_ancf.equations.compiled import shared, twin

    compiled.address("common"), compiled.address("kernels")
    for group, calls in shared.GROUPS.items():
        for call in calls:
            (found,) = twin.twin(call.text).shared.values()
            assert found.group == group and call.text.__name__ in found.symbol
            assert len(call.args) == call.text.__code__.co_argcount


@source
def exchange(a, places, y, flags):
    y[0] = a[1, 2, 1]
    y[-1] = a[-1, places[1], places[-2]]
    a[places[0], -2, 1] = 7
    places[-1] = 5
    y[2] += places[3]
    y[3:5] = a[0, 1]
    flags[-3] = y[0] > 1.0
    if flags[1]:
        y[5] = a[2, 0, 0] - 1


@source
def exchange_within(a, places, y, flags):
    exchange(a, places, y, flags)


def test_texts_of_the_package_count_indices_from_the_begin():
    """Compiled, they do not ask for negative ones."""
    found = set()
    for path in (ROOT / "skfem_ancf").rglob("*.py"):
        for text in ast.walk(ast.parse(path.read_text())):
            marks = {getattr(x, "id", "") for x in getattr(text, "decorator_list", ())}
            if marks & {"source", "jit"}:
                found.add(text.name)
                for x in ast.walk(text):
                    if isinstance(x, ast.Subscript):
                        parts = x.slice.elts if isinstance(x.slice, ast.Tuple) else [x.slice]
                        ends = [getattr(y, end, None) for y in parts for end in ("lower", "upper")]
                        assert not any(isinstance(y, ast.UnaryOp) for y in parts + ends), text.name
    assert {"collocate", "equilibrium", "cable_block"} < found


@source
def cube(x, y):
    for i in lanes(x.size):
        y[i] = x[i] * x[i] * x[i]


@source
def sum_of_cubes(x, y):
    cube(x, y)
    y[0] = np.sum(y)


@source
def cubes_of_cubes(x, y):
    cube(x, y)
    cube(y, y)


@source
def square(x, y):
    for i in lanes(x.size):
        y[i] = x[i] * x[i]


@source
def total_of_squares(x, y):
    square(x, y)
    total = np.sum(y)
    for i in lanes(x.size):
        y[i] += total
