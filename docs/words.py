"""Words that one types into the search, by the page of the heading that answers them."""

import re

WORDS = {
    "loads": ["moving load", "bolt preload", "electrostatic", "follower force", "spring", "wind",
              "gravity", "self-weight", "prestress", "earthquake", "point load",
              "distributed load", "load case", "combination", "envelope", "foundation", "rope",
              "mass"],
    "trust": ["mesh convergence"],
    "units": ["units"],
    "fields": ["strength", "deflection", "bending moment", "utilisation", "von Mises",
               "principal stress", "section forces"],
    "obstacles": ["stiffness obstacle", "friction", "impact", "belt", "pressure", "pulley"],
    "domains": ["own weak form"],
    "recipes": ["plane mesh", "curved beam"],
    "modes": ["natural frequencies", "buckling", "critical load", "modal analysis", "flutter",
              "imperfection"],
    "choose": ["element", "material", "plane strain"],
    "motion": ["damping", "time step", "restart", "checkpoint", "dynamics"],
    "frames": ["hinge", "DXF", "Gmsh", "truss"],
    "solving": ["snap-through", "post-buckling", "does not converge", "quasi-static",
                "linear theory", "mechanism", "arc length"],
    "sections": ["temperature", "thermal expansion", "sandwich", "laminate", "profile", "IPE",
                 "taper"],
    "faq": ["fatigue", "safety factor", "will it break", "3D", "GPU", "rubber", "initial velocity",
            "drop", "notebook", "Pyodide", "JupyterLite"],
    "limitations": ["fracture", "torsion"],
    "plasticity": ["plasticity", "yield", "creep", "viscoelastic"],
    "supports": ["settlement", "displacement control", "symmetry", "boundary condition",
                 "reaction", "stress concentration"],
    "contact": ["contact"],
    "joints": ["joint"],
    "bodies": ["rigid body", "motor"],
    "control": ["resonance", "random vibration", "state space"],
    "clusters": ["parallel"],
    "speed": ["Numba", "memory"],
    "report": ["report"],
    "paraview": ["film", "animation", "ParaView"],
    "gradients": ["optimization", "parameter identification", "gradient"],
    "formulations": ["locking"],
    "own": ["own element", "own material"],
}


def heading_of(phrase, headings, stems):
    """The first of some headings that has the words of a phrase, by their stems; or None."""
    return next((one for one in headings if stems(phrase) <= stems(one)), None)


def indexed(page, text, stems):
    """The text of a page with its words as entries of the index, at their headings.

    Sphinx's search names them first, and leads to the heading; without them it takes headings only
    that are at most twice as long as what is looked for.
    """
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", prose, re.MULTILINE)
    entries = {}
    for phrase in WORDS.get(page, ()):
        entries.setdefault(heading_of(phrase, headings, stems), []).append(f"!{phrase}")
    for heading, words in entries.items():
        line, level = re.search(rf"^((#+) {re.escape(heading)})$", text, re.MULTILINE).groups()
        entry = f"```{{index}} {', '.join(words)}\n```"
        # above the heading, so that it is seen; the title of a page has to be first
        both = f"{line}\n\n{entry}" if level == "#" else f"{entry}\n\n{line}"
        text = text.replace(f"\n{line}\n", f"\n{both}\n", 1) if level != "#" else (
            text.replace(f"{line}\n", f"{both}\n", 1))
    return text
