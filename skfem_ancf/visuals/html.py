"""HTML of states, scenes, paths and motions in notebooks."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable
from typing import Any

import numpy as np

from ..core import AncfError

#: Resolution of the pictures, in dots per inch.
DPI = 80


def picture(draw: Callable[[], Any], dpi: int = DPI) -> str:
    """An img element of the figure of ``draw()``; empty if that fails."""
    try:
        figure, data = draw().figure, io.BytesIO()
        figure.savefig(data, format="png", dpi=dpi, bbox_inches="tight")
    except AncfError:
        return ""
    return f'<img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}"/>'


def _words(text):
    return f"<pre>{html.escape(text)}</pre>"


def state_html(state: Any) -> str:
    """The text of a State, and its picture."""
    return _words(str(state)) + picture(state.plot)


def scene_html(scene: Any) -> str:
    """A table of the items of a Scene, and its reference configuration."""
    rows: list[tuple[str, object]] = [("beam", b) for b in scene.beams]
    rows += [("rigid body", b) for b in scene.bodies]
    rows += [("domain", d) for d in scene.domains]
    rows += [("item", one) for one in scene.items]
    texts = [(kind, " ".join(repr(thing).split())) for kind, thing in rows]
    table = "".join(f"<tr><td>{kind}</td><td>" + html.escape(
        text if len(text) <= 160 else text[:157] + "...") + "</td></tr>" for kind, text in texts)
    return (_words(repr(scene)[1:-1]) + f"<table>{table}</table>"
            + picture(lambda: scene.state().plot("displacement", colorbar=False, title="",
                                                  cmap="Greys")))


def path_html(path: Any) -> str:
    """The text of a Path, and its load against the largest nodal displacement."""
    def draw():
        state = path.state(len(path) - 1)
        beam = max(state.beams, key=lambda b: np.max(np.abs(state.u_of(b))))
        moved = state.u_of(beam).reshape(-1, beam.nd)[:, :2]
        node, component = np.unravel_index(np.argmax(np.abs(moved)), moved.shape)
        return path.plot(beam.mesh.p[:, node], int(component), beam)

    return _words(repr(path)[1:-1]) + picture(draw)


def history_html(history: Any) -> str:
    """The text of a History, and its energies over time."""
    return _words(repr(history)[1:-1]) + (
        picture(lambda: history_picture(history)) if len(history) > 1 else "")


def history_picture(history: Any) -> Any:
    """Axes with the energies of a History over time."""
    from .matplotlib import dress, new_axes

    ax = new_axes((5.5, 3.0))
    for name in ("strain", "kinetic", "potential", "total"):
        ax.plot(history.t, getattr(history, f"{name}_energy"), lw=1.4, label=name)
    ax.legend(fontsize=8, frameon=False)
    dress(ax, "energy", "time", "")
    return ax
