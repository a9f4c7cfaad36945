"""Beam elements. A new element is one file and one line here."""

from .ancf import (ORDER_OF_FIELD, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamANCFHermite,
                   ElementBeamCable, ElementBeamPatelShabana, choose_element)
from .base import ElementBeam

#: Elements by name.
ELEMENTS = {
    **{f"ancf-{n}": (lambda n=n: ElementBeamANCF(n)) for n in range(1, 11)},
    "patel-shabana": ElementBeamPatelShabana,
    **{f"cubic-{n}": (lambda n=n: ElementBeamANCFCubic(n)) for n in (1, 2, 3, 6)},
    **{f"degree-{p}-order-{n}": (lambda n=n, p=p: ElementBeamANCFHermite(n, p))
       for p, n in ((5, 2), (9, 1))},
}

__all__ = ["ELEMENTS", "ORDER_OF_FIELD", "ElementBeam", "ElementBeamANCF",
           "ElementBeamANCFCubic", "ElementBeamANCFHermite", "ElementBeamCable",
           "ElementBeamPatelShabana", "choose_element"]
