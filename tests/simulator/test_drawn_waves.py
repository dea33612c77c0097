"""What drawn waves do to recordings: a calm changes nothing, a sea keeps the energy, and pings differ as waves run."""

import warnings

import numpy as np
import pytest

from insonify.propagation.explicit_surface import explicit_waves
from insonify.scenario.scenario import Scenario
from insonify.scenario.wave_warnings import wave_focusing
from insonify.simulator import arrivals, simulate
from insonify.validity import PhysicsWarning
from oracles.scenes import each_ping, nominal, point
from oracles.time_series import relative_rms
from oracles.traced import FRACTAL

CALM = {"reflection": "explicit", "swell": {"height": 1e-8, "length": 30.0}}
SWELL = {"reflection": "explicit", "swell": {"height": 0.3, "length": 30.0}, "wave_direction": 1.3}
WINDY = {"reflection": "explicit", "wind_speed": 5.0, "wave_direction": 1.3}


def bed(field, surface, *, seed=1, families=("D", "S"), **track):
    """The seabed alone, 75 to 82 m away, by some families."""
    return nominal(
        surface=surface, seed=seed, field=field, line={"length": 0.5}, track={"window": (0.1, 0.102), **track},
        paths={"max_reflections": 2, "contributions": ["seabed"], "families": list(families)},
    )  # fmt: skip


def power(scenario):
    """Mean power of one ping."""
    sound = simulate(scenario, threads=1)
    return np.mean(
        sound["intensity"].values if scenario.field == "incoherent" else np.abs(sound["pressure"].values) ** 2
    )


def test_a_calm_is_a_mirror():
    """Under waves of ten nanometres both readings are those of a mirror."""
    calm, mirror = (simulate(bed("coherent", surface))["pressure"].values for surface in (CALM, {}))
    assert relative_rms(calm, mirror) < 1e-4
    assert power(bed("incoherent", CALM)) == pytest.approx(power(bed("incoherent", {})), rel=1e-3)


@pytest.mark.parametrize("surface", [SWELL, WINDY])
def test_waves_sound_the_same_on_any_number_of_cores(surface):
    """Bit for bit, and from ping to ping in any order."""
    scenario = bed("coherent", surface, pings=3, interval=0.7, window=(0.1, 0.1005), families=["S"])
    scenario = scenario.with_("paths.scatterers_per_cell", 1)
    together = simulate(scenario, pings=[2, 1], threads=2)["pressure"].values
    np.testing.assert_array_equal(together[1], simulate(scenario, pings=[1], threads=1)["pressure"].values[0])


def test_a_scene_turned_and_moved_as_a_whole_sounds_the_same():
    """Scene, waves, sonar and lattice turned by 70 degrees and moved by kilometres: the same recording."""

    def received(angle, move):
        c, s = np.cos(angle), np.sin(angle)
        north, east = np.array([[c, -s], [s, c]]) @ [3.0, 75.0] + move
        surface = {**WINDY, **{"swell": SWELL["swell"], "wave_direction": 0.4 + angle}}
        return simulate(
            nominal(
                targets=[point(north, east, 19.5)], surface=surface, line={"length": 1.0}, paths={"families": ["S"]},
                seabed={"scatterer_grid": {"origin": tuple(move), "heading": angle}},
                track={"position": (*move, 11.0), "heading": angle, "window": (0.1, 0.1005)},
            )
        )["pressure"].values  # fmt: skip

    assert relative_rms(received(np.radians(70.0), np.array([1500.0, -800.0])), received(0.0, np.zeros(2))) < 1e-4


def test_out_and_back_reach_the_sea_at_their_own_times():
    """S-S echoes of a point: reciprocal pairs of bounces have lost their reciprocity, by less than the waves run."""
    scenario = nominal(
        targets=[point(0.0, 75.0, 19.5)], surface=SWELL, paths={"max_reflections": 1, "contributions": ["target"]},
        track={"window": (0.1, 0.11)},
    )  # fmt: skip
    found = arrivals(scenario)
    out, back = (
        found.take((found.transmit_family == a) & (found.receive_family == b)) for a, b in (("S", "D"), ("D", "S"))
    )
    assert len(out) == len(back) >= 1
    apart = np.abs(np.sort(out.delay) - np.sort(back.delay)).max()
    assert 1e-8 < apart < 2 * 0.3 / 1500


@pytest.mark.parametrize("surface", [SWELL, pytest.param(WINDY, marks=pytest.mark.validate)])
def test_the_mean_of_coherent_pings_is_the_incoherent_reading(surface):
    """<|coherent|^2> = incoherent within 1 dB: 12 seas, of about 16 cells each (error 0.3 dB)."""
    coherent, incoherent = (
        each_ping([bed(field, surface, seed=seed) for seed in range(12)], power) for field in ("coherent", "incoherent")
    )
    assert 10 * np.log10(coherent.mean() / incoherent.mean()) == pytest.approx(0.0, abs=1.0)


def test_waves_refuse_what_they_cannot_follow():
    """Legs with two surface bounces, with the fix."""
    with pytest.raises(ValueError, match=r"SBS has more.*families: \[D, S, B, SB, BS"):
        nominal(surface=WINDY, paths={"max_reflections": 3})


def test_crowded_and_high_waves_are_reported_before_the_run():
    """A wind sea drawn down to 1 m has bounces side by side; waves of a metre reach a sonar at 0.4 m."""

    def message(surface, **track):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scenario = nominal(surface=surface, track={"window": (0.1, 0.11), **track})
        assert isinstance(scenario, Scenario)
        return [str(word.message) for word in caught if word.category is PhysicsWarning]

    assert message(SWELL) == message(WINDY) == []
    (crowded,) = message({**WINDY, "cutoff_wavelength": 1.0})
    assert "side by side" in crowded and "longer surface.cutoff_wavelength" in crowded
    (deep,) = message({"reflection": "explicit", "swell": {"height": 1.0, "length": 200.0}}, position=(0.0, 0.0, 0.4))
    assert "troughs reach down to it" in deep


def test_one_swell_along_a_path_has_the_curvature_ratio_of_the_design():
    """2 eta'' r1 r2 / ((r1 + r2) sin g) = 1 at 2.9 cm by 20 m for S at 150 m: across the path sin^2 of that."""
    swell = {"reflection": "explicit", "swell": {"height": 0.058, "length": 20.0}, "wave_direction": np.pi / 2}
    scenario = nominal(surface=swell, paths={"families": ["S"]}, track={"window": (0.1, 2 * 153.3 / 1500)})
    across, _ = wave_focusing(explicit_waves(scenario.surface, 1, 20.0), scenario, 11.0)
    assert across * np.sqrt(2) / (31 / 153.3) ** 2 == pytest.approx(1.0, rel=0.1)


def everything(top, bottom, **paths):
    """A box on fractal ground under drawn waves in water of one gradient, 62 m away."""
    water = {"noise_level_db": None, "profile": [[0.0, top], [8.0, top], [20.0, bottom]]}
    return nominal(
        water=water, surface={**WINDY, "swell": SWELL["swell"]}, box={"position": (0.0, 62.0)},
        seabed={"relief": [FRACTAL], "cutoff_wavelength": 2.0},
        track={"window": (0.083, 0.0841)}, line={"length": 1.0},
        paths={"max_reflections": 1, **paths},
    )  # fmt: skip


@pytest.mark.slow
def test_everything_at_once_is_one_coherent_run():
    """Layers, fractal ground, wind waves, swell and a box: paths of both families off the ground and the box."""
    scenario = everything(1510.0, 1490.0, scatterers_per_cell=1)
    sound = simulate(scenario, threads=2)["pressure"].values
    np.testing.assert_array_equal(sound, simulate(scenario, threads=1)["pressure"].values)
    assert np.all(np.isfinite(sound)) and np.abs(sound).min() > 0
    found = arrivals(scenario)
    paths = {(str(thing), str(out)) for thing, out in zip(found.object, found.transmit_family, strict=True)}
    assert {(thing, family) for thing in ("seabed", "box") for family in "DS"} <= paths


@pytest.mark.slow
def test_hardly_layered_water_sounds_like_water_of_one_speed():
    """A gradient of 1 mm/s over 12 m: the same bounces, folds and glints as by straight rays, within 2 %."""
    layered = everything(1500.001, 1500.0)
    straight = layered.with_("water", {"noise_level_db": None, "sound_speed": 1500.0005})
    one, other = (simulate(scenario)["pressure"].values for scenario in (layered, straight))
    assert relative_rms(one, other) < 0.02
