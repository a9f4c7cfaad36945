"""The report: the goals as ratios within one run, and the fronts behind them."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from . import large
from .figures import front, usable
from .problems import PROBLEMS

OURS, EXUDYN, Q2, TEXTBOOK = "skfem-ancf", "Exudyn", "scikit-fem Q2", "scikit-fem forms"
TANGENT = "Tangent assembly 100 times faster than the textbook BilinearForm, 16 to 4096 elements"
ITERATION = "A static iteration at 16 elements, N = 3, under 0.25 ms"
FRAME = "A frame of 14 x 14 cells, whole, twice as fast as Exudyn's best with an error of 1e-4"
SWEEP = "A sweep of cantilevers, beside a loop of Exudyn's at no larger error"
DECADES = 10.0 ** -np.arange(1.0, 8.0)


class Goal(NamedTuple):
    """So many times faster than a peer at each error of a case, and everywhere between them."""

    wanted: str
    case: str
    peer: str
    targets: np.ndarray
    factors: tuple[float, ...] = (1.0,)
    key: str = "seconds"

    def factor(self, error):
        """That of the smallest target which is no smaller, the last of those given at most."""
        met = int(np.sum(self.targets * (1.0 + 1e-6) >= error)) - 1
        return self.factors[min(max(met, 0), len(self.factors) - 1)]


GOALS = (Goal("5.2: 2, 3 and 4 times faster than Exudyn's best at errors of 1e-2, of 1e-3, and of "
              "1e-4 to 1e-7", "5.2", EXUDYN, DECADES[1:], (2.0, 3.0, 4.0)),
         Goal("Soft pendulum: three times faster than Exudyn's best from 1e-3 to 1e-6", "pendulum",
              EXUDYN, DECADES[2:6], (3.0,)),
         Goal("Spin-up: five times faster than Exudyn's best from 1e-3 to 1e-7", "spin-up", EXUDYN,
              DECADES[2:], (5.0,)),
         Goal("Thrown rod: five times faster than Exudyn's best from 1e-3 to 1e-7", "free-rod",
              EXUDYN, DECADES[2:], (5.0,)),
         Goal("Thick continuum: stock scikit-fem Q2 beaten a hundredfold", "thick", Q2,
              DECADES[1:4], (100.0,)),
         Goal("5.2, whole: from parameters to the tip in a warm process, 1, 1.5 and 2 times faster "
              "than Exudyn's best at errors of 1e-2, of 1e-3, and of 1e-4 to 1e-7", "5.2", EXUDYN,
              DECADES[1:], (1.0, 1.5, 2.0), "whole_seconds"),
         Goal("Soft pendulum, whole: from parameters to the tip in a warm process, ahead of "
              "Exudyn's best from 1e-3 to 1e-6", "pendulum", EXUDYN, DECADES[2:6], (1.0,),
              "whole_seconds"))


def table(head, rows):
    """Lines of a Markdown table."""
    def line(cells):
        return "| " + " | ".join(map(str, cells)) + " |"

    return [line(head), line(["---"] * len(head)), *(line(row) for row in rows), ""]


def fastest(rows, code, target, key="seconds"):
    """The fastest run of a code with an error of at most the target, or None."""
    good = [r for r in usable(rows) if r["code"] == code and r["error"] <= target]
    return min(good, key=lambda r: r[key], default=None)


def named(r, key="seconds"):
    """A run in a few words."""
    if r is None:
        return "none reaches it"
    steps = f", {r['steps']} steps" if r["steps"] and "steps" not in r["variant"] else ""
    return f"{1e3 * r[key]:.3g} ms ({r['variant']}; {r['elements']} elements{steps})"


def lead(rows, peer, target, key="seconds"):
    """How many times faster than a peer at an error; 0 if only the peer reaches it."""
    mine, its = fastest(rows, OURS, target, key), fastest(rows, peer, target, key)
    return 0.0 if mine is None else np.inf if its is None else its[key] / mine[key]


def weakest(rows, goal):
    """Errors between each of a goal's and the next at which it is missed or the lead is least.

    Not where that is as at one of them. The lead falls, as the error grows, only where a run of the
    peer becomes good enough.
    """
    def ahead(error):
        return lead(rows, goal.peer, error, goal.key)

    peer = [r for r in usable(rows) if r["code"] == goal.peer]
    errors = [e for e in sorted({r["error"] for r in peer})
              if fastest(peer, goal.peer, e, goal.key)["error"] == e]
    out = []
    for high, low in pairwise(sorted(goal.targets, reverse=True)):
        ends = ahead(low), ahead(high)
        inside = {e: ahead(e) for e in errors if low < e < high and ahead(e) not in ends}
        least = min(inside.values(), default=np.inf)
        out += [e for e, found in inside.items()
                if found < goal.factor(e) or found == least < min(ends)]
    return out


def places(rows, goal):
    """Errors at which a goal is judged, the largest first."""
    return sorted([*goal.targets, *weakest(rows, goal)], reverse=True)


def at(error, targets):
    """An error in a few digits."""
    return f"{error:.0e}" if error in targets else f"{error:.2e}"


def against(rows, goal):
    """Rows (error, ratio, verdict, ours, peer's) of one goal, where it is judged."""
    return [one_against(rows, goal, target) for target in places(rows, goal)]


def one_against(rows, goal, target):
    """A row of :func:`against`: factor times faster than a peer."""
    mine, its = (fastest(rows, code, target, goal.key) for code in (OURS, goal.peer))
    ratio = lead(rows, goal.peer, target, goal.key)
    return (at(target, goal.targets), f"{ratio:.3g}" if mine and its else "",
            "met" if mine and ratio >= goal.factor(target) else "missed",
            named(mine, goal.key), named(its, goal.key))


def decades(rows, case):
    """Rows as :func:`against` at each decade, of a case that has no goal."""
    goal = Goal("", case, EXUDYN, DECADES[1:])
    return [one_against(rows, goal, target) for target in goal.targets]


def goal_against(results, goal):
    """Lines for a goal on a case."""
    if goal.case not in results:
        return [f"**{goal.wanted}**: not measured in this run.", ""]
    if not any(r["code"] == goal.peer for r in results[goal.case]):
        return [f"**{goal.wanted}**: not measured, {goal.peer} did not take part.", ""]
    rows = against(results[goal.case], goal)
    met = sum(r[2] == "met" for r in rows)
    verdict = "met" if met == len(rows) else f"met at {met} of {len(rows)}" if met else "missed"
    return [f"**{goal.wanted}**: {verdict}.", "",
            *table(["error", f"times faster than {goal.peer}", "", OURS, goal.peer], rows)]


def tangents(rows):
    """Elements, seconds by pairs, batched and fused, and the verdict on a hundred times."""
    for n in dict.fromkeys(r["elements"] for r in rows):
        pairs, batched, fused = (next(r["seconds"] for r in rows if r["elements"] == n
                                      and r["variant"].startswith(v))
                                 for v in ("BilinearForm", "batched", "fused"))
        yield n, pairs, batched, fused, "met" if pairs >= 100.0 * fused else "missed"


def goals(results):
    """Every goal that was measured, as rows: goal, at, wanted, found, verdict, ours, peer's."""
    out = []
    for goal in GOALS:
        rows = results.get(goal.case, ())
        if any(r["code"] == goal.peer for r in rows) and all(goal.key in r for r in rows):
            out += [(goal.wanted, f"error {target}", f"{goal.factor(float(target)):g} times", ratio,
                     *rest) for target, ratio, *rest in against(rows, goal)]
    square = [r for r in results.get("frames", ()) if r["cells"] == 14]
    mine, its = (fastest(square, code, 1.0001e-4) for code in (OURS, EXUDYN))
    if mine and its:
        found = its["seconds"] / mine["seconds"]
        out.append((FRAME, "14 x 14", "2 times", f"{found:.3g}",
                    "met" if found >= 2.0 else "missed", named(mine), named(its)))
    for n, pairs, _, fused, verdict in tangents(results.get("tangent", ())):
        out.append((TANGENT, f"{n} elements", "100 times", f"{pairs / fused:.3g}", verdict,
                    f"{1e3 * fused:.3g} ms", f"{1e3 * pairs:.3g} ms"))
    for r in results.get("iteration", ()):
        if r["variant"].endswith("its iterations"):
            out.append((ITERATION, r["variant"], "0.25 ms", f"{1e3 * r['seconds']:.3g} ms",
                        "met" if r["seconds"] < 2.5e-4 else "missed", "", ""))
    return out


def sweeps(rows):
    """Rows of this package in a sweep, how many times faster than a peer, and its row."""
    for mine in rows:
        if mine["code"] == OURS:
            its = fastest(rows, EXUDYN, mine["error"])
            yield mine, its["seconds"] / mine["seconds"] if its else None, its


def sweep(results):
    """Lines for many scenes."""
    if "sweep" not in results:
        return [f"**{SWEEP}**: not measured in this run.", ""]
    lines = [(r["variant"], r["note"].split()[0], r["elements"], f"{r['error']:.1e}",
              f"{1e3 * r['seconds']:.3g}", f"{r['setup_seconds']:.2g}",
              f"{ratio:.3g}" if its else "", named(its))
             for r, ratio, its in sweeps(results["sweep"])]
    return [f"**{SWEEP}**. (By a clock on the wall, for each member; building, and the start of "
            "processes, are in it; the start is what a sweep of two members took before.)", "",
            *table(["what", "members", "elements", "error", "ms a member", "start (s)",
                    "times faster", EXUDYN], lines)]


def goal_tangent(results):
    """Lines for the assembly of the tangent."""
    if "tangent" not in results:
        return [f"**{TANGENT}**: not measured in this run.", ""]
    lines = [(n, f"{1e3 * pairs:.3g}", f"{1e3 * batched:.3g}", f"{1e3 * fused:.3g}",
              f"{pairs / batched:.3g}", f"{pairs / fused:.3g}", verdict)
             for n, pairs, batched, fused, verdict in tangents(results["tangent"])]
    verdict = "met" if all(line[-1] == "met" for line in lines) else "missed"
    return [f"**{TANGENT}**: {verdict}. (N = 3, full quadrature; the fused kernel gives the "
            "internal force as well.)", "",
            *table(["elements", "pairs (ms)", "batched form (ms)", "fused kernel (ms)",
                    "ratio, batched", "ratio, fused", ""], lines)]


def goal_iteration(results):
    """Lines for one static iteration."""
    if "iteration" not in results:
        return [f"**{ITERATION}**: not measured in this run.", ""]
    rows = results["iteration"]
    mine = [r for r in rows if r["variant"].endswith("its iterations")]
    met = sum(r["seconds"] < 2.5e-4 for r in mine)
    verdict = "met" if met == len(mine) else "missed" if not met else f"met by {met} of {len(mine)}"
    return [f"**{ITERATION}**: {verdict}.", "",
            *table(["what", "ms"], [(r["variant"], f"{1e3 * r['seconds']:.3g}") for r in rows])]


def steps(results):
    """Lines for a step of each kind."""
    if "steps" not in results:
        return []
    return ["**A step of each kind**, in a whole run.", "", *table(
        ["what", "elements", "steps", "error", "ms a step"],
        [(r["variant"], r["elements"], r["steps"], f"{r['error']:.1e}", f"{1e3 * r['seconds']:.3g}")
         for r in results["steps"]])]


def scaling(rows):
    """Lines about size."""
    lines = []
    for variant in dict.fromkeys(r["variant"] for r in rows):
        mine = [r for r in rows if r["variant"] == variant]
        known = [r for r in mine if r["peak_mb"] != ""]
        per = ""
        if len(known) > 1 and known[-1]["elements"] > 10 * known[0]["elements"]:
            a, b = known[0], known[-1]
            per = f"{1024 * (b['peak_mb'] - a['peak_mb']) / (b['elements'] - a['elements']):.3g}"
        for r in mine:
            lines.append((variant, r["elements"], r["dofs"], f"{1e3 * r['seconds']:.4g}",
                          f"{1e6 * r['seconds'] / r['elements']:.3g}", r["iterations"],
                          r["peak_mb"], per if r is mine[-1] else "", r["note"]))
    return ["## Size", "", "One linear system of a beam of elements of one length: assembled, "
            "factorised, solved. Memory is the peak of a process that does nothing else, imports "
            "included; the last column but one is its growth.", "",
            *table(["variant", "elements", "coordinates", "ms", "microseconds an element",
                    "iterations", "peak (MB)", "kB an element", ""], lines), "![](scaling.png)", ""]


def frames(rows):
    """Lines about square frames."""
    cells = [(r["cells"], r["code"], r["variant"], f"{r['error']:.1e}", f"{1e3 * r['seconds']:.4g}",
              r["iterations"], r["peak_mb"], r["note"]) for r in rows]
    return ["## Square frames under a lateral load", "", "From parameters to the displacement of a "
            "corner: building is in the time.", "",
            *table(["cells", "code", "variant", "error", "ms", "iterations", "peak (MB)", ""],
                   cells)]


def large_frames(rows):
    """Lines about large frames."""
    cells = [(r["cells"], r["dofs"], r["code"], r["variant"], f"{1e3 * r['seconds']:.4g}",
              r["iterations"], r["peak_mb"], r["note"]) for r in rows]
    statics = [r for r in rows if r["variant"] == "statics"]
    powers = [f"{name} grows as the power {large.fitted(statics, column):.2f} of the coordinates"
              for name, column in (("time", "seconds"), ("memory", "peak_mb"))]
    return ["## Large frames", "", "Statics from parameters to the displacement of a corner, "
            "building and the first solution included; other rows without building. In statics "
            f"{' and '.join(powers)}, by least squares.", "",
            *table(["cells", "coordinates", "code", "what", "ms", "iterations", "peak (MB)", ""],
                   cells)]


def case_lines(name, rows):
    """Lines of a case: the front of each code."""
    lines = [f"## {name}: {PROBLEMS[name].title}", "", f"![]({name}.png)", "",
             f"Data: [{name}.csv]({name}.csv). Runs that no other of the same code beats:", ""]
    cells = []
    for code in dict.fromkeys(r["code"] for r in rows):
        for r in front([r for r in usable(rows) if r["code"] == code]):
            cells.append((code, r["variant"], r["elements"], r["steps"] or "", f"{r['error']:.1e}",
                          f"{1e3 * r['seconds']:.3g}", f"{1e3 * r['whole_seconds']:.3g}",
                          r["iterations"], r["peak_mb"]))
    lines += table(["code", "variant", "elements", "steps", "error", "ms", "whole (ms)",
                    "iterations", "peak (MB)"], cells)
    cold = [(r["code"], r["variant"], r["elements"], r["steps"] or "", f"{r['error']:.1e}",
             f"{1e3 * r['seconds']:.3g}", f"{1e3 * r['whole_seconds']:.3g}",
             f"{r['cold_seconds']:.3g}") for r in rows if r["cold_seconds"] > 0.0]
    if cold:
        lines += ["Cold, in a new process with nothing compiled before:", "", *table(
            ["code", "variant", "elements", "steps", "error", "ms", "whole (ms)", "cold (s)"],
            cold)]
    failed = [r for r in rows if str(r["note"]).startswith("failed")]
    if failed:
        lines += [f"{len(failed)} of {len(rows)} runs found no solution: " + "; ".join(
            f"{count} of {code}" for code, count in _count(r["code"] for r in failed)) + ".", ""]
    return lines


def _count(items):
    items = list(items)
    return [(item, items.count(item)) for item in dict.fromkeys(items)]


def report(results, about, loading, quick):
    """The report as Markdown."""
    lines = [
        "# Time against error", "", f"{about[0]}; {about[1]}.", "",
        "Seconds are processor time of the solution alone, median of several runs after a first "
        "one, all in this run and on one core; `whole_seconds` are those from the parameters to "
        "the value read, in a process that has done it before, building meshes, tables and systems "
        "included; `cold_seconds` those of a new process, imports included, with no compiled code "
        "on disk, of one run of each code. Loading the compiled kernels and imports took "
        f"{loading:.2g} s once. The error is the distance of the tip from the converged solution "
        "of the code's own mechanical model, over the length of the beam; on the thick continuum "
        "from the one two-dimensional reference. A ratio compares the fastest runs of both codes "
        "whose error is at most the one given.", ""]
    if quick:
        lines += ["**Quick: a few runs only. No verdict below means anything.**", ""]
    if not any(r["code"] == EXUDYN for rows in results.values() for r in rows):
        lines += ["**Exudyn is not installed, or no case with it was asked for: its rows are "
                  "missing.**", ""]
    lines += ["## Goals", "",
              *(line for goal in GOALS for line in goal_against(results, goal)),
              *goal_tangent(results), *goal_iteration(results), *steps(results),
              *sweep(results)]
    others = [name for name in ("5.2-1e3", "5.2-1e4", "5.1", "roll-up")
              if name in results and any(r["code"] == EXUDYN for r in results[name])]
    if others:
        lines += ["## The other cases against Exudyn", "", "Times faster; below 1 it is slower.",
                  "", *table(["case", *(f"{t:.0e}" for t in DECADES[1:])],
                             [[name, *(row[1] or ("only ours" if row[2] == "met" else "neither"
                                                  if row[3] == row[4] else "only Exudyn")
                                       for row in decades(results[name], name))]
                              for name in others])]
    if "frames" in results:
        lines += frames(results["frames"])
    if "large" in results:
        lines += large_frames(results["large"])
    if "scaling" in results:
        lines += scaling(results["scaling"])
    for name in PROBLEMS:
        if name in results:
            lines += case_lines(name, results[name])
    return "\n".join(lines)
