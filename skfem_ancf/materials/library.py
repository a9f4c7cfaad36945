"""Values of common materials by name. Steels: EN 1993-1-1 (E, nu, thermal expansion) and EN
10025-2, yield strength up to 16 mm; stainless steel: EN 10088; aluminium: EN 1999-1-1. All others
are typical values at room temperature, as data sheets state them: they vary with grade, moisture,
temperature, rate and direction of printing."""

from typing import Any

from ..core import require_option, retold

#: Metres and newtons in a unit.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
FORCES = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}

#: E in GPa, nu, density in kg/m3, thermal expansion in 1e-6/K, strength in MPa (yield or proof).
STANDARD = {
    "S235": (210.0, 0.3, 7850.0, 12.0, 235.0),
    "S275": (210.0, 0.3, 7850.0, 12.0, 275.0),
    "S355": (210.0, 0.3, 7850.0, 12.0, 355.0),
    "S460": (210.0, 0.3, 7850.0, 12.0, 460.0),
    "1.4301": (200.0, 0.3, 7900.0, 16.0, 210.0),
    "EN AW-6060 T66": (70.0, 0.3, 2700.0, 23.0, 160.0),
    "EN AW-6082 T6": (70.0, 0.3, 2700.0, 23.0, 250.0),
}
TYPICAL = {
    "spring steel": (206.0, 0.3, 7850.0, 11.5, 1200.0),
    "stainless spring steel": (185.0, 0.3, 7900.0, 16.0, 1100.0),
    "EN AW-7075 T6": (71.0, 0.33, 2810.0, 23.5, 460.0),
    "brass": (110.0, 0.35, 8440.0, 20.0, 200.0),
    "Ti-6Al-4V": (114.0, 0.34, 4430.0, 8.6, 830.0),
    "POM": (2.8, 0.37, 1410.0, 110.0, 65.0),
    "PA 6": (1.2, 0.39, 1140.0, 90.0, 45.0),
    "PA 6 dry": (3.0, 0.39, 1140.0, 90.0, 80.0),
    "PA 66 GF30": (6.5, 0.38, 1360.0, 40.0, 115.0),
    "PC": (2.35, 0.37, 1200.0, 65.0, 62.0),
    "ABS": (2.2, 0.37, 1050.0, 90.0, 42.0),
    "PP": (1.5, 0.42, 905.0, 150.0, 33.0),
    "PETG": (2.1, 0.38, 1270.0, 60.0, 48.0),
    "PLA": (3.3, 0.36, 1240.0, 68.0, 55.0),
    "silicone": (2.5e-3, 0.49, 1150.0, 300.0, 7.0),
}


def values_of(name: str, units: Any) -> tuple[dict[str, float], str]:
    """Arguments of a material in units of force and length, and what is said of them."""
    with retold((KeyError, TypeError, IndexError), "units must be a force of {} and a length of "
                "{}, as ('N', 'mm'), got {!r}", ", ".join(FORCES), ", ".join(LENGTHS), units):
        force, length = FORCES[units[0]], LENGTHS[units[1]]
    known = STANDARD | TYPICAL
    E, nu, density, expansion, strength = known[require_option("material", name, known)]
    stress = length**2 / force
    return dict(E=1e9 * E * stress, nu=nu, density=density * length**4 / force,
                thermal_expansion=1e-6 * expansion, strength=1e6 * strength * stress), (
        f"{name}, typical values" if name in TYPICAL else name)
