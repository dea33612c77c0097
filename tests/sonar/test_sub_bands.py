"""Claims about sub-bands: a few of its values determine a smooth function of frequency."""

import numpy as np
import pytest

from insonify.sonar.pulse import Pulse
from insonify.sonar.received_pulse import receive_pulse
from insonify.sonar.receiver import Receiver
from insonify.sonar.sub_bands import band_nodes, half_bandwidth, lagrange_weights

SWEEP = receive_pulse(Pulse(kind="lfm", frequency=100e3, bandwidth=8e3, duration=2e-3), Receiver(bandwidth=20e3))
TONE = receive_pulse(Pulse(kind="cw", frequency=100e3, duration=1e-3, taper="hann"), Receiver(bandwidth=20e3))


def test_the_band_is_the_pulse_and_not_the_receiver():
    """A sweep of 8 kHz: band and skirts, all but 1e-4, are within the receiver; a soft tone has 2 / T and a little."""
    assert 4e3 < half_bandwidth(SWEEP) < 12.5e3
    assert 1e3 < half_bandwidth(TONE) < 3e3


def test_a_wide_pulse_is_cut_by_the_receiver():
    """60 kHz of sweep in a band of 20 kHz: no more than the receiver's edge."""
    wide = receive_pulse(Pulse(kind="lfm", frequency=100e3, bandwidth=60e3, duration=1e-3), Receiver(bandwidth=20e3))
    assert 9e3 < half_bandwidth(wide) < 12.5e3


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_nodes_are_chebyshev_s(count):
    """Zeros of T_n on the band: cos(n arccos x) = 0; one node is the carrier."""
    node = band_nodes(SWEEP, count)
    assert len(node) == count and np.all(np.diff(node) > 0)
    x = node / half_bandwidth(SWEEP) if count > 1 else node
    np.testing.assert_allclose(np.cos(count * np.arccos(x)), 0, atol=1e-12)


def test_polynomials_are_reproduced_and_ones_add_to_one():
    """Five nodes give any quartic back, everywhere between them; shares add to one."""
    node, x = band_nodes(SWEEP, 5), np.linspace(-4e3, 4e3, 41)
    share = lagrange_weights(node, x)
    np.testing.assert_allclose(share.sum(axis=0), 1, atol=1e-12)
    quartic = np.polynomial.Polynomial([1.0, -2e-4, 3e-8, 1e-12, -5e-16])
    np.testing.assert_allclose(quartic(node) @ share, quartic(x), rtol=1e-9, atol=1e-9)


def test_beyond_the_edge_nothing_grows():
    """At ten times the band the shares are those of the edge: a polynomial of degree 15 would be 1e19 there."""
    node = band_nodes(SWEEP, 16)
    edge = half_bandwidth(SWEEP)
    far = lagrange_weights(node, np.array([10 * edge, -10 * edge]), -edge, edge)
    np.testing.assert_array_equal(far, lagrange_weights(node, np.array([edge, -edge])))
    assert np.abs(far).max() < 2
