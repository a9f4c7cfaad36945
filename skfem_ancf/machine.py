"""Where texts run: in plain NumPy, or compiled."""

from .equations import Tables


class Machine:
    """Runs the texts of a system.

    Attributes
    ----------
    tables : Tables
    """

    def __init__(self, system):
        self.tables = Tables(system)

    def of(self, text):
        """The function of a text, plain or compiled, and the equations that it takes."""
        return text, self.tables.plain
