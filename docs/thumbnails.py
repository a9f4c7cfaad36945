"""Thumbnails of the gallery: the largest drawing of an example, without axes, bars and words."""

import ast
import re
from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.transforms import Bbox

#: Pixels of a thumbnail.
SIZE = 460, 300
FOLDER = Path(__file__).resolve().parent / "generated" / "thumbnails"
#: The size of the largest drawing of each example so far.
largest: dict[str, float] = {}


def size(ax):
    """Square inches of a drawing; of what has no field a tenth, of a colour bar nothing."""
    if ax.get_label() == "<colorbar>":
        return 0.0
    box = ax.get_window_extent().transformed(ax.figure.dpi_scale_trans.inverted())
    field = any(part.get_array() is not None for part in ax.collections)
    return box.width * box.height * (1.0 if field else 0.1)


def draw(figure, ax, filename):
    """Save the inside of one drawing, and leave its figure as it was."""
    words = [*figure.texts, *(text for part in figure.subfigs for text in part.texts),
             *(other for other in figure.axes if other is not ax), *ax.child_axes,
             *ax.spines.values(), *ax.texts, ax.xaxis, ax.yaxis, ax.get_legend()]
    hidden = [part for part in words if part is not None and part.get_visible()]
    titles = {where: ax.get_title(where) for where in ("left", "center", "right")}
    box = ax.get_window_extent().transformed(figure.dpi_scale_trans.inverted())
    half = max(box.width, box.height * SIZE[0] / SIZE[1]) / 2.0
    x, y = (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0
    high = half * SIZE[1] / SIZE[0]
    engine = figure.get_layout_engine()
    figure.set_layout_engine("none")
    for part in hidden:
        part.set_visible(False)
    for where in titles:
        ax.set_title("", loc=where)
    figure.savefig(filename, dpi=SIZE[0] / (2.0 * half),
                   bbox_inches=Bbox([[x - half, y - high], [x + half, y + high]]))
    for part in hidden:
        part.set_visible(True)
    for where, title in titles.items():
        ax.set_title(title, loc=where)
    figure.set_layout_engine(engine)


def thumbnails(block, block_vars, gallery_conf):
    """Before matplotlib's figures are saved: the largest drawing of the example so far."""
    stem = Path(block_vars["src_file"]).stem
    FOLDER.mkdir(parents=True, exist_ok=True)
    figures = [plt.figure(number) for number in plt.get_fignums()]
    largest[stem] = largest_of(figures, FOLDER / f"{stem}.png", largest.get(stem, 0.0))
    return ""


def largest_of(figures, filename, least=0.0):
    """Save the largest drawing of figures, if it is larger than ``least``; returns its size."""
    for figure in figures:
        figure.canvas.draw()
        for ax in figure.axes:
            if ax.get_visible() and size(ax) > least:
                least = size(ax)
                draw(figure, ax, filename)
    return least


def replace(app):
    """After the gallery has run: these thumbnails in place of its own."""
    for file in FOLDER.glob("*.png"):
        target = Path(app.srcdir, "gallery", "images", "thumb", f"sphx_glr_{file.stem}_thumb.png")
        if target.exists():
            target.write_bytes(file.read_bytes())


def sentence(example):
    """The first paragraph of an example, which is a sentence (tests/test_demos.py)."""
    text = ast.get_docstring(ast.parse(example.read_text(encoding="utf-8")))
    return " ".join(text.split("\n\n")[1].replace("``", "").split())


def captions(app, docname, source):
    """A sentence under each thumbnail of the gallery."""
    if docname != "gallery/index":
        return
    demos = Path(app.srcdir).parent / "demos"
    parts = re.split(r'(:doc:`/gallery/(\w+)`)', re.sub(r' tooltip="[^"]*"', "", source[0]))
    for k in range(2, len(parts), 3):
        text = sentence(demos / f"{parts[k]}.py")
        parts[k + 1] = parts[k + 1].replace(
            "</div>\n", f'</div>\n      <div class="thumbnail-sentence">{text}</div>\n', 1)
    source[0] = "".join(part for k, part in enumerate(parts) if k % 3 != 2)


def _get_sg_image_scraper():
    """What sphinx-gallery asks a module for."""
    return thumbnails


def setup(app):
    """Called by Sphinx."""
    app.connect("builder-inited", replace, priority=900)
    app.connect("source-read", captions)
