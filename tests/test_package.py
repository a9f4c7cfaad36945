"""sdist and wheel hold what they should: built, installed where no checkout is, and tested."""

import importlib.util
import os
import re
import subprocess
import sys
import sysconfig
import tarfile
import venv
import zipfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import skfem_ancf

ROOT = Path(__file__).resolve().parent.parent
#: Quick, and of every folder that the tests read: docs, demos, benchmarks, the Makefile.
SUBSET = ["tests/test_readme.py::" + name for name in (
    "test_links_lead_somewhere", "test_targets_of_the_readme_are_in_the_makefile",
    "test_scripts_of_a_page_run_in_order[README.md]")] + [
    "tests/test_demos.py::test_a_demo_runs_and_draws[plain_scikit_fem]",
    "tests/test_bench.py::test_the_page_is_made_of_a_run", "tests/test_mapping.py"]
BUILD = "import sys, setuptools.build_meta as b; b.build_sdist(sys.argv[1])"
WHEEL = "import sys, setuptools.build_meta as b; b.build_wheel(sys.argv[1])"


def run(*command, cwd, **env):
    """Run in an environment that knows no checkout; what it printed, or a failure with it."""
    clean = {k: v for k, v in os.environ.items()
             if not k.startswith(("PYTHON", "PYTEST", "COV_")) or k == "PYTHONWARNINGS"}
    done = subprocess.run([str(c) for c in command], cwd=cwd, env={**clean, **env}, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    return done.stdout


def major(package):
    """Its version, not imported: setuptools changes the import system."""
    try:
        return int(version(package).split(".")[0])
    except PackageNotFoundError:
        return -1


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The sdist of a copy of the checkout, unpacked, and the wheel made from it."""
    if major("setuptools") < 77:
        pytest.skip("setuptools is older than pyproject.toml wants")
    if not (ROOT / "MANIFEST.in").exists():
        pytest.skip("not run from a checkout or an sdist")
    tmp = tmp_path_factory.mktemp("built")
    copy = tmp / "copy"
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            cwd=ROOT, capture_output=True, text=True, check=False)
    files = [ROOT / f for f in listed.stdout.split("\0") if f] or [
        p for p in ROOT.rglob("*") if not {"__pycache__", ".venv", "out"} & set(p.parts)]
    for source in files:
        if source.is_file():
            target = copy / source.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(source.read_bytes())
    run(sys.executable, "-c", BUILD, tmp, cwd=copy)
    sdist, = tmp.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        if hasattr(tarfile, "data_filter"):
            archive.extractall(tmp, filter="data")
        else:
            archive.extractall(tmp)
    source = tmp / sdist.name[:-len(".tar.gz")]
    run(sys.executable, "-c", WHEEL, tmp, cwd=source)
    wheel, = tmp.glob("*.whl")
    return copy, sdist, source, wheel


def test_the_sdist_holds_the_tests_and_what_they_read(built):
    copy, _, source, _ = built
    for folder in ("skfem_ancf", "tests", "docs", "demos", "benchmarks", "validation"):
        wanted = {p.relative_to(copy) for p in (copy / folder).rglob("*") if p.is_file()}
        assert wanted - {p.relative_to(source) for p in source.rglob("*")} == set(), folder
    for name in ("Makefile", "LICENSE", "README.md", "pyproject.toml", "MANIFEST.in",
                 "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", ".pre-commit-config.yaml",
                 ".github/workflows/tests.yml"):
        assert (source / name).is_file(), name


def test_the_wheel_holds_the_package_and_nothing_else(built):
    copy, _, _, wheel = built
    with zipfile.ZipFile(wheel) as archive:
        names = [n for n in archive.namelist() if ".dist-info/" not in n]
        metadata, = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        metadata = archive.read(metadata).decode()
    sources = [*(copy / "skfem_ancf").rglob("*.py"), copy / "skfem_ancf" / "py.typed"]
    assert sorted(names) == sorted(p.relative_to(copy).as_posix() for p in sources)
    assert f"\nVersion: {skfem_ancf.__version__}\n" in metadata
    assert "\nLicense-Expression: BSD-3-Clause\n" in metadata
    owner = re.search(r"Copyright \(c\) \d+, (.*)", (ROOT / "LICENSE").read_text())[1]
    assert f"\nAuthor: {owner}\n" in metadata
    for minor in range(10, 15):
        assert f"\nClassifier: Programming Language :: Python :: 3.{minor}\n" in metadata
    assert "\nClassifier: Typing :: Typed\n" in metadata
    assert wheel.name.endswith("-py3-none-any.whl")  # pure Python: for Pyodide too


@pytest.mark.parametrize("kind", ["sdist", "wheel"])
def test_installed_in_an_environment_of_its_own(built, kind, tmp_path):
    """The tests of the sdist run against what was installed; the dependencies are this Python's."""
    if major("pip") < 0:
        pytest.skip("there is no pip")
    _, sdist, source, wheel = built
    venv.create(tmp_path / "env", with_pip=False)
    python = tmp_path / "env" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))",
                    cwd=tmp_path).strip())
    # searched after the environment's own; the .pth files there, of checkouts, are not read
    (site / "dependencies.pth").write_text("\n".join(
        {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}))
    run(python, "-m", "pip", "install", "--no-index", "--no-deps", "--no-build-isolation",
        "--ignore-installed", "--disable-pip-version-check", sdist if kind == "sdist" else wheel,
        cwd=tmp_path)
    found = run(python, "-c", "import skfem_ancf as a; print(a.__version__, a.__file__)",
                cwd=tmp_path).split()
    assert found[0] == skfem_ancf.__version__ and Path(found[1]).is_relative_to(site)
    code = ("import sys, pytest; sys.path.remove(''); status = pytest.main(sys.argv[1:]); "
            "import skfem_ancf; print('tested', skfem_ancf.__file__); sys.exit(status)")
    out = run(python, "-c", code, "-p", "no:cacheprovider", *SUBSET, cwd=source,
              SKFEM_ANCF_COMPILED="0")  # not to compile it anew
    assert f"tested {found[1]}" in out
    assert re.search(r"\d+ passed", out) or "[100%]" in out


def read_yaml(name):
    return pytest.importorskip("yaml").safe_load((ROOT / name).read_text(encoding="utf-8"))


def test_one_version_everywhere():
    headings = re.findall(r"^## \[(.*?)\](?: - (\S+))?$", (ROOT / "CHANGELOG.md").read_text(),
                          re.MULTILINE)
    assert headings[0] == ("Unreleased", "")
    citation = read_yaml("CITATION.cff")
    assert headings[1] == (skfem_ancf.__version__, str(citation["date-released"]))
    assert str(citation["version"]) == skfem_ancf.__version__


def test_the_citation_is_of_this_package_and_of_the_paper():
    citation = read_yaml("CITATION.cff")
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["license"] == "BSD-3-Clause"
    assert citation["authors"][0]["name"] in (ROOT / "LICENSE").read_text()
    paper = citation["references"][0]
    assert paper["title"] in (ROOT / "docs" / "paper.md").read_text().replace("\n", " ")
    for reference in citation["references"]:
        assert {"type", "title", "authors"} <= set(reference)


def test_workflows_call_targets_of_the_makefile():
    makefile, called = (ROOT / "Makefile").read_text(), set()
    for file in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        for job in read_yaml(file.relative_to(ROOT))["jobs"].values():
            for step in job["steps"]:
                called |= set(re.findall(r"make ([\w-]+)", step.get("run", "")))
    assert called == {"test", "test-settings", "test-noise", "test-least", "lint", "docs", "dist"}
    assert all(f"\n{target}:" in makefile for target in called)
    tested = read_yaml(".github/workflows/tests.yml")["jobs"]["test"]["strategy"]["matrix"]
    assert tested["python"] == ["3.10", "3.11", "3.12", "3.13", "3.14"]


def test_extras_are_in_the_readme():
    extras = re.findall(r"^(\w+) = \[", (ROOT / "pyproject.toml").read_text().split(
        "[project.optional-dependencies]")[1].split("\n[")[0], re.MULTILINE)
    users = set(extras) - {"coverage", "lint", "dist"}  # of targets of the Makefile alone
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert {name for name in extras if f"\n| `{name}` | " in readme} == users


def test_the_readme_runs_with_the_dependencies_alone(tmp_path):
    """Each script to a last line that draws, which says what a picture needs."""
    scripts = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"),
                         re.DOTALL)
    drawn = [script for script in scripts if script.splitlines()[-1].startswith("state.plot(")]
    others = "".join(script for script in scripts if script not in drawn)
    assert len(drawn) == 1
    for script in (*drawn, others):
        code = ("import sys; sys.modules.update(dict.fromkeys("
                "['matplotlib', 'tqdm', 'numba', 'pyvista', 'imageio']))\n" + script)
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, text=True, check=False,
                              env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True)
        assert done.stdout
        if script is others:
            assert done.returncode == 0
        else:
            assert 'pip install ".[plot]"' in done.stderr.splitlines()[-1]
    assert [p.name for p in tmp_path.iterdir()] == ["cantilever.vtu"]


IN_A_BROWSER = """
import sys, threading, subprocess, multiprocessing.process
def refuse(*args, **options):
    raise RuntimeError("a browser has no threads and no processes")
threading.Thread.start = subprocess.Popen.__init__ = refuse
multiprocessing.process.BaseProcess.start = refuse
sys.modules.update(dict.fromkeys(["numba", "llvmlite", "tqdm", "pyvista", "imageio"]))
import numpy as np
from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
mesh = MeshBeam.init_line(np.linspace(0, 1, 9), 0.01)
beam = Beam(mesh, ElementBeamANCFCubic(2), StVenantKirchhoff(2e11, 0.3, 7800), 0.01)
scene = Scene(beam).clamp("left").gravity((0, -9.81))
assert scene.solve_static().stress((0.5, 0.005))[0] > 0.0
scene.modes(2), scene.integrate(0.01, 1e-3), scene.solve_static().save("beam.vtu")
if len(sys.argv) > 1:
    scene.solve_static().report("beam.html")
    scene.integrate(0.01, 1e-3).animate("beam.gif", fps=10)
for module in list(sys.modules.values()):
    path = getattr(module, "__file__", None) or ""
    if "site-packages" in path and not path.endswith(".py"):
        print(path)
"""


def test_it_runs_where_there_are_no_threads_and_processes(tmp_path):
    """As Pyodide runs the wheel in a browser: binaries are those of NumPy and SciPy alone."""
    pictures = ["pictures"] * (importlib.util.find_spec("matplotlib") is not None)
    printed = run(sys.executable, "-c", IN_A_BROWSER, *pictures, cwd=tmp_path, PYTHONPATH=str(ROOT))
    owners = {line.split("site-packages")[1].strip(os.sep).split(os.sep)[0]
              for line in printed.splitlines() if "site-packages" in line}
    assert "numpy" in owners
    assert owners <= {"numpy", "scipy", "charset_normalizer",  # the last of rich: optional there
                      "matplotlib", "PIL", "contourpy", "kiwisolver"}
    own = {path.suffix for path in (ROOT / "skfem_ancf").rglob("*")
           if path.is_file() and "__pycache__" not in path.parts}
    assert own <= {".py", ".typed", ".json", ".csv"}


def test_binder_installs_an_extra_that_exists():
    lines = (ROOT / "binder" / "requirements.txt").read_text(encoding="utf-8").splitlines()
    named = re.fullmatch(r"\.\[(\w+)\]", next(line for line in lines if line.startswith(".")))[1]
    assert re.search(rf"^{named} = \[", (ROOT / "pyproject.toml").read_text(), re.MULTILINE)


def test_what_is_heavy_is_imported_when_it_is_needed():
    heavy = ("scipy.spatial", "scipy.optimize", "scipy.interpolate", "scipy.integrate",
             "scipy.ndimage", "numba", "meshio", "matplotlib", "pyvista", "tqdm")
    code = f"import sys, skfem_ancf; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], text=True, check=True,
                          stdout=subprocess.PIPE)
    assert done.stdout.strip() == "[]"
