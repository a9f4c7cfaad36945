"""Packs of beams, by the places of their words."""

from ...beam.strain_energy import PACKS
from .records import reader, record_type
from .twin import jit

#: What reads a pack at an address, by the name of its class.
READERS = {kind.__name__: reader(record_type(kind)) for kind in PACKS}
_section, _cable = READERS.values()


@jit
def section_pack(body, k):
    return _section(body.packs[k])


@jit
def cable_pack(body, k):
    return _cable(body.packs[k])
