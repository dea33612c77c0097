"""Bounds by which solids on either side of a ray, or below it are left out, and the field past many edges at once."""

import numpy as np

from insonify.propagation._silhouette_kernel import RayEnd, edge_fields, passes_above, passes_above_all
from insonify.propagation.knife_edge import edge_polynomials, knife_edge
from insonify.propagation.knife_edge_kernel import ENDLESS


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


def test_fields_past_many_edges_are_fresnel_integrals():
    """In light and shadow, on each quarter of a cycle, to 3e-6; past an endless screen 0, without one 1."""
    numbers = np.concatenate([np.linspace(-40, 40, 20001), [-500.0, 500.0, -ENDLESS, ENDLESS]])
    real, imag = np.empty_like(numbers), np.empty_like(numbers)
    edge_fields(numbers, edge_polynomials(), real, imag)
    np.testing.assert_allclose(real + 1j * imag, [*knife_edge(numbers[:-2]), 1, 0], rtol=0, atol=3e-6)
    shadow = numbers > 10  # the fields become small: they stay as exact, relatively
    np.testing.assert_allclose((np.abs(real + 1j * imag) * numbers)[shadow], 1 / np.sqrt(2) / np.pi, rtol=1e-3)
