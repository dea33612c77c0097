"""Level curves: the recording taken apart by contribution and by pair of families."""

import numpy as np
import pytest

from insonify.simulator import levels, simulate
from insonify.synthesis.level_curves import pair_name
from insonify.synthesis.noise import noise_intensity
from oracles.scenes import nominal

SCENE = {
    "box": {}, "surface": {"scattering": {"strength_db": -35}}, "track": {"window": (0.2, 0.206)},
    "water": {"noise_level_db": 45},
}  # fmt: skip


@pytest.fixture(scope="module")
def curves():
    """Levels of the nominal scene with a box, a scattering surface and noise."""
    return levels(nominal(**SCENE))


def power(curve):
    """Intensity behind a level."""
    return 10 ** (curve.values / 10)


def test_the_contributions_add_up_to_the_recording(curves):
    """Seabed + surface + target + noise = total = the incoherent reading."""
    whole = curves.level_db.sel(pair="all")
    parts = sum(
        power(whole.sel(contribution=contribution)) for contribution in ("seabed", "surface", "target", "noise")
    )
    np.testing.assert_allclose(power(whole.sel(contribution="total")), parts, rtol=1e-9)
    received = simulate(nominal(field="incoherent", **SCENE)).intensity.values[0, 0]
    np.testing.assert_allclose(parts, received, rtol=1e-6)


def test_few_points_give_the_same_curves_with_ripples(curves):
    """1.5 quadrature points in a cell, for pictures: ripples below 0.5 dB rms, no offset; targets are the same."""
    few = levels(nominal(**SCENE), scatterers_per_cell=1.5).level_db.sel(pair="all")
    off = (few - curves.level_db.sel(pair="all")).sel(contribution=["seabed", "surface", "target"])
    where = np.isfinite(curves.level_db.sel(pair="all", contribution=["seabed", "surface", "target"]))
    assert 0 < off.sel(contribution="seabed").std() < 0.5
    assert (np.abs(off.where(where).mean("time")) < 0.15).all()


def test_pairs_of_a_bed_far_from_the_surface_add_as_energies(curves):
    """At 150 m the pairs of one place lie milliseconds apart: the curves of the six pairs add up to the bed's."""
    bed = curves.level_db.sel(contribution="seabed")
    names = ["D-D", "D-S", "D-BS", "S-S", "S-BS", "BS-BS"]
    np.testing.assert_allclose(sum(power(bed.sel(pair=name)) for name in names), power(bed.sel(pair="all")), rtol=1e-6)
    assert np.isneginf(bed.sel(pair="D-B").values).all()


def test_the_surface_is_reached_by_its_own_families(curves):
    """The surface is reached by D, B and SB; S would be its own scattering once more."""
    surface = curves.level_db.sel(contribution="surface")
    assert np.isfinite(surface.sel(pair="D-SB").values).all()
    assert np.isneginf(surface.sel(pair="D-S").values).all()


def test_the_noise_curve_is_the_level_given_over_the_band(curves):
    """45 dB re 1 uPa^2/Hz through the band's energy width: 45 + 10 log B, B by quadrature."""
    offset = np.linspace(-0.625, 0.625, 10_001) * 20e3
    edge = np.clip((np.abs(offset) / 20e3 - 0.5) / 0.125, 0, 1)
    width = np.trapezoid(np.cos(np.pi / 2 * edge) ** 4, offset)
    noise = curves.level_db.sel(contribution="noise", pair="all").values
    np.testing.assert_allclose(noise, 45 + 10 * np.log10(width), atol=1e-3)


def test_a_pair_has_one_name_in_either_order():
    """Fewer bounces first, surface before bottom."""
    assert pair_name("S", "D") == pair_name("D", "S") == "D-S"
    assert pair_name("B", "S") == "S-B"
    assert pair_name("BS", "SB") == "SB-BS"


def test_silence_has_no_level():
    """Without noise and before any echo the level is minus infinity, not a number made up."""
    quiet = levels(nominal(paths={"contributions": ["target"]}, track={"window": (0.0, 0.001)}))
    assert np.isneginf(quiet.level_db.sel(contribution="noise", pair="all").values).all()
    assert noise_intensity(None, None) == 0.0
