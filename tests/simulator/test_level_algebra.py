"""Levels satisfy the sonar equation's arithmetic: what is added in decibels, and what in energy."""

from itertools import combinations_with_replacement

import numpy as np
import pytest
import xarray as xr

from insonify.simulator import build_simulator, levels, simulate
from insonify.synthesis.level_curves import ALL, pair_name
from oracles.scenes import nominal, point

SHORT = {"window": (0.195, 0.205)}
ROUGH = {"scattering": {"strength_db": -30}}


def power(curves: xr.Dataset, **chosen: str) -> np.ndarray:
    """Curves as mean-square pressure [uPa^2]."""
    return 10 ** (curves.level_db.sel(**chosen).values / 10)


@pytest.fixture(scope="module")
def everything() -> xr.Dataset:
    """Bed, surface, box and noise in a slice, two reflections."""
    return levels(nominal(box={}, surface=ROUGH, water={"noise_level_db": 60.0}, track=SHORT,
                          paths={"geometry": "slice"}))  # fmt: skip


def test_the_total_is_the_sum_of_its_causes(everything: xr.Dataset) -> None:
    """Energies of contributions add: seabed + surface + target + noise, to rounding."""
    parts = sum(
        power(everything, contribution=contribution, pair=ALL)
        for contribution in ("seabed", "surface", "target", "noise")
    )
    np.testing.assert_allclose(power(everything, contribution="total", pair=ALL), parts, rtol=1e-9)


def test_the_total_is_what_the_incoherent_recording_holds(everything: xr.Dataset) -> None:
    """Two doors, one number: `levels` and `simulate` of the same scenario, to rounding."""
    scenario = nominal(box={}, surface=ROUGH, water={"noise_level_db": 60.0}, track=SHORT, field="incoherent",
                   paths={"geometry": "slice"})  # fmt: skip
    total = power(everything, contribution="total", pair=ALL)
    np.testing.assert_allclose(total, simulate(scenario).intensity.values[0, 0], rtol=1e-9)


def test_there_is_a_curve_for_each_pair_that_can_be(everything: xr.Dataset) -> None:
    """Fifteen unordered pairs of five families; a boundary scatters in six of them, a target in all."""
    named = {pair_name(*pair) for pair in combinations_with_replacement(("D", "S", "B", "SB", "BS"), 2)}
    assert set(everything.pair.values) == named | {ALL}
    received = {
        contribution: {
            str(p)
            for p in everything.pair.values
            if np.isfinite(everything.level_db.sel(contribution=contribution, pair=p)).any()
        }
        for contribution in ("seabed", "surface", "target")
    }
    assert received["target"] == named | {ALL}
    assert received["seabed"] == {pair_name(*p) for p in combinations_with_replacement(("D", "S", "BS"), 2)} | {ALL}
    assert received["surface"] == {pair_name(*p) for p in combinations_with_replacement(("D", "B", "SB"), 2)} | {ALL}


def test_noise_has_no_time_and_no_way(everything: xr.Dataset) -> None:
    """One level throughout, and only on the curve of all pairs."""
    noise = everything.level_db.sel(contribution="noise")
    assert np.ptp(noise.sel(pair=ALL).values) == 0
    assert not np.isfinite(noise.drop_sel(pair=ALL)).any()


@pytest.mark.parametrize("decibels", [6.0, 20.0])
def test_a_stronger_source_lifts_every_curve_by_as_much(decibels: float) -> None:
    """Levels rise by the source level, dB for dB, to 1e-9 dB."""
    settings = {"track": SHORT, "paths": {"geometry": "slice"}}
    strong, quiet = (
        levels(nominal(**settings)).level_db.values,
        levels(nominal(**settings, sonar={"source_level_db": 220 - decibels})).level_db.values,
    )
    there = np.isfinite(quiet)
    np.testing.assert_array_equal(np.isfinite(strong), there)
    np.testing.assert_allclose(strong[there] - quiet[there], decibels, atol=1e-9)


def test_a_rougher_bed_lifts_its_own_curve_alone() -> None:
    """Lambert's strength enters once, in decibels; the surface does not notice."""
    quiet, strong = (
        levels(nominal(seabed={"depth": 20, "scattering": {"strength_db": s}}, surface=ROUGH, track=SHORT,
                       paths={"geometry": "slice"}))
        for s in (-30.0, -20.0)
    )  # fmt: skip
    for contribution, rise in (("seabed", 10.0), ("surface", 0.0)):
        change = strong.level_db.sel(contribution=contribution, pair=ALL) - quiet.level_db.sel(
            contribution=contribution, pair=ALL
        )
        np.testing.assert_allclose(change, rise, atol=1e-9)


@pytest.mark.parametrize("part", [0.3, 1.0])
def test_a_perturbed_amplitude_adds_a_third_of_its_square(part: float) -> None:
    """Uniform in 1 +- e: E|1 + e(2u - 1)|^2 = 1 + e^2 / 3, on a bed received by direct paths."""
    settings = {"track": SHORT, "water": {"noise_level_db": None}}
    still, shaken = (
        levels(nominal(**settings, paths={"geometry": "slice", "max_reflections": 0, "amplitude_perturbation": e}))
        for e in (0.0, part)
    )
    rise = power(shaken, contribution="seabed", pair=ALL) / power(still, contribution="seabed", pair=ALL)
    np.testing.assert_allclose(rise, 1 + part**2 / 3, rtol=1e-9)


def test_a_perturbed_echo_has_that_energy_in_the_mean_of_many_pings() -> None:
    """400 pings of one point by its direct path, e = 1: mean energy 1 + e^2 / 3, standard error 4.5 %, 15 % allowed."""
    scenario = nominal(targets=[point(0, 20, 11)], paths={"max_reflections": 0, "contributions": ["target"],
                                                      "amplitude_perturbation": 1.0},
                   track={"window": (0.0262, 0.0272), "pings": 400, "interval": 0.3})  # fmt: skip
    energy = np.sum(np.abs(simulate(scenario).pressure.values[:, 0]) ** 2, axis=-1)
    one = np.sum(np.abs(simulate(scenario.model_copy(update={"paths": scenario.paths.model_copy(
        update={"amplitude_perturbation": 0.0})}), pings=[0]).pressure.values) ** 2)  # fmt: skip
    assert energy.mean() / one == pytest.approx(4 / 3, rel=0.15)
    assert energy.max() / one <= 4 * (1 + 1e-5)


def test_each_channel_has_its_own_level() -> None:
    """Two beams, the point in the first: the second receives it 40 dB lower, and `channel` states which is drawn."""
    scenario = nominal(targets=[point(0, 150, 15)], receive={"steer": [0.0, np.radians(10)], "shading": "hann"},
                   transmit={"length": 0.05, "steer": [0.0]}, paths={"max_reflections": 0, "contributions": ["target"]},
                   track=SHORT)  # fmt: skip
    on, off = (levels(scenario, channel=c).level_db.sel(contribution="target", pair=ALL).max().item() for c in (0, 1))
    assert on - off > 40
    recorded = simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values[0].max(axis=-1)
    assert on - off == pytest.approx(10 * np.log10(recorded[0] / recorded[1]), abs=1e-6)


def test_compression_lifts_an_echo_over_the_noise_by_band_times_duration() -> None:
    """A sweep of 15 kHz and 2 ms: a point keeps its peak, noise falls from the band's to the pulse's 1 / T.

    Gain = noise bandwidth before over 1 / energy duration after, 10 log10(B T) within 0.1 dB for the noise; the
    peak of a lone echo stays within 1 dB, for the edges of the band take a little of the sweep.
    """
    lfm = {"kind": "lfm", "frequency": 100e3, "duration": 2e-3, "bandwidth": 12e3, "taper": "tukey"}
    received = []
    for compress in (False, True):
        scenario = nominal(targets=[point(0, 150, 11)], water={"noise_level_db": 60.0}, track={"window": (0.19, 0.21)},
                       paths={"max_reflections": 0, "contributions": ["target"]},
                       sonar={"pulse": lfm, "receiver": {"bandwidth": 20e3, "matched_filter": compress}})  # fmt: skip
        curves = levels(scenario)
        received.append([curves.level_db.sel(contribution=c, pair=ALL).values.max() for c in ("target", "noise")])
    (echo, noise), (sharp, quiet) = received
    assert sharp - echo == pytest.approx(0, abs=1.0)
    # before: the receiver's noise width, 20 kHz flat and two cosine-squared edges of 2.5 kHz at 3/8 each
    width = 20e3 + 2 * 2.5e3 * 3 / 8
    assert noise - quiet == pytest.approx(10 * np.log10(width * 2e-3 * (1 - 0.0625)), abs=0.1)


def test_levels_of_a_compressed_sweep_are_those_of_its_compressed_pulse() -> None:
    """Reverberation follows the energy of the waveform as recorded: tone, sweep and compressed sweep alike."""
    ratio = []
    for pulse, compress in (
        ({"kind": "cw", "frequency": 100e3, "duration": 1e-3}, False),
        ({"kind": "lfm", "frequency": 100e3, "duration": 1e-3, "bandwidth": 15e3}, False),
        ({"kind": "lfm", "frequency": 100e3, "duration": 1e-3, "bandwidth": 15e3}, True),
    ):
        sonar = {"pulse": pulse, "receiver": {"matched_filter": compress}}
        scenario = nominal(track={"window": (0.17, 0.23)}, sonar=sonar,
                           paths={"geometry": "slice", "max_reflections": 0})  # fmt: skip
        mean = power(levels(scenario), contribution="seabed", pair=ALL).mean()
        ratio.append(mean / build_simulator(scenario).pulse.effective_duration)
    np.testing.assert_allclose(10 * np.log10(np.array(ratio) / ratio[0]), 0, atol=0.25)


@pytest.mark.parametrize("names", [("D", "S", "B", "SB", "BS", "SBS", "BSB", "F", "FS", "FB", "FBS", "BH", "SBH")])
def test_both_orders_of_a_pair_have_one_name(names):
    """Out by one family and back by another is one pair with its reverse, off faces and hulls too: BS-FS, not FS-BS.

    Under two names each order would stand alone, without the interference of both (6 dB for the two together).
    """
    for one, other in combinations_with_replacement(names, 2):
        assert pair_name(one, other) == pair_name(other, one)
    assert pair_name("FS", "BS") == "BS-FS" and pair_name("BS", "SB") == "SB-BS" and pair_name("F", "D") == "D-F"


def test_levels_of_pairs_under_a_hull_add_up():
    """Of one contribution, its pairs' mean powers sum to that of all within 0.02 dB: BS-BH with both its orders."""
    hull = {"length": 20.0, "width": 6.0, "offset": (0.0, 0.0, -0.5)}
    found = levels(nominal(field="incoherent", sonar={"hull": hull}, track={"window": (0.03, 0.06)},
                           paths={"families": ["D", "BS"], "contributions": ("seabed",)}))  # fmt: skip
    power = (10 ** (found.level_db.sel(contribution="seabed") / 10)).mean("time")
    assert {"BH-BS"} <= set(power.pair.values) and "BS-BH" not in power.pair.values
    pairs = float(power.sum("pair") - power.sel(pair=ALL))
    assert 10 * np.log10(pairs / float(power.sel(pair=ALL))) == pytest.approx(0.0, abs=0.02)
