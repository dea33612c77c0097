"""Claims about recorders: closed forms of looks, gain, decimation, companding, rounding and clipping."""

import numpy as np
import pytest
import xarray as xr
from pydantic import ValidationError
from scipy.special import polygamma
from scipy.stats import skew

from insonify.processing import instrument_recording, lines_as_pings, received_level, record_series, recorded_level
from insonify.processing.recorder import recorded_time
from insonify.sonar.recorder import Recorder

TIME = np.arange(2000) * 1e-5 + 1e-3
PLAIN = {"stages": []}


def recorder(*stages, **more):
    """A recorder of some stages, each a kind and its settings."""
    return Recorder(stages=[{"kind": kind, **settings} for kind, settings in stages], **more)


def rayleigh(*shape, power=1.0, seed=1):
    """Complex Gaussian pressure of a mean intensity."""
    parts = np.random.default_rng(seed).normal(scale=np.sqrt(power / 2), size=(2, *shape))
    return parts[0] + 1j * parts[1]


@pytest.mark.parametrize("looks", [1, 2, 4, 8])
def test_the_mean_of_n_intensities_is_gamma_distributed(looks):
    """Level of Rayleigh speckle: std 10 / ln 10 sqrt(psi'(n)), skew psi''(n) / psi'(n)^1.5; 125 000 samples or more."""
    recorded, time = record_series(
        rayleigh(500, 2000), TIME, recorder(("looks", {"samples": looks}), ("companding", {}))
    )
    assert time.size == 2000 // looks and time[0] == pytest.approx(TIME[:looks].mean())
    trigamma = polygamma(1, looks)
    assert recorded.std() == pytest.approx(10 / np.log(10) * np.sqrt(trigamma), rel=0.01)
    assert skew(recorded.ravel()) == pytest.approx(polygamma(2, looks) / trigamma**1.5, abs=0.04)


def test_the_mean_of_n_amplitudes_has_the_spread_of_one_over_root_n():
    """Coefficient of variation sqrt(4 / pi - 1) / sqrt(n), of samples and of pings alike; 62 500 samples."""
    speckle = rayleigh(500, 2000)
    for stage in ({"samples": 4}, {"pings": 4}, {"samples": 2, "pings": 2}):
        recorded, _ = record_series(speckle, TIME, recorder(("looks", {"of": "amplitude", **stage})))
        assert recorded.size == speckle.size // 4
        assert recorded.std() / recorded.mean() == pytest.approx(np.sqrt(4 / np.pi - 1) / 2, rel=0.015)


@pytest.mark.parametrize("step", [1, 2, 3, 4])
def test_means_that_share_samples_are_correlated_by_the_part_they_share(step):
    """Intensities of means of 4, `step` apart: correlation (4 - step) / 4 within four standard errors."""
    recorded, _ = record_series(rayleigh(200, 2000), TIME, recorder(("looks", {"samples": 4, "step": step})))
    one, other = recorded[:, :-1].ravel() ** 2, recorded[:, 1:].ravel() ** 2
    assert np.corrcoef(one, other)[0, 1] == pytest.approx(1 - step / 4, abs=0.025)


def test_gain_is_x_log_r_plus_two_alpha_r_plus_offset():
    """Kongsberg's law, and a curve of its own on top, linear between its rows."""
    law = {"tvg_db_per_decade": 30, "absorption_db_per_m": 0.07, "fixed_db": -12.5}
    slant = TIME * 1480 / 2
    expected = 30 * np.log10(np.maximum(slant, 1)) + 0.14 * np.maximum(slant, 1) - 12.5
    for curve, more in (((), 0.0), (((2.0, 0.0), (10.0, 16.0)), np.clip(2 * (slant - 2), 0, 16))):
        gain = recorder(("gain", {**law, "curve": curve}), ("companding", {}))
        recorded, _ = record_series(np.full(TIME.size, 10.0), TIME, gain, sound_speed=1480.0)
        np.testing.assert_allclose(recorded, 20 + expected + more, atol=1e-9)
    with pytest.raises(ValidationError, match="curve: has ranges that do not increase"):
        recorder(("gain", {"curve": [(2, 0), (2, 1)]}))


@pytest.mark.parametrize("keep", ["mean", "peak", "sample"])
def test_decimation_keeps_mean_peak_or_sample(keep):
    """Mean intensity of Rayleigh speckle in parts of 5: 1, the harmonic number of 5, and 1 (40 000 parts)."""
    recorded, time = record_series(rayleigh(100, 2000), TIME, recorder(("decimation", {"samples": 400, "keep": keep})))
    assert (recorded**2).mean() == pytest.approx(sum(1 / k for k in range(1, 6)) if keep == "peak" else 1, rel=0.025)
    np.testing.assert_allclose(time, TIME.reshape(400, 5).mean(axis=1))
    constant = record_series(np.full(TIME.size, 3.0), TIME, recorder(("decimation", {"samples": 300, "keep": keep})))
    np.testing.assert_allclose(constant[0], 3)


@pytest.mark.parametrize(
    ("stages", "step"),
    [
        ([("quantisation", {"bits": 10})], 1.0),
        ([("companding", {}), ("quantisation", {"bits": 8, "step_db": 0.5})], 0.5),
    ],
)
def test_rounding_adds_a_twelfth_of_a_squared_step(stages, step):
    """Error of recorded counts and of levels in half decibels: uniform over a step, of variance step^2 / 12."""
    speckle = rayleigh(50, 2000, power=100.0)
    recorded, _ = record_series(speckle, TIME, recorder(*stages, full_scale_db=40))
    fine, _ = record_series(speckle, TIME, recorder(*stages[:-1]))
    error = (recorded - (fine * 1023 / 100 if step == 1 else fine))[np.abs(speckle) < 100]
    assert np.all(np.abs(error) <= step / 2 + 1e-9) and np.all(recorded / step % 1 == 0)
    assert error.var() == pytest.approx(step**2 / 12, rel=0.02)


@pytest.mark.parametrize("full_scale_db", [-6, 0, 3])
def test_the_clipped_part_of_speckle_is_exponential(full_scale_db):
    """Rayleigh amplitudes beyond full scale F: exp(-F^2 / mean intensity), within four standard errors."""
    part = np.exp(-(10 ** (full_scale_db / 10)))
    for stages in ([("clipping", {})], [("quantisation", {"bits": 16})], [("companding", {"law": "mu"})]):
        recorded, _ = record_series(rayleigh(100, 2000), TIME, recorder(*stages, full_scale_db=full_scale_db))
        tolerance = 4 * np.sqrt(part * (1 - part) / recorded.size) + 1e-4
        assert np.mean(recorded >= recorded.max() * (1 - 1e-12)) == pytest.approx(part, abs=tolerance)


@pytest.mark.parametrize(
    ("stages", "error"),
    [
        ([], 1e-9), ([("companding", {})], 1e-9), ([("companding", {"law": "gamma", "gamma": 0.4})], 1e-9),
        ([("companding", {"law": "mu", "mu": 100})], 1e-9), ([("quantisation", {"bits": 24})], 1e-2),
        ([("companding", {}), ("quantisation", {"bits": 10, "step_db": 0.5})], 0.25 + 1e-9),
        ([("companding", {"law": "gamma"}), ("quantisation", {"bits": 16})], 0.02),
        ([("quantisation", {"bits": 24}), ("companding", {"law": "mu"}), ("quantisation", {"bits": 16})], 0.02),
    ],
)  # fmt: skip
def test_companding_and_gain_are_undone(stages, error):
    """Level before the recorder, of levels from 60 to 118 dB under a full scale of 150 dB behind the gain."""
    level, time = np.linspace(60, 118, 200), np.linspace(2e-3, 20e-3, 200)
    gain = ("gain", {"tvg_db_per_decade": 20, "absorption_db_per_m": 0.1, "fixed_db": 3})
    chain = recorder(gain, *stages, full_scale_db=150)
    recorded, _ = record_series(10 ** (level / 20), time, chain)
    np.testing.assert_allclose(received_level(recorded, time, chain), level, atol=error)


def test_a_recording_keeps_its_pressure_or_leaves_it():
    """Lines over (line, channel, bin) beside the pressure, or alone; for levels and images, lines are pings."""
    pressure = rayleigh(5, 2, TIME.size).astype(np.complex64)
    recording = xr.Dataset(
        {"pressure": (("ping", "channel", "time"), pressure), "steer": ("channel", np.zeros(2))},
        {"time": TIME, "ping": [3, 4, 5, 6, 7]},
    )
    chain = recorder(("looks", {"samples": 4, "pings": 2}), ("companding", {}))
    both, alone = (instrument_recording(recording, chain.model_copy(update={"keep": k})) for k in ("both", "recorded"))
    assert both.pressure.equals(recording.pressure) and "pressure" not in alone
    assert both.recorded.shape == (2, 2, 500) and both.line_ping.values.tolist() == [3, 5]
    np.testing.assert_array_equal(both.bin_time, recorded_time(TIME, chain))
    by_hand = (np.abs(pressure[:4].reshape(2, 2, 2, 500, 4)) ** 2).mean(axis=(1, 4))
    np.testing.assert_allclose(10 ** (both.recorded / 10), by_hand, rtol=1e-5)
    lines = lines_as_pings(alone)
    assert lines.recorded.dims == ("ping", "channel", "time") and lines.ping.values.tolist() == [3, 5]
    assert recorded_level(lines).equals(lines.recorded) and recorded_level(lines).attrs["units"] == "dB re 1 uPa"


@pytest.mark.parametrize(
    ("stages", "message"),
    [
        ([("companding", {}), ("gain", {})], "gain comes after companding"),
        ([("quantisation", {"bits": 8}), ("gain", {})], "full_scale_db: is missing"),
        ([("clipping", {})], "full_scale_db: is missing"),
        ([("companding", {}), ("quantisation", {"bits": 8})], "belongs to levels"),
        ([("quantisation", {"bits": 8, "step_db": 0.5})], "belongs to levels"),
        ([("companding", {}), ("companding", {})], "companding comes after companding"),
    ],
)
def test_stages_in_an_impossible_order_are_refused(stages, message):
    """The message names the stage and gives the remedy."""
    with pytest.raises(ValidationError, match=message):
        recorder(*stages)
    with pytest.raises(ValidationError, match="gain comes after quantisation"):
        recorder(("quantisation", {"bits": 8}), ("gain", {}), full_scale_db=100)


def test_more_looks_than_samples_are_refused():
    """Plain arrays: the message has both numbers."""
    for stage in (("looks", {"samples": 3000}), ("decimation", {"samples": 3000, "keep": "sample"})):
        with pytest.raises(ValueError, match="is 3000, and a line has 2000"):
            record_series(rayleigh(1, 2000), TIME, recorder(stage))
