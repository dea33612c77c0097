"""Waveform bases of given sizes."""

import numpy as np

from insonify.synthesis.waveform_basis import WaveformBasis


def chebyshev_basis(count: int, half_range: float = 3e-3, middle: float = 0.0) -> WaveformBasis:
    """Basis of so many waveforms at Chebyshev's nodes of a range of Doppler factors less one."""
    nodes = middle - half_range * np.cos((np.arange(count) + 0.5) * np.pi / count)
    return WaveformBasis(nodes, (middle - half_range, middle + half_range))
