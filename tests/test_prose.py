"""Pages and public docstrings are in plain words and short sentences."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
MODULES = sorted((ROOT / "skfem_ancf").rglob("*.py"))
#: What not to write, as a regular expression, and what to write instead.
WORDS = {
    r"of (one's|your) own": "custom, user-defined; your ...",
    r"one's own": "custom, user-defined",
    r"held by|those that are held": "supported by, constrained by, stabilised by",
    r"lets? go( of)? again": "released, separates",
    r"(is|are|was|were) (told|spread) by": "given by, distributed by",
    r"unless told otherwise": "by default",
    r"open by": "the residual of",
    r"carried stress": "independent stress, mixed form",
    r"stress-free (body|state|shape)": "reference configuration",
    r"growth strains?": "eigenstrain",
    r"astray": "diverges",
    r"twins?": "compiled version",
    r"lanes": "vectorised index",
    r"slabs?": "layer",
    r"weld(ed)? to the ground": "clamp, clamped",
    r"[a-z]+s (anew|afresh)|made anew": "again",
    r"may be had": "is available",
    r"texts? of (a|the) kernel": "kernel",
    r"spread (load|force|moment)s?": "distributed load",
    r"of the order of magnitude of": "about",
    r"two doors|doors lead": "two ways",
}
#: A sentence of a page, and a page's mean, in words; a formula or a piece of code is one.
LONGEST, MEAN = 40, 20


def prose(text):
    """Paragraphs of Markdown, without code, tables, formulas and targets of links."""
    text = re.sub(r"^(`{3,}|~{3,}).*?^\1\s*?$", "\n\n", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"\$\$.*?\$\$", " formula ", text, flags=re.DOTALL)
    text = re.sub(r"\$[^$\n]+\$|`[^`]+`", "code", text)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"^\s*(\|.*|:::.*|:[a-z]+:.*|\([\w-]+\)=|<.*>)$", "", text, flags=re.MULTILINE)
    text = re.sub(r"^(#+ |\s*[-*] |\s*\d+\. )(.*)$", r"\n\n\2", text, flags=re.MULTILINE)
    return [" ".join(part.split()) for part in re.split(r"\n\s*\n", text) if part.strip()]


def sentences(text):
    """Lists of words: of each sentence of the prose."""
    found = (part for paragraph in prose(text)
             for part in re.split(r"(?<=[a-z0-9)\]*\"][.?!])\s+(?=[A-Z\"`*(\[]|code)", paragraph))
    words = (re.findall(r"[\w'²³°.,/^-]*\w[\w'²³°.,/^-]*", sentence) for sentence in found)
    return [line for line in words if line]


def strings(module):
    """Docstrings of a module and messages of its errors and warnings."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)):
            yield ast.get_docstring(node, clean=False) or ""
        elif isinstance(node, ast.Raise) or (
                isinstance(node, ast.Call) and getattr(node.func, "id", "") == "warn"):
            yield " ".join(part.value for part in ast.walk(node)
                           if isinstance(part, ast.Constant) and isinstance(part.value, str))


def dialect(text):
    """What a text has of the words not to write."""
    text = " ".join(text.split())
    return [f"{found[0]!r}: {instead}" for word, instead in WORDS.items()
            for found in re.finditer(rf"\b({word})\b", text, re.IGNORECASE)]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_pages_have_no_dialect(page):
    assert not dialect(re.sub(r"\]\([^)]*\)", "]", page.read_text(encoding="utf-8")))


def test_docstrings_and_errors_have_no_dialect():
    found = [f"{module.relative_to(ROOT)}: {words}" for module in MODULES
             for text in strings(module) for words in dialect(text)]
    assert not found, "\n".join(found)


def test_demos_have_no_dialect():
    found = [f"{demo.stem}: {words}" for demo in sorted((ROOT / "demos").glob("*.py"))
             for text in (ast.get_docstring(ast.parse(demo.read_text(encoding="utf-8"))),
                          *re.findall(r"^# %%\n((?:#.*\n)*)", demo.read_text(encoding="utf-8"),
                                      re.MULTILINE))
             for words in dialect(text.replace("\n# ", "\n"))]
    assert not found, "\n".join(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_sentences_of_a_page_are_short(page):
    found = sentences(page.read_text(encoding="utf-8"))
    long = [" ".join(words) for words in found if len(words) > LONGEST]
    assert not long, f"more than {LONGEST} words: " + "\n".join(long)
    if found:
        mean = sum(map(len, found)) / len(found)
        assert mean <= MEAN, f"{mean:.1f} words a sentence"


def test_the_measure_counts_sentences():
    text = "# Title\n\nOne two `a b`, e.g. *x*. Next one\nis $x + y$ [as here](page.md).\n\n- item"
    assert [len(words) for words in sentences(text)] == [1, 4, 1, 6, 1]
    assert dialect("A law of one's\nown") == ["\"of one's own\": custom, user-defined; your ...",
                                              "\"one's own\": custom, user-defined"]
