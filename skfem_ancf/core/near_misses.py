"""Suggestions for unknown attributes."""

from __future__ import annotations

import difflib
import re
from typing import TYPE_CHECKING

#: Synonyms in other packages. The first word of a key is the attribute that an object must have.
MEANT = {
    "solve_static": "solve run_static static equilibrium analyze analyse analysis newton nonlinear",
    "solve_linear": "linear run_linear linear_static",
    "run": "quasi_static quasistatic solve_steps steps",
    "integrate": "simulate simulation transient dynamic dynamics solve_dynamic time_history evolve",
    "modes": "eigenvalues eigenfrequencies eigenmodes frequencies natural_frequencies modal eig",
    "buckling": "buckle buckling_loads linear_buckling critical_load critical_loads",
    "continuation": "arc_length arclength riks path equilibrium_path",
    "point_force": "force forces add_force point_load nodal_force nodal_load concentrated_force",
    "line_load": "distributed_load distributed_force uniform_load q",
    "gravity": "self_weight weight body_force acceleration",
    "moment": "torque end_moment point_moment",
    "add": "add_load add_support add_joint add_spring append",
    "clamp": "fixed fixed_support support encastre built_in fix_end boundary_condition bc",
    "pin": "pinned support simply_supported",
    "fix": "support roller constrain constraint dirichlet boundary_condition bc",
    "hinge": "pin_joint revolute revolute_joint",
    "weld": "connect rigid_joint fixed_joint glue join",
    "obstacle": "contact wall ground",
    "replace(loads=...)": "load_case load_cases with_loads set_loads",
    "replace(beams=...)": "with_beams",
    "solve_static().plot": "plot_deformed plot_displacement plot_stress plot_strain draw_deformed",
    "solve_static().displacement": "displacement displacements deflection deflections u",
    "solve_static().stress": "stress stresses von_mises",
    "solve_static().strain": "strain strains",
    "solve_static().reactions": "reactions reaction",
    "solve_static().save": "save export write to_vtk",
    "plot": "plot_deformed plot_displacement draw show",
    "field": "von_mises sigma",
    "displacement": "deflection deflections disp",
    "resultants": "section_forces internal_forces bending_moment normal_force shear_force N Q M",
    "reactions": "support_forces support_reactions forces",
    "save": "export write to_vtk to_vtu",
    "sensors.to_csv": "to_csv csv write_csv save_csv",
    "to_xarray": "to_pandas to_dataframe dataset",
    "animate": "film movie video gif",
    "t": "time times",
    "frequencies": "omega omegas eigenfrequencies natural_frequencies",
    "shapes": "eigenvectors vectors mode_shapes modeshapes",
    "load": "load_factor load_factors lambdas",
    "p": "nodes points coordinates vertices",
    "nelements": "n_elements elements ne",
    "refined": "refine subdivide",
    "draw": "plot show",
}


def meant(thing: object, name: str) -> list[str]:
    """At most three attributes of an object that an unknown name may mean."""
    there = [one for one in dir(thing) if not one.startswith("_")]
    found = [key for key, words in MEANT.items()
             if name.lower() in words.lower().split() and re.split(r"\W", key)[0] in there]
    return (found or difflib.get_close_matches(name, there, 3, 0.6))[:3]


class NearMisses:
    """Base class whose AttributeError suggests attributes for synonyms.

    Examples
    --------
    >>> from skfem_ancf import MeshBeam
    >>> MeshBeam.init_line([0, 1], height=0.1).refine(2)
    Traceback (most recent call last):
    ...
    AttributeError: MeshBeam has no attribute 'refine'; did you mean refined?
    """

    if not TYPE_CHECKING:  # type checkers must see the real attributes only
        def __getattr__(self, name):
            if hasattr(type(self), name):  # a property failed: raise its error
                return object.__getattribute__(self, name)
            others = [] if name.startswith("_") else meant(self, name)
            text = f"; did you mean {' or '.join(others)}?" if others else ""
            # without name=, else Python adds its own suggestion
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}{text}",
                                 name=None, obj=None)
