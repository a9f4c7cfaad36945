"""What is compiled, by the size of the task, and what is kept of it."""

import ast
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.core import code_cache
from skfem_ancf.core.source import MARKED
from skfem_ancf.core.errors import CompilationWarning
from skfem_ancf.equations import backend
from skfem_ancf.solvers.iteration import ITERATIONS

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "skfem_ancf"

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
    """The default rules, nothing loaded, nothing on disk; what is compiled is plain Python."""
    from skfem_ancf.core import jit
    from skfem_ancf.core.code_cache import VARIABLE

    monkeypatch.delenv(VARIABLE, raising=False)
    compiled, s = [], scene()
    plain = s.system.backend.tables.plain

    def entry(function, args):
        compiled.append(function.__name__)
        return lambda equations, *rest: function(plain, *rest)

    monkeypatch.setattr(backend, "LOADED", {})
    monkeypatch.setattr(backend, "PROBLEMS", [])
    monkeypatch.setattr(backend, "_worked", 0.0)
    monkeypatch.setattr(backend, "ITERATION", 1e-2)  # of larger meshes than are solved here
    monkeypatch.setattr(jit, "entry", entry)
    monkeypatch.setattr(jit, "load_part", lambda name: None)
    monkeypatch.setattr(code_cache, "on_disk", lambda *names: not names)
    monkeypatch.setattr(code_cache, "note", lambda name: None)
    return s, compiled


#: Of a motion of 1000 steps.
STEPS = dict(t_end=1.0, dt=1e-3)


def test_work_in_numpy_is_counted_until_compiling_pays(auto, monkeypatch):
    """Many small solutions are one large task, and so are an analysis or steps of it."""
    s, loads = auto
    one, price = ITERATIONS * s.system.backend.seconds(1), backend.compiling(
        s.system.backend._missing("equilibrium")) / backend.SERVES
    number = 0
    while not loads and number < 1000:
        reason = s.plan()["compiled loop"]
        s.solve_static()
        number += 1
    assert loads == ["equilibrium"]
    assert number == pytest.approx(price / one, abs=1)  # as the last of them would pay it
    assert "s once, in this process NumPy takes about" in reason
    assert scene().plan()["compiled loop"].endswith("compiled code is loaded")
    assert backend._worked == 0.0  # paid


def test_code_on_disk_is_loaded_sooner_but_not_at_once(auto, monkeypatch):
    s, loads = auto
    monkeypatch.setattr(code_cache, "on_disk", lambda *names: True)
    number = 0
    while not loads and number < 1000:
        s.solve_static()
        number += 1
    assert number == pytest.approx(backend.LOADING / (ITERATIONS * s.system.backend.seconds(1)),
                                   abs=1)
    assert backend._worked > 0.0  # other functions follow at once
    s.integrate(0.02, 1e-3)
    assert loads[0] == "equilibrium" and loads[-1] == "steps"


def test_small_tasks_run_in_numpy(auto):
    s, loads = auto
    s.solve_static()
    s.integrate(0.01, 1e-3)
    assert not loads
    assert "loading compiled code at least" in s.plan()["compiled loop"]


def test_a_long_motion_is_compiled_on_its_way_which_is_said(auto, capsys):
    s, loads = auto
    assert s.plan("dynamic")["compiled loop"].startswith("yes")
    assert s.plan()["compiled loop"].startswith("no")
    s.integrate(**STEPS, t_eval=[1.0])
    assert loads[0] == "steps"
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("skfem_ancf: compiling once, about ") and " s, cached in " in said[0]
    assert said[-1].endswith("100%") and len(said) > 2  # parts, and the steps
    assert s.plan("dynamic")["compiled loop"].endswith("compiled code is loaded")
    s.system.internal_force(np.full(s.layout.N, 1e-3))  # as energies of the motion ask for them
    assert loads == ["steps", "force"]


@pytest.mark.parametrize("threads", [False, True])
def test_members_of_a_sweep_count(threads, auto):
    """They are solved by the same process, in threads or not."""
    from skfem_ancf import sweep

    s, loads = auto
    few = 20
    with ThreadPoolExecutor(2) as pool:
        sweep(lambda x: s, {"x": np.arange(few)},
              lambda s: s.solve_static().displacement((1, 0))[1], client=pool if threads else None)
    assert not loads
    assert backend._worked > 0.9 * few * ITERATIONS * s.system.backend.seconds(1)


def test_all_that_is_compiled_marks_the_cache():
    """Files of compiled functions and of what they use; no others, so that work goes on there."""
    files = {path.relative_to(PACKAGE).with_suffix("").as_posix() for path in
             code_cache.compiled_files()}
    assert {"equations/evaluation", "core/loops", "core/jit", "beam/kernels/tables"} <= files
    assert not files & {"core/code_cache", "equations/backend", "scene/scene"}
    for function, module in MARKED.items():
        if module is not None or not function.__module__.startswith("skfem_ancf"):
            continue
        for name in function.__code__.co_names:
            used = vars(sys.modules[function.__module__]).get(name)
            if used is None or isinstance(used, ModuleType) or not _ours(function, name, used):
                continue
            assert _ours(function, name, used) in files, (function, name)


def _ours(function, name, used):
    """The file of the package that defines what a function uses by a name, or None."""
    tree = ast.parse(Path(sys.modules[function.__module__].__file__).read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and any((a.asname or a.name) == name
                                                    for a in node.names):
            module = import_module("." * node.level + (node.module or ""),
                                   sys.modules[function.__module__].__package__)
            if MARKED.get(used if callable(used) else None) is not None:
                return None  # replaced by its loops
            found = Path(module.__file__)
            return (found.relative_to(PACKAGE).with_suffix("").as_posix()
                    if found.is_relative_to(PACKAGE) else None)
    return None


def test_a_folder_that_cannot_be_written_is_said_once(auto, monkeypatch, tmp_path):
    s, loads = auto
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
    for function in code_cache.folder, code_cache.can_keep, code_cache._warn_of:
        function.cache_clear()
    try:
        with pytest.warns(CompilationWarning, match="each process compiles again.*NUMBA_CACHE_DIR"):
            s.integrate(0.3, 1e-3, t_eval=[0.3])
        assert not loads  # it would not pay
        assert backend.Backend(s.system).choose("steps").mode == "plain"
    finally:
        for function in code_cache.folder, code_cache.can_keep, code_cache._warn_of:
            function.cache_clear()


def test_the_command_says_how_it_is_used():
    done = subprocess.run([sys.executable, "-m", "skfem_ancf"], cwd=ROOT, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 1 and "python -m skfem_ancf compile" in done.stderr


def test_everything_is_compiled_beforehand(needs_compiled, monkeypatch):
    from skfem_ancf.core.code_cache import VARIABLE
    from skfem_ancf.__main__ import compile_all

    monkeypatch.setenv(VARIABLE, "1")
    compile_all()
    assert set(backend.COMPILING) <= set(backend.LOADED)
    assert code_cache.on_disk(*backend.COMPILING)


@pytest.mark.parametrize("error", [ImportError("made for another NumPy"),
                                   AttributeError("Numba has changed")])
def test_what_cannot_be_compiled_runs_in_numpy(error, auto, monkeypatch, caplog):
    """Said once, and nothing is lost."""
    from skfem_ancf.core import jit

    s, _ = auto

    def fail(*args):
        raise error

    monkeypatch.setattr(jit, "entry", fail)
    monkeypatch.setattr(backend, "_worked", 1000.0)
    for _ in range(2):
        assert s.solve_static().converged
    said = [r.message for r in caplog.records if "runs in NumPy" in r.message]
    assert len(said) == 1 and str(error) in said[0]
    assert str(error) in s.plan()["compiled loop"]


@pytest.mark.parametrize("damage", ["empty", "noise", "middle", "a file in the way"])
def test_a_cache_that_cannot_be_used_costs_time_only(damage, tmp_path, needs_compiled):
    """A small function, with what Numba has kept of it spoilt between two processes."""
    code = f"""
import numpy as np, sys
sys.path.insert(0, {str(tmp_path)!r})
from small import double
from skfem_ancf.core.jit import entry
y = np.zeros(3)
entry(double, (np.ones(3), y))(np.ones(3), y)
print(y.tolist())
"""
    (tmp_path / "small.py").write_text(
        "from skfem_ancf.core.source import indices, source\n\n\n@source\ndef double(x, y):\n"
        "    for i in indices(x.size):\n        y[i] = 2.0 * x[i]\n")
    folder = tmp_path / "numba"
    if damage == "a file in the way":
        folder.write_text("")
        said = run(code, tmp_path, errors=True)
        assert said.count("each process compiles again") == 1
        assert str(folder) in said and "NUMBA_CACHE_DIR" in said
    else:
        assert run(code, tmp_path).strip() == "[2.0, 2.0, 2.0]"
        kept = [p for p in folder.rglob("*") if p.is_file() and "double" in p.name]
        assert kept
        before = {path: path.read_bytes() for path in kept}
        for path, text in before.items():
            if damage == "middle":
                if path.suffix == ".nbc":  # the machine code
                    middle, size = len(text) // 2, len(text) // 4
                    path.write_bytes(text[:middle - size] + bytes(2 * size) + text[middle + size:])
            else:
                path.write_bytes(b"" if damage == "empty" else b"\x80 no code")
    assert run(code, tmp_path).strip() == "[2.0, 2.0, 2.0]"
    if damage == "middle":  # compiled again, and read by the next process
        mended = {path: path.read_bytes() for path in kept}
        assert all(len(mended[path]) > 0.9 * len(text) for path, text in before.items())
        assert not any(bytes(len(text) // 2) in text for text in mended.values())
        assert run(code, tmp_path).strip() == "[2.0, 2.0, 2.0]"
        assert mended == {path: path.read_bytes() for path in kept}
