"""Speckle drawn from an expected intensity has the statistics of many scatterers in a resolution cell."""

import numpy as np
import pytest
from scipy import stats

from insonify import random_keys
from insonify.processing.speckle import speckle_intensity
from insonify.sonar.pulse import Pulse
from insonify.sonar.received_pulse import received_pulse
from insonify.sonar.receiver import Receiver


def pulse():
    """A tone of 0.3 ms through a band of 8 kHz."""
    from insonify.sonar import PlanarArray, Sonar

    array = PlanarArray(width=0.5, height=0.02)
    tone = Pulse(kind="cw", frequency=100e3, duration=0.3e-3)
    return received_pulse(
        Sonar(source_level_db=200, pulse=tone, transmit=array, receive=array, receiver=Receiver(bandwidth=8e3))
    )


def drawn(looks=1, stream=random_keys.SPECKLE, pings=400, seed=5):
    """Speckle of some pings of 60 samples."""
    return speckle_intensity(pulse(), 10e3, (pings, 1, 60), seed=seed, stream=stream, looks=looks)[:, 0]


@pytest.mark.parametrize("looks", [1, 4])
def test_intensity_is_gamma_distributed_with_its_looks(looks):
    """Kolmogorov-Smirnov test of 2400 independent samples at 0.1 %: exponential for one look (Rayleigh amplitude)."""
    samples = drawn(looks)[:, ::10].ravel()  # 1 ms apart, beyond the pulse
    assert stats.kstest(samples, stats.gamma(looks, scale=1 / looks).cdf).pvalue > 1e-3
    assert samples.mean() == pytest.approx(1, abs=4 / np.sqrt(looks * samples.size))


def test_neighbours_are_correlated_as_by_the_pulse():
    """Correlation of intensities is the squared autocorrelation of the pulse (Siegert), within four standard errors."""
    intensity, received = drawn(pings=2000), pulse()
    waveform = received.samples(np.arange(-40, 60) / 10e3)
    for lag in (1, 2, 3, 6):
        own = np.abs(np.vdot(waveform[lag:], waveform[:-lag])) / np.vdot(waveform, waveform).real
        measured = np.corrcoef(intensity[:, :-lag].ravel(), intensity[:, lag:].ravel())[0, 1]
        assert measured == pytest.approx(own**2, abs=0.04)


def test_streams_are_realisations_of_their_own():
    """The other stream has unrelated speckle; the same key the same bits, ping by ping."""
    one, other = drawn(), drawn(stream=random_keys.OTHER_SPECKLE)
    assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.05
    np.testing.assert_array_equal(drawn(pings=10), one[:10])
