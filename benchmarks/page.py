"""Write the times of README.md and docs/benchmarks.md from the CSV files of a run of bench.py.

    python benchmarks/page.py --take out/bench   keeps what a run has written, and writes the pages
    python benchmarks/page.py --check            fails where a page says something else

Between ``<!-- bench NAME -->`` and ``<!-- end -->`` stands what :data:`TABLES` makes of the rows.
What was not measured stays as it is, so that a folder of some cases renews theirs alone. Where the
code that is timed has changed since the commit of the run, the page says which.
"""

import argparse
import csv
import re
import shutil
import subprocess
from pathlib import Path

from work_precision import large
from work_precision.figures import front, usable
from work_precision.problems import PROBLEMS
from work_precision.report import (DECADES, EXUDYN, GOALS, OURS, Q2, at, fastest, goals, places,
                                   sweeps, table, tangents, weakest)

ROOT = Path(__file__).resolve().parents[1]
PAGES = "README.md", "docs/benchmarks.md"
KEYS = "seconds", "whole_seconds"
#: Folders of the package that decide times.
TIMED = "beam/kernels", "solvers", "dynamics"
NUMBERS = {"error": float, "seconds": float, "whole_seconds": float, "cold_seconds": float,
           "setup_seconds": float, "peak_mb": float, "elements": int, "dofs": int, "steps": int,
           "iterations": float, "cells": int}
BLOCK = re.compile(r"(<!-- bench (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
#: Other cases of statics and motion, and their titles.
OTHERS = {"5.2-1e3": "gravity cantilever, L/h = 1e3", "5.2-1e4": "gravity cantilever, L/h = 1e4",
          "5.1": "small deflection 5.1", "roll-up": "roll-up by an end moment",
          "spin-up": "spin-up of an arm, a driven section, 5 s", "free-rod": "thrown rod, 0.5 s"}


def read(folder):
    """Rows of each case of a run, as bench.py has had them."""
    results = {}
    for path in sorted(Path(folder).glob("*.csv")):
        if path.stem != "goals":
            with open(path, newline="", encoding="utf-8") as file:
                results[path.stem] = [{k: _number(k, v) for k, v in row.items()}
                                      for row in csv.DictReader(file)]
    return results


def _number(name, text):
    kind = NUMBERS.get(name, str)
    return kind(text) if text else float("nan") if kind is float else ""


def ms(seconds):
    return short(1e3 * seconds, 3)


def short(value, digits=2):
    """A number to so many digits, without an exponent."""
    return f"{float(f'{value:.{digits}g}'):.9g}"


def named(r):
    steps = f", {r['steps']} steps" if r["steps"] and r["steps"] > 1 else ""
    return f"{r['elements']} x {r['variant']}{steps}"


def ratio(rows, peer, target, key, factor):
    """How many times faster than a peer at an error, and whether that misses a goal."""
    mine, its = fastest(rows, OURS, target, key), fastest(rows, peer, target, key)
    if not mine or not its:
        return "-" if mine is its else "only here" if mine else "**missed**: none here"
    found = its[key] / mine[key]
    return short(found) + (", **missed**" if factor and found < factor else "")


def factor(case, key, target):
    """The factor of the goal on a case at an error, or None."""
    return next((g.factor(target) for g in GOALS if g.case == case and g.key == key
                 and (1.0 - 1e-6) * min(g.targets) < target < (1.0 + 1e-6) * max(g.targets)), None)


def duel(case, peer):
    """Lines for a case: the solution and the whole of both, at each error."""
    def lines(results):
        rows, out = results[case], []
        ours = [g for g in GOALS if g.case == case]
        for target in sorted({t for g in ours for t in places(rows, g)}, reverse=True):
            cells = [at(target, ours[0].targets)]
            for code in (OURS, peer):
                solved, whole = (fastest(rows, code, target, key)
                                 for key in ("seconds", "whole_seconds"))
                cells += ["-"] * 3 if solved is None else [
                    named(solved), ms(solved["seconds"]), ms(whole["whole_seconds"])]
            cells += [ratio(rows, peer, target, key, factor(case, key, target))
                      for key in ("seconds", "whole_seconds")]
            alone = [r for r in rows if r["code"] == peer or in_numpy(r)]
            cells.append(" / ".join(ratio(alone, peer, target, key, None)
                                    for key in ("seconds", "whole_seconds"))
                         if fastest(alone, OURS, target) else "-")
            out.append(cells)
        return table(["error", "here", "solve (ms)", "whole (ms)", peer, "solve (ms)", "whole (ms)",
                      "solve, times faster", "whole, times faster", "the same in NumPy alone"],
                     out) + cold(rows)
    return lines


def in_numpy(r):
    """Whether a row is one of this package without compiled code."""
    return r["code"] == OURS and "NumPy" in r["variant"]


def cold(rows):
    """A sentence on the runs in processes of their own."""
    found = [f"{r['cold_seconds']:.2g} s {r['code']} ({named(r)}, error {r['error']:.0e})"
             for r in rows if r["cold_seconds"] > 0.0]
    return [f"Cold, a new process with nothing compiled: {'; '.join(found)}.", ""] if found else []


def others(results):
    """Ratios of the other cases, solve and whole, and the least between; None if one is missing."""
    if not set(OTHERS) <= set(results):
        return None

    def both(case, target):
        found = [ratio(results[case], EXUDYN, target, key, factor(case, key, target))
                 for key in ("seconds", "whole_seconds")]
        return found[0] if found[0] == found[1] else " / ".join(found)

    between = [[title, f"{target:.2e}", both(case, target)] for case, title in OTHERS.items()
               for goal in GOALS if goal.case == case for target in weakest(results[case], goal)]
    return table(["case", *(f"{t:.0e}" for t in DECADES[1:])], [
        [title, *(both(case, t) for t in DECADES[1:])] for case, title in OTHERS.items()]) + (
        ["Least between these errors:", "", *table(["case", "error", "solve / whole"], between)]
        if between else [])


#: What README.md compares: title, case, peer, error.
SHORT = (("cantilever under gravity", "5.2", EXUDYN, 1e-4),
         ("soft pendulum over 1 s", "pendulum", EXUDYN, 1e-4),
         ("cantilever, small deflection", "5.1", EXUDYN, 1e-4),
         ("thick cantilever", "thick", Q2, 1e-3))


def readme(results):
    """The times of README.md, and by how much NumPy alone is slower; None if a case is missing."""
    if not {"frames", *(case for _, case, *_ in SHORT)} <= set(results):
        return None
    out, slower = [], []
    for title, case, peer, error in SHORT:
        rows = results[case]
        mine, its = (fastest(rows, code, error) for code in (OURS, peer))
        alone = fastest([r for r in rows if in_numpy(r)], OURS, error)
        slower.append(alone["seconds"] / mine["seconds"])
        out.append((f"{title}, error {error:.0e}", f"{ms(mine['seconds'])} ms",
                    f"{ms(alone['seconds'])} ms", f"{ms(its['seconds'])} ms ({peer})"))
    rows = [r for r in results["frames"] if r["cells"] == 30]
    mine, its = (fastest(rows, code, 1.0001e-4) for code in (OURS, EXUDYN))
    out.append(("frame of 30 x 30 cells, building it included, error 1e-04",
                f"{ms(mine['seconds'])} ms", "", f"{ms(its['seconds'])} ms ({EXUDYN})"))
    return table(["time on one core", "compiled", "NumPy alone", "the other"], out) + [
        f"Without Numba these take {short(min(slower))} to {short(max(slower))} times as long.", ""]


def compiling(results):
    """What compiling takes."""
    return table(["a new process", "processor time (s)"],
                 [(r["variant"], short(r["seconds"])) for r in results["compiling"]])


def sweep(results):
    head = ["members", "what", "error", "microseconds a member", "times faster than Exudyn"]
    return table(head, [
        (r["note"].split()[0], f"{r['elements']} x {r['variant']}", f"{r['error']:.0e}",
         short(1e6 * r["seconds"], 3), short(found, 3))
        for r, found, its in sweeps(results["sweep"]) if its])


def tangent(results):
    return table(["elements", "textbook pairs (ms)", "batched form (ms)", "compiled kernel (ms)",
                  "batched, kernel, times faster"], [
        (n, ms(pairs), ms(batched), ms(fused), f"{short(pairs / batched)}, {short(pairs / fused)}"
         + ", **missed**" * (verdict == "missed"))
        for n, pairs, batched, fused, verdict in tangents(results["tangent"])])


def iteration(results):
    return table(["what", "ms"], [(r["variant"], ms(r["seconds"])) for r in results["iteration"]])


def steps(results):
    return table(["what", "elements", "steps", "error", "ms a step"], [
        (r["variant"], r["elements"], r["steps"], f"{r['error']:.0e}", ms(r["seconds"]))
        for r in results["steps"]])


def frames(results):
    return table(["cells", "code", "elements", "error", "ms", "MB"], [
        (f"{r['cells']} x {r['cells']}", r["code"], r["variant"], f"{r['error']:.0e}",
         ms(r["seconds"]), f"{r['peak_mb']:.0f}" if r["peak_mb"] > 0 else "")
        for r in results["frames"] if r["error"] == r["error"]])


def large_frames(results):
    rows = results["large"]
    found = [r for r in rows if r["variant"] == "statics"]
    powers = [large.fitted(found, column) for column in ("seconds", "peak_mb")]
    return table(["cells", "coordinates", "code", "what", "ms", "MB"], [
        (f"{r['cells']} x {r['cells']}", r["dofs"], r["code"], r["variant"], ms(r["seconds"]),
         f"{r['peak_mb']:.0f}" if r["peak_mb"] > 0 else "") for r in rows
        if r["seconds"] == r["seconds"]]) + [
        f"In statics time grows as the power {powers[0]:.2f} of the coordinates, memory as "
        f"{powers[1]:.2f}, by least squares.", ""]


def scaling(results):
    rows = results["scaling"]
    kinds = list(dict.fromkeys(r["variant"] for r in rows))
    cells = {(r["variant"], r["elements"]): f"{ms(r['seconds'])} ms, {r['peak_mb']:.0f} MB"
             for r in rows}
    return table(["elements", *kinds], [[n, *(cells.get((kind, n), "") for kind in kinds)]
                                        for n in dict.fromkeys(r["elements"] for r in rows)])


def about(results):
    """What ran where, and how many goals were met."""
    first = next(iter(results.values()))[0]
    found = [row[4] for row in goals(results)]
    missed = found.count("missed")
    since = changed(re.search(r"commit (\w+)", first["versions"]))
    return [f"One run: {first['machine']}; {first['versions']}. Of {len(found)} goals "
            f"{len(found) - missed} were met, {missed} missed; those are marked below.", "",
            *(["Files that changed since that commit, and are not timed again. "
               + " ".join(since), ""] if since else [])]


def changed(commit):
    """Files that decide times and are no longer what they were at a commit (a match), by git.

    A sentence for each folder.
    """
    if commit is None:
        return []
    found = subprocess.run(["git", "diff", "--name-only", commit[1], "--", *(
        f"skfem_ancf/{folder}" for folder in TIMED)], cwd=ROOT, capture_output=True, text=True,
        check=False)
    if found.returncode:
        raise SystemExit(f"no commit {commit[1]} here: {found.stderr.strip()}")
    files = [line.rpartition("/") for line in found.stdout.split()]
    return [f"In `{folder}`: " + ", ".join(f"`{name}`" for at, _, name in files if at == folder)
            + "." for folder in dict.fromkeys(folder for folder, _, _ in files)]


#: The lines of each table, by the case that it needs; "about" and "others" take all of them.
TABLES = {"about": about, "5.2": duel("5.2", EXUDYN), "pendulum": duel("pendulum", EXUDYN),
          "thick": duel("thick", Q2), "others": others, "sweep": sweep, "tangent": tangent,
          "iteration": iteration, "steps": steps, "frames": frames, "large": large_frames,
          "scaling": scaling, "compiling": compiling, "readme": readme}


def renewed(text, results):
    """The page with the tables of what was measured."""
    def block(match):
        name = match[2]
        if name not in ("about", "others", "readme") and name not in results:
            return match[0]
        lines = TABLES[name](results)
        return match[0] if lines is None else match[1] + "\n".join(["", *lines]) + match[3]

    return BLOCK.sub(block, text)


def take(folder, results):
    """Keep the files of a run: of each code what no other run of it beats, alone or as a whole."""
    results.mkdir(exist_ok=True)
    for name, rows in read(folder).items():
        with open(Path(folder) / f"{name}.csv", newline="", encoding="utf-8") as file:
            lines = list(csv.DictReader(file))
        best = rows
        if name in PROBLEMS:
            groups = [[r for r in usable(rows) if (r["code"], in_numpy(r)) == one]
                      for one in {(r["code"], in_numpy(r)) for r in rows}]
            best = [r for r in rows if r["cold_seconds"] > 0.0]
            best += [r for group in groups for key in KEYS for r in front(group, key)]
        with open(results / f"{name}.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, lines[0])
            writer.writeheader()
            writer.writerows(line for line, r in zip(lines, rows) if r in best)


def main(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", default=ROOT / "benchmarks" / "results", help="CSV files")
    parser.add_argument("--take", help="folder that bench.py has written")
    parser.add_argument("--check", action="store_true", help="write nothing, fail if they differ")
    options = parser.parse_args(arguments)
    if options.take:
        take(options.take, Path(options.results))
        for shown in (ROOT / "docs").glob("bench_*.png"):  # of the same run as the tables
            made = Path(options.take) / shown.name.removeprefix("bench_")
            if made.exists():
                shutil.copyfile(made, shown)
    results = read(options.results)
    for page in PAGES:
        text = (ROOT / page).read_text(encoding="utf-8")
        if (new := renewed(text, results)) != text:
            if options.check:
                raise SystemExit(f"{page} does not say what was measured, or the code has changed "
                                 "since: run make bench, or python benchmarks/page.py")
            (ROOT / page).write_text(new, encoding="utf-8")


if __name__ == "__main__":
    main()
