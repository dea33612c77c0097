"""Random numbers by key: the same key always has the same number.

Nothing here has a state. A draw is a function of the seed, the stream (what the draw is
for) and four counters (which cell, which ping, which sample), so a position keeps its
scatterer in every ping, and the order or number of threads cannot change a bit.

Source: Salmon, Moraes, Dror & Shaw (2011), "Parallel random numbers: as easy as 1, 2, 3",
Proc. SC11: the Philox4x32 generator with ten rounds.
"""

import math
from operator import index

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.jit import njit

# The numbers are part of every stored result: append new ones, never renumber.
SEABED = 1
"""Stream of the scatterers on the seabed: position in the cell and phase."""
SURFACE = 2
"""Stream of the scatterers on the sea surface."""
TARGET = 3
"""Stream of the scatterers drawn on targets."""
SLICE = 4
"""Stream of the scatterers in a vertical plane."""
JITTER = 5
"""Stream of the phase jitter, one draw per ordered replica."""
NOISE = 6
"""Stream of the ambient noise, one draw per ping, channel and sample."""
PERTURBATION = 7
"""Stream of the random amplitude perturbation, one draw per ordered replica."""
SEA_SURFACE = 9
"""Stream of the waves on the sea: wavenumber, direction and phase of each."""
TERRAIN = 10
"""Stream of the relief: heights of lattice nodes, turns and shifts of octaves, sediment patches."""
MOTION = 12
"""Stream of the platform's motion: frequency and phase of each wave in each of its six freedoms."""
NAVIGATION = 13
"""Stream of the errors of the logged navigation, one draw per column and ping."""
TRACER = 16
"""Stream of the directions of traced rays, one draw per ray and ping."""
GLINT = 17
"""Stream of the glints of the sea surface: the waves that make them, one draw per point, family and bounce."""
ELEMENTS = 20
"""Stream of the errors of a receiving array's elements."""
WATER_DELAYS = 37
"""Stream of the waves that uneven water's delays are made of."""
TEXTURE = 26
"""Stream of the seabed's texture: numbers of lattice nodes."""
VOLUME = 27
"""Stream of the scatterers in the water: position in the cell and phase."""
PAIR_SAMPLING = 36
"""Stream of the scatterers that are evaluated for weak pairs of legs: one draw per scatterer."""
SPECKLE = 40
"""Stream of the speckle drawn from an expected intensity: one draw per ping, channel and sample."""
OTHER_SPECKLE = 41
"""Stream of another realisation of that speckle."""
DATASET = 42
"""Stream of what varies between the images of a data set: one draw per key and image."""
RECEIVER = 35
"""Stream of the receiver's own noise: one draw per ping, channel and sample, and the phases of its tones."""

_WORD = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
# Multipliers and key increments (Weyl sequences) of Philox4x32, Salmon et al. (2011).
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)
_ROUNDS = 10

_SEED_LIMIT = 1 << 64
_GOLDEN = 0x9E3779B97F4A7C15


def stream_key(seed: int, stream: int) -> tuple[int, int]:
    """The Philox key of one stream of one seed, two 32-bit words.

    Args:
        seed: Any whole number of 64 bits, 0 to 2^64 - 1 [1].
        stream: One of the streams named above [1].

    Returns:
        The two words of the key. In one stream no two seeds share a key, and neighbouring
        seeds or streams have unrelated keys.
    """
    seed = index(seed)
    if not 0 <= seed < _SEED_LIMIT:
        raise ValueError(f"seed is {seed}; give a whole number from 0 to 2^64 - 1")
    mixed = _splitmix64(seed ^ _splitmix64(index(stream) * _GOLDEN % _SEED_LIMIT))
    return mixed & 0xFFFFFFFF, mixed >> 32


def _splitmix64(word: int) -> int:
    """`splitmix64` of a Python number."""
    return int(splitmix64(np.uint64(word)))


@njit(cache=True, nogil=True)
def splitmix64(word: np.uint64) -> np.uint64:
    """Spread every bit of a 64-bit word over all its bits, one to one [1]. To be called from other kernels too.

    Source: Steele, Lea & Flood (2014), "Fast splittable pseudorandom number generators",
    OOPSLA: the output function of SplitMix64.
    """
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.uint64(word ^ (word >> np.uint64(31)))


@njit(inline="always")
def _philox_round(
    x0: np.uint64, x1: np.uint64, x2: np.uint64, x3: np.uint64, a: np.uint64, b: np.uint64
) -> tuple[np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64]:
    """Four words and a key after one round: both numbers of a pair of words are 32 bits of 64."""
    # 64-bit words hold the full product of two 32-bit ones.
    product_0, product_1 = x0 * _MULTIPLIER_0, x2 * _MULTIPLIER_1
    return (
        (product_1 >> _SHIFT) ^ x1 ^ a,
        product_1 & _WORD,
        (product_0 >> _SHIFT) ^ x3 ^ b,
        product_0 & _WORD,
        (a + _WEYL_0) & _WORD,
        (b + _WEYL_1) & _WORD,
    )


@njit(cache=True, nogil=True)
def philox(c0: int, c1: int, c2: int, c3: int, k0: int, k1: int) -> tuple[np.uint32, np.uint32, np.uint32, np.uint32]:
    """Four random 32-bit words that belong to four counters and a key.

    Args:
        c0: First counter; of any whole number the low 32 bits count, so -1 is allowed [1].
        c1: Second counter [1].
        c2: Third counter [1].
        c3: Fourth counter [1].
        k0: First word of the key [1].
        k1: Second word of the key [1].

    Returns:
        Four independent words, uniform over 0 to 2^32 - 1. To be called from other kernels too.

    Source: Salmon et al. (2011), Philox4x32-10.
    """
    x0, x1 = np.uint64(c0) & _WORD, np.uint64(c1) & _WORD
    x2, x3 = np.uint64(c2) & _WORD, np.uint64(c3) & _WORD
    a, b = np.uint64(k0) & _WORD, np.uint64(k1) & _WORD
    for _ in range(_ROUNDS):
        x0, x1, x2, x3, a, b = _philox_round(x0, x1, x2, x3, a, b)
    return np.uint32(x0), np.uint32(x1), np.uint32(x2), np.uint32(x3)


@njit(cache=True, nogil=True)
def philox_consecutive(first: int, c1: int, c2: int, c3: int, k0: int, k1: int, words: NDArray[np.uint32]) -> None:
    """The words of neighbouring first counters: what `philox` has, in vectors, six times as fast.

    Args:
        first: First counter of the first; then it goes up by one [1].
        c1: Second counter of all [1].
        c2: Third counter of all [1].
        c3: Fourth counter of all [1].
        k0: First word of the key [1].
        k1: Second word of the key [1].
        words: Result, the four words of each, shape (4, n).
    """
    w0, w1, w2, w3 = words[0], words[1], words[2], words[3]
    begin, second = np.uint64(first), np.uint64(c1) & _WORD
    third, fourth = np.uint64(c2) & _WORD, np.uint64(c3) & _WORD
    for n in range(words.shape[1]):
        x0, x1, x2, x3 = (begin + np.uint64(n)) & _WORD, second, third, fourth
        a, b = np.uint64(k0) & _WORD, np.uint64(k1) & _WORD
        for _ in range(_ROUNDS):
            x0, x1, x2, x3, a, b = _philox_round(x0, x1, x2, x3, a, b)
        w0[n], w1[n], w2[n], w3[n] = x0, x1, x2, x3


@njit(cache=True, nogil=True)
def philox_at(
    first: NDArray[np.int64], second: NDArray[np.int64], c2: int, c3: int, k0: int, k1: int, words: NDArray[np.uint32]
) -> None:
    """The words of any first and second counters: what `philox` has, in vectors.

    Args:
        first: First counters [1], shape (n,).
        second: Second counters [1].
        c2: Third counter of all [1].
        c3: Fourth counter of all [1].
        k0: First word of the key [1].
        k1: Second word of the key [1].
        words: Result, the four words of each, shape (4, n or more).
    """
    w0, w1, w2, w3 = words[0], words[1], words[2], words[3]
    third, fourth = np.uint64(c2) & _WORD, np.uint64(c3) & _WORD
    for n in range(first.size):
        x0, x1, x2, x3 = np.uint64(first[n]) & _WORD, np.uint64(second[n]) & _WORD, third, fourth
        a, b = np.uint64(k0) & _WORD, np.uint64(k1) & _WORD
        for _ in range(_ROUNDS):
            x0, x1, x2, x3, a, b = _philox_round(x0, x1, x2, x3, a, b)
        w0[n], w1[n], w2[n], w3[n] = x0, x1, x2, x3


@njit(cache=True, nogil=True)
def uniform_from_word(word: np.uint32) -> float:
    """A random word as a number strictly between 0 and 1 [1]: safe in a logarithm."""
    return (np.float64(word) + 0.5) * 2.0**-32


@njit(cache=True, nogil=True)
def complex_normal_pair(w0: np.uint32, w1: np.uint32, w2: np.uint32, w3: np.uint32) -> tuple[complex, complex]:
    """Two independent circular complex Gaussian numbers of unit mean power, from four words.

    Source: Box & Muller (1958), Ann. Math. Stat. 29, 610; the power of each number is
    exponential with mean 1, its phase uniform.
    """
    first, second = math.sqrt(-math.log(uniform_from_word(w0))), math.sqrt(-math.log(uniform_from_word(w2)))
    angle, turn = 2 * math.pi * uniform_from_word(w1), 2 * math.pi * uniform_from_word(w3)
    return (
        complex(first * math.cos(angle), first * math.sin(angle)),
        complex(second * math.cos(turn), second * math.sin(turn)),
    )


def uniforms(
    seed: int, stream: int, c0: ArrayLike, c1: ArrayLike = 0, c2: ArrayLike = 0, c3: ArrayLike = 0
) -> NDArray[np.float64]:
    """Four uniform numbers for every set of four counters.

    Args:
        seed: Seed of the scenario [1].
        stream: Number of the random stream [1].
        c0: First counter, whole numbers of any sign, any shape; the low 32 bits count [1].
        c1: Second counter, broadcast against the first [1].
        c2: Third counter [1].
        c3: Fourth counter [1].

    Returns:
        Uniform numbers, strictly between 0 and 1, shape (..., 4): `uniforms(7, SEABED, n)`
        for n of shape (n,) has shape (n, 4).
    """
    counters = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=np.int64) for c in (c0, c1, c2, c3))), axis=-1)
    draws = np.empty(counters.shape, dtype=np.float64)
    _fill_uniforms(counters.reshape(-1, 4), *stream_key(seed, stream), draws.reshape(-1, 4))
    return draws


def complex_normals(
    seed: int, stream: int, ping: int, channel: int, count: int, *, start: int = 0
) -> NDArray[np.complex128]:
    """Circular complex Gaussian samples of unit mean power, E|w|^2 = 1.

    Args:
        seed: Seed of the scenario [1].
        stream: Number of the random stream [1].
        ping: Number of the ping [1].
        channel: Number of the channel of the ping [1].
        count: Number of samples [1].
        start: Index of the first sample; samples 100 to 199 are the same whether
            computed alone or as part of a longer run [1].

    Returns:
        Samples [1], shape (count,).
    """
    samples = np.empty(count, dtype=np.complex128)
    _fill_normals(ping, channel, start, *stream_key(seed, stream), samples)
    return samples


@njit(cache=True, nogil=True)
def _fill_uniforms(counters: NDArray[np.int64], k0: int, k1: int, draws: NDArray[np.float64]) -> None:
    """Four uniform numbers for each row of counters."""
    for n in range(counters.shape[0]):
        words = philox(counters[n, 0], counters[n, 1], counters[n, 2], counters[n, 3], k0, k1)
        for m in range(4):
            draws[n, m] = uniform_from_word(words[m])


@njit(cache=True, nogil=True)
def _fill_normals(ping: int, channel: int, start: int, k0: int, k1: int, samples: NDArray[np.complex128]) -> None:
    """Samples start, start + 1, ... of one channel of one ping."""
    # One block of four words serves the two samples 2n and 2n + 1; an odd start wastes half a block.
    stop = start + samples.size
    for block in range(start // 2, (stop + 1) // 2):
        w0, w1, w2, w3 = philox(block, block >> 32, channel, ping, k0, k1)
        even, odd = complex_normal_pair(w0, w1, w2, w3)
        if 2 * block >= start:
            samples[2 * block - start] = even
        if 2 * block + 1 < stop:
            samples[2 * block + 1 - start] = odd
