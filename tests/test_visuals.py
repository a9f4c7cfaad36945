"""Pictures: what is drawn, without a display."""

import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose
from test_io import affine, bent, turn

from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, MissingExtra, NameUnknown,
                        Scene, StVenantKirchhoff)
from skfem_ancf.recovery.fields import DRAWN, FIELDS
from skfem_ancf.visuals.matplotlib import plot_state

STEEL = StVenantKirchhoff(E=1e6, nu=0.3)


def drawn(ax):
    """The coloured patches."""
    return next(c for c in ax.collections if type(c).__name__ == "TriMesh")


@pytest.fixture(scope="module")
def state():
    return bent()


@pytest.mark.parametrize("field", DRAWN)
def test_every_field_is_drawn_and_named(state, field):
    ax = state.plot(field)
    assert ax.get_title(loc="left") == FIELDS[field].title
    low, high = drawn(ax).get_clim()
    values = drawn(ax).get_array()
    start = FIELDS[field].neutral
    assert high - start == pytest.approx(abs(values - start).max())
    assert low == pytest.approx(2 * start - high if FIELDS[field].signed else start)
    assert ax.get_aspect() == 1.0


def test_picture_files(state, tmp_path):
    for suffix in ("png", "pdf", "svg"):
        path = tmp_path / "new" / f"beam.{suffix}"
        state.plot(filename=path, dpi=60)
        assert path.stat().st_size > 2000
    assert len(list(path.parent.iterdir())) == 3


def test_png_shows_both_signs(state, tmp_path):
    from matplotlib.image import imread

    state.plot("S_xx", colorbar=False, filename=tmp_path / "beam.png", dpi=80)
    rgb = imread(tmp_path / "beam.png")[..., :3]
    assert np.sum((rgb[..., 0] > 0.6) & (rgb[..., 2] < 0.3)) > 20   # red: tension
    assert np.sum((rgb[..., 2] > 0.5) & (rgb[..., 0] < 0.4)) > 20   # blue: compression


def test_slender_beams_are_drawn_thicker_and_say_so():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamANCF(2), STEEL, 1)
    state = affine(beam, turn(0.5))
    ax = state.plot()
    assert [t.get_text() for t in ax.texts] == ["section drawn 4 times as thick"]
    thick = drawn(state.plot(thickness=8))._triangulation
    # turned back, the section is 8 times 0.01 high
    across = turn(-0.5) @ np.array([thick.x, thick.y])
    assert_allclose([across[1].min(), across[1].max()], [-0.04, 0.04], atol=1e-14)
    assert_allclose([across[0].min(), across[0].max()], [0, 1], atol=1e-14)
    assert not state.plot(thickness=1).texts


def test_limits_clip_with_arrows(state):
    ax = state.plot("S_xx", limits=(-1, 2))
    image = drawn(ax)
    assert image.get_clim() == (-1, 2) and image.colorbar.extend == "both"
    assert drawn(state.plot("S_xx")).colorbar.extend == "neither"


@pytest.mark.parametrize("options, error, message", [
    (dict(field="eps_zz"), NameUnknown, "known: 'displacement'"),
    (dict(thickness=0), InputError, "thickness must be positive"),
    (dict(thickness="thick"), InputError, "thickness must be a number"),
    (dict(limits=(1, 1)), InputError, "must increase"),
    (dict(limits=1), InputError, "two numbers"),
    (dict(limits=(np.nan, 1)), InputError, "finite"),
    (dict(subdivide=(0, 1)), InputError, "positive integers"),
])
def test_bad_options(state, options, error, message):
    with pytest.raises(error, match=message):
        state.plot(**options)


def test_without_matplotlib(state, monkeypatch):
    for name in [m for m in sys.modules if m.split(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r'pip install "skfem-ancf\[plot\]"'):
        state.plot()


def test_colour_bars_say_the_unit(state):
    def labels(**options):
        ax = state.plot("S_xx", **options)
        return {text for bar in (*ax.figure.axes, *ax.child_axes)
                for text in (bar.get_xlabel(), bar.get_ylabel())} - {"x", "y", ""}

    assert labels(unit="Pa") == {"Pa"} and labels() == {"force / area"} and not labels(unit="")
    with pytest.raises(InputError, match="unit must be a text"):
        state.plot("S_xx", unit=1)


def test_several_states_share_a_picture():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2),
                StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.02)
    history = Scene(beam).pin("left").gravity((0, -9.81)).integrate(0.2, 0.02)
    ax = history.plot("eps_xx", [0, 0.1, 0.199], thickness=1, subdivide=(4, 2))
    images = [c for c in ax.collections if c.get_array() is not None]
    outlines = [c for c in ax.collections if len(c.get_paths()) == 3]
    alone = [history.state(k).plot("eps_xx", thickness=1, subdivide=(4, 2)) for k in (0, 5, 10)]
    own = np.concatenate([c.get_array() for one in alone for c in one.collections
                          if c.get_array() is not None])
    assert len(images) == 1 and len(outlines) == 1 and len(ax.figure.axes) == 2
    np.testing.assert_allclose(images[0].get_array(), own, atol=1e-12 + 1e-6 * np.abs(own).max())
    assert len(history.plot(times=0.1, undeformed=False).collections) == 2
    assert len(history.plot().collections[-1].get_paths()) == 8
    with pytest.raises(InputError, match="no state to draw"):
        plot_state([])
    for wrong in (["x"], [], 0.3, [-1e-3, 0.1]):
        with pytest.raises(InputError, match="times"):
            history.plot(times=wrong)
