"""Files for ParaView: one state as .vtu, a series of them as .pvd."""

from .vtu import PvdWriter, body_fields, save_vtu

__all__ = ["PvdWriter", "body_fields", "save_vtu"]
