"""Bounds by which solids beside or below a ray are left out agree with the test of every column."""

import numpy as np

from insonify.propagation._silhouette_kernel import RayEnd, passes_above, passes_above_all
from insonify.propagation.knife_edge import edge_diffraction_table
from insonify.propagation.knife_edge_kernel import ENDLESS, FAR, edge_diffraction, edge_diffractions


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


def test_fields_past_many_edges_are_those_past_each():
    """In and out of shadows, on their edge, beyond the table and without end, bit for bit."""
    ends = np.array([0.0, -0.0, FAR, -FAR, np.nextafter(FAR, 0), 1e4, -1e4, ENDLESS, -ENDLESS, 1 / 96, 1e-300])
    numbers = np.concatenate([np.random.default_rng(1).uniform(-40, 40, 500), ends])
    table, real, imag = edge_diffraction_table(), np.empty_like(numbers), np.empty_like(numbers)
    edge_diffractions(numbers, table, np.empty((8, numbers.size)), real, imag)
    np.testing.assert_array_equal(real + 1j * imag, [edge_diffraction(float(number), table) for number in numbers])
