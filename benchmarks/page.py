"""Write the tables of docs/benchmarks.md from the CSV files that bench.py has written.

    python benchmarks/page.py [--results out/bench] [--page docs/benchmarks.md]

Between ``<!-- bench NAME -->`` and ``<!-- end -->`` stands what :data:`TABLES` makes of the rows of
one run. What was not measured stays as it is, so that a folder of some cases renews theirs alone.
"""

import argparse
import csv
import re
from pathlib import Path

from work_precision import large
from work_precision.report import (DECADES, EXUDYN, GOALS, OURS, Q2, at, fastest, goals, places,
                                   sweeps, table, tangents, weakest)

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
    return next((g.factor for g in GOALS if g.case == case and g.key == key
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
            out.append(cells)
        return table(["error", "here", "solve (ms)", "whole (ms)", peer, "solve (ms)", "whole (ms)",
                      "solve, times faster", "whole, times faster"], out) + cold(rows)
    return lines


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

    between = {title: [f"{both(case, target)} at {target:.2e}" for goal in GOALS
                       if goal.case == case for target in weakest(results[case], goal)]
               for case, title in OTHERS.items()}
    return table(["case", *(f"{t:.0e}" for t in DECADES[1:])], [
        [title, *(both(case, t) for t in DECADES[1:])] for case, title in OTHERS.items()]) + (
        [f"Least between these errors, {title}: {'; '.join(found)}."
         for title, found in between.items() if found] + [""])


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
    return [f"One run: {first['machine']}; {first['versions']}. Of {len(found)} goals "
            f"{len(found) - missed} were met, {missed} missed; those are marked below.", ""]


#: The lines of each table, by the case that it needs; "about" and "others" take all of them.
TABLES = {"about": about, "5.2": duel("5.2", EXUDYN), "pendulum": duel("pendulum", EXUDYN),
          "thick": duel("thick", Q2), "others": others, "sweep": sweep, "tangent": tangent,
          "iteration": iteration, "steps": steps, "frames": frames, "large": large_frames,
          "scaling": scaling}


def renewed(text, results):
    """The page with the tables of what was measured."""
    def block(match):
        name = match[2]
        if name not in ("about", "others") and name not in results:
            return match[0]
        lines = TABLES[name](results)
        return match[0] if lines is None else match[1] + "\n".join(["", *lines]) + match[3]

    return BLOCK.sub(block, text)


def main(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", default="out/bench", help="folder that bench.py has written")
    parser.add_argument("--page", default="docs/benchmarks.md", type=Path, help="page to renew")
    options = parser.parse_args(arguments)
    options.page.write_text(renewed(options.page.read_text(encoding="utf-8"),
                                    read(options.results)), encoding="utf-8")


if __name__ == "__main__":
    main()
