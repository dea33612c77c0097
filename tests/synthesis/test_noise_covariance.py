"""What channels receive alike of noise from many directions."""

import numpy as np
import pytest
from scipy.special import j1

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.synthesis.noise_covariance import _closed_form, _direction_average, covariance_factor, noise_covariance
from oracles.arrays import elements_scenario

WAVELENGTH = 0.015


def ping_geometry(receive, record="elements", **track):
    """A sonar at rest whose wavelength is 15 mm."""
    settings = {"speed": 0.0, "heading": 0.4, **track}
    return build_simulator(
        elements_scenario([], receive=receive, receiver={"record": record}, track=settings)
    ).ping_geometry(0)


def line(count, pitch, **more):
    """A line of elements so many wavelengths apart."""
    return {"kind": "line", "length": count * pitch * WAVELENGTH, "elements": count, "element": "omni", **more}


def test_noise_has_the_wavelength_at_the_receiver():
    """A receiver in slower water than its transmitter's: sin kd / kd with its own k, all ways to 1e-6."""
    profile = [[0, 1550.0], [5, 1550.0], [8, 1450.0], [20, 1450.0]]
    values = elements_scenario([], receive=line(6, 0.5), track={"speed": 0.0}).model_dump(mode="json")
    fixed = {"kind": "static", "position": (30.0, 0.0, 12.0)}
    values |= {"water": {"profile": profile, "noise_level_db": None}, "receiver_track": fixed,
             "track": {**values["track"], "start": (0.0, 0.0, 4.0)}}  # fmt: skip
    here = build_simulator(Scenario.model_validate(values)).ping_geometry(0)
    place = here.elements.positions
    apart = np.linalg.norm(place[:, None] - place, axis=-1)
    for found in (_closed_form(here), _direction_average(here, "isotropic")):
        np.testing.assert_allclose(found, np.sinc(2 * apart * 100e3 / 1450), atol=1e-6)


def phases(here):
    """Wavenumber times distance of each pair."""
    place = here.elements.positions
    return 2 * np.pi / WAVELENGTH * np.linalg.norm(place[:, None] - place, axis=-1)


SCATTERED = (0.004 * np.random.default_rng(2).normal(size=(7, 3))).tolist()


@pytest.mark.parametrize(
    "receive",
    [
        line(9, 0.4),
        line(9, 0.4, element="baffled"),
        line(9, 0.7, element="cosine"),
        {"kind": "planar", "width": 0.03, "height": 0.02, "columns": 4, "rows": 3, "element": "cosine"},
        {"kind": "elements", "positions": SCATTERED, "element": "omni"},
        {"kind": "arc", "radius": 0.04, "arc_angle": 2.0, "elements": 7, "element": "omni"},
    ],
    ids=lambda values: f"{values['kind']} {values['element']}",
)  # fmt: skip
def test_closed_forms_are_the_mean_over_directions(receive):
    """Sin x / x, half of it behind a baffle, j1(x) / 2 x with cosines: two ways that share no code, 1e-9."""
    here = ping_geometry(receive)
    closed = _closed_form(here)
    assert np.abs(closed - _direction_average(here, "isotropic")).max() < 1e-9
    if receive["element"] == "omni":
        assert np.abs(closed - np.sinc(phases(here) / np.pi)).max() < 1e-12


@pytest.mark.parametrize("heading", [0.0, 1.0])
def test_noise_of_the_surface_is_that_of_its_dipoles(heading):
    """Cron & Sherman (1962): side by side 2 J1(x) / x, one above the other 2 (sin x / x + (cos x - 1) / x^2), 1e-4."""
    level = ping_geometry(line(8, 0.4), heading=heading)
    x = np.where(phases(level) > 0, phases(level), 1.0)
    side = np.where(phases(level) > 0, 2 * j1(x) / x, 1.0)
    assert np.abs(noise_covariance(level, "surface") - side).max() < 1e-4
    post = {
        "kind": "elements",
        "element": "omni",
        "positions": [(0.0, 0.0, 0.3 * WAVELENGTH * row) for row in range(6)],
    }
    above = ping_geometry(post, heading=heading)
    x = np.where(phases(above) > 0, phases(above), 1.0)
    real = np.where(phases(above) > 0, 2 * (np.sin(x) / x + (np.cos(x) - 1) / x**2), 1.0)
    found = noise_covariance(above, "surface")
    assert np.abs(found.real - real).max() < 1e-4
    # it comes from above: the deeper element receives it later
    assert found[1, 0].imag < -0.5


def test_elements_that_face_aside_share_the_directions_that_both_face():
    """Baffled elements of an arc, against 200 000 directions spread evenly: 3e-3.

    Each alone receives half of it all.
    """
    here = ping_geometry({"kind": "arc", "radius": 0.03, "arc_angle": 2.5, "elements": 6, "element": "baffled"})
    count = 200_000
    down = 1 - (2 * np.arange(count) + 1) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    ring = np.sqrt(1 - down**2)
    ways = np.stack([ring * np.cos(turn), ring * np.sin(turn), down], axis=1)
    facing = here.elements.orientations
    faced = np.stack([np.cos(facing), np.sin(facing), 0 * facing]).T @ ways.T > 0
    received = faced * np.exp(2j * np.pi / WAVELENGTH * (here.elements.positions @ ways.T))
    brute = received @ received.conj().T / count
    found = noise_covariance(here, "isotropic")
    assert np.abs(found - brute).max() < 3e-3
    assert np.diag(found).real == pytest.approx(0.5, abs=1e-12)


def test_half_wave_lines_gain_ten_log_m_wherever_they_look():
    """Enoch (1973): elements whole half-waves apart gain 10 log M, steered or not. 16 of them: 12.04 dB, 1e-3."""
    here = ping_geometry(line(16, 0.5, steer=[0.0, 0.3, 0.9]), "beams")
    power = np.diag(noise_covariance(here, "isotropic")).real
    assert 10 * np.log10(power) == pytest.approx(-10 * np.log10(16), abs=1e-3)


@pytest.mark.parametrize("element", ["omni", "baffled"])
def test_beams_receive_what_their_elements_would_after_delay_and_sum(element):
    """Levels and correlation of beams, from their patterns, are w* C w of the elements: 1e-5 of the power."""
    array = line(24, 0.3, element=element, shading="hamming")
    steers = [0.0, 0.05, -0.4]
    beams = noise_covariance(ping_geometry({**array, "steer": steers}, "beams"), "isotropic")
    elements = ping_geometry(array)
    place = elements.elements.positions[:, 1]
    weight = 0.54 + 0.46 * np.cos(2 * np.pi * place / array["length"])
    turned = np.exp(-2j * np.pi / WAVELENGTH * np.outer(np.sin(steers), place)) * weight / weight.sum()
    summed = turned @ noise_covariance(elements, "isotropic") @ turned.conj().T
    assert np.abs(beams - summed).max() < 1e-5 * np.abs(summed).max()


def test_a_continuous_line_gains_twice_its_length_in_wavelengths():
    """DI = 10 log (2 L / wavelength) for a long line, 3 dB more behind a baffle: 100 wavelengths, 0.01 dB."""
    here = ping_geometry({"kind": "line", "length": 1.5}, "beams")
    power = noise_covariance(here, "isotropic")[0, 0].real
    assert -10 * np.log10(power) == pytest.approx(10 * np.log10(2 * 2 * 100), abs=0.01)


def test_a_factor_gives_its_covariance_back_even_where_elements_crowd():
    """40 elements in one wavelength receive nearly the same: the factor's square is their covariance within 1e-8."""
    covariance = noise_covariance(ping_geometry(line(40, 0.025)), "isotropic")
    lower = covariance_factor(covariance)
    assert np.abs(lower @ lower.conj().T - covariance).max() < 1e-8
    assert np.array_equal(lower, np.tril(lower))
