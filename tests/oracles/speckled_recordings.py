"""Recordings of speckle, made without the simulator: a fan of resolution cells with texture, gain and noise."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import fftconvolve

from insonify.comparison.samples import Samples

SOUND_SPEED = 1500.0
STEP = 0.05


@dataclass(frozen=True)
class SpeckledScene:
    """A level bed seen by a sonar with one beam, as a product of speckle, texture and a law of range."""

    pings: int = 40
    samples: int = 600
    altitude: float = 5.0
    slope_db: float = -30.0
    """Level for each tenfold range [dB]."""
    level_db: float = 0.0
    decay_db: float = 6.0
    """Further loss behind each bottom echo [dB/m]."""
    noise_db: float = -50.0
    k_shape: float = np.inf
    """Shape of the texture of the K distribution."""
    looks: int = 1
    cell: int = 3
    """Samples of a pulse."""
    alike_pings: int = 1
    """Pings that share their speckle by a moving mean."""
    clip_db: float = np.inf
    """Level at which the samples are clipped [dB]."""
    shift: int = 0
    stretch: float = 1.0
    multiples_db: float = -10.0
    """Level of each multiple re the one before [dB]."""

    def but(self, **changes: float) -> "SpeckledScene":
        """The same scene with other values."""
        return replace(self, **changes)  # type: ignore[arg-type]

    def samples_of(self, seed: int) -> Samples:
        """One draw of it."""
        rng = np.random.default_rng(seed)
        looks = [self._look(rng) for _ in range(self.looks)]
        values = looks[0] if self.looks == 1 else np.sqrt(np.mean(np.abs(looks) ** 2, axis=0))
        limit = 10 ** (self.clip_db / 20)
        if np.isfinite(limit):
            values = np.where(np.abs(values) > limit, values / np.abs(values) * limit, values)
        return Samples(
            f"draw {seed}", values[:, None], STEP * np.arange(1, self.samples + 1), "uPa", SOUND_SPEED,
            frequency=100e3, pulse_length=2 * STEP * self.cell / SOUND_SPEED,
            altitude=np.full(self.pings, self.altitude), depth=3.1,
        )  # fmt: skip

    def _look(self, rng: np.random.Generator) -> np.ndarray:
        shape = (self.pings + self.alike_pings - 1, self.samples + self.cell - 1)
        white = rng.standard_normal((*shape, 2)).view(complex)[..., 0] / np.sqrt(2)
        if np.isfinite(self.k_shape):
            white = white * np.sqrt(rng.gamma(self.k_shape, 1 / self.k_shape, shape))
        kernel = np.ones((self.alike_pings, self.cell)) / np.sqrt(self.alike_pings * self.cell)
        speckle = fftconvolve(white, kernel, mode="valid")
        noise = rng.standard_normal((self.pings, self.samples, 2)).view(complex)[..., 0] / np.sqrt(2)
        return speckle * self._amplitude() + noise * 10 ** (self.noise_db / 20)

    def _amplitude(self) -> np.ndarray:
        r = STEP * np.arange(1 - self.shift, self.samples + 1 - self.shift) / self.stretch
        level = np.full(r.shape, -300.0)
        for n in range(1, 4):
            start = n * self.altitude
            inside = r >= start
            tail = self.level_db + self.slope_db * np.log10(np.maximum(r, start) / start) - self.decay_db * (r - start)
            law = tail + (n - 1) * self.multiples_db
            level = np.where(inside, 10 * np.log10(10 ** (level / 10) + 10 ** (law / 10)), level)
        return 10 ** (level / 20)
