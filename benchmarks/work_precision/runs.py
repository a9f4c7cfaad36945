"""What a run is, and how it is timed."""

import compileall
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from .problems import Problem

COLUMNS = ("case", "code", "variant", "elements", "dofs", "steps", "error", "seconds",
           "whole_seconds", "cold_seconds", "iterations", "peak_mb", "setup_seconds", "runs",
           "note", "versions", "machine", "cells")
#: Seconds spent on the repetitions of one run, each of two passes, and how many there are at most.
BUDGET, MOST = 0.1, 7
#: A run that takes longer than this many seconds is made once.
LONG = 1.5


@dataclass
class Solver:
    """A discretised problem: ``solve()`` is timed, ``read(result)`` is not.

    ``read`` returns the tip displacement (2,), the number of load or time steps and that of the
    iterations.
    """

    solve: Callable
    read: Callable
    dofs: int


@dataclass
class Run:
    """One entry of a work-precision diagram; ``model`` names the reference for its error.

    ``recipe`` has the module whose ``run`` has made it, and its arguments behind the problem.
    """

    problem: Problem
    code: str
    variant: str
    elements: int
    model: str
    build: Callable
    steps: int | None = None
    recipe: tuple = ()

    @property
    def label(self):
        return f"{self.problem.name} {self.code} {self.variant} {self.elements}"


def grading(n, grade=1.0):
    """n + 1 numbers from 0 to 1, denser near 0 if grade > 1."""
    return np.linspace(0.0, 1.0, n + 1) ** grade


def clock():
    """Seconds of processor time of this process: on one core the time it takes by itself."""
    return time.process_time()


def versions():
    """Versions of what takes part, and the commit, in one line."""
    out = [f"python {platform.python_version()}"]
    for name in ("skfem-ancf", "scikit-fem", "numpy", "scipy", "numba", "exudyn"):
        try:
            out.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            continue
    try:
        found = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True,
                               text=True, check=True, cwd=Path(__file__).parent)
        out.append(f"commit {found.stdout.strip()}")
    except (OSError, subprocess.CalledProcessError):
        pass
    return ", ".join(out)


def machine():
    """The processor, in one line."""
    name = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        name = next(line.split(":", 1)[1].strip() for line in lines
                    if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return f"{name}, {platform.system()}, one core"


def single_core():
    """Keep this process on one core, if the system allows it."""
    try:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    except (AttributeError, OSError):
        pass


@contextmanager
def every_core():
    """Inside, this process and those that it starts have all cores."""
    try:
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, range(os.cpu_count()))
    except (AttributeError, OSError):
        yield
        return
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


class Timed:
    """A run with its measurements; a run that fails keeps the message instead."""

    def __init__(self, run):
        self.run, self.seconds, self.note, self.solver = run, [], "", None
        self.wholes, self.cold = [], np.nan
        self.first = self.setup = np.nan
        try:
            start = clock()
            self.solver = run.build()
            built = clock()
            self.result = self.solver.read(self.solver.solve())
            end = clock()
        except Exception as error:  # whatever a code raises, it has not solved the problem
            self.note = f"failed: {type(error).__name__}: {str(error).splitlines()[0][:120]}"
            self.solver = None
            return
        self.setup, self.first = built - start, end - built
        if self.first > LONG:
            self.seconds, self.wholes = [self.first], [end - start]

    def repeat(self):
        """Time the run a few times more, alone and from parameters to the value that is read."""
        if self.solver is None or self.first > LONG:
            return
        for _ in range(int(np.clip(BUDGET / max(self.first, 1e-6), 1, MOST))):
            start = clock()
            self.solver.solve()
            self.seconds.append(clock() - start)
        for _ in range(int(np.clip(BUDGET / max(self.setup + self.first, 1e-6), 1, MOST))):
            start = clock()
            solver = self.run.build()
            solver.read(solver.solve())
            self.wholes.append(clock() - start)

    def error(self, reference):
        """Distance of the tip from its reference, over the length of the beam."""
        return float(np.linalg.norm(np.asarray(self.result[0]) - reference) / self.run.problem.L)

    def row(self, reference, peak, about):
        """A row of the CSV file; ``about`` is (versions, machine)."""
        r = self.run
        if self.solver is None:
            return dict(zip(COLUMNS, (r.problem.name, r.code, r.variant, r.elements, "", r.steps,
                                      np.nan, np.nan, np.nan, np.nan, "", peak, np.nan, 0,
                                      self.note, *about)))
        _, steps, iterations = self.result
        seconds, error = float(np.median(self.seconds)), self.error(reference)
        return dict(zip(COLUMNS, (
            r.problem.name, r.code, r.variant, r.elements, self.solver.dofs, steps, error, seconds,
            float(np.median(self.wholes)), self.cold, iterations, peak,
            self.setup + max(0.0, self.first - seconds), len(self.seconds), self.note, *about)))


def cold(run):
    """Processor time from the start of a process to the value read, with nothing compiled before.

    What other codes need is not imported; nan where it cannot be told. Bytecode of Python is
    there, as an installation leaves it: a checkout may have none.
    """
    module, args, options = run.recipe
    return alone([sys.executable, str(Path(__file__).with_name("cold.py")),
                  json.dumps([module, run.problem.name, args, options])])


def alone(command, **variables):
    """Processor time of a command as a process of its own, with no compiled code on disk."""
    compileall.compile_dir(Path(__file__).parents[2] / "skfem_ancf", quiet=2)
    with tempfile.TemporaryDirectory() as empty:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, **variables, "NUMBA_CACHE_DIR": empty})
        if not hasattr(os, "wait4"):
            process.wait()
            return np.nan
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = status
    return usage.ru_utime + usage.ru_stime if status == 0 else np.nan


class Memory:
    """Peak memory of a run by itself, in a process forked from one that has only imported.

    That process is started once and loads what all runs need, the compiled kernels included, so
    that its children show the imports and the run and nothing else.
    """

    def __init__(self, quick):
        self.process = None
        if hasattr(os, "fork"):
            script = Path(__file__).with_name("memory.py")
            self.process = subprocess.Popen(
                [sys.executable, str(script), *(["--quick"] if quick else [])], text=True,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process is not None:
            self.process.stdin.close()
            self.process.wait()
            self.process.stdout.close()

    def peak(self, case, index):
        """Peak resident memory (MB) of run number ``index`` of a case; "" where not known."""
        if self.process is None:
            return ""
        try:
            self.process.stdin.write(json.dumps([case, index]) + "\n")
            self.process.stdin.flush()
            return json.loads(self.process.stdout.readline())
        except (OSError, ValueError):
            self.process = None
            return ""
