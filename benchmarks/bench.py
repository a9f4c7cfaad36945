"""Measure run time against error, for this package and its peers, and judge the goals.

    python benchmarks/bench.py [--out out/bench] [--quick] [--only 5.2 pendulum tangent]
"""

import argparse
import csv
import os
import sys
from pathlib import Path

for _name in ("OPENBLAS", "OMP", "MKL", "NUMBA"):  # before NumPy is imported
    os.environ[f"{_name}_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent))

import numpy as np
from tqdm import tqdm
from work_precision import figures, frames, large, micro, runs, steps, sweeps
from work_precision.cases import CASES, in_numpy, runs_of, warm_up
from work_precision.problems import PROBLEMS
from work_precision.references import reference
from work_precision.report import OURS, goals, report

OPERATIONS = ("tangent", "iteration", "steps", "scaling", "frames", "large", "sweep", "compiling")
SIZES = {False: dict(tangent=(16, 256, 4096), scaling=(16, 64, 256, 1024, 4096, 16384, 100000),
                     frames=(14, 30, 100), large=(14, 30, 65, 100, 204), sweep=(500,),
                     compiling=tuple(micro.COMPILED)),
         True: dict(tangent=(16,), scaling=(16, 64), frames=(2,), large=(2, 3), sweep=(5,),
                    compiling=("imports",))}
PASSES = 2
#: Error of the runs that are made cold, too.
GOOD = 1e-4


def measure(case, quick, about, memory, watch):
    """Rows of one case: every run once to warm up, then all of them again, pass by pass.

    Those of this package that no other of it beats are made in NumPy alone, too.
    """
    entries = runs_of(case, quick)
    timed = [runs.Timed(run) for run in watch(entries, f"{case}, first runs")]
    for k in range(PASSES):
        for entry in watch(timed, f"{case}, pass {k + 1}"):
            entry.repeat()
    cold_of(timed)
    rows = [entry.row(reference(case, entry.run.model), memory.peak(case, k) if memory else "",
                      about) for k, entry in enumerate(watch(timed, f"{case}, memory"))]
    best = figures.front([r for r in figures.usable(rows) if r["code"] == OURS])
    alone = [runs.Timed(in_numpy(entry.run)) for entry, r in zip(timed, rows) if r in best]
    for entry in alone * PASSES:
        entry.repeat()
    return rows + [entry.row(reference(case, entry.run.model), "", about) for entry in alone]


def cold_of(timed):
    """Measure of each code one run in a process of its own: the fastest that is good enough."""
    for code in {entry.run.code for entry in timed if entry.run.recipe}:
        errors = [(entry, entry.error(reference(entry.run.problem.name, entry.run.model)))
                  for entry in timed if entry.run.code == code and entry.solver is not None]
        wanted = max(GOOD, min((error for _, error in errors), default=0.0))
        good = [entry for entry, error in errors if error <= wanted]
        if good:
            fastest = min(good, key=lambda entry: np.median(entry.wholes))
            fastest.cold = runs.cold(fastest.run)


def write(filename, head, rows):
    """Write a CSV file; numbers to seven digits, what is not known stays empty."""
    with open(filename, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        for cells in rows:
            writer.writerow(["" if v is None or v != v else f"{v:.7g}" if isinstance(v, float)
                             else v for v in cells])


def run(out, names, quick):
    """Measure the named cases and operations and write everything; returns the rows by name."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    runs.single_core()
    about, results = (runs.versions(), runs.machine()), {}
    start = runs.clock()
    warm_up()
    loading = runs.clock() - start
    cases = [name for name in names if name in CASES]
    sizes = SIZES[quick]
    total = (sum((2 + PASSES) * len(runs_of(name, quick)) for name in cases)
             + sum({"tangent": len(sizes["tangent"]), "iteration": 2,
                    "steps": len(steps.KINDS), "scaling": 3 * len(sizes["scaling"]),
                    "frames": len(sizes["frames"]),
                    "large": len(sizes["large"]), "sweep": len(sizes["sweep"]),
                    "compiling": len(sizes["compiling"])}[name]
                   for name in names if name in OPERATIONS))
    with tqdm(total=total, unit="run", dynamic_ncols=True) as bar, runs.Memory(quick) as memory:

        def watch(items, label):
            bar.set_description(label)
            for item in items:
                yield item
                bar.update(1)

        for name in names:
            if name in CASES:
                rows = measure(name, quick, about, memory, watch)
                figures.work_precision(rows, PROBLEMS[name].title).savefig(out / f"{name}.png")
            elif name == "tangent":
                rows = micro.tangents(sizes["tangent"], about, watch)
            elif name == "iteration":
                rows = micro.iteration(about, watch)
            elif name == "steps":
                rows = steps.measure(about, watch)
            elif name == "frames":
                rows = frames.measure(sizes["frames"], about, watch, memory)
            elif name == "large":
                rows = large.measure(sizes["large"], about, watch, memory)
            elif name == "compiling":
                rows = micro.compiling(sizes["compiling"], about, watch)
            elif name == "sweep":
                rows = sweeps.measure(sizes["sweep"], about, watch)
            else:
                rows = micro.scaling(sizes["scaling"], about, watch, memory)
                figures.scaling(rows).savefig(out / "scaling.png")
            results[name] = rows
            write(out / f"{name}.csv", runs.COLUMNS,
                  ([r.get(c, "") for c in runs.COLUMNS] for r in rows))
    write(out / "goals.csv", ("goal", "at", "wanted", "found", "verdict", OURS, "peer"),
          goals(results))
    text = report(results, about, loading, quick)
    (out / "report.md").write_text(text, encoding="utf-8")
    return results


def main(arguments=None):
    """The command line."""
    known = [*CASES, *OPERATIONS]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/bench", help="folder to write to")
    parser.add_argument("--quick", action="store_true", help="a few runs only, to see it work")
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="CASE",
                        help=f"some of {', '.join(known)}")
    options = parser.parse_args(arguments)
    run(options.out, [name for name in known if name in options.only], options.quick)
    print(f"{options.out}/report.md")


if __name__ == "__main__":
    main()
