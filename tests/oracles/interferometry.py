"""What two receivers one above the other receive of a flat bed, on the average: the integral over the footprint.

Of E[s1 s2*] only the scatterers' own products are left, so it is an integral over the bed: of both pulses, both
delays, spreading and law. Shares no code with the project.
"""

import numpy as np

from insonify.scenario.scenario import Scenario
from oracles.time_series import pulse_spectrum

SPEED, CARRIER, ALTITUDE, TILT, LENGTH = 1500.0, 150e3, 9.0, np.radians(35), 0.3
WAVE = SPEED / CARRIER


def surveyed(baselines, pulse, band, window, *, pings, hop=2.0, paths=None, receiver=None, **top):
    """A sonar 9 m above a flat bed that looks 35 degrees down to starboard; each ping covers ground of its own.

    Args:
        baselines: Distances of pairs of receivers about one middle [wavelengths]; the upper one comes first.
        pulse: Changes to a pulse at 150 kHz.
        band: Bandwidth of the receiver [Hz].
        window: Recorded [s].
        pings: Number of pings.
        hop: Distance between pings [m].
        paths: Changes to the choice of paths.
        receiver: Changes to the receiver.
        top: Changes to the scenario itself.
    """
    places = [(0.0, 0.0, sign * waves * WAVE / 2) for waves in baselines for sign in (-1, 1)]
    line = {"kind": "line", "length": LENGTH}
    described = {
        "water": {"sound_speed": SPEED, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35},
        "sonar": {
            "source_level_db": 200,
            "pulse": {"frequency": CARRIER, **pulse},
            "transmit": line,
            "receive": {"kind": "elements", "positions": places, "size": (LENGTH, 0.0)},
            "receiver": {"bandwidth": band, "record": "elements", **(receiver or {})},
            "mounting": {"tilt": TILT},
        },
        "track": {
            "kind": "line",
            "start": (0.0, 0.0, 20.0 - ALTITUDE),
            "speed": hop,
            "interval": 1.0,
            "pings": pings,
            "window": window,
            "stop_and_hop": True,
        },
        "paths": {
            "max_reflections": 0,
            "contributions": ["seabed"],
            "edge_diffraction": "none",
            "beam_cutoff_db": -30,
            **(paths or {}),
        },
        **top,
    }
    return Scenario(**described)


def tone(duration, band):
    """A tone after the receiver's band: a function of time."""
    offset = np.linspace(-0.625, 0.625, 1001) * band
    spectrum = pulse_spectrum(offset, duration=duration, fraction=0.1, bandwidth=0.0, band=band, matched_filter=False)
    time = np.linspace(-3 / band, duration + 3 / band, 1001)
    value = np.exp(2j * np.pi * np.outer(time, offset)) @ spectrum * (offset[1] - offset[0])
    return lambda t: np.interp(t, time, value.real, 0, 0) + 1j * np.interp(t, time, value.imag, 0, 0)


def footprint(time, waves, pulse, duration):
    """E[s1 s2*], E|s1|^2 and E|s2|^2 over time of the upper and the lower receiver, in one unit, each (time,).

    Args:
        time: After the start of transmission [s], shape (time,).
        waves: Distance of the receivers [wavelengths].
        pulse: As received, a function of time.
        duration: Duration of the pulse [s].
    """
    up = np.array([0.0, np.sin(TILT), -np.cos(TILT)]) * waves * WAVE / 2
    azimuth, held = np.linspace(-1, 1, 15) * np.arcsin(WAVE / LENGTH), []
    for now in time:
        edge = SPEED / 2 * np.array([now - duration - 4e-4, now + 4e-4])
        # a ring of slant ranges: the area of r dr dazimuth over the cosine of the grazing angle lies level
        slant = np.linspace(max(edge[0], ALTITUDE * 1.0001), edge[1], 601)[:, None]
        level = np.sqrt(slant**2 - ALTITUDE**2)
        place = np.stack([level * np.sin(azimuth), level * np.cos(azimuth), 0 * level * azimuth + ALTITUDE], axis=-1)
        beam = np.sinc(LENGTH / WAVE * place[..., 0] / slant) ** 4
        weight = beam * (ALTITUDE / slant) ** 2 / slant**4 * slant
        tau = [(slant + np.linalg.norm(place - side * up, axis=-1)) / SPEED for side in (1, -1)]
        received = [pulse(now - late) * np.exp(-2j * np.pi * CARRIER * (late - tau[0])) for late in tau]
        held.append(
            [
                np.sum(weight * a * np.conj(b))
                for a, b in ((received[0], received[1]), received[:1] * 2, received[1:] * 2)
            ]
        )
    cross, upper, lower = np.array(held).T
    return cross, upper.real, lower.real
