"""Pace of this machine: processor time re that on the machine on which the unit costs were measured.

Processors of one generation differ by a factor of two, as much as an estimate may be off. The pace is the root of that
of a transform: on shared processors a transform takes up to 2.6 times as long for a while, whole runs 1.0 to 1.9 times.
"""

import math
import time
from functools import lru_cache

import numpy as np

TRANSFORM_SECONDS = 34e-6
"""Processor time of a Fourier transform of 4096 complex numbers on the reference machine [s]."""
_LARGEST = 4.0
_TRIES, _TRANSFORMS, _PAUSE_SECONDS = 12, 4, 2e-3


@lru_cache(maxsize=1)
def machine_pace() -> float:
    """Processor time of this machine re that of the reference machine, from 1/4 to 4 [1].

    The shortest of some tries over 30 ms counts, since others may disturb some of them.

    Example:
        >>> 0.25 <= machine_pace() <= 4
        True
    """
    values, shortest = np.exp(1j * np.arange(4096.0) ** 2), np.inf
    for _ in range(_TRIES):
        time.sleep(_PAUSE_SECONDS)
        begin = time.thread_time()
        for _ in range(_TRANSFORMS):
            np.fft.fft(values)
        shortest = min(shortest, time.thread_time() - begin)
    return float(np.clip(math.sqrt(shortest / _TRANSFORMS / TRANSFORM_SECONDS), 1 / _LARGEST, _LARGEST))
