"""Standard profiles against published tables, and materials by name."""

import pickle

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementQuad2, LinearForm, MeshQuad, condense, solve
from skfem.helpers import dot, grad

from skfem_ancf import (Beam, CallError, ElasticPlastic, ElementBeamANCF, ElementBeamCable, Frame,
                        InputError, MeshBeam, NameUnknown, NeoHookean, Scene, Section,
                        StVenantKirchhoff)

STEEL = StVenantKirchhoff.named("S235")

#: Area in cm2 and second moment of area in cm4, as published (catalogues of ArcelorMittal and of
#: hollow sections after EN 10210 and EN 10219).
PUBLISHED = {
    "IPE": """80 7.64 80.1; 100 10.3 171; 120 13.2 318; 140 16.4 541; 160 20.1 869; 180 23.9 1317;
200 28.5 1943; 220 33.4 2772; 240 39.1 3892; 270 45.9 5790; 300 53.8 8356; 330 62.6 11770;
360 72.7 16270; 400 84.5 23130; 450 98.8 33740; 500 115.5 48200; 550 134.4 67120; 600 156 92080""",
    "HEA": """100 21.2 349.2; 120 25.3 606.2; 140 31.4 1033; 160 38.8 1673; 180 45.3 2510;
200 53.8 3692; 220 64.3 5410; 240 76.8 7763; 260 86.8 10450; 280 97.3 13670; 300 112.5 18260;
320 124.4 22930; 340 133.5 27690; 360 142.8 33090; 400 159 45070; 450 178 63720; 500 197.5 86970;
550 211.8 111900; 600 226.5 141200; 650 241.6 175200; 700 260.5 215300; 800 285.8 303400;
900 320.5 422100; 1000 346.8 553800""",
    "HEB": """100 26 449.5; 120 34 864.4; 140 43 1509; 160 54.3 2492; 180 65.3 3831; 200 78.1 5696;
220 91 8091; 240 106 11260; 260 118.4 14920; 280 131.4 19270; 300 149.1 25170; 320 161.3 30820;
340 170.9 36660; 360 180.6 43190; 400 197.8 57680; 450 218 79890; 500 238.6 107200;
550 254.1 136700; 600 270 171000; 650 286.3 210600; 700 306.4 256900; 800 334.2 359100;
900 371.3 494100; 1000 400 644700""",
    "UPN": """80 11 106; 100 13.5 206; 120 17 364; 140 20.4 605; 160 24 925; 180 28 1350;
200 32.2 1910; 220 37.4 2690; 240 42.3 3600; 260 48.3 4820; 280 53.3 6280; 300 58.8 8030;
320 75.8 10870; 350 77.3 12840; 380 80.4 15760; 400 91.5 20350""",
    "L": """40x40x4 3.08 4.47; 50x50x5 4.80 11; 60x60x6 6.91 22.8; 70x70x7 9.40 42.3;
80x80x8 12.3 72.2; 90x90x9 15.5 116; 100x100x10 19.2 177; 120x120x12 27.5 368; 150x150x15 43 898""",
    "T": "50 5.66 12.1; 70 10.6 44.5; 100 20.9 179; 120 29.6 366",
    "RHS": "100x50x4 11.2 140; 200x100x8 44.8 2234", "SHS": "100x5 18.7 279; 150x8 44.8 1491",
    "CFRHS": "100x50x4 10.95 134", "CFSHS": "100x5 18.4 271",
    "CHS": "60.3x3.2 5.74 23.5; 114.3x5 17.2 257; 168.3x6.3 32.1 1053"}
ROWS = [(f"{series} {name}", float(A), float(I)) for series, rows in PUBLISHED.items()
        for name, A, I in (row.split() for row in rows.split(";"))]


def beam_of(name, unit="cm", element=None, material=None):
    section = Section.profile(name, unit=unit)
    mesh = MeshBeam.init_line(np.linspace(0, 20 * section.height, 5), section.height)
    return Beam(mesh, element or ElementBeamCable(5), material or StVenantKirchhoff(1.0, 0.3, 1.0),
                section=section)


@pytest.mark.parametrize("name, A, I", ROWS, ids=[row[0] for row in ROWS])
def test_areas_and_moments_are_those_of_the_tables(name, A, I):
    """With root radii and tapers: to the digits of the tables; sharp corners miss 2 to 6 %."""
    EA, ES, EI = beam_of(name).across.moments(np.array([[0.5]]), np.array([0]))[:, 0, 0]
    assert EA == pytest.approx(A, rel=4e-3)
    assert EI - ES**2 / EA == pytest.approx(I, rel=4e-3)


# areas and moments of outlines, as polygons drawn from the sizes of the standards


def rounded(corners, radii, count=200):
    """A closed polygon (2, n) with rounded corners."""
    x, out = np.array(corners, float), []
    for k, r in enumerate(radii):
        a, b = (x[n % len(x)] - x[k] for n in (k - 1, k + 1))
        a, b = a / np.hypot(*a), b / np.hypot(*b)
        middle = x[k] + (a + b) / np.hypot(*(a + b)) * r / np.sqrt(0.5 - 0.5 * a @ b)
        begin, end = (complex(*(x[k] + way * r * np.sqrt((1 + a @ b) / (1 - a @ b)) - middle))
                      for way in (a, b))
        z = complex(*middle) + begin * np.exp(
            1j * np.linspace(0, np.angle(end / begin) if r else 0.0, count if r else 1))
        out.append([z.real, z.imag])
    return np.hstack(out)


def mirrored(corners, radii):
    """Right half of a symmetric outline, completed."""
    return rounded([*corners, *((-x, y) for x, y in corners[::-1])], [*radii, *radii[::-1]])


def box(b, h, r, y=0.0):
    return mirrored([(b / 2, y), (b / 2, y + h)], [r, r])


def circle(r, y):
    z = r * np.exp(2j * np.pi * np.arange(2000) / 2000)
    return np.array([z.real, z.imag + y])


#: Outlines and holes of one size of each series, in mm.
OUTLINES = {
    "IPE 200": [mirrored([(50, 0), (50, 8.5), (2.8, 8.5), (2.8, 191.5), (50, 191.5), (50, 200)],
                         [0, 0, 12, 12, 0, 0])],
    "HEB 100": [mirrored([(50, 0), (50, 10), (3, 10), (3, 90), (50, 90), (50, 100)],
                         [0, 0, 12, 12, 0, 0])],
    "HEA 100": [mirrored([(50, 0), (50, 8), (2.5, 8), (2.5, 88), (50, 88), (50, 96)],
                         [0, 0, 12, 12, 0, 0])],
    # the flange is 8 and 18 thick halfway, with a slope of 8 % and 5 %
    "UPN 80": [rounded([(0, 0), (45, 0), (45, 6.2), (6, 9.32), (6, 70.68), (45, 73.8), (45, 80),
                        (0, 80)], [0, 0, 4, 8, 8, 4, 0, 0])],
    "UPN 400": [rounded([(0, 0), (110, 0), (110, 15.6), (14, 20.4), (14, 379.6), (110, 384.4),
                         (110, 400), (0, 400)], [0, 0, 9, 18, 18, 9, 0, 0])],
    "L 50x50x5": [rounded([(0, 0), (50, 0), (50, 5), (5, 5), (5, 50), (0, 50)],
                          [0, 0, 3.5, 7, 3.5, 0])],
    # flange and web are 11 thick in their middle, with slopes of 2 %
    "T 100": [mirrored([(4.5, 0), (6.27250900, 88.6254502), (50, 89.5), (50, 100)],
                       [2.75, 11, 5.5, 0])],
    "RHS 100x50x4": [box(50, 100, 6), box(42, 92, 4, 4)],
    "SHS 100x5": [box(100, 100, 7.5), box(90, 90, 5, 5)],
    "CFRHS 100x50x4": [box(50, 100, 8), box(42, 92, 4, 4)],
    "CHS 60.3x3.2": [circle(30.15, 30.15), circle(26.95, 30.15)]}


def moments(x):
    """Area, first and second moment about y = 0 of a polygon."""
    (x0, y0), (x1, y1) = x, np.roll(x, -1, axis=1)
    c = x0 * y1 - x1 * y0
    return np.array([np.sum(c), np.sum(c * (y0 + y1)) / 3, np.sum(c * (y0**2 + y0 * y1 + y1**2)) / 6
                     ]) / 2


def widths(x, y):
    """Width of a polygon at heights y (n,)."""
    (x0, y0), (x1, y1) = x, np.roll(x, -1, axis=1)
    up, rise = (y[:, None] >= y0) != (y[:, None] >= y1), np.where(y1 == y0, 1.0, y1 - y0)
    return np.sum(up * np.sign(y1 - y0) * (x0 + (y[:, None] - y0) / rise * (x1 - x0)), axis=1)


@pytest.mark.parametrize("name", OUTLINES)
def test_area_moments_and_shear_are_those_of_the_outline(name):
    """Shear area of Jourawski's stress: I^2 over the integral of S^2 / b."""
    signs = (1, -1)
    A, S, I = sum(sign * moments(x) for sign, x in zip(signs, OUTLINES[name]))
    beam = beam_of(name, "mm", ElementBeamANCF(1))
    found, first, second = beam.across.moments(np.array([[0.5]]), np.array([0]))[:, 0, 0]
    assert found == pytest.approx(A, rel=1e-5)
    assert first / found + beam.mesh.height / 2 == pytest.approx(S / A, rel=1e-5)
    assert second - first**2 / found == pytest.approx(I - S**2 / A, rel=1e-5)
    dy = beam.mesh.height / 3000
    y = dy * (np.arange(3000) + 0.5)
    b = sum(sign * widths(x, y) for sign, x in zip(signs, OUTLINES[name]))
    first = b * (y - S / A) * dy
    compliance = np.sum((np.cumsum(first) - first / 2)**2 / b) * dy
    shear = (I - S**2 / A)**2 / compliance
    assert beam.across.shear * found == pytest.approx(shear, rel=1e-3)


@pytest.mark.parametrize("shape, h, b, web, flange, ratio", [
    ("rectangle", 100.0, 2.0, None, None, 1.0), ("I", 200.0, 100.0, 5.6, 8.5, 0.952),
    ("T", 100.0, 100.0, 11.0, 11.0, 0.878)])
def test_the_shear_area_beside_that_of_a_prism(shape, h, b, web, flange, ratio):
    """Saint-Venant's flexure of the section, nu = 0, by scikit-fem: wide flanges shear more."""
    thick, f = (b, 0.0) if web is None else (web, flange)
    x = np.unique([*np.linspace(0, thick / 2, 7), *np.linspace(thick / 2, b / 2, 31)])
    y = np.unique([*np.linspace(0, f, 9), *np.linspace(f, h - f, 41), *np.linspace(h - f, h, 9)])
    mesh = MeshQuad.init_tensor(x, y)
    cx, cy = mesh.p[:, mesh.t].mean(axis=1)
    inside = (cx < thick / 2) | (cy > h - f) | ((cy < f) & (shape == "I"))
    basis = Basis(mesh.restrict(np.flatnonzero(inside)), ElementQuad2())
    height, dx = np.asarray(basis.global_coordinates())[1], 2 * basis.dx
    A, centre = np.sum(dx), np.sum(height * dx) / np.sum(dx)
    K = BilinearForm(lambda u, v, w: 2 * dot(grad(u), grad(v))).assemble(basis)
    force = LinearForm(lambda v, w: 2 * (w.x[1] - centre) * v).assemble(basis)
    warping = solve(*condense(K, force, D=np.array([0])))
    shear = np.sum((height - centre)**2 * dx)**2 / (force @ warping)
    sizes = {} if web is None else {"web": web, "flange": flange}
    beam = Beam(MeshBeam.init_line([0, 1000], h), ElementBeamANCF(1), StVenantKirchhoff(1.0, 0.0),
                section=Section.profile(shape, width=b, **sizes))
    factor = 5 / 6 if beam.across.shear is None else beam.across.shear
    assert shear / (factor * A) == pytest.approx(ratio, rel=0.005)


def test_units_masses_and_names():
    for unit, height in (("m", 0.2), ("mm", 200.0), ("in", 200 / 25.4)):
        assert Section.profile("IPE 200", unit=unit).height == pytest.approx(height, rel=1e-14)
    assert beam_of("IPE200", "m", material=STEEL).total_mass / 4.0 == pytest.approx(22.4, rel=0.003)
    assert Section.profile("rhs 100×50×4").height == Section.profile("RHS 100x50x4").height == 0.1
    assert Section.profile("CHS 60,3x3,2").height == pytest.approx(0.0603)
    assert repr(Section.profile("HEB 300")) == "<HEB 300>"
    again = pickle.loads(pickle.dumps(beam_of("UPN 200")))
    assert again.across.layers[0].width == beam_of("UPN 200").across.layers[0].width


@pytest.mark.parametrize("wrong, match", [
    ("IPE 210", "'IPE 200'|'IPE 220'"), ("IPX 200", "profile"), ("L 50x50x7", "profile"),
    ("SHS 100x40", "too thick"), ("CHS 20x10", "no hole"), ("RHS 100x50", "too thick|no hole")])
def test_wrong_names(wrong, match):
    with pytest.raises((NameUnknown, InputError), match=match):
        Section.profile(wrong)


def test_other_arguments_and_meshes_teach():
    with pytest.raises(CallError, match="has its sizes by its name"):
        Section.profile("IPE 200", width=0.1)
    with pytest.raises(NameUnknown, match="unit"):
        Section.profile("IPE 200", unit="km")
    mesh = MeshBeam.init_line([0, 1], 200.0)
    with pytest.raises(InputError, match='unit="mm"'):
        Beam(mesh, ElementBeamCable(5), STEEL, section=Section.profile("IPE 200"))
    with pytest.raises(NameUnknown, match="'tube'"):
        Section.profile("tub", wall=0.1)


def test_a_frame_takes_the_height_of_its_profiles():
    """Sag of a simply supported IPE 300, 5 q L^4 / (384 E I), with its shear in an ANCF element."""
    frame = Frame.from_lines([(0, 0), (6, 0), (6, 2)], [(0, 1), (1, 2)], material=STEEL,
                             groups={"girder": [0], "post": [1]}, hinges=[(0, 1)],
                             sections={"girder": {"section": Section.profile("IPE 300")},
                                       "post": {"section": Section.profile("SHS 100x5")}})
    assert [beam.mesh.height for beam in frame.beams] == pytest.approx([0.3, 0.1])
    frame.pin(0).clamp(2).line_load((0, -1e4), beam="girder")
    state = frame.solve_linear()
    sag = 5 * 1e4 * 6**4 / (384 * 2.1e11 * 8356e-8)
    lift = 0.5 * state.displacement((6, 0), line=1)[1]
    assert lift - state.displacement((3, 0))[1] == pytest.approx(sag, rel=5e-3)
    assert abs(state.extremes("S_xx", 1, beam="girder")[0].value) == pytest.approx(
        1e4 * 36 / 8 / 557e-6, rel=0.01)  # W = 557 cm3


@pytest.mark.parametrize("name", ["HEA 200", "UPN 200", "RHS 100x50x4", "L 100x100x10", "T 50"])
def test_profiles_bend_in_elements_with_sections(name):
    """A cantilever in bending: M L^2 / (2 E I); recovered stress M / W at the face."""
    beam = beam_of(name, "m", ElementBeamANCF(3), STEEL.replace(nu=0.0))
    EA, ES, EI = beam.across.moments(np.array([[0.5]]), np.array([0]))[:, 0, 0]
    L, I = 20 * beam.mesh.height, (EI - ES**2 / EA) / 2.1e11
    M = 1e-4 * 2.1e11 * I / L
    state = Scene(beam).clamp("left", thickness="free").moment("right", M).solve_linear()
    assert state.displacement((L, 0))[1] == pytest.approx(M * L**2 / (2 * 2.1e11 * I), rel=2e-3)
    h = beam.mesh.height
    arm = 0.5 * h - ES / EA * 1.0
    assert state.stress((0.5 * L, 0.5 * h - 1e-9))[0] == pytest.approx(-M * arm / I, rel=5e-3)


def test_materials_by_name():
    steel = StVenantKirchhoff.named("S355", ("N", "mm"))
    assert (steel.E, steel.strength) == pytest.approx((2.1e5, 355.0))
    assert steel.density == pytest.approx(7.85e-9) and steel.thermal_expansion == 1.2e-5
    assert steel.title == "S355" and repr(steel).startswith("'S355': StVenantKirchhoff(E=210000")
    rubber = NeoHookean.named("silicone", plane="strain")
    assert rubber.title == "silicone, typical values" and rubber.plane == "strain"
    assert StVenantKirchhoff.named("POM", E=3.1e9).title == ""
    assert steel.replace(E=1.0).title == "" and pickle.loads(pickle.dumps(steel)).title == "S355"
    metal = ElasticPlastic.named("S235", yield_stress=235e6, hardening=2e9)
    assert metal.yield_stress == metal.strength == pytest.approx(235e6)
    with pytest.raises(NameUnknown, match="S235"):
        StVenantKirchhoff.named("S236")
    for units in (("N", "yd"), "N", None):
        with pytest.raises(InputError, match=r"\('N', 'mm'\)"):
            StVenantKirchhoff.named("S235", units)
