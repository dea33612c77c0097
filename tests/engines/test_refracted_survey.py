"""Surveys through layered water: runs in parts agree, and so do all accumulators."""

import warnings
from itertools import product

import numpy as np
import pytest

import insonify
from insonify.propagation.families import families_up_to
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.refracted_rays import RefractedRays
from insonify.records.legs import ray_name
from insonify.simulator import build_simulator
from insonify.sonar.ping_geometry import array_depths
from insonify.synthesis.replica_jitter import _code, replica_jitter
from oracles.scenes import nominal, point

THERMO = [[0.0, 1510.0], [8.0, 1510.0], [14.0, 1490.0], [20.0, 1490.0]]
CAUSTIC = [[0.0, 1510.0], [4.0, 1510.0], [8.0, 1490.0], [20.0, 1490.0]]
QUIET = {"noise_level_db": None}


def layered(profile=THERMO, **changes):
    """The nominal scene in layered water."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # corners of these profiles are meant
        return nominal(water={**QUIET, "profile": profile}, **changes)


def test_water_states_which_rays_it_has():
    """Straight for one speed, curved for a profile; a profile that does not reach the seabed is refused."""
    assert isinstance(build_simulator(nominal(water=QUIET)).engine.rays, StraightRays)
    assert isinstance(build_simulator(layered()).engine.rays, RefractedRays)
    with pytest.raises(ValueError, match=r"profile"):
        build_simulator(layered([[0.0, 1510.0], [15.0, 1490.0]]))


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_threads_and_parts_do_not_change_a_bit(field):
    """Three pings of a passing sonar, with a box and a point: one thread or two, all at once or each alone."""
    scenario = _passing(field)
    name = "pressure" if field == "coherent" else "intensity"
    whole = insonify.simulate(scenario, threads=2)[name].values
    alone = np.concatenate([insonify.simulate(scenario, pings=[ping], threads=1)[name].values for ping in (2, 0, 1)])
    np.testing.assert_array_equal(whole, alone[[1, 2, 0]])
    assert np.abs(whole).max() > 0


def _passing(field):
    """A sonar that runs north past a box."""
    scenario = layered(box={"position": (0.3, 40.0)}, field=field, paths={"max_reflections": 2})
    track = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": 2.0, "pings": 3, "window": (0.050, 0.058)}
    return type(scenario)(**{**scenario.model_dump(), "track": track})


def test_level_curves_add_up_to_the_expected_intensity():
    """All contributions together are the expected intensity; pairs are given by family, several rays of one as one."""
    scenario = layered(CAUSTIC, track={"window": (0.21, 0.22)}, paths={"max_reflections": 1}, field="incoherent",
                   targets=[point(0, 160, 15)])  # fmt: skip
    curves = insonify.levels(scenario)
    total = 10 ** (curves.level_db.sel(contribution="total", pair="all").values / 10)
    received = insonify.simulate(scenario).intensity.values[0, 0]
    np.testing.assert_allclose(total, received, rtol=1e-9, atol=1e-12 * received.max())
    assert set(curves.pair.values) == {"all", "D-D", "D-S", "D-B", "S-S", "S-B", "B-B"}


def test_a_slice_is_refracted_by_the_thermocline():
    """The direct reverberation of a slice ends with the direct path, at 162 m; in water of one speed it goes on."""
    few = {
        "track": {"window": (0.15, 0.24)},
        "paths": {"geometry": "slice", "max_reflections": 0},
        "field": "incoherent",
    }
    refracted, straight = layered(**few), nominal(water=QUIET, **few)
    ends = {}
    for name, scenario in (("refracted", refracted), ("straight", straight)):
        series = insonify.simulate(scenario)
        intensity = series.intensity.values[0, 0]
        ends[name] = float(series.time.values[np.flatnonzero(intensity > 1e-6 * intensity.max())[-1]])
    assert ends["refracted"] == pytest.approx(2 * 162 / 1493, abs=2e-3)
    assert ends["straight"] > 0.239


def test_each_end_has_the_beam_of_its_own_depth():
    """A transmitter at 5 m in fast water and a receiver at 16 m in slow: beams by the wavelength at each."""
    scenario = layered(transmit={"offset": (0.0, 0.0, -6.0)}, receive={"offset": (0.0, 0.0, 5.0)})
    here = build_simulator(scenario).ping_geometry(0)
    aside = np.array([[np.sin(0.005), np.cos(0.005), 0.0]])
    sent, received = here.transmit_beams.gain(aside)[0, 0], here.receive_beams.gain(aside)[0, 0]
    for gain, speed in ((sent, 1510.0), (received, 1490.0)):
        assert abs(gain) == pytest.approx(abs(np.sinc(1.5 * 100e3 / speed * np.sin(0.005))), abs=1e-5)
    assert here.sound_speed == 1510.0
    np.testing.assert_allclose(
        array_depths(scenario.sonar, build_simulator(scenario).platforms.transmitter_poses), [5.0, 16.0]
    )


def test_each_ray_of_a_family_has_a_jitter_of_its_own():
    """Up to twelve bounces and eight rays, names have numbers below 256, each its own; the first is its family."""
    names = [ray_name(family, branch) for family, branch in product(families_up_to(12), range(8))]
    codes = {_code(name) for name in names}
    assert len(codes) == len(names) == 200 and max(codes) < 256
    shaken = replica_jitter(1, 0, PathSettings(jitter=1.0))
    place = np.arange(2000, dtype=np.uint64)
    one, other = shaken.factor(place, "D", "D"), shaken.factor(place, "D", "D2")
    assert abs(np.mean(one * np.conj(other))) < 4 / np.sqrt(2000)
    assert ray_name("D", 0) == "D" and ray_name("BS", 2) == "BS3"
