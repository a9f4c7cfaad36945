"""Packs of beams, by the places of their words."""

from ..body import CablePack, SectionPack
from .records import reader, record_type
from .twin import jit

_section, _cable = reader(record_type(SectionPack)), reader(record_type(CablePack))


@jit
def section_pack(body, k):
    return _section(body.packs[k])


@jit
def cable_pack(body, k):
    return _cable(body.packs[k])
