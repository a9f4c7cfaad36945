"""Beam elements: what is interpolated. A new element is one file and one line here."""

from .ancf import ElementBeamANCF
from .base import ElementBeam
from .cable import ElementBeamCable
from .choose import ORDER_OF_FIELD, choose_element
from .cubic import ElementBeamANCFCubic
from .patel_shabana import ElementBeamPatelShabana

#: The elements that the tests run over, by name.
ELEMENTS = {
    **{f"ancf-{n}": (lambda n=n: ElementBeamANCF(n)) for n in range(1, 11)},
    "patel-shabana": ElementBeamPatelShabana,
    **{f"cubic-{n}": (lambda n=n: ElementBeamANCFCubic(n)) for n in (1, 2, 3, 6)},
}

__all__ = ["ELEMENTS", "ORDER_OF_FIELD", "ElementBeam", "ElementBeamANCF",
           "ElementBeamANCFCubic", "ElementBeamCable", "ElementBeamPatelShabana",
           "choose_element"]
