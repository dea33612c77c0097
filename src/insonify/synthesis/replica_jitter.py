"""The paper's random jitter of each pulse replica: in phase, and in amplitude.

The jitter is given in wavelengths, as a delay would be, but turns the phase only: the envelope stays
where the path's own delay puts it. Each ordered pair of families at each place is a replica of its own;
its draw is keyed by seed, ping, place and families, and is shared by all channels. In the mean a jitter
of up to J wavelengths, uniform, leaves sinc^2(J) of the interference between replicas; an amplitude
changed by up to a part e, uniform, adds e^2 / 3 to the energy of each.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit
from insonify.propagation.families import bounce_sequence
from insonify.propagation.path_settings import PathSettings


@dataclass(frozen=True, slots=True)
class ReplicaJitter:
    """Jitter of one ping's replicas."""

    seed: int
    ping: int
    jitter: float
    """Largest random phase, one turn for each wavelength [wavelengths]."""
    amplitude: float
    """Largest random change of amplitude, as a part of it [1]."""

    @property
    def is_zero(self) -> bool:
        """True where nothing is perturbed."""
        return self.jitter == 0 and self.amplitude == 0

    @property
    def interference_factor(self) -> float:
        """Part of the mean product of two replicas that survives [1]."""
        return float(np.sinc(self.jitter) ** 2)

    @property
    def mean_energy(self) -> float:
        """Mean energy of one replica re the unperturbed one [1]."""
        return 1 + self.amplitude**2 / 3

    def factor(
        self, scatterer_id: NDArray[np.uint64], transmit_family: str, receive_family: str
    ) -> NDArray[np.complex128]:
        """Complex factor of the replicas of some places, for one ordered pair of rays [1], shape (n,).

        Args:
            scatterer_id: Keys of the places, shape (n,).
            transmit_family: Family of the leg out, with a number where it is a further ray of it, such as D2.
            receive_family: Family of the leg back, likewise.
        """
        result = np.empty(len(scatterer_id), complex)
        families = (_code(transmit_family) << 8) | _code(receive_family)
        k0, k1 = random_keys.stream_key(self.seed, random_keys.JITTER)
        _factors(scatterer_id, self.ping, families, k0, k1, self.jitter, self.amplitude, result)
        return result


def replica_jitter(seed: int, ping: int, choice: PathSettings) -> ReplicaJitter:
    """The perturbation that a choice of paths asks for, at one ping."""
    return ReplicaJitter(seed, ping, choice.jitter, choice.amplitude_perturbation)


def _code(ray: str) -> int:
    """A number below 256 for each ray: twice its bounces, plus one if bottom first, plus 32 for each ray before it."""
    family = ray.rstrip("12345678")
    string = bounce_sequence(family)
    return 32 * (int(ray[len(family) :] or 1) - 1) + 2 * len(string) + string.startswith("B")


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
