"""Makes the pictures of the guides: python docs/pictures.py."""

import shutil
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).resolve().parent
sys.path.insert(0, str(DOCS.parent / "demos"))

import cantilever
import rollup
import spring


def main(folder=DOCS):
    """Write cantilever.png (64 elements), cantilever_16.png (not recovered), rollup, spring."""
    for elements, name, recover in ((64, "cantilever.png", True), (16, "cantilever_16.png", False)):
        state = cantilever.cantilever(2e8, elements).gravity((0, -9.81)).solve_static()
        cantilever.picture(state, Path(folder) / name, recover)
    with tempfile.TemporaryDirectory() as out:
        for demo in (rollup, spring):
            demo.main(out, progress=False)
            shutil.copy(Path(out) / f"{demo.__name__}.png", folder)


if __name__ == "__main__":
    main()
