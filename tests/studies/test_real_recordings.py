"""The studies of real recordings: their statistics against closed forms, and the recordings where they are at hand."""

import numpy as np
import pytest

from insonify.studies import echosounder_noise, real_recordings, sidescan_wreck
from insonify.studies import harbour_angular_response as angular
from insonify.studies import harbour_echo_trains as trains
from insonify.studies import two_headed_angular_response as heads
from oracles.instrument_files import DATA


def test_speckle_of_single_looks_is_rayleigh() -> None:
    """Exponential intensities: 10 log10(e) pi / sqrt(6) = 5.57 dB and skew -1.14, widened by the mean of neighbours."""
    angle, rng = np.linspace(40, 75, 20_000), np.random.default_rng(2)
    level = angular.speckle(angle, 10 * np.log10(rng.exponential(size=angle.size)))
    spread, skew, variation = angular.speckle_moments([level])
    own = (10 / np.log(10)) ** 2 * np.pi**2 / 6
    neighbours = (10 / np.log(10)) ** 2 / angular.NEIGHBOURS  # variance of the level of a mean of n looks, large n
    assert spread == pytest.approx(np.sqrt(own + neighbours), abs=0.1)
    assert skew == pytest.approx(-1.14, abs=0.12)
    assert variation == pytest.approx(np.sqrt(1 + 2 / angular.NEIGHBOURS), abs=0.1)


def test_insonified_area_is_limited_by_pulse_or_beam() -> None:
    """Oblique: width x range x pulse / sine; vertical: the beam's footprint."""
    slant, angle, length = np.array([10.0, 8.0]), np.array([60.0, 0.0]), np.array([0.05, 0.05])
    found = 10 ** (angular._area_db(slant, angle, 0.02, 0.03, length) / 10)
    assert found == pytest.approx([0.02 * 10 * 0.05 / np.sin(np.pi / 3), 0.02 * 0.03 * 64])


def test_energy_in_the_gate_is_that_of_the_echo() -> None:
    """A constant level over 0.2 m within the gate has 0.2 of the energy of one over a metre."""
    slant = np.arange(0, 10, 0.001)
    level = np.where(np.abs(slant - 5) < 0.1, -20.0, -300.0)
    assert trains._gated(slant, level, 5.0) == pytest.approx(-20 + 10 * np.log10(0.2), abs=0.03)


def test_a_perfect_mirror_has_an_apparent_reflection_of_zero() -> None:
    """A bed that mirrors all: the echo's apparent reflection is 0 dB, spreading and absorption undone."""
    import insonify

    scenario = insonify.load_scenario("examples/nominal.yaml").with_({
        "targets": [], "seabed.scattering": None, "seabed.reflection": 1.0, "surface.reflection": "flat",
        "surface.wind_speed": None, "paths.families": ["D", "B"], "sonar.mounting.tilt": "90 deg",
        "water.sound_speed": trains.SOUND_SPEED, "sonar.transmit": {"kind": "point"},
        "sonar.receive": {"kind": "point"},
        "track.window": ["5 ms", "25 ms"], "sonar.pulse.taper": "hann", "sonar.pulse.duration": "0.5 ms",
    })  # fmt: skip
    slant, level = trains._apparent(insonify.simulate(scenario), scenario)
    peak = int(np.argmax(level))
    assert slant[peak] == pytest.approx(9 + 0.5e-3 / 2 * trains.SOUND_SPEED / 2, abs=0.05)  # the middle of the pulse
    assert level[peak] - 20 * np.log10(slant[peak] / 9) == pytest.approx(0, abs=0.1)


def test_echoes_at_multiples_of_the_first_range_are_not_late() -> None:
    """Leading edges at 5, 10 and 15.2 m: 0, 0 and 0.2 m late, to a twentieth of a sample of 1 cm."""
    slant = np.arange(0, 20, 0.01)
    pulses = [np.clip(1 - np.abs(slant - (edge + 0.05)) / 0.1, 0, 1) for edge in (5.0, 10.0, 15.2)]
    level = 20 * np.log10(np.maximum(np.max(pulses, axis=0), 1e-9))
    assert trains._train(slant, level, 5.02)[1] == pytest.approx([0, 0, 0.2], abs=5e-4)


def test_a_ping_with_foreign_sounds_between_the_echoes_is_left_out() -> None:
    """Two pings at -100 dB, one of them at -70 dB about 2.6 times the first range."""
    slant = np.arange(0, 20, 0.01)
    level = np.full((2, slant.size), -100.0)
    level[0, np.abs(slant - 13) < 0.5] = -70.0
    assert trains.without_interference(slant, level, 5.0).tolist() == [False, True]


def test_filtered_noise_has_the_bandwidth_of_its_filter() -> None:
    """White noise behind a mean of n = 8: squared triangular correlation, 3 n / (2 n^2 + 1) of the rate; index 1."""
    rng = np.random.default_rng(3)
    white = rng.normal(size=(2, 4, 40_000))
    field = np.apply_along_axis(np.convolve, -1, white[0] + 1j * white[1], np.ones(8) / 8, "valid")
    found = echosounder_noise.noise_of(field, 10e-6)
    assert found.bandwidth == pytest.approx(3 * 8 / (2 * 8**2 + 1) * 1e5, rel=0.03)
    assert found.index == pytest.approx(1, abs=0.03)


def test_peaks_of_rayleigh_samples_have_the_moments_of_their_closed_form() -> None:
    """The mean intensity of a peak of 5 is 1 + 1/2 + ... + 1/5; a trend over a patch changes no moment."""
    rng = np.random.default_rng(4)
    peak = np.sqrt(rng.exponential(size=(5, 200, 200)).max(axis=0))
    assert np.mean(peak**2) == pytest.approx(137 / 60, rel=0.02)
    flat, trend = sidescan_wreck._patch(peak), sidescan_wreck._patch(peak * np.linspace(1, 2, 200))
    assert trend[:4] == pytest.approx(flat[:4], abs=0.02)
    assert flat[4:] == pytest.approx((0, 0), abs=0.02)


def test_soundings_of_a_transducer_beside_the_antenna_have_angles_of_their_own() -> None:
    """3 m to port of an antenna and 4 m down, of a transducer on the sounding's line: vertical."""
    import xarray as xr

    one = {"starboard": [[-3.0, 1.0]], "forward": [[8.0, 8.0]], "down": [[4.0, 4.0]]}
    found = heads.signed_angle(
        xr.Dataset({k: (("ping", "beam"), v) for k, v in one.items()}), np.array([8.0, -3.0, 0.0])
    )
    assert found == pytest.approx(np.array([[0.0, 45.0]]))


def test_verdicts_name_what_fails() -> None:
    """Differences of 1 and 4 dB against a limit of 2 dB: one of two angles within."""
    difference = np.where(np.isin(angular.ANGLES, [20.0, 30.0]), 0.0, np.nan)
    real = difference.copy()
    simulated = difference + np.where(angular.ANGLES == 20, 1.0, 4.0)
    one = angular.Response("300", real, real, simulated)
    verdict = real_recordings.angle_verdict("sonar", angular.AngularResults([one], "sand", {}, [], []))
    assert not verdict.holds and verdict.found.startswith("1 of 2 within") and "at most 4.0 dB" in verdict.found


def test_the_noise_of_a_real_echosounder_is_that_behind_its_filters() -> None:
    """EK80 at 333 kHz: fitted to one ping, the other within 2 dB; bandwidth of the stated filters within 10 %."""
    if not (DATA / "real" / trains.FILE).is_file():
        pytest.skip(f"{trains.FILE}, a public recording, is not in the folder INSONIFY_DATA")
    noise = echosounder_noise.evaluate(DATA / "real")
    assert abs(noise.predicted.level_db - noise.simulated.level_db) < 2
    assert noise.fitted.bandwidth == pytest.approx(noise.filtered.bandwidth, rel=0.1)
