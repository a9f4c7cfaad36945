"""Contact by the names that :mod:`skfem_ancf.equations.loops` imports."""

from ..contact.kernels import of_contacts
from ..contact.tables import ContactTables, Question

__all__ = ["ContactTables", "Question", "of_contacts"]
