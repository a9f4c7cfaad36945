"""Tables of beams, by the places of their words."""

from ...beam.kernels.tables import StrainTables
from .records import reader, record_type
from .twin import jit

#: What reads tables at an address.
READER = reader(record_type(StrainTables))


@jit
def tables_of(body, k):
    return READER(body.packs[k])
