"""Compute the examples of the paper and write tables, figures and a report.

    python benchmarks/paper.py [--out out/paper] [--only 5.2 5.4] [--quick]
"""

import argparse
import sys
import time
from pathlib import Path

from tqdm import tqdm

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "validation")]

from reproduction.examples import EXAMPLES
from reproduction.figures import DRAW
from reproduction.models import FULL, QUICK
from reproduction.report import report


def run(out, numbers, settings):
    """Compute some examples and write everything; returns the results by number."""
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    start, results = time.perf_counter(), {}
    total = sum(EXAMPLES[number].runs + 1 for number in numbers)
    with tqdm(total=total, unit="run", dynamic_ncols=True) as bar:

        def watch(items, label):
            for item in items:
                bar.set_description(f"{label} {getattr(item, 'name', '')}".strip())
                yield item
                bar.update(1)

        for number in numbers:
            result = results[number] = EXAMPLES[number].compute(settings, watch)
            bar.set_description(f"{number} files")
            for name, sheet in result.sheets.items():
                sheet.write(out / f"{name}.csv")
            for name, figure in DRAW[number](result).items():
                figure.savefig(out / f"{name}.png")
            bar.update(1)
    text = report(results, settings, time.perf_counter() - start, settings == FULL)
    (out / "report.md").write_text(text, encoding="utf-8")
    return results


def main(arguments=None):
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", default="out/paper", help="folder to write to")
    parser.add_argument("--only", nargs="+", choices=EXAMPLES, default=list(EXAMPLES),
                        metavar="EXAMPLE", help=f"some of {', '.join(EXAMPLES)}")
    parser.add_argument("--quick", action="store_true", help="coarse, a quarter of a minute")
    options = parser.parse_args(arguments)
    numbers = [number for number in EXAMPLES if number in options.only]
    run(options.out, numbers, QUICK if options.quick else FULL)
    print(f"{options.out}/report.md")


if __name__ == "__main__":
    main()
