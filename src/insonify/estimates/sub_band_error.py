"""Error of taking beams and absorption at a few frequencies of the band only, and the number that would suffice.

The error is that of reverberation: rms over all directions that the beams receive, alike at all azimuths, and over the
pulse's spectrum, at the end of the window, where absorption differs most between frequencies.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.sonar.beam import beams
from insonify.sonar.hydrophones import one_element
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.sonar import Sonar
from insonify.sonar.sub_bands import band_nodes, half_bandwidth, lagrange_weights
from insonify.synthesis.element_arrivals import relative_absorption

Floats = NDArray[np.float64]

ENOUGH_DB = -40.0
"""Error that is small beside speckle and beside the uncertainty of any array [dB]."""
TRIED = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32)
"""Numbers of sub-bands [1]."""
_FREQUENCIES, _AZIMUTHS, _FAINT = 33, 14_400, 1e-2
_ELEVATIONS = np.radians([-20.0, -5.0, 0.0, 5.0, 20.0, 45.0])


@dataclass(frozen=True, slots=True)
class SubBandError:
    """Error of a recording because beams and absorption are not taken at every frequency."""

    sub_bands: int
    """Number of sub-bands of the scenario."""
    error_db: float
    """Their rms error relative to the rms of the sound [dB]."""
    enough: int | None
    """Least of `TRIED` that reach `ENOUGH_DB`; None: none does."""

    def summary(self) -> str:
        """Message on the error; empty where the scenario needs no change."""
        if self.error_db <= ENOUGH_DB:
            return ""
        has = "one frequency serves" if self.sub_bands == 1 else f"{self.sub_bands} frequencies serve"
        found = f"{has} the whole band, which is {self.error_db:.0f} dB off: beams and absorption change across it"
        if self.enough is None:
            return f"{found}; no number of sub-bands up to {TRIED[-1]} reaches {ENOUGH_DB:.0f} dB"
        return f"{found}; sonar.receiver.sub_bands: {self.enough} would reach {ENOUGH_DB:.0f} dB"


def estimate_sub_band_error(scenario: Scenario) -> SubBandError:
    """Estimate the error of a scenario's sub-bands.

    Args:
        scenario: The scenario; its first ping is evaluated.
    """
    simulator, chosen = build_simulator(scenario), scenario.sonar.receiver.sub_bands
    side, geometry = scenario.sonar.side_sonars[0], simulator.ping_geometries(0)[0]
    direction, edge = _insonified_directions(geometry), half_bandwidth(geometry.pulse)
    offset = np.linspace(-edge, edge, _FREQUENCIES)
    power = np.abs(geometry.pulse.spectrum(offset)) ** 2
    known = np.array([_response(scenario, side, geometry, direction, f) for f in offset])
    whole = float(np.sum(power[:, None] * known**2))

    def error(count: int) -> float:
        node = band_nodes(geometry.pulse, count)
        at = np.array([_response(scenario, side, geometry, direction, f) for f in node])
        guess = lagrange_weights(node, offset).T @ at
        return float(np.sum(power[:, None] * (known - guess) ** 2)) / whole

    own = _db(error(chosen))
    enough = chosen if own <= ENOUGH_DB else next((k for k in TRIED if _db(error(k)) <= ENOUGH_DB), None)
    return SubBandError(chosen, own, enough)


def _insonified_directions(ping_geometry: PingGeometry) -> Floats:
    """Directions that both beams receive, shape (n, 3)."""
    azimuth, down = np.meshgrid(np.linspace(-np.pi, np.pi, _AZIMUTHS, endpoint=False), _ELEVATIONS)
    level = np.cos(down)
    direction = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(down)], axis=-1).reshape(-1, 3)
    both = np.abs(
        ping_geometry.transmit_beams.single_beam(0).gain(direction)[0]
        * ping_geometry.receive_beams.single_beam(0).gain(direction)[0]
    )
    return np.asarray(direction[both >= _FAINT * both.max()])


def _response(scenario: Scenario, side: Sonar, geometry: PingGeometry, direction: Floats, offset: float) -> Floats:
    """Pressure at one frequency in those directions, through both beams and the water to the end of the window [1]."""
    frequency = geometry.frequency + offset
    receive_array = one_element(side.receive) if geometry.elements is not None else side.beam_arrays[-1]
    gain = np.ones(len(direction))
    for array in (side.beam_arrays[0], receive_array):
        gain = (
            gain
            * beams(array, frequency, geometry.sound_speed, geometry.transmit_beams.axes)
            .single_beam(0)
            .gain(direction)[0]
        )
    length = np.full(1, geometry.sound_speed * geometry.window[1])
    return np.asarray(gain * relative_absorption(length, float(offset), geometry.frequency, scenario.water))


def _db(power: float) -> float:
    return float(10 * np.log10(max(power, 1e-30)))
