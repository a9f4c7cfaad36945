"""Measures the peak memory of runs: reads [case, number] line by line, prints megabytes."""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from work_precision import frames
from work_precision.cases import runs_of, warm_up
from work_precision.micro import SCALED


def peak(case, index, quick):
    """Peak resident memory (MB) of a child that makes run ``index``, or scales to that size."""
    pid = os.fork()
    if pid == 0:
        try:
            if case == "frames":
                frames.frame(index).solve_linear()
            elif case == "large":
                frames.frame(index).solve_static()
            elif case in SCALED:
                SCALED[case](index).solve_linear()
            else:
                runs_of(case, quick)[index].build().solve()
        except Exception:
            os._exit(1)
        os._exit(0)
    _, status, usage = os.wait4(pid, 0)
    scale = 2.0**20 if sys.platform == "darwin" else 1024.0
    return round(usage.ru_maxrss / scale, 1) if status == 0 else ""


def main():
    """Serve until the input ends."""
    quick = "--quick" in sys.argv
    out = os.fdopen(os.dup(1), "w")  # what codes print must not come between
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for k, line in enumerate(sys.stdin):
        if k == 0:  # and not before: it would take a core from what is measured meanwhile
            warm_up()
        print(json.dumps(peak(*json.loads(line), quick)), file=out, flush=True)


if __name__ == "__main__":
    main()
