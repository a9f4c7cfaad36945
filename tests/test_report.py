"""Reports as pages of HTML: what they say, and that they need nothing else."""

import re
from html.parser import HTMLParser

import numpy as np
import pytest
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad

from skfem_ancf import (Beam, Circle, Domain, ElasticPlastic, ElementBeamANCF, ElementBeamCable,
                        FileError, Frame, InputError, MeshBeam, RigidBody, Scene, Section,
                        StVenantKirchhoff)
from skfem_ancf.results.output import total_force

STEEL = StVenantKirchhoff(2.1e11, 0.3, density=7850, strength=235e6)


class Page(HTMLParser):
    """Rows of tables, headings, texts, and sources of pictures; closes what it opens."""

    def __init__(self, path):
        super().__init__()
        self.rows, self.text, self.sources, self.open = [], {}, [], []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()

    def handle_starttag(self, tag, attributes):
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag in ("img", "link", "script", "a"):
            self.sources.append(dict(attributes).get("src", tag))
        if tag not in ("img", "meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data
        elif self.open:
            self.text.setdefault(self.open[-1], []).append(data)

    def row(self, *start):
        return next(row for row in self.rows if row[:len(start)] == list(start))


def test_a_girder_on_two_supports(tmp_path):
    """Reactions q L / 2, sag 5 q L^4 / (384 E I), M = q L^2 / 8, sigma = M / W, and where."""
    frame = Frame.from_lines([(0, 0), (4, 0)], [(0, 1)], material=STEEL, height=0.2, width=0.1,
                             groups={"girder <1>": [0]})
    frame.units("N", "m").pin(0).hold(1, "y").line_load((0, -1e4))
    path = frame.solve_linear().report(tmp_path / "new" / "girder.html", title="A & B")
    page = Page(path)
    assert not page.open and len(page.sources) == 4
    assert all(source.startswith("data:image/png;base64,") for source in page.sources)
    assert "http" not in re.sub(r"base64,[^']*", "", path.read_text(encoding="utf-8"))
    assert page.text["h1"] == ["A & B"] and page.row("girder <1>")[1:3] == ["4 m", "0.2 m"]
    for at in ("node 0 at (0, 0)", "node 1 at (4, 0)"):
        assert page.row(at)[1:3] == ["0 N", "20 kN"]
    assert page.row("loads")[1:] == ["0 N", "-40 kN", "-80 kN m"]
    assert page.row("supports")[1:] == ["0 N", "40 kN", "80 kN m"]
    sag = 5 * 1e4 * 4**4 / (384 * 2.1e11 * 0.1 * 0.2**3 / 12)
    assert float(page.row("largest displacement")[1].split()[0]) == pytest.approx(sag, rel=0.01)
    stress, unit = page.row("largest S xx")[1].split()  # with 0.2 q / b of the body's solution
    assert abs(float(stress)) == pytest.approx(30.02, abs=0.001) and unit == "MPa"
    assert float(page.row("largest utilisation")[1]) == pytest.approx(30 / 235, rel=2e-3)
    assert page.row("maximum M")[1:3] == ["20 kN m", "(2, 0)"]
    assert page.row("StVenantKirchhoff, plane stress")[1:] == [
        "210 GPa", "0.3", "7850", "235 MPa"]
    assert page.row("distributed force")[1] == "from (0, 0) to (4, 0)"
    said = " ".join(page.text["p"])
    assert "They are in balance" in said and "None: the solution" in said
    assert re.search(r"skfem-ancf \d.*NumPy \d", said)


def test_all_kinds_of_forces_balance(tmp_path):
    """Obstacle, spring, weight, rigid body: their sum vanishes, and each has its line."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), 0.01), ElementBeamANCF(2), STEEL,
                width=0.05, name="arm")
    body = RigidBody(2.0, 0.01, (1.0, 0.0))
    scene = Scene(beam, body)
    scene.weld(("arm", "right"), (body, (1, 0)))
    scene.clamp("left", beam="arm").gravity((0, -9.81))
    scene.spring(1e4, (("arm", (0.8, 0)), (0.8, -0.3)))
    state = scene.obstacle(Circle((0.5, -0.055), 0.05)).units("N", "m").solve_static(tol=1e-12)
    page = Page(state.report(tmp_path / "arm.html"))
    weight = 9.81 * (7850 * 0.01 * 0.05 + 2.0)
    assert float(page.row("loads")[2].split()[0]) == pytest.approx(-weight, rel=1e-3)
    held, sprung = (float(page.row(name)[2].split()[0])
                    for name in ("supports", "springs, obstacles, foundations"))
    assert sprung == pytest.approx(state.contact().total[1] - state.spring_force(), rel=1e-3)
    assert held + sprung == pytest.approx(weight, rel=1e-3)
    assert page.row("(0, 0) of beam arm")[2] == page.row("supports")[2]
    assert any("obstacle touches it" in text for text in page.text["p"])
    assert page.row("body") and page.row("spring")


def test_total_force_has_moments_about_the_origin():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.1), ElementBeamANCF(2), STEEL, 0.1)
    scene = Scene(beam).point_force((2.0, 3.0), at=(0.6, 0.05)).moment("right", 7.0)
    u = np.zeros(scene.N)
    force = scene.system.external_force(u, 1.0)
    assert total_force(scene.system, u, force) == pytest.approx([2, 3, 3 * 0.6 - 2 * 0.05 + 7])


def test_findings_and_brittle_strengths(tmp_path):
    glass = STEEL.replace(strength=(1e6, 5e6))
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), ElementBeamCable(5), glass, 0.1)
    state = Scene(beam).clamp("left").point_force((0, -50), at=(1, 0)).solve_static()
    page = Page(state.report(tmp_path / "glass.html"))
    assert any("times the strength" in text for text in page.text["p"])
    assert page.row("StVenantKirchhoff, plane stress")[-1] == "1000000 / 5000000"
    numbers = Section.numbers(EA=1e6, EI=1e2)
    bare = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), ElementBeamCable(5),
                section=numbers)
    state = Scene(bare).clamp("left").point_force((0, -5), at=(1, 0)).solve_static()
    rows = [row[0] for row in Page(state.report(tmp_path / "bare.html")).rows]
    assert "largest displacement" in rows and "largest S xx" not in rows


def test_a_motion_is_reported_at_its_worst_instant(tmp_path):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5), STEEL, 0.05)
    scene = Scene(beam).clamp("left").point_force((0, -10.0), at=(1, 0))
    history = scene.sensor("energy", lambda state: state.strain_energy).integrate(0.06, 0.002)
    page = Page(history.report(tmp_path / "motion.html"))
    worst = int(np.argmax([state.extremes(count=1)[0].value for state in history]))
    assert any(f"the instant t = {history.t[worst]:g}," in text for text in page.text["p"])
    assert len(page.sources) == 6 and page.row("inertia and damping")


def test_a_strip_that_sprang_back_bears_nothing(tmp_path):
    """Its page says so of the reactions, and that section forces are errors of the elements."""
    steel = ElasticPlastic(2e11, 0.3, 3e8, hardening=2e8)
    mesh = MeshBeam.init_line(np.linspace(0, 0.1, 7), 0.002)
    strip = Beam(mesh, ElementBeamCable(3), steel, 0.01)
    bending = Scene(strip).clamp("left").fix("right", "r^2", displacement=lambda t: -0.03 * t)
    bent = bending.run(1.0, increments=6).state(-1)
    left = Scene(strip).clamp("left").run(2.0, increments=1, start=bent).state(-1)
    text = Page(left.report(tmp_path / "left.html")).text["p"]
    assert "No forces act on the structure." in text and not any("motion" in one for one in text)
    assert any(one.endswith("has no load. The exact ones are zero.") for one in text)
    text = Page(bent.report(tmp_path / "bent.html")).text["p"]
    assert any(one.endswith("They are in balance.") for one in text)


def test_obstacles_are_listed(tmp_path):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), ElementBeamCable(5), STEEL, 0.1)
    scene = Scene(beam).clamp("left").obstacle(
        Circle((0.9, 0.06), 0.05), friction=0.2, position=lambda t: (0, -0.02 * t))
    row = Page(scene.solve_static().report(tmp_path / "pressed.html")).row("obstacle")
    assert row[-2:] == ["Circle about (0.9, 0.06), radius 0.05, moves", "friction 0.2"]


def test_wrong_files(tmp_path):
    beam = Beam(MeshBeam.init_line([0, 1], 0.01), ElementBeamCable(5), STEEL, 0.05)
    state = Scene(beam).clamp("left").point_force((0, -1.0), at=(1, 0)).solve_static()
    for wrong in ("report.pdf", 3):
        with pytest.raises((InputError, FileError)):
            state.report(wrong)


def a_domain_and_a_beam(load=-1e4, name="root", E=2.1e11):
    """A cantilever of length 2 of one law: its first half is a domain, its second half a beam."""
    mesh = MeshQuad.init_tensor(np.linspace(0, 1, 17), np.linspace(-0.1, 0.1, 5)).with_defaults()
    law = STEEL.replace(E=E, nu=0.0)
    root = Domain.solid(Basis(mesh, ElementVector(ElementQuad2())), law, 0.1, name)
    arm = Beam(MeshBeam.init_line(np.linspace(1, 2, 9), 0.2), ElementBeamANCF(2), law, 0.1,
               name="arm")
    scene = Scene(root, arm).units("N", "m").clamp("left", root).point_force((0, load), at=(2, 0))
    scene.weld((root, "right"), (arm, "left"))
    return scene


@pytest.mark.parametrize("solve", ["solve_static", "solve_linear"])
def test_a_domain_has_its_rows_beside_the_beams(tmp_path, solve):
    """Stress 6 F x / (b h^2): that of the clamp is in the domain, half of it in the beam.

    The clamp holds the warping of its section, which adds 2 %.
    """
    state = getattr(a_domain_and_a_beam().line_load((0, -100.0), beam="arm"), solve)()
    sigma, small = 6 * (1e4 * 2 + 150) / (0.1 * 0.2**2), 6 * (1e4 + 50) / (0.1 * 0.2**2)
    worst = state.extremes(count=4)
    assert {(one.beam, one.kind) for one in worst} == {("root", "domain")}
    assert worst[0].value == pytest.approx(sigma / 235e6, rel=0.03)
    assert np.abs(worst[0].point) == pytest.approx([0, 0.1], abs=1e-9)
    assert np.hypot(*(worst[2].point - worst[0].point)) >= 0.1 * (1 - 1e-12)
    assert str(worst[0]).endswith(" of domain 'root'")
    assert state.extremes(count=1, beam="root")[0].value == worst[0].value
    assert state.extremes(count=1, beam="arm")[0].value == pytest.approx(small / 235e6, rel=0.03)
    assert state.checks.utilisation.kind == "domain"
    page = Page(state.report(tmp_path / "both.html"))
    rows = {row[3]: row for row in page.rows if row[0] == "largest utilisation"}
    assert float(rows["root"][1]) == pytest.approx(sigma / 235e6, rel=0.03)
    assert float(rows["arm"][1]) == pytest.approx(small / 235e6, rel=0.03)
    assert page.row("distributed force")[3] == "100 N/m" and page.row("force")[3] == "10 kN"
    assert page.row("root")[1].startswith("Domain root of 64 MeshQuad1 cells")
    assert len([row for row in page.rows if row[0].startswith("StVenantKirchhoff")]) == 1
    assert page.row("(0, 0) of root")[2] == "10.1 kN"  # no round-off in the place
    assert page.row("maximum M")[1] == "0 N m"
    axes = state.plot_resultants(on="structure")
    box = np.vstack([path.vertices for artist in axes[2].collections
                     for path in artist.get_paths() if len(path.vertices) == 5])
    assert box.min(axis=0) == pytest.approx([0, -0.1]) and axes[2].get_xlim()[0] < 0.0


def test_domains_alone_are_reported_and_checked(tmp_path):
    mesh = MeshQuad.init_tensor(np.linspace(0, 2, 9), np.linspace(0, 1, 3)).with_defaults()
    strip = Domain.solid(Basis(mesh, ElementVector(ElementQuad2())), STEEL, 0.1)
    scene = Scene(strip).fix("left", "u^1").fix("bottom", "u^2").fix("right", "u^1", 0.2)
    state = scene.solve_static()
    wide = 0.5 * 2.1e11 * (1.1**2 - 1) / 235e6  # second Piola-Kirchhoff over the strength
    narrow = np.sqrt(1 - 0.3 * (1.1**2 - 1))  # stretch across, and of the thickness
    assert state.extremes(count=1)[0].value == pytest.approx(wide * 1.1 / narrow**2, rel=1e-6)
    assert state.extremes(count=1)[0].beam == 0
    assert state.checks.largest_stretch == pytest.approx(1.1, rel=1e-9)
    assert state.checks.smallest_det == pytest.approx(1.1 * narrow, rel=1e-9)
    assert any(text.startswith("the strain is 0.1: Hooke's law") for text in state.checks.findings)
    assert any("of domain 0 is" in text for text in state.checks.findings)
    page = Page(state.report(tmp_path / "strip.html"))
    assert page.row("largest displacement")[1:] == ["0.2025", "(2, 1)", "0"]
    assert sum("times the strength" in text for text in page.text["p"]) == 1
    with pytest.raises(InputError, match=r"those of beams: .*plot\(.von_mises.\)"):
        state.plot_resultants()


def test_extremes_of_what_has_no_stress():
    """A domain of user-defined forms has displacements alone; a rigid body has no field."""
    scene = a_domain_and_a_beam()
    solid = scene.domains[0]
    bare = Domain(solid.basis, solid.residual, solid.tangent, name="bare")
    body = RigidBody(1.0, 1.0, (5.0, 0.0), name="block")
    scene = Scene(scene.beams[0], bare, body).clamp("left", bare).clamp((5, 0), "block")
    scene.weld((bare, "right"), ("arm", "left"))
    state = scene.point_force((0, -1e4), at=(2, 0)).solve_static()
    assert {one.beam for one in state.extremes()} == {"arm"}
    assert state.extremes("displacement", 1, beam="bare")[0].value > 0
    with pytest.raises(InputError, match="Domain.solid"):
        state.extremes("von_mises", beam="bare")
    with pytest.raises(InputError, match="beams and domains"):
        state.extremes("displacement", beam="block")
