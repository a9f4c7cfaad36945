"""Choice of the element of lowest order for requested fields and accuracy."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.errors import InputError, require_like, require_names, require_positive
from ..core.types import Isotropic
from ..mesh.mesh_beam import MeshBeam
from .ancf import ElementBeamANCF, ElementBeamANCFCubic
from .base import ElementBeam
from .cable import ElementBeamCable

#: Least order for a field of the section; 0 is the cable.
ORDER_OF_FIELD = {"displacement": 0, "eps_xx": 0, "S_xx": 0, "eps_yy": 2, "eps_xy": 3, "S_yy": 5,
                  "S_xy": 3}


def choose_element(mesh: MeshBeam, material: Isotropic, fields: str | Sequence[str] = (),
                   tolerance: float = 1e-3) -> ElementBeam:
    """The element of lowest order that represents the fields to a given accuracy.

    The error of a beam theory is a power of h / L, with L the length of the beam. The cable omits
    shear, ``3 E I / (k_s G A L^2)`` of the deflection of a cantilever. A section of order 1 or 2
    omits warping, about ``(h / L)^2 / 10``. Order 3 represents the shear parabola, with an error of
    order ``(h / L)^3``. The result is a quintic cable, or has cubic sections, or linear ones on a
    beam shorter than 20 heights.

    Parameters
    ----------
    mesh, material
        Mesh and material of the beam.
    fields
        Fields of the section that are needed: names from :data:`ORDER_OF_FIELD`.
    tolerance
        Relative error of the deflection due to the theory, without the discretisation error.

    Raises
    ------
    NameUnknown
        If a field is not known.
    """
    require_like("mesh", mesh, "MeshBeam", "height", "lengths")
    require_like("material", material, "Material", "E", "G", "nu")
    fields = require_names("field", fields, ORDER_OF_FIELD)
    tolerance = require_positive("tolerance", tolerance)
    if tolerance >= 1.0:
        raise InputError(f"the tolerance is relative and below 1, got {tolerance!r}")
    ratio = mesh.height / float(mesh.lengths.sum())
    k_s = 10.0 * (1.0 + material.nu) / (12.0 + 11.0 * material.nu)
    shear = 0.25 * material.E / (k_s * material.G) * ratio**2
    wanted = max((ORDER_OF_FIELD[name] for name in fields), default=0)
    enough = (0 if shear <= tolerance else 2 if 0.1 * ratio**2 <= tolerance else
              3 if ratio**3 <= tolerance else 5)
    if not material.is_hooke:  # a cable uses E and nu only
        wanted = max(wanted, 2)
    order = max(wanted, enough)
    if order == 0:
        return ElementBeamCable(5)
    return ElementBeamANCFCubic(order) if ratio < 0.05 else ElementBeamANCF(order)
