"""The shapes in which echoes of one pulse come back to a sonar under way: quicker or slower than it was sent.

An echo from ahead is the pulse in fast motion. Instead of a waveform for every echo there are a few, at Chebyshev's
nodes over the range of Doppler factors that the beams hear, and every echo is a sum of these: as many as hold the
error of the sum. Each is stretched about its middle, where its phase is that of the pulse that was sent: so the phase
that has to be met is that of half a pulse only.

Source: interpolation at Chebyshev nodes, error of exp(j phi x) on -1..1 at most 2 (phi / 2)^n / n!; Trefethen (2013),
Approximation Theory and Approximation Practice, ch. 8 (bound for entire functions, from memory).
"""

import math
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.sonar.beam import Beams
from insonify.sonar.heard import HeardPulse
from insonify.sonar.pulse import Pulse
from insonify.sonar.stance import Stance
from insonify.sonar.sub_bands import half_band, shares

Floats = NDArray[np.float64]

ERROR = 1e-6
"""Of the sum of shapes, relative to the pulse's peak [1]."""
MOST = 48
"""Shapes at most [1]."""
FAINT = 10 ** (-45 / 20)
"""Two-way gain below which a direction's Doppler need not be met exactly, relative to the loudest [1]."""
_AZIMUTHS, _ELEVATIONS = 720, 37


@dataclass(frozen=True, slots=True)
class Shapes:
    """Waveforms of which every echo is a sum: one for each node of Doppler, at each node of frequency."""

    doppler: Floats
    """Doppler factor less one of each node, increasing [1], shape (dopplers,)."""
    band: Floats = field(default_factory=lambda: np.zeros(1))
    """Offset of each node from the carrier, increasing [Hz], shape (bands,)."""
    edge: float = np.inf
    """Offset from the carrier beyond which what an echo loses changes no more [Hz]."""

    def spectra(self, pulse: HeardPulse, frequencies: Floats) -> NDArray[np.complex128]:
        """Spectrum of each shape at offsets from the carrier [s], shape (bands, dopplers, frequencies).

        Those of the last few sonars are kept: one that keeps its speed and attitude asks for the same at every ping.
        """
        key = (id(pulse), self.doppler.tobytes(), self.band.tobytes(), self.edge, hash(frequencies.tobytes()))
        held = _SPECTRA.get(key)
        if held is None:
            if len(_SPECTRA) >= _MOST_KEPT:
                _SPECTRA.clear()
            # the pulse is kept, so that no other can take its number
            held = _SPECTRA[key] = self._spectra(pulse, frequencies), pulse
        return held[0]

    def _spectra(self, pulse: HeardPulse, frequencies: Floats) -> NDArray[np.complex128]:
        """The same, made anew."""
        moved = [
            pulse.spectrum(frequencies, float(factor)) * _about_the_middle(pulse, float(factor), frequencies)
            for factor in self.doppler
        ]
        return np.asarray(shares(self.band, frequencies, -self.edge, self.edge)[:, None] * np.array(moved) + 0j)

    def _part(self, pulse: HeardPulse, band: int, row: int, offset: Floats) -> NDArray[np.complex128]:
        """What one shape makes of a stretched pulse's spectrum at offsets from the carrier [Hz]."""
        centred = _about_the_middle(pulse, float(self.doppler[row]), offset)
        return np.asarray(shares(self.band, offset, -self.edge, self.edge)[band] * centred)

    def parts(self, doppler: Floats) -> Floats:
        """What each node of Doppler contributes to some echoes [1], shape (dopplers, n).

        Args:
            doppler: Their Doppler factors less one [1], shape (n,).
        """
        middle, half = (self.doppler[0] + self.doppler[-1]) / 2, (self.doppler[-1] - self.doppler[0]) / 2
        half = half / math.cos(math.pi / 2 / len(self.doppler)) if half > 0 else 0.0
        return shares(self.doppler, doppler, middle - half, middle + half)

    def samples(self, pulse: HeardPulse, time: Floats, doppler: Floats) -> NDArray[np.complex128]:
        """Waveforms of some echoes of unit pressure in each band [1], shape (bands, n); their sum is heard.

        Args:
            pulse: As the receiver hears it.
            time: Since each echo's delay [s], shape (n,).
            doppler: Their Doppler factors less one [1], shape (n,).
        """
        if len(self.band) == 1 and len(self.doppler) == 1:
            return pulse.samples(time)[None]
        parts, heard = self.parts(doppler), np.zeros((len(self.band), len(time)), complex)
        sooner = start_after(pulse, doppler)
        for band, row in np.ndindex(heard.shape[0], len(parts)):
            tables = pulse.reshaped(float(self.doppler[row]), partial(self._part, pulse, band, row))
            heard[band] += parts[row] * tables.samples(time + sooner)
        return heard * np.exp(2j * np.pi * pulse.pulse.frequency * sooner)


def start_after(pulse: HeardPulse, doppler: ArrayLike) -> Floats:
    """How much later an echo starts than an unstretched pulse would that has the same middle [s], shape of doppler.

    Args:
        pulse: What was sent, as heard.
        doppler: Doppler factors less one [1], any shape.
    """
    d = np.asarray(doppler, float)
    return np.asarray(pulse.pulse.duration / 2 * d / (1 + d))


def _about_the_middle(pulse: HeardPulse, doppler: float, offset: Floats) -> NDArray[np.complex128]:
    """What shifts a pulse stretched about its start to one stretched about its middle, where it keeps its phase."""
    return np.asarray(np.exp(-2j * np.pi * (pulse.pulse.frequency + offset) * start_after(pulse, doppler)))


def shapes_of(stance: Stance, error: float = ERROR) -> Shapes:
    """The shapes that one ping takes.

    Args:
        stance: The sonar, which may be under way.
        error: What the sum may be wrong by, relative to the pulse's peak [1].
    """
    band, edge = np.array([0.0]), np.inf
    if stance.bands:
        band, edge = np.array([sub.offset for sub in stance.bands]), half_band(stance.pulse)
    if stance.still:
        return Shapes(np.zeros(1), band, edge)
    low, high = heard_dopplers(stance)
    count = doppler_nodes(stance.pulse.pulse, high - low, error)
    node = -np.cos((np.arange(count) + 0.5) * np.pi / count)
    return Shapes((low + high) / 2 + (high - low) / 2 * node, band, edge)


def doppler_nodes(pulse: Pulse, width: float, error: float = ERROR) -> int:
    """How many shapes a range of Doppler factors takes; `MOST` where that is not enough.

    Args:
        pulse: What was sent.
        width: Greatest less least Doppler factor [1].
        error: What the sum may be wrong by, relative to the pulse's peak [1].
    """
    turn = math.pi * (pulse.frequency + pulse.bandwidth / 2) * pulse.duration * width / 2
    count = 1
    while count < MOST and 2 * (turn / 2) ** count / math.factorial(count) > error:
        count += 1
    return count


def heard_dopplers(stance: Stance) -> tuple[float, float]:
    """Least and greatest Doppler factor less one of what the beams hear during one ping [1].

    On one platform both legs go the same way; between two any way that the one sends meets any that the other hears.

    Args:
        stance: The sonar under way.
    """
    assert stance.course is not None
    apart = stance.receive_survey is not None
    alike = stance.elements is None or not np.any(stance.elements.facing)
    sent_to, heard_from = _loud_ways(stance.transmit_beams, stance.receive_beams if alike else None, apart=apart)
    _, first, growth = (row[0] for row in stance.course.of(stance.arms[1:]))
    sent = stance.transmit_velocity
    heard = [first, first + growth * stance.course.window]
    leaving = 1 - sent_to @ sent / stance.sound_speed
    coming = [1 + heard_from @ velocity / stance.receive_speed for velocity in heard]
    if apart:
        leaving, coming = _ends(leaving)[:, None], [_ends(part) for part in coming]
    factor = np.concatenate([(part / leaving - 1).ravel() for part in coming])
    margin = 0.02 * float(max(np.linalg.norm(sent), *(np.linalg.norm(v) for v in heard))) / stance.sound_speed
    return float(factor.min()) - margin, float(factor.max()) + margin


_LOUD: dict[Any, tuple[Floats, Floats, list[Beams]]] = {}
_SPECTRA: dict[Any, tuple[NDArray[np.complex128], HeardPulse]] = {}
_MOST_KEPT = 8


def _loud_ways(sent: Beams, heard: Beams | None, *, apart: bool) -> tuple[Floats, Floats]:
    """Directions that beams send to and hear from, of some all around, each (any, 3); kept for the same beams.

    Args:
        sent: Transmit beams.
        heard: Receive beams; None: they hear all around.
        apart: Whether they are on two platforms, or else what counts is heard both ways.
    """
    ends = [beams for beams in (sent, heard) if beams is not None]
    key = (apart, *((beams.axes.tobytes(), beams.pattern) for beams in ends))
    held = _LOUD.get(key)
    if held is None:
        azimuth, down = np.meshgrid(
            np.linspace(-np.pi, np.pi, _AZIMUTHS, endpoint=False), np.linspace(-np.pi / 2, np.pi / 2, _ELEVATIONS)
        )
        level = np.cos(down)
        way = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(down)], axis=-1).reshape(-1, 3)
        out = np.abs(sent.gain(way)).max(axis=0)
        back = np.ones(len(way)) if heard is None else np.abs(heard.gain(way)).max(axis=0)
        gains = (out, back) if apart else (out * back, out * back)
        one, other = (way[gain >= FAINT * gain.max()] for gain in gains)
        if len(_LOUD) >= _MOST_KEPT:
            _LOUD.clear()
        # the beams are kept, so that no others can take their tables' numbers
        held = _LOUD[key] = one, other, ends
    return held[:2]


def _ends(values: Floats) -> Floats:
    """The least and the greatest of some values, shape (2,)."""
    return np.array([values.min(), values.max()])
