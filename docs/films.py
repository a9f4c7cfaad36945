"""Films that an example of the gallery writes to out/ are shown where it does so."""

import shutil
from pathlib import Path

from sphinx_gallery.scrapers import figure_rst


def films(block, block_vars, gallery_conf):
    """The pictures of a block of code: the .gif files that it names."""
    shown = []
    for film in sorted((Path(block_vars["src_file"]).parent / "out").glob("*.gif")):
        if f"/{film.name}\"" in block[1]:
            shown.append(Path(next(block_vars["image_path_iterator"])).with_suffix(".gif"))
            shutil.copy(film, shown[-1])
    return figure_rst([str(path) for path in shown], gallery_conf["src_dir"])


def _get_sg_image_scraper():
    """What sphinx-gallery asks a module for."""
    return films
