"""Recordings that do not match: pings, steps, units, parts, beams, missing samples, single pings, detections."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.signal import decimate

import insonify
from insonify.comparison.frame import common_frame
from insonify.comparison.samples import Samples
from insonify.formats.store_description import StoreError
from oracles.few_of import few_of
from oracles.speckled_recordings import SpeckledScene

SCENE = SpeckledScene()


def coarser(samples, factor):
    """Every `factor`-th sample behind a filter for that step."""
    values = decimate(samples.values, factor, ftype="fir", axis=2)
    return replace(samples, values=values, slant_range=samples.slant_range[::factor])


def with_holes(samples):
    """A recording of which one ping, the far end and some samples are missing."""
    values = samples.values.copy()
    values[3], values[..., 500:], values[10:12, :, 40:90] = np.nan, np.nan, np.nan
    return replace(samples, values=values)


ALTERED = {
    "fewer pings": lambda s: replace(s, values=s.values[:17], altitude=s.altitude[:17]),
    "a shorter range": lambda s: replace(s, values=s.values[..., 20:420], slant_range=s.slant_range[20:420]),
    "missing samples": with_holes,
    "amplitudes without phase": lambda s: replace(s, values=np.abs(s.values)),
    "twice the step": lambda s: coarser(s, 2),
    "another unit": lambda s: replace(s, values=300 * s.values, unit="counts"),
    "no pulse, no altitude": lambda s: replace(s, pulse_length=np.nan, altitude=np.empty(0), depth=np.nan),
}


@pytest.mark.parametrize("name", ALTERED)
def test_an_uneven_pair_of_draws_does_not_differ(name):
    """What a pair of recordings does not share is no difference between two draws of one scene."""
    found = insonify.compare(SCENE.samples_of(21), ALTERED[name](SCENE.samples_of(22)))
    assert not found.different, found.summary()
    assert len([f for f in found.findings if f.verdict == "alike"]) >= 6


@few_of((0, 2), "pings", [1, 2, 5])
def test_few_pings_are_judged_by_tiles_of_range(pings):
    """With one to five pings two draws do not differ, and a noise floor 15 dB higher is found."""
    few = SCENE.but(pings=pings)
    assert not insonify.compare(few.samples_of(31), few.samples_of(32)).different
    found = insonify.compare(few.samples_of(31), few.but(noise_db=-35.0).samples_of(32))
    assert "level against range" in found.different
    assert any("tiles of range" in note for note in found.notes)


def test_pings_of_a_moored_ship_count_as_one_block():
    """Sixteen pings of one realisation are one block, sixteen draws are sixteen."""
    one = SCENE.but(pings=1).samples_of(41)
    moored = replace(one, values=np.repeat(one.values, 16, axis=0), altitude=np.repeat(one.altitude, 16))
    moving = SCENE.but(pings=16).samples_of(42)
    assert common_frame(moored, moving).blocks == (1, 1) and common_frame(moving, moving).blocks == (16, 16)
    for field in (np.abs(moored.values), moored.values):
        assert common_frame(replace(moored, values=field), replace(moored, values=field)).blocks == (1, 1)


def test_the_transmitted_pulse_is_left_out():
    """A record that opens 60 dB above its echoes is compared behind that."""
    draw = SCENE.samples_of(51)
    values = draw.values.copy()
    values[..., :6] = 1e3
    opened = replace(draw, values=values)
    assert 0.3 < common_frame(opened, draw).slant_range[0] < 1.0
    assert common_frame(draw, draw).slant_range[0] == draw.slant_range[0]


def test_equal_units_keep_their_levels_and_others_lose_one_constant():
    """300 times the amplitude in other units is -49.5 dB, within the speckle of the total energy."""
    one, two = SCENE.samples_of(61), SCENE.samples_of(62)
    assert common_frame(one, two).scaled_db == 0
    other = replace(two, values=300 * two.values, unit="counts")
    assert common_frame(one, other).scaled_db == pytest.approx(-49.54, abs=1.0)


def fan(seed, depth=8.0, scatter=0.02, beams=64):
    """Detections of a fan over a level bed, as a dataset of pings."""
    rng = np.random.default_rng(seed)
    angle = np.radians(np.linspace(-60, 60, beams))
    slant = (depth + scatter * rng.standard_normal((12, beams))) / np.cos(angle)
    level = -20 + 10 * np.log10(rng.standard_exponential((12, beams)))
    return xr.Dataset(
        {"travel_time": (("ping", "beam"), slant / 750), "backscatter": (("ping", "beam"), level)},
        coords={"angle": ("beam", angle)}, attrs={"sound_speed": 1500.0, "title": f"fan {seed}"},
    )  # fmt: skip


@pytest.mark.parametrize(("changes", "different"), [({}, False), ({"depth": 8.03}, True), ({"scatter": 0.04}, True),
                                                    ({"beams": 48}, False)])  # fmt: skip
def test_detections_are_compared_by_depth_and_scatter(changes, different):
    """Fans of two draws are alike, whatever their beams; 3 cm of depth and twice the scatter are found."""
    found = insonify.compare(fan(1), fan(2, **changes))
    assert ("detections" in found.different) == different, found.summary()


def test_detections_and_samples_are_refused():
    """A fan of detections beside samples of range: the message names both and the groups to try."""
    with pytest.raises(StoreError, match=r"fan 1 and draw 1: detections and samples.*--group soundings"):
        insonify.compare(fan(1), SCENE.samples_of(1))


@pytest.mark.parametrize(("decorrelated", "different"), [(0.0, False), (0.5, True)])
def test_coherence_between_parts_is_compared(decorrelated, different):
    """Four parts with common speckle; half of it replaced by noise of their own is found."""

    def parts(seed, own):
        rng, draw = np.random.default_rng(seed), SCENE.but(pings=12, noise_db=-80.0).samples_of(seed)
        noise = rng.standard_normal((12, 4, 600, 2)).view(complex)[..., 0] / np.sqrt(2)
        law = np.abs(SCENE._amplitude())
        values = np.sqrt(1 - own) * draw.values + np.sqrt(own) * noise * law
        return replace(draw, values=values, parts=True)

    found = insonify.compare(parts(71, 0.2), parts(72, 0.2 + decorrelated))
    assert ("coherence between sectors" in found.different) == different
    near = found.finding("coherence between sectors").values[3].real
    assert near == pytest.approx(0.8, abs=0.05)  # share of the common power


def test_samples_refuse_axes_of_unequal_length():
    """The message names the column and both lengths."""
    with pytest.raises(ValueError, match="slant_range has 3 rows"):
        Samples("a", np.zeros((2, 1, 4)), np.arange(3.0), "V")
    with pytest.raises(ValueError, match=r"angle has 2 rows; values have 1"):
        Samples("a", np.zeros((2, 1, 4)), np.arange(4.0), "V", angle=np.zeros(2))
