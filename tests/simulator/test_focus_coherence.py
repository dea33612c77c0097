"""Claims about how alike what two elements receive is: van Cittert and Zernike, displaced phase centres."""

from functools import partial

import numpy as np
import pytest

from insonify.processing import complex_coherence, compressed_recording
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles.aperture import ALTITUDE, CARRIER, ELEMENT, SPEED, band, strip

SENDER = 0.5
"""Length of the transmitter of the van Cittert-Zernike scenes [m]."""
APART = (0.05, 0.2, 0.3, 0.4, 0.5, 0.6)
"""Distances of pairs of receivers about the transmitter's middle [m]."""


def pairs(shading, pings, floor_db=-30):
    """Pairs of points along the track receive a flat bed from 30 to 97 m; each ping covers ground of its own."""
    places = [(0.0, sign * apart / 2, 0.0) for apart in APART for sign in (-1, 1)]
    described = {
        "water": {"sound_speed": SPEED, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35},
        "sonar": {
            "source_level_db": 200,
            "pulse": {"kind": "cw", "frequency": 100e3, "duration": 0.4e-3},
            "transmit": {"kind": "line", "length": SENDER, "shading": shading},
            "receive": {"kind": "elements", "positions": places, "element": "omni"},
            "receiver": {"bandwidth": 6e3, "record": "elements"},
        },
        "track": {
            "kind": "line",
            "start": (0.0, 0.0, 11.0),
            "speed": 10.0,
            "interval": 1.0,
            "pings": pings,
            "window": (0.04, 0.13),
            "stop_and_hop": True,
        },
        "paths": {
            "max_reflections": 0,
            "contributions": ["seabed"],
            "edge_diffraction": "none",
            "beam_cutoff_db": floor_db,
            "scatterers_per_cell": 2,
        },
    }
    held = simulate(Scenario(**described)).pressure.values
    level = held / np.sqrt(np.mean(np.abs(held) ** 2, axis=(0, 1)))
    return np.array(
        [complex_coherence(level[:, 2 * n].ravel(), level[:, 2 * n + 1].ravel()) for n in range(len(APART))]
    )


def autocorrelation(shading):
    """Of the transmitter's weights, at the distances of the pairs [1]."""
    place = (np.arange(2000) + 0.5) / 2000 - 0.5
    weight = {"uniform": np.ones(2000), "hann": np.cos(np.pi * place) ** 2}[shading]
    whole = np.correlate(weight, weight, "full")[1999:] / np.sum(weight**2)
    return np.interp(APART, np.arange(2000) / 2000 * SENDER, whole, right=0.0)


@pytest.mark.parametrize("shading", ["uniform", "hann"])
def test_neighbours_are_as_alike_as_the_transmitter_is_to_itself_moved(shading):
    """Van Cittert & Zernike: coherence is the autocorrelation of the transmitter's weights: a triangle if uniform.

    About 220 looks to a ping; of N looks a coherence g is known to (1 - g^2) / sqrt(2 N): six pings, 0.02, and three of
    that are allowed. Its phase is none. Source: Mallart & Fink (1991), J. Acoust. Soc. Am. 90(5), not verified.
    """
    np.testing.assert_allclose(pairs(shading, 6), autocorrelation(shading), atol=0.06)


@pytest.mark.validate
@pytest.mark.parametrize("shading", ["uniform", "hann"])
def test_neighbours_are_as_alike_as_the_transmitter_is_to_itself_moved_closely(shading):
    """The same over 40 pings, 8800 looks, with the side lobes down to -45 dB: 0.0075 standard error, within 0.03."""
    np.testing.assert_allclose(pairs(shading, 40, -45), autocorrelation(shading), atol=0.03)


def displaced(apart, seed=1, pings=1, window=(0.0370, 0.0435)):
    """Series of a bed at 30 m; the transmitter is `apart` ahead of the phase centre, the receiver as much behind it."""
    ends = {
        "transmit": {"kind": "line", "length": ELEMENT, "offset": (apart, 0.0, 0.0)},
        "receive": {"kind": "elements", "positions": [(0, 0, 0)], "size": (ELEMENT, 0.0), "offset": (-apart, 0.0, 0.0)},
    }
    track = {"start": (0.0, 0.0, 20.0 - ALTITUDE), "speed": 70.0, "pings": pings, "window": window}
    scenario = strip(sonar=ends, track=track, paths={"contributions": ["seabed"], "beam_cutoff_db": -40}, seed=seed)
    held = compressed_recording(simulate(scenario), scenario.sonar.pulse, window="hamming").pressure.values[:, 0]
    return held[:, 10:-60].ravel()  # the last echoes are cut off within the pulse


def parallax(apart):
    """Coherence of one bed received from one phase centre with both ends there and `apart` from it: the integral."""
    offset, spectrum = band(61)
    power = np.abs(spectrum * (0.54 + 0.46 * np.cos(2 * np.pi * offset / 30e3))) ** 2 * (np.abs(offset) < 15e3)
    along, places, sums = np.linspace(-12, 12, 6001)[:, None], np.array([-apart, 0.0, apart]), np.zeros(3, complex)
    for slant in np.linspace(27.9, 31.7, 13):
        ends = np.hypot(along - places, slant)
        gain = np.sinc(ELEMENT * CARRIER / SPEED * (along - places) / ends)
        two, one = gain[:, 0] * gain[:, 2], gain[:, 1] ** 2
        late = (ends[:, 0] + ends[:, 2] - 2 * ends[:, 1]) / SPEED
        turned = np.exp(-2j * np.pi * np.multiply.outer(late, CARRIER + offset)) @ power / power.sum()
        sums += [np.sum(two * one * turned), np.sum(two**2), np.sum(one**2)]
    return abs(sums[0]) / np.sqrt(abs(sums[1] * sums[2]))


def test_displaced_ends_with_one_phase_centre_receive_one_speckle():
    """Ends 20 cm ahead and behind at 30 m: coherence at least 0.995; as the integral over the beams states, to 0.005.

    What is lost is the parallax (2 d)^2 / 4 R: its delay and, over 3.8 m of range, its phase. About 100 looks: known to
    1e-4 at 20 cm, to 1.7e-3 at 40 cm.
    """
    here = displaced(0.0)
    found = {apart: abs(complex_coherence(here, displaced(apart))) for apart in (0.2, 0.4)}
    assert found[0.2] >= 0.995
    for apart, coherence in found.items():
        assert coherence == pytest.approx(parallax(apart), abs=0.005)


def test_another_bed_has_another_speckle():
    """Fresh scatterers: under 0.05, which 4000 looks (eight pings of 17 m) exceed once in 10 000 times."""
    receive = partial(displaced, pings=8, window=(0.037, 0.060))
    assert abs(complex_coherence(receive(0.0, seed=1), receive(0.2, seed=2))) < 0.05
