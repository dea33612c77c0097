"""Arrivals as a channel hears them: when they come to its element, how strong, and how much quicker than when sent.

The numbers are those that the recording is made of, from the same kernels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.records.pairs import Pairs
from insonify.sonar.stance import Stance
from insonify.synthesis._element_kernel import arrive_bent, arrive_moving, arrive_still
from insonify.synthesis.elements import (
    Echoes,
    Ends,
    absorbed,
    all_echoes,
    come_from,
    ends_of,
    sent_at_the_middle,
    taken_by,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AsHeard:
    """One channel's hearing of a block of scatterers."""

    pairs: Pairs
    echoes: tuple[Echoes, ...]
    """By each ordered pair of legs."""
    stance: Stance
    ends: Ends
    channel: int
    """Which element; of beams, any."""
    water: Water
    towards: Floats
    """Directions in which the channel hears them, away from the sonar, shape (pairs, n, 3)."""

    def __call__(self, row: int) -> tuple[Floats, Floats, Floats, Floats]:
        """How the echoes by one ordered pair of legs are heard.

        Args:
            row: Which pair.

        Returns:
            Delay of the pulse's start [s], shape (n,); factor on the pressure in each band [1], shape (n, bands);
            Doppler factor less one [1], shape (n,); directions in which they are heard [1], shape (n, 3).
        """
        i, j = self.pairs.pair[row]
        delay, factor, doppler = heard_by(self.echoes[row], self.stance, self.ends, self.channel, self.water)
        travelled, carrier = self.pairs.out.length[i] + self.pairs.back.length[j], self.stance.frequency
        offsets = [band.offset for band in self.stance.bands] or [0.0]
        bands = [factor * absorbed(travelled, offset, carrier, self.water) for offset in offsets]
        return delay, np.stack(bands, axis=1), doppler, self.towards[row]


def as_heard(pairs: Pairs, stance: Stance, channel: int, water: Water) -> AsHeard:
    """One channel's hearing of a block.

    Args:
        pairs: Legs out and back of the block.
        stance: The sonar at this ping.
        channel: Which element; of beams, any.
        water: Between sonar and scatterers.
    """
    ends, gone = ends_of(stance), sent_at_the_middle(pairs.out.departure, pairs.out.length, stance)[0]
    rows, towards, _ = come_from(pairs, stance, gone, ends)
    mine = towards[channel if len(towards) > 1 else 0][rows]
    return AsHeard(pairs, tuple(all_echoes(pairs, stance, water)), stance, ends, channel, water, mine)


def heard_by(
    echoes: Echoes, stance: Stance, ends: Ends, channel: int, water: Water
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Echoes as one channel hears them: the numbers that its recording is made of.

    Args:
        echoes: By one pair of legs, n of them.
        stance: The sonar at this ping.
        ends: Of `ends_of`.
        channel: Which element; of beams, any.
        water: Between sonar and scatterers.

    Returns:
        Delay of the pulse's start [s], factor on the pressure [1], Doppler factor less one [1], each of shape (n,).
    """
    e = channel if stance.elements is not None else 0
    n = len(echoes.delay)
    when, doppler, fade = np.empty(n), np.zeros(n), np.empty(n, np.float32)
    motion = ends.place[e], ends.velocity[e], ends.acceleration[e]
    middle = 0.0 if stance.still else stance.pulse.pulse.duration / 2
    towards, slowness = list(np.ascontiguousarray(echoes.towards.T)), 1 / stance.receive_speed
    loss = taken_by(water, stance.frequency)
    front, following = echoes.front, 1 / (1 - echoes.leaving)
    if water.layered:
        arrive_bent(echoes.delay, front.bend, front.away, *towards, following, front.beside, *motion, slowness,
                    front.gradient, loss, middle, when, fade, doppler)  # fmt: skip
    elif stance.still:
        arrive_still(echoes.delay, 1 / front.bend, *towards, ends.place[e], slowness, loss, when, fade)
    else:
        arrive_moving(echoes.delay, 1 / front.bend, *towards, following, *motion, slowness, loss, middle, when,
                      fade, doppler)  # fmt: skip
    # the kernel tells where an unstretched pulse would start that has the same middle
    return when + middle * doppler / (1 + doppler), np.asarray(fade * echoes.louder), doppler
