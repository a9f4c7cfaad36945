"""The search of the site finds what engineers look for; of the pages, if the site is not built."""

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


#: What is looked for, and the page of a heading with these words: the site's search names headings
#: first.
HEADINGS = {
    "moving load": "loads", "bolt preload": "loads", "electrostatic": "loads",
    "mesh convergence": "trust", "units": "units", "strength": "fields",
    "stiffness obstacle": "obstacles", "own weak form": "domains", "plane mesh": "recipes",
    "natural frequencies": "modes", "buckling": "modes", "friction": "obstacles",
    "follower force": "loads", "element": "choose", "damping": "motion", "spring": "loads",
    "hinge": "frames", "wind": "loads", "gravity": "loads", "self-weight": "loads",
    "snap-through": "solving", "post-buckling": "solving", "critical load": "modes",
    "prestress": "loads", "temperature": "sections", "thermal expansion": "sections",
    "fatigue": "faq", "safety factor": "faq", "will it break": "faq", "fracture": "limitations",
    "torsion": "limitations", "3D": "faq", "GPU": "faq", "does not converge": "solving",
    "plasticity": "plasticity", "yield": "plasticity", "creep": "plasticity",
    "viscoelastic": "plasticity", "material": "choose", "plane strain": "choose", "rubber": "faq",
    "earthquake": "loads", "settlement": "supports", "displacement control": "supports",
    "symmetry": "supports", "boundary condition": "supports", "reaction": "supports",
    "stress concentration": "supports", "point load": "loads", "distributed load": "loads",
    "load case": "loads", "combination": "loads", "envelope": "loads", "foundation": "loads",
    "rope": "loads", "mass": "loads", "impact": "obstacles", "belt": "obstacles",
    "pressure": "obstacles", "contact": "contact", "joint": "joints", "rigid body": "bodies",
    "motor": "bodies", "resonance": "control", "random vibration": "control",
    "state space": "control", "modal analysis": "modes", "flutter": "modes",
    "imperfection": "modes", "time step": "motion", "initial velocity": "faq",
    "restart": "motion", "checkpoint": "motion", "parallel": "clusters", "Numba": "speed",
    "memory": "speed", "sandwich": "sections", "laminate": "sections", "profile": "sections",
    "IPE": "sections", "taper": "sections", "deflection": "fields", "bending moment": "fields",
    "utilisation": "fields", "von Mises": "fields", "principal stress": "fields",
    "section forces": "fields", "report": "report", "DXF": "frames", "Gmsh": "frames",
    "truss": "frames", "film": "paraview", "animation": "paraview", "ParaView": "paraview",
    "optimization": "gradients", "parameter identification": "gradients",
    "gradient": "gradients", "quasi-static": "solving", "linear theory": "solving",
    "mechanism": "solving", "locking": "formulations", "own element": "own",
    "curved beam": "recipes", "arc length": "solving", "dynamics": "motion", "drop": "faq",
    "notebook": "faq", "Pyodide": "faq", "JupyterLite": "faq",
    "pulley": "obstacles",
    "own material": "own"}


@pytest.fixture(scope="module")
def headings():
    """From the name of a page to the stems of each of its headings."""
    if not BUILT.exists():
        return {page.stem: [stems(line.lstrip("# ")) for line in page.read_text(
            encoding="utf-8").splitlines() if line.startswith("#")]
            for page in (ROOT / "docs").glob("*.md")}
    index = json.loads(re.fullmatch(r"Search\.setIndex\((.*)\)",
                                    BUILT.read_text(encoding="utf-8"), re.DOTALL)[1])
    found = {name: [] for name in index["docnames"]}
    for title, places in index["alltitles"].items():
        for number, _ in places:
            found[index["docnames"][number]].append(stems(title))
    return found


@pytest.mark.parametrize("phrase", HEADINGS)
def test_a_heading_answers(phrase, headings):
    assert any(stems(phrase) <= heading for heading in headings[HEADINGS[phrase]])


@pytest.mark.parametrize("phrase", PHRASES)
def test_search_finds(phrase, pages):
    assert stems(phrase) <= pages[PHRASES[phrase]]
