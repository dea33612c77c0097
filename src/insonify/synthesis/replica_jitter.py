"""Random jitter of each pulse replica, in phase and in amplitude.

The jitter is given in wavelengths, as a delay would be, but changes the phase only: the envelope keeps
the delay of the path. Each ordered pair of families at each scatterer is a replica of its own;
its random numbers are keyed by seed, ping, scatterer and families, and shared by all channels. In the mean, a jitter
uniform up to J wavelengths leaves sinc^2(J) of the interference between replicas; a relative amplitude change
uniform up to e adds e^2 / 3 to the energy of each. Replicas of unlike jitter have the mean factors mu = sinc(J)
exp(-j pi J), so that E |sum f A|^2 = |sum mu A|^2 + sum (1 + e^2 / 3 - |mu|^2) |A|^2.
"""

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit
from insonify.propagation.families import bounce_sequence, first_boundary
from insonify.propagation.path_settings import PathSettings, ReplicaPerturbation
from insonify.records.pairs import Pairs


@lru_cache(maxsize=4)
def _squared_sinc(jitter: float) -> float:
    """Mean product of two replicas with random phases uniform up to `jitter` [wavelengths], re that without [1]."""
    return float(np.sinc(jitter) ** 2)


@dataclass(frozen=True, slots=True)
class ReplicaJitter:
    """Random phases and amplitudes of one ping's replicas."""

    seed: int
    ping: int
    """Number of the ping."""
    jitter: float
    """Largest random phase, as the change of path length of that phase [wavelengths]."""
    amplitude: float
    """Largest random relative change of amplitude [1]."""

    perturbations: tuple[ReplicaPerturbation, ...] = ()
    """Jitter and amplitude of some families or objects."""

    @property
    def is_zero(self) -> bool:
        """True without jitter."""
        return self.jitter == 0 and self.amplitude == 0 and not self.perturbations

    @property
    def interference_factor(self) -> float:
        """Mean product of two replicas re that without jitter, of families and objects without perturbation [1]."""
        return _squared_sinc(self.jitter)

    @property
    def mean_energy(self) -> float:
        """Mean energy of one replica re that without jitter, of families and objects without perturbation [1]."""
        return 1 + self.amplitude**2 / 3

    def largest(self, object_name: str, transmit_family: str, receive_family: str) -> tuple[float, float]:
        """Largest random phase [wavelengths] and relative change of amplitude [1] of one ordered pair of rays.

        Args:
            object_name: Object that scatters.
            transmit_family: Family of the transmit leg, with or without the number of its ray.
            receive_family: Family of the receive leg.
        """
        jitter, amplitude = self.jitter, self.amplitude
        legs = {name.rstrip("0123456789") for name in (transmit_family, receive_family)}
        for perturbation in self.perturbations:
            if (perturbation.families is None or legs & set(perturbation.families)) and (
                perturbation.objects is None or object_name in perturbation.objects
            ):
                jitter = jitter if perturbation.jitter is None else perturbation.jitter
                amplitude = (
                    amplitude if perturbation.amplitude_perturbation is None else perturbation.amplitude_perturbation
                )
        return jitter, amplitude

    def factor(
        self, scatterer_id: NDArray[np.uint64], transmit_family: str, receive_family: str, object_name: str = ""
    ) -> NDArray[np.complex128]:
        """Complex factor of the replicas of some scatterers, for one ordered pair of rays [1], shape (n,).

        Args:
            scatterer_id: Identifiers of the scatterers, shape (n,).
            transmit_family: Family of the transmit leg, with a number for further rays, such as D2.
            receive_family: Family of the receive leg, with a number for further rays.
            object_name: Object of the scatterers.
        """
        result = np.empty(len(scatterer_id), complex)
        families = (_code(transmit_family) << 8) | _code(receive_family)
        families |= ("H" in transmit_family) << 17 | ("H" in receive_family) << 16
        k0, k1 = random_keys.stream_key(self.seed, random_keys.JITTER)
        jitter, amplitude = self.largest(object_name, transmit_family, receive_family)
        _factors(scatterer_id, self.ping, families, k0, k1, jitter, amplitude, result)
        return result

    def expected_parts(self, pairs: Pairs) -> Iterator[tuple[Pairs, float, float]]:
        """Copies of a block whose mean intensities add.

        Args:
            pairs: Pairs of one block.

        Yields:
            Copy, factor of |sum of its replicas|^2 [1], factor of its sum of |replica|^2 [1].
        """
        if not self.perturbations:
            yield pairs, self.interference_factor, self.mean_energy - self.interference_factor
            return
        largest = np.array([self.largest(pairs.scatterers.object, *names) for names in pairs.rays()]).reshape(-1, 2)
        mean = np.sinc(largest[:, 0]) * np.exp(-1j * np.pi * largest[:, 0])
        spread = np.sqrt(np.maximum(1 + largest[:, 1] ** 2 / 3 - np.abs(mean) ** 2, 0.0))
        for factor, interfering in ((mean, 1.0), (spread, 0.0)):
            if factor.any():
                yield replace(pairs, stored_strengths=pairs.strength * factor[:, None]), interfering, 1 - interfering


def replica_jitter(seed: int, ping: int, path_settings: PathSettings) -> ReplicaJitter:
    """Replica jitter of one ping, as set by the path settings."""
    return ReplicaJitter(
        seed, ping, path_settings.jitter, path_settings.amplitude_perturbation, path_settings.replica_perturbations
    )


def _code(ray: str) -> int:
    """Number below 256 of each ray, part of the key of its random numbers.

    Twice its bounces, plus one if the bottom comes first, plus 32 for each ray of the family before it.
    """
    family = ray.rstrip("0123456789")
    if family.startswith("F"):  # by way of a face: of all codes those of the fifth ray and beyond
        return 128 + zlib.crc32(ray.encode()) % 128
    letters = bounce_sequence(family)
    return 32 * (int(ray[len(family) :] or 1) - 1) + 2 * len(letters) + (first_boundary(letters) == "bottom")


@njit(cache=True, nogil=True)
def _factors(
    scatterer_id: NDArray[np.uint64], ping: int, families: int, k0: int, k1: int, jitter: float, amplitude: float,
    result: NDArray[np.complex128],
) -> None:  # fmt: skip
    """Fill `result` with (1 + amplitude (2 u - 1)) exp(-j 2 pi jitter v), u and v uniform."""
    for n in range(scatterer_id.size):
        low, high = scatterer_id[n] & np.uint64(0xFFFFFFFF), scatterer_id[n] >> np.uint64(32)
        w0, w1, _, _ = random_keys.philox(low, high, ping, families, k0, k1)
        angle = -2 * np.pi * jitter * random_keys.uniform_from_word(w0)
        change = 1 + amplitude * (2 * random_keys.uniform_from_word(w1) - 1)
        result[n] = change * complex(np.cos(angle), np.sin(angle))
