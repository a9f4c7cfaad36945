"""The search of the site finds what engineers look for; of the pages, if the site is not built."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

english = pytest.importorskip("sphinx.search.en")

ROOT = Path(__file__).resolve().parent.parent
BUILT = ROOT / "out" / "docs" / "searchindex.js"
#: What is looked for, and a page that the search has to name.
PHRASES = {
    "degrees of freedom": "glossary", "boundary condition": "supports", "transient": "motion",
    "quasi-static": "solving", "export to ParaView": "recipes", "initial imperfection": "recipes",
    "plastic": "limitations", "moving load": "recipes", "prescribed displacement": "recipes",
    "force-displacement curve": "recipes", "natural frequencies": "modes",
    "buckling load": "modes", "von Mises": "fields", "contact": "obstacles", "units": "units"}


def stems(text):
    """The stems of the words of a text that Sphinx's search knows."""
    search = english.SearchEnglish({})
    return {search.stem(word.lower()) for word in search.split(text)
            if search.word_filter(word.lower())}


@pytest.fixture(scope="module")
def pages():
    """From the name of a page to the stems that find it."""
    if not BUILT.exists():
        return {page.stem: stems(page.read_text(encoding="utf-8"))
                for page in (ROOT / "docs").glob("*.md")}
    text = BUILT.read_text(encoding="utf-8")
    index = json.loads(re.fullmatch(r"Search\.setIndex\((.*)\)", text, re.DOTALL)[1])
    found = {name: set() for name in index["docnames"]}
    for kind in ("terms", "titleterms"):
        for stem, numbers in index[kind].items():
            for number in [numbers] if isinstance(numbers, int) else numbers:
                found[index["docnames"][number]].add(stem)
    return found


@pytest.fixture(scope="module")
def words():
    """The table of docs/words.py."""
    spec = importlib.util.spec_from_file_location("words", ROOT / "docs" / "words.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_headings_answer_and_are_in_the_index(words):
    """Each phrase has a heading with its words, and an entry there that the search names first.
    """
    found = {}
    if BUILT.exists():
        index = json.loads(re.fullmatch(r"Search\.setIndex\((.*)\)",
                                        BUILT.read_text(encoding="utf-8"), re.DOTALL)[1])
        found = {entry: {index["docnames"][number] for number, *_ in places}
                 for entry, places in index["indexentries"].items()}
    for page, phrases in words.WORDS.items():
        text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
        made = words.indexed(page, text, stems)
        for phrase in phrases:
            entry = rf"```{{index}}.*!{re.escape(phrase)}(?:,.*)?\n```"
            beside = [re.search(one, made, re.MULTILINE) for one in (
                rf"{entry}\n\n##+ (.*)$", rf"^# (.*)\n\n{entry}")]
            assert any(stems(phrase) <= stems(one[1]) for one in beside if one), (
                f"{page}.md has no heading with the words of {phrase!r}")
            assert not found or page in found.get(phrase.lower(), ()), phrase
        assert re.sub(r"```{index} .*\n```\n\n", "", made) == text


@pytest.mark.parametrize("phrase", PHRASES)
def test_search_finds(phrase, pages):
    assert stems(phrase) <= pages[PHRASES[phrase]]
