"""How Sphinx makes the pages: make docs."""

import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

# pictures are drawn without a display, and scenes computed in NumPy: nothing is timed here
os.environ.setdefault("SKFEM_ANCF_COMPILED", "0")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")

import pyvista
import skfem_ancf
import words
from pyvista.plotting.utilities.sphinx_gallery import DynamicScraper
from sphinx.search.en import SearchEnglish

pyvista.BUILDING_GALLERY, SEARCH = True, SearchEnglish({})
warnings.filterwarnings("error", module="skfem_ancf")

project = "skfem-ancf"
author = "the skfem-ancf developers"
project_copyright = "2026, the skfem-ancf developers"
release = version = skfem_ancf.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc",
              "sphinx.ext.mathjax", "sphinx-mathjax-offline", "sphinx_design",
              "sphinx_gallery.gen_gallery", "thumbnails"]
exclude_patterns = ["generated/verification.md"]  # a part of a page
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
mathjax_path = "mathjax/tex-chtml.js"

# the reference: signatures have the types, docstrings the words
autosummary_generate = True
autodoc_typehints = "signature"
autodoc_member_order = "bysource"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Place", "WhichBeam",
                                                "WhichMember", "TimeFunction", "StrPath", "Rule")}
python_use_unqualified_type_names = True
maximum_signature_line_length = 88
numpydoc_show_class_members = False
templates_path = ["templates"]

sphinx_gallery_conf = {
    "examples_dirs": "../demos",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"__init__\.py",
    "image_scrapers": ("thumbnails", "matplotlib", "films", DynamicScraper()),
    "matplotlib_animations": True,
    "abort_on_example_error": True,
    "remove_config_comments": True,
    "min_reported_time": 1e9,
    "thumbnail_size": (460, 300),
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "plot_gallery": "True",
    "doc_module": ("skfem_ancf",),
    "backreferences_dir": "generated/examples",
    "inspect_global_variables": True,
    "nested_sections": False,
    "within_subsection_order": "order.Order",
}

html_theme = "pydata_sphinx_theme"
html_title = "skfem-ancf"
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_search_scorer = str(HERE / "scorer.js")
html_show_sourcelink = False
html_copy_source = False
html_sidebars = {"index": [], "tutorial": []}
html_theme_options = {
    "logo": {"text": "skfem-ancf"},
    "navbar_align": "left",
    "header_links_before_dropdown": 7,
    "show_toc_level": 2,
    "show_prev_next": False,
    "navbar_end": ["theme-switcher"],
    "footer_start": ["copyright"],
    "footer_end": ["theme-version"],
}


def titled(match):
    """A link to a page, with the page's title in place of the name of its file."""
    name = match[1]
    title = (HERE / name).read_text(encoding="utf-8").split("\n")[0].removeprefix("# ")
    return f"[{title}]({name}"


def links_of_pages(app, docname, source):
    """Links out of docs/ to what has a page here; of other files only the name is left."""
    text = re.sub(r"\[([\w-]+\.md)\]\(\1", titled, source[0])
    text = text.replace("](../CONTRIBUTING.md", "](contributing.md")
    text = re.sub(r"\]\((?:\.\./)?demos/(\w+)\.py\)", r"](gallery/\1.rst)", text)
    text = re.sub(r"\[[^\]]*\]\(\.\./([^)]*)\)", r"`\1`", text)
    source[0] = words.indexed(docname, text, stems)


def stems(text):
    """The stems of the words of a text that the search knows."""
    return {SEARCH.stem(word.lower()) for word in SEARCH.split(text)
            if SEARCH.word_filter(word.lower())}


def links_of_parts(app, path, docname, content):
    """The same for README.md, CONTRIBUTING.md and CHANGELOG.md, which lie above docs/."""
    if path.suffix == ".md":
        content[0] = content[0].replace("[docs/", "[").replace("](docs/", "](").replace(
            "](CONTRIBUTING.md", "](contributing.md")
        links_of_pages(app, docname, content)


def names_of_types(app, what, name, thing, options, signature, returned):
    """Names of types as they are written, inside of others too."""
    return tuple(text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text)
                 for text in (signature, returned))


def verification(app):
    """The table of verification.md, computed."""
    subprocess.run([sys.executable, HERE.parent / "benchmarks" / "verification.py", "--out",
                    HERE / "generated" / "verification.md"], check=True,
                   stdout=subprocess.DEVNULL)


def setup(app):
    """Called by Sphinx."""
    app.connect("source-read", links_of_pages)
    app.connect("include-read", links_of_parts)
    app.connect("builder-inited", verification)
    app.connect("autodoc-process-signature", names_of_types)
