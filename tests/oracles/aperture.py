"""Synthetic apertures over a flat bed: scenes to record, and images summed by frequency, ping and element in float64.

The sums share no code with the project: pulse and band by quadrature, beams at every frequency, every pixel by itself.
"""

import numpy as np

from insonify.scenario.scenario import Scenario
from oracles.time_series import pulse_spectrum

SPEED, CARRIER, ELEMENT = 1500.0, 150e3, 0.1
SWEEP = {"kind": "lfm", "frequency": CARRIER, "bandwidth": 30e3, "duration": 1e-3}
BAND = 40e3
ALTITUDE, SLANT = 9.0, 30.0
GROUND = float(np.sqrt(SLANT**2 - ALTITUDE**2))
PLACES = (np.arange(4) - 1.5) * ELEMENT
"""Of four elements, ahead of the array's middle, from which they are sent to [m]."""


def strip(targets=(), *, places=PLACES, track=None, sonar=None, receiver=None, paths=None, **top):
    """A sonar 9 m above the bed that looks to starboard and records its elements: two phase centres to an element.

    Args:
        targets: Places of point targets of 0 dB: north, east, depth.
        places: Positions of the elements, ahead of the array's middle [m].
        track: Changes to the track: 36 pings over 7 m north, stop and hop.
        sonar: Changes to the sonar.
        receiver: Changes to the receiver.
        paths: Changes to the choice of paths.
        top: Changes to the scenario itself.
    """
    row = [(0.0, -float(ahead), 0.0) for ahead in places]  # facing starboard, the right is astern
    described = {
        "water": {"sound_speed": SPEED, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35},
        "targets": [
            {"shape": "point", "label": f"t{n}", "target_strength_db": 0.0, "position": tuple(map(float, place))}
            for n, place in enumerate(targets)
        ],
        "sonar": {
            "source_level_db": 200, "pulse": SWEEP, "transmit": {"kind": "line", "length": ELEMENT},
            "receive": {"kind": "elements", "positions": row, "size": (ELEMENT, 0.0)},
            "receiver": {"bandwidth": BAND, "record": "elements", **(receiver or {})}, **(sonar or {}),
        },
        "track": {"kind": "line", "start": (-3.5, 0.0, 20.0 - ALTITUDE), "speed": 2.0, "interval": 0.1, "pings": 36,
                  "window": (0.0385, 0.0425), "stop_and_hop": True, **(track or {})},
        "paths": {"max_reflections": 0, "contributions": ["target"], "edge_diffraction": "none", **(paths or {})},
        **top,
    }  # fmt: skip
    return Scenario(**described)


def steps(pings=36, start=-3.5, step=0.2):
    """Places of the sonar at its pings [m], shape (ping, 3)."""
    north = start + step * np.arange(pings)
    return np.stack([north, 0 * north, 0 * north + 20.0 - ALTITUDE], axis=1)


def elements(sent, places=PLACES):
    """Places of the elements, shape (ping, channel, 3)."""
    return sent[:, None] + np.asarray(places)[:, None] * np.array([1.0, 0, 0])


def band(bins=121):
    """Offsets from the carrier [Hz] and the spectrum of a compressed echo of amplitude one, which adds up to one."""
    offset = ((np.arange(bins) + 0.5) / bins - 0.5) * 1.25 * BAND
    about = {"duration": 1e-3, "fraction": 0.1, "bandwidth": 30e3, "matched_filter": False}
    sent = pulse_spectrum(offset, band=1e9, **about)
    received = pulse_spectrum(offset, band=BAND, **about) * np.conj(sent)
    return offset, received / np.sum(np.abs(sent) ** 2)


def image(pixels, target, sent, received, *, widest=np.pi / 2, speed=SPEED, beams_follow_frequency=True):
    """The back-projected image of a point of one: the mean over pings and elements, shape (pixel,).

    Args:
        pixels: Places, shape (pixel, 3).
        target: Place of the point, shape (3,).
        sent: Where the sound was sent from, shape (ping, 3).
        received: Where it was received, shape (ping, channel, 3).
        widest: Angle off broadside beyond which a ping counts for nothing [rad].
        speed: Speed of sound that the processor takes.
        beams_follow_frequency: Whether patterns are those of every frequency, or of the carrier's alone.
    """
    offset, spectrum = band()
    pitch = CARRIER + (offset if beams_follow_frequency else 0 * offset)
    total, count = np.zeros(len(pixels), complex), np.zeros(len(pixels))
    for place, row in zip(sent, received, strict=True):
        out, back = target - place, target - row
        reached, returned = np.linalg.norm(out), np.linalg.norm(back, axis=-1)
        tau = (reached + returned) / SPEED
        cosines = np.stack([np.full(len(row), out[0] / reached), back[:, 0] / returned])
        gain = np.prod(np.sinc(ELEMENT * pitch / SPEED * cosines[..., None]), axis=0) / (reached * returned)[:, None]
        away = np.linalg.norm(pixels - place, axis=-1)
        counted = np.abs(pixels[:, 0] - place[0]) <= np.sin(widest) * away
        expected = (away[:, None] + np.linalg.norm(pixels[:, None] - row, axis=-1)) / speed
        late = expected - tau
        turned = np.exp(2j * np.pi * ((CARRIER + offset) * late[..., None] % 1))
        total += counted * np.einsum("pcf,cf,f->p", turned, gain, spectrum)
        count += counted * len(row)
    return total / np.maximum(count, 1)


def width(place, value, drop_db=3.0):
    """Distance between the points some way below the peak, by straight lines in dB."""
    level = 20 * np.log10(np.abs(value) / np.abs(value).max())
    peak = int(np.argmax(level))
    first = peak - int(np.argmax(level[peak::-1] < -drop_db))
    last = peak + int(np.argmax(level[peak:] < -drop_db))
    return np.interp(drop_db, -level[last - 1 : last + 1], place[last - 1 : last + 1]) - np.interp(
        -drop_db, level[first : first + 2], place[first : first + 2]
    )


def side_lobe(value):
    """Height of the highest lobe beside the main one [dB re the peak]."""
    level = np.abs(value) / np.abs(value).max()
    inner = (level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])
    return float(20 * np.log10(np.sort(level[1:-1][inner])[-2]))
