"""The least versions that pyproject.toml promises, as constraints for pip: ``make test-least``."""

import re
from pathlib import Path

TEXT = (Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8")


def promised():
    """Requirements of the package and of the extras that ``all`` names, as texts."""
    extras = re.search(r"^all = .*\[(.*)\]\"\]$", TEXT, re.MULTILINE)[1].split(",")
    for name in ["dependencies", *extras]:
        line = re.search(rf"^{name} = \[(.*)\]$", TEXT, re.MULTILINE)[1]
        yield from re.findall(r'"([^"]+)"', line)


if __name__ == "__main__":
    for text in promised():
        print(re.sub(r">=([0-9.]+).*", r"==\1", text))
