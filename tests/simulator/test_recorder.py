"""Claims about recorders in runs: lines on disk are those of the pings, however a run is cut; real statistics."""

import numpy as np
import pytest
from scipy.stats import kurtosis, skew

from insonify import load_scenario, plotting, simulate
from insonify.formats.netcdf_file import read_netcdf, write_netcdf
from insonify.formats.zarr_store import open_recording
from insonify.processing import record_series, sidescan
from insonify.recording_run import record
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from oracles.scenes import nominal

STAGES = [
    {"kind": "gain", "tvg_db_per_decade": 20}, {"kind": "looks", "samples": 4, "pings": 2},
    {"kind": "companding", "law": "gamma"}, {"kind": "quantisation", "bits": 8},
]  # fmt: skip


def scene(keep, **changes):
    """Five short pings with a recorder that averages two of them."""
    chain = {"keep": keep, "full_scale_db": 150, "stages": STAGES}
    return nominal(track={"window": (0.1, 0.105), "pings": 5}, sonar={"recorder": chain}, **changes)


@pytest.mark.parametrize("keep", ["both", "recorded"])
def test_lines_on_disk_are_those_in_memory(tmp_path, keep):
    """Two pings make a line; a run in parts, in any order, leaves the same bits; netCDF and pictures read them."""
    whole, path = simulate(scene(keep)), tmp_path / "a.zarr"
    for pings, lines in (([3], [False, False]), ([4, 0], [False, False]), (None, [True, True])):
        record(scene(keep), path, pings=pings)
        found = open_recording(path)
        assert np.isfinite(found.recorded.values).all(axis=(1, 2)).tolist() == lines
    np.testing.assert_array_equal(found.recorded, whole.recorded)
    assert found.recorded.shape[::2] == (2, whole.sizes["time"] // 4) and found.done.values.all()
    assert ("pressure" in found) == ("pressure" in whole) == (keep == "both")
    if keep == "both":
        np.testing.assert_array_equal(found.pressure, whole.pressure)
    assert read_netcdf(write_netcdf(whole, tmp_path / "a.nc")).recorded.equals(whole.recorded)
    for ping in (None, 3):
        assert plotting.recording(path, tmp_path / f"{ping}.png", ping=ping).is_file()
    assert plotting.recording(path, tmp_path / "ground.png", ground=True).is_file()
    assert sidescan(whole, gain="none").level_db.shape[0] == (5 if keep == "both" else 2)


def test_a_line_follows_from_the_pressure_beside_it():
    """The recorder of a run is the function on arrays, with the water's sound speed and absorption."""
    scenario = scene("both")
    whole, water = simulate(scenario), {"sound_speed": scenario.water.sound_speed}
    water["absorption_db_per_m"] = float(scenario.water.absorption(scenario.sonar.pulse.frequency))
    numbers, time = record_series(whole.pressure, whole.time, scenario.sonar.recorder, **water)
    np.testing.assert_array_equal(numbers.astype(np.float32), whole.recorded)
    np.testing.assert_array_equal(time, whole.bin_time)
    expected = simulate(scene("both", field="incoherent"))
    power, _ = record_series(np.sqrt(expected.intensity), expected.time, scenario.sonar.recorder, **water)
    np.testing.assert_array_equal(power.astype(np.float32), expected.recorded)


def test_impossible_recorders_are_refused(tmp_path):
    """More pings in a line than the track has, more samples in a look than the window."""
    for stage, message in (("pings: 9", "line of 9 pings"), ("samples: 90000", "is 90000, and a line has")):
        text = (
            f"sonar: {{source_level_db: 210, pulse: {{kind: cw, frequency: 100 kHz, duration: 0.1 ms}}, "
            f"transmit: {{kind: point}}, receive: {{kind: point}}, recorder: {{stages: [{{kind: looks, {stage}}}]}}}}"
        )
        (tmp_path / "a.yaml").write_text(
            text + "\ntrack: {kind: static, position: [0 m, 0 m, 5 m], window: [0 ms, 9 ms]}"
        )
        with pytest.raises(Exception, match=message):
            load_scenario(tmp_path / "a.yaml")


WRECK = """
seed: {seed}
water: {{noise_level_db: 30 dB}}
seabed: {{depth: 12.9 m, scattering: {{sediment: medium sand}}, texture: {{k_shape: 1.2, correlation_length: 2 cm}}}}
sonar:
  source_level_db: 210 dB
  pulse: {{kind: cw, frequency: 600 kHz, duration: 0.01 ms}}
  transmit: {{kind: planar, width: 36 cm, height: 2 mm}}
  receive: {{kind: planar, width: 36 cm, height: 2 mm}}
  receiver: {{bandwidth: 80 kHz}}
  recorder: {{full_scale_db: 190 dB, stages: [{{kind: gain, tvg_db_per_decade: 40}},
    {{kind: decimation, samples: 120, keep: peak}}, {{kind: quantisation, bits: 15}}]}}
  mounting: {{bearing: 90 deg, tilt: 15 deg}}
track: {{kind: line, start: [0 m, 0 m, 10 m], heading: 0 deg, speed: 1.05 m/s, pings: 40, interval: 0.1135 s,
  window: [12.667 ms, 18.667 ms]}}
paths: {{max_reflections: 0, scatterers_per_cell: 4}}
"""
"""A sidescan of 600 kHz as the Marine Sonic HDS recorded a wreck: bins of 3 cm, lines of 12 cm, 2.9 m high."""


def patch_statistics(image):
    """Statistics of the amplitudes of one patch, less a quadratic trend, shape (pings, bins)."""
    y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in image.shape), indexing="ij")
    trend = np.stack([one.ravel() for one in (x**0, x, y, x * x, y * y, x * y)], axis=1)
    flat = image / (trend @ np.linalg.lstsq(trend, image.ravel())[0]).reshape(image.shape)
    z, log = (flat - flat.mean()) / flat.std(), np.log(np.maximum(flat, 1e-6)).ravel()
    power = flat**2
    return {
        "CV": flat.std() / flat.mean(), "skew": skew(flat.ravel()), "kurtosis": kurtosis(flat.ravel()),
        "std ln A": log.std(), "skew ln A": skew(log), "SI": power.var() / power.mean() ** 2,
        "across": (z[:, 1:] * z[:, :-1]).mean(), "along": (z[1:] * z[:-1]).mean(),
    }  # fmt: skip


MULTIBEAM = """
seed: 2
water: {noise_level_db: 30 dB}
seabed: {depth: 9.2 m, scattering: {sediment: medium sand}}
sonar:
  source_level_db: 208 dB
  pulse: {kind: cw, frequency: 300 kHz, duration: 0.1 ms}
  transmit: {kind: planar, width: 2.5 mm, height: 36 cm}
  receive: {kind: line, length: 36 cm, steer: {from: 50 deg, to: 70 deg, step: 0.5 deg}}
  receiver: {bandwidth: 30 kHz}
  recorder: {keep: recorded, stages: [{kind: gain, tvg_db_per_decade: 40, fixed_db: -160}, {kind: companding},
    {kind: quantisation, bits: 16, step_db: 0.1}]}
  mounting: {bearing: 0 deg, tilt: 90 deg}
track: {kind: line, start: [0 m, 0 m, 1 m], heading: 0 deg, speed: 2 m/s, pings: 6, interval: 0.1 s,
  window: [15 ms, 34 ms]}
paths: {max_reflections: 0, scatterers_per_cell: 4}
"""
"""Seabed image of a multibeam of 300 kHz over a flat bed, 50 to 70 deg: single samples in steps of 0.1 dB."""


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_a_seabed_image_has_the_speckle_of_one_look():
    """Re the mean of 24 neighbouring beams, in the ranges of ten lines of an EM2042: std and skew of level, CV."""
    recording = simulate(parse_model(Scenario, MULTIBEAM), threads=1)
    delay = 8.2 / np.cos(recording.steer.values) * 2 / 1500 + 5e-5
    width = 2.2e-4 * np.tan(recording.steer.values)
    power = 10 ** (recording.recorded.values / 10)
    inside = np.abs(recording.bin_time.values - delay[:, None]) < width[:, None]
    beam = np.array([[one[rows].mean() for one, rows in zip(ping, inside, strict=True)] for ping in power])
    count = len(delay)
    near = np.array([beam[:, max(0, k - 12) : k + 13].mean(axis=1) for k in range(count)]).T
    relative = np.concatenate([(ping / around[:, None])[inside] for ping, around in zip(power, near, strict=True)])
    level = 10 * np.log10(relative)
    assert 4.9 < level.std() < 6.3 and -1.3 < skew(level) < -0.8
    assert 0.90 < relative.std() / relative.mean() < 1.15


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
def test_a_sidescan_has_the_speckle_of_the_recorded_wreck():
    """600 kHz, peak of 5 samples, 15 bits: means of 4 patches, in the ranges of 6 patches of the file."""
    ranges = {
        "CV": (0.325, 0.420), "skew": (0.86, 1.91), "kurtosis": (1.0, 11.5), "std ln A": (0.317, 0.406),
        "skew ln A": (-0.24, -0.04), "SI": (0.50, 1.14), "across": (0.09, 0.215),
        "along": (-0.014, 0.06),  # 0 to 0.06 in the file, and one standard error of 4800 samples
    }  # fmt: skip
    patches = []
    for seed in range(1, 5):
        recording = simulate(parse_model(Scenario, WRECK.format(seed=seed)), threads=1)
        assert recording.recorded.shape == (40, 1, 120) and recording.recorded.attrs["units"] == "1"
        patches.append(patch_statistics(recording.recorded.values[:, 0].astype(float)))
    mean = {name: np.mean([patch[name] for patch in patches]) for name in ranges}
    for name, (low, high) in ranges.items():
        assert low <= mean[name] <= high, (name, mean[name])
