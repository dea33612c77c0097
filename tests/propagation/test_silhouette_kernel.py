"""Bounds by which solids beside or below a ray are left out agree with the test of every column."""

import numpy as np

from insonify.propagation._silhouette_kernel import RayEnd, passes_above, passes_above_all


def test_a_ray_above_the_highest_top_is_above_all_columns():
    """5000 rays past random columns: those above the highest pass each; most of those above each are found at once."""
    draw, found, above = np.random.default_rng(1), 0, 0
    for _ in range(5000):
        columns = np.zeros((6, 6))
        columns[:, 0], columns[:, 1] = draw.uniform(18, 20, 6), draw.uniform(8, 10, 6)
        columns[:, 4], columns[:, 5] = columns[:, 0] - 0.1, columns[:, 0] + 0.1
        reach, end, slope = draw.uniform(19.5, 60), draw.uniform(5, 11), draw.uniform(-0.5, 1.0)
        level, wavelength = float(np.cos(np.arctan(slope))), 0.00375
        ray = RayEnd(end, slope, level, reach / level)
        each = passes_above(ray, reach, wavelength, columns, 6.0)
        behind = reach - columns[:, 5].max(), reach - columns[:, 4].min()
        at_once = passes_above_all(ray, *behind, columns[:, 1].min(), wavelength, 6.0)
        assert each or not at_once
        found, above = found + at_once, above + each
    assert 0.5 * above < found < above
