"""Material laws. A new law is one file and one line here."""

from .base import LinearLaw, Material
from .neo_hookean import NeoHookean
from .st_venant_kirchhoff import StVenantKirchhoff
from .pointwise import PointwiseMaterial

#: The laws that the tests run over, by name.
MATERIALS = {"st-venant-kirchhoff": StVenantKirchhoff, "neo-hookean": NeoHookean}

__all__ = ["MATERIALS", "LinearLaw", "Material", "NeoHookean",
           "PointwiseMaterial", "StVenantKirchhoff"]
