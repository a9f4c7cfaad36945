"""Material laws. A new law is one file and one line here."""

from .base import LinearLaw, Material
from .neo_hookean import NeoHookean
from .st_venant_kirchhoff import StVenantKirchhoff
from .pointwise import PointwiseMaterial
from .history import HistoryMaterial
from .elastic_plastic import ElasticPlastic, Voce
from .prony import Prony

#: The laws that the tests run over, by name.
MATERIALS = {"st-venant-kirchhoff": StVenantKirchhoff, "neo-hookean": NeoHookean}

__all__ = ["MATERIALS", "ElasticPlastic", "HistoryMaterial", "LinearLaw", "Material", "NeoHookean",
           "PointwiseMaterial", "Prony", "StVenantKirchhoff", "Voce"]
