"""Soundings over planes: depth, scatter and level by beam angle are those planted, with missing beams as well."""

import numpy as np
import pytest

from insonify.comparison.detections import BIN_DEG, BINS, DetectedDepths
from insonify.comparison.frame import common_frame
from insonify.comparison.samples import Samples

ANGLE = np.radians(np.arange(-64.5, 65, 1.0))
MIDDLE = BIN_DEG * (np.arange(BINS) + 0.5) - 90
PINGS, SCATTER = 200, 0.03


def soundings(slope=0.0, *, gaps=0.0, level=0.0):
    """Ranges to a plane that rises to starboard, 10 m below, whose depths scatter by 3 cm, a share of them missing."""
    rng = np.random.default_rng(2)
    depth = 10.0 / (1 + slope * np.tan(ANGLE)) + SCATTER * rng.standard_normal((PINGS, ANGLE.size))
    depth[rng.random(depth.shape) < gaps] = np.nan
    values = np.where(np.isfinite(depth), 10 ** (level / 20), np.nan)[..., None] + 0j
    return Samples("fan", values, np.array([10.0]), "uPa", angle=ANGLE, detected_range=depth / np.cos(ANGLE))


@pytest.mark.parametrize("gaps", [0.0, 0.3], ids=["whole", "gaps"])
@pytest.mark.parametrize("slope", [0.0, 0.05])
def test_depth_scatter_and_level_are_found_by_angle(slope, gaps):
    """Depth to 4 mm, scatter to 8 % over a level bed, level to 1e-6 dB: 1000 soundings or more in a bin."""
    fan = soundings(slope, gaps=gaps, level=7.0)
    frame = common_frame(fan, fan)
    measure = DetectedDepths(frame)
    assert not measure.unsuited(frame) and len(measure.quantities) == 3 * BINS
    depth, scatter, level = measure.estimate(measure.sums(frame.first).sum(axis=0)).reshape(3, BINS)
    inside = abs(MIDDLE) < 60
    plane = 10.0 / (1 + slope * np.tan(ANGLE))
    row = ((np.degrees(ANGLE) + 90) // BIN_DEG).astype(int)
    due = np.array([plane[row == k].mean() if (row == k).any() else np.nan for k in range(BINS)])
    np.testing.assert_allclose(depth[inside], due[inside], atol=0.004)
    np.testing.assert_allclose(level[inside], 7.0, atol=1e-6)
    assert np.isnan(depth[abs(MIDDLE) > 70]).all()
    if not slope:
        np.testing.assert_allclose(scatter[inside], SCATTER, rtol=0.08)
