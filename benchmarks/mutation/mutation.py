"""Small changes of the package's text: do the tests see them?

    python benchmarks/mutation/mutation.py --sample 300        # of every change the operators make
    python benchmarks/mutation/mutation.py --named             # those of named.py, written by hand
    python benchmarks/mutation/mutation.py --only joints/weld  # of some files

First the tests run once under coverage, which says what tests run which line (kept in
out/mutation, ``--again`` makes it anew). Then each mutant runs the tests of its line, the
quickest first, until one fails. No file is changed: a mutant is compiled in place of its module in
a process of its own. Everything runs without Numba, for what is mutated is the text in NumPy; the
compiled kernels are compared with it by tests/test_compiled.py.

The survivors of the last run, and why they survive, are in survivors.md.
"""

import argparse
import ast
import contextlib
import copy
import importlib.abc
import importlib.util
import json
import os
import random
import resource
import signal
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "skfem_ancf"
OUT = ROOT / "out" / "mutation"
# what draws, writes files, or is compiled is compared as a whole
EVERY = "**/*"
NOT_CHANGED = ("core/jit.py", "core/loops.py", "equations/loops.py", "beam/kernels/loops.py",
               "io/", "visuals/", "core/progress.py")
# what starts processes of its own, needs Numba, draws, or repeats the others at random
LEFT_OUT = ["test_bench.py", "test_compiled.py", "test_demos.py", "test_docstrings.py",
            "test_fuzz.py", "test_package.py", "test_readme.py", "test_visuals.py"]
KILLED, SURVIVED, TIME, BROKEN = "killed", "survived", "killed (time)", "broken"
EXPLAINED = "explained"


def files(patterns):
    """Modules of the package, relative to it, that the patterns name."""
    out = []
    for pattern in patterns:
        found = sorted(PACKAGE.glob(pattern if pattern.endswith(".py") else f"{pattern}.py"))
        if not found:
            raise SystemExit(f"no file of the package is called {pattern!r}")
        names = [f.relative_to(PACKAGE).as_posix() for f in found if f.name != "__init__.py"]
        out += [n for n in names if pattern != EVERY or not n.startswith(NOT_CHANGED)]
    return out


# mutants

SWAPS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
         ast.Pow: ast.Mult, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
         ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
         ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In}
OPPOSITE = {ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt}


def changes(node):
    """Pairs of what is changed and a function that changes a copy of the node in place."""
    def replace(**fields):
        return lambda n: [setattr(n, name, value) for name, value in fields.items()]

    if isinstance(node, ast.BoolOp) or (
            isinstance(node, (ast.BinOp, ast.AugAssign)) and type(node.op) in SWAPS):
        new = SWAPS[type(node.op)]
        yield f"{type(node.op).__name__} -> {new.__name__}", replace(op=new())
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        for table in (SWAPS, OPPOSITE):
            new = table.get(type(node.ops[0]))
            if new is not None:
                yield f"{type(node.ops[0]).__name__} -> {new.__name__}", replace(ops=[new()])
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float, bool):
        v = node.value
        new = not v if isinstance(v, bool) else v + 1 if isinstance(v, int) else 2.0 * v or 1.0
        yield f"{v!r} -> {new!r}", replace(value=new)
    elif isinstance(node, ast.If):
        for value in (True, False):
            yield f"if -> if {value}", replace(test=ast.Constant(value))
    elif isinstance(node, ast.IfExp):
        for value in (True, False):
            yield f"... if -> if {value}", replace(test=ast.Constant(value))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        yield f"{type(node.op).__name__} dropped", replace(op=ast.UAdd() if isinstance(
            node.op, ast.USub) else ast.Not(), **({} if isinstance(node.op, ast.USub) else {
                "operand": ast.UnaryOp(ast.Not(), node.operand)}))
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        yield "call dropped", replace(value=ast.Constant(None))
    elif isinstance(node, ast.Break):
        yield "break -> continue", None


def ignored(node):
    """True for what is said, not done: messages, logging, representations."""
    return (isinstance(node, (ast.Raise, ast.JoinedStr))
            or (isinstance(node, ast.FunctionDef) and node.name in ("__repr__", "describe_dof"))
            or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
                and ast.unparse(node.value.func).startswith(("logger.", "bar.")))
            or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)))


def mutants(name):
    """(line, what, number) of every mutant of a file; the number finds it again."""
    tree = ast.parse((PACKAGE / name).read_text())
    found = []

    def walk(node):
        for child in ast.iter_child_nodes(node):
            if ignored(child):
                continue
            for what, _ in changes(child):
                found.append((child.lineno, what, len(found)))
            walk(child)

    walk(tree)
    return found


def mutated(name, number):
    """The module with one mutant, as a tree, and the line as it is now."""
    tree = ast.parse((PACKAGE / name).read_text())
    count = 0

    def walk(node):
        nonlocal count
        for field, value in ast.iter_fields(node):
            for k, child in enumerate(value if isinstance(value, list) else [value]):
                if not isinstance(child, ast.AST) or ignored(child):
                    continue
                for _, change in changes(child):
                    if count == number:
                        if change is None:
                            value[k] = ast.copy_location(ast.Continue(), child)
                        else:
                            change(child)
                        count += 1
                        return child
                    count += 1
                done = walk(child)
                if done is not None:
                    return done
        return None

    child = walk(tree)
    # the statement about it, for the report
    return ast.fix_missing_locations(tree), ast.unparse(copy.deepcopy(child)).splitlines()[0]


# runs

class Instead(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports one module of the package from another tree."""

    def __init__(self, name, tree):
        self.path, self.tree = PACKAGE / name, tree
        self.module = "skfem_ancf." + name[:-3].replace("/", ".")

    def find_spec(self, fullname, path, target=None):
        if fullname == self.module:
            return importlib.util.spec_from_file_location(fullname, self.path, loader=self)
        return None

    def exec_module(self, module):
        exec(compile(self.tree, str(self.path), "exec"), module.__dict__)


class Watch:
    """A pytest plugin: contexts for coverage, durations, and which test failed first."""

    def __init__(self, cov=None):
        self.cov, self.durations, self.failed, self.red = cov, {}, None, []

    def pytest_runtest_logstart(self, nodeid):
        if self.cov is not None:
            self.cov.switch_context(nodeid)

    def pytest_runtest_logreport(self, report):
        self.durations[report.nodeid] = self.durations.get(report.nodeid, 0.0) + report.duration
        if report.failed:
            self.failed = self.failed or report.nodeid
            self.red.append(report.nodeid)


def pytest_in(arguments, plugin):
    import pytest
    os.chdir(ROOT)
    with open(os.devnull, "w") as null, contextlib.redirect_stdout(null), \
            contextlib.redirect_stderr(null):
        return pytest.main(["-q", "-p", "no:cacheprovider", "--no-header", "--tb=no", *arguments],
                           plugins=[plugin])


def forked(work, limit):
    """What ``work`` returns in a process of its own, which may use ``limit`` seconds of CPU."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
        signal.alarm(8 * limit)  # one that waits uses none
        try:
            answer = work()
        except BaseException as error:
            answer = [BROKEN, repr(error)[:200]]
        with os.fdopen(write, "w") as pipe:
            json.dump(answer, pipe)
            pipe.flush()
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else None


def tests():
    return [str(f.relative_to(ROOT)) for f in sorted((ROOT / "tests").glob("test_*.py"))
            if f.name not in LEFT_OUT]


def baseline(again):
    """Which tests run which line of which file, and how long each takes.

    Kept from run to run; files of tests that are new are added. ``again`` where the package has
    changed so much that its lines have moved.
    """
    import coverage
    data, times = OUT / "coverage", OUT / "times.json"
    durations = json.loads(times.read_text()) if times.exists() and not again else {}
    known = {nodeid.split("::")[0] for nodeid in durations}
    new = [t for t in tests() if t not in known]
    if new:
        print(f"one run of {len(new)} files of tests under coverage ...", flush=True)

        def run():
            cov = coverage.Coverage(data_file=str(data), source=[str(PACKAGE)], branch=True,
                                    config_file=False)
            if durations:
                cov.load()
            cov.start()
            watch = Watch(cov)
            code = pytest_in(new, watch)
            cov.stop()
            cov.save()
            green = {t: s for t, s in watch.durations.items() if t not in watch.red}
            return [int(code), green, watch.red]

        code, added, red = forked(run, 7200)
        if code not in (0, 1):
            raise SystemExit(f"the tests do not run: pytest ends with {code}")
        if red:
            print("red without a mutant, and left out:", *red)
        durations.update(added)
        times.write_text(json.dumps(durations))
    found = coverage.CoverageData(basename=str(data))
    found.read()
    return found, durations


def tests_of(found, durations, name, lines, most):
    """Tests that run one of the lines, the quickest first, up to ``most`` seconds of them."""
    by_line = found.contexts_by_lineno(str(PACKAGE / name))
    wanted = {t for line in lines for t in by_line.get(line, ()) if t}
    if not wanted:  # run on import: any test of the file may see it
        wanted = {t for ts in by_line.values() for t in ts if t}
    order = sorted((t for t in wanted if t in durations), key=lambda t: (durations[t], t))
    out, total = [], 0.0
    for t in order:
        total += durations[t]
        if out and total > most:
            break
        out.append(t)
    return out


def run_mutant(name, tree, nodes, limit):
    if not nodes:
        return [SURVIVED, "no test runs this line"]

    def work():
        sys.meta_path.insert(0, Instead(name, tree))
        watch = Watch()
        code = pytest_in(["-x", "-p", "no:hypothesispytest", *nodes], watch)
        if code == 0:
            return [SURVIVED, f"{len(nodes)} tests"]
        return [KILLED, watch.failed or f"pytest ends with {int(code)}"]

    return forked(work, limit) or [TIME, ""]


def named():
    """Mutants written by hand: (title, file, tree, test)."""
    sys.path.insert(0, str(Path(__file__).parent))
    from named import NAMED
    for title, name, old, new, test in NAMED:
        text = (PACKAGE / name).read_text()
        if text.count(old) != 1:
            yield title, name, None, None
            continue
        if test is not None and ".py" not in test:
            test = f"test_details.py::{test}"
        yield title, name, ast.parse(text.replace(old, new)), test


def sampled(arguments):
    every = [(name, *m) for name in files(arguments.only or [EVERY]) for m in mutants(name)]
    rng = random.Random(arguments.seed)
    rng.shuffle(every)
    chosen = every[arguments.skip:arguments.skip + arguments.sample]
    print(f"{len(every)} mutants, of which {len(chosen)} are run")
    for name, line, what, number in chosen:
        tree, text = mutated(name, number)
        yield f"{name}:{line} [{number}] {what}: {text[:70]}", name, tree, (line,)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", help="files, as joints/weld or statics/*")
    parser.add_argument("--sample", type=int, default=300, help="how many, drawn at random")
    parser.add_argument("--skip", type=int, default=0, help="how many of them were run before")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--named", action="store_true", help="those written by hand instead")
    parser.add_argument("--match", default="", help="with --named: part of the title")
    parser.add_argument("--limit", type=int, default=60, help="processor seconds for a mutant")
    parser.add_argument("--most", type=float, default=20.0, help="seconds of tests for a mutant")
    parser.add_argument("--again", action="store_true", help="measure the coverage anew")
    arguments = parser.parse_args()

    sys.modules["numba"] = None
    sys.path.insert(0, str(ROOT))
    OUT.mkdir(parents=True, exist_ok=True)
    found, durations = (None, None) if arguments.named else baseline(arguments.again)
    import matplotlib
    matplotlib.use("Agg")
    import meshio  # noqa: F401  what every child would import
    import scipy.integrate
    import scipy.linalg
    import scipy.optimize
    import scipy.sparse.linalg  # noqa: F401
    import skfem  # noqa: F401

    run = f"run-{arguments.seed}-{arguments.skip}.txt"
    count, log = {}, OUT / ("named.txt" if arguments.named else run)
    begin = time.time()
    with open(log, "w") as lines:
        for title, name, tree, where in (named() if arguments.named else sampled(arguments)):
            if arguments.named and arguments.match not in title:
                continue
            if arguments.named and tree is not None and where is None:
                verdict, why = EXPLAINED, "survivors.md"
            elif tree is None:
                verdict, why = BROKEN, "its text is no longer there: mend named.py"
            else:
                nodes = ([where and f"tests/{where}"] if arguments.named else
                         tests_of(found, durations, name, where, arguments.most))
                nodes = [n for n in nodes if n]
                verdict, why = run_mutant(name, tree, nodes, arguments.limit)
            count[verdict] = count.get(verdict, 0) + 1
            line = f"{verdict:14} {title}   <- {why}"
            print(line, file=lines, flush=True)
            if verdict in (SURVIVED, BROKEN) or arguments.named:
                print(line, flush=True)
    total = sum(count.values())
    print(f"{total} mutants in {time.time() - begin:.0f} s: "
          + ", ".join(f"{n} {verdict}" for verdict, n in sorted(count.items())))
    return 1 if count.get(BROKEN) or (arguments.named and count.get(SURVIVED)) else 0


if __name__ == "__main__":
    sys.exit(main())
