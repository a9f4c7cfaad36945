"""One run in a process of its own: its arguments are in JSON behind the name of the script."""

import json
import sys
from importlib import import_module
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from work_precision.problems import PROBLEMS

if __name__ == "__main__":
    module, problem, args, options = json.loads(sys.argv[1])
    run = import_module(f"work_precision.{module}").run(PROBLEMS[problem], *args, **options)
    solver = run.build()
    solver.read(solver.solve())
