"""Bounds by which solids on either side of a ray, or below it are left out, and the field past many edges at once."""

import numpy as np

from insonify.propagation._silhouette_kernel import (
    LANES,
    EdgeScratch,
    PlanView,
    RayEnd,
    Silhouette,
    SolidScreen,
    blocked_part,
    edge_fields,
    outline_of,
    passes_above,
    passes_above_all,
)
from insonify.propagation.knife_edge import edge_polynomials, knife_edge
from insonify.propagation.knife_edge_kernel import ENDLESS, FAR

BED_DEPTH, WAVELENGTH = 10.0, 0.002


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
    numbers = np.concatenate([np.linspace(-40, 40, 20001), [-500.0, 500.0, -ENDLESS, ENDLESS]]).astype(np.float32)
    real, imag = np.empty_like(numbers), np.empty_like(numbers)
    edge_fields(numbers, edge_polynomials(), real, imag)
    exact = knife_edge(numbers[:-2].astype(float))
    np.testing.assert_allclose(real + 1j * imag, [*exact, 1, 0], rtol=0, atol=3e-6)
    shadow = numbers > 10  # the fields become small: they stay as exact, relatively
    np.testing.assert_allclose((np.abs(real + 1j * imag) * numbers)[shadow], 1 / np.sqrt(2) / np.pi, rtol=1e-3)


def drawn_silhouette(draw: np.random.Generator, count: int) -> Silhouette:
    """Silhouette of some columns 9 to 10 m away, of which about half stand on the seabed."""
    borders = np.sort(draw.uniform(-0.05, 0.05, count + 1))
    columns = np.empty((count, 6))
    columns[:, 0], columns[:, 1] = draw.uniform(9, 10, count), draw.uniform(9.5, 9.8, count)
    columns[:, 2], columns[:, 3] = draw.uniform(9, 10, count), draw.uniform(9.85, 10.15, count)
    columns[:, 4], columns[:, 5] = columns[:, [0, 2]].min(axis=1) - 0.1, columns[:, [0, 2]].max(axis=1) + 0.1
    return Silhouette(0.3, borders, draw.uniform(9, 10, count + 1), columns)


def test_the_blocked_part_is_the_sum_over_the_columns():
    """Random silhouettes, column by column with exact Fresnel integrals in double precision, to 1e-5."""
    draw, largest, any_base = np.random.default_rng(2), 0.0, 0
    for count in (1, 7, 8, 9, 29, 64):
        silhouette = drawn_silhouette(draw, count)
        screen = SolidScreen(silhouette, BED_DEPTH, 0, False, 6.0)
        outline = outline_of(silhouette, BED_DEPTH)
        size = 2 * outline.tops.shape[1] + outline.bases.shape[1]
        assert outline.tops.shape[1] % LANES == outline.bases.shape[1] % LANES == 0
        any_base += int((outline.base_row >= 0).sum())
        for _ in range(40):
            scratch = EdgeScratch(*(np.empty(size, np.float32) for _ in range(3)))
            turn, reach = draw.uniform(-0.06, 0.06), draw.uniform(9.2, 16)
            depth = draw.uniform(9.5, 10.1) * reach / 9.5  # at the silhouette about its top
            slope = depth / reach
            end = RayEnd(depth, slope, 1 / np.hypot(1, slope), reach * np.hypot(1, slope))
            view = PlanView(reach, reach, np.cos(turn), np.sin(turn))
            found, _ = blocked_part(end, view, WAVELENGTH, screen, outline, edge_polynomials(), scratch)
            exact = expected_blocked_part(silhouette, end, reach, turn)
            assert abs(found - exact) < 1e-5
            largest = max(largest, abs(exact))
    assert largest > 0.9
    assert any_base > 20


def expected_blocked_part(silhouette: Silhouette, end: RayEnd, reach: float, turn: float) -> complex:
    """The sum over the columns of the two sides' difference times the base's field less the top's."""
    columns = silhouette.columns
    behind = reach - silhouette.border_ranges * np.cos(silhouette.border_bearings - turn)
    off = silhouette.border_ranges * np.sin(silhouette.border_bearings - turn)
    sides = np.where(
        behind > 0, knife_edge(fresnel_number(off, np.abs(behind) / end.horizontal_component, end.length)), off < 0
    )
    numbers = []
    for distance, depth in ((columns[:, 0], columns[:, 1]), (columns[:, 2], columns[:, 3])):
        below_edge = (end.depth - (reach - distance) * end.slope - depth) * end.horizontal_component
        numbers.append(fresnel_number(below_edge, np.abs(reach - distance) / end.horizontal_component, end.length))
    bases = np.where((columns[:, 3] < BED_DEPTH) & (reach > columns[:, 2]), knife_edge(numbers[1]), 1)
    parts = (sides[:-1] - sides[1:]) * (bases - knife_edge(numbers[0]))
    crosses = (silhouette.border_bearings[:-1] <= turn) & (turn <= silhouette.border_bearings[1:])
    is_inside = crosses & (columns[:, 4] < reach) & (reach < columns[:, 5])
    return complex(np.sum(parts[(numbers[0] > -FAR) & (reach > columns[:, 0]) & ~is_inside]))


def fresnel_number(off: np.ndarray, behind: np.ndarray, length: float) -> np.ndarray:
    """Fresnel number from the excess length of the path by the edge, at least a wavelength from both ends."""
    behind = np.maximum(behind, WAVELENGTH)
    before = length - behind
    excess = np.hypot(off, behind) - behind + np.hypot(off, before) - before
    return np.asarray(np.sign(off) * np.sqrt(np.maximum(excess, 0) * 4 / WAVELENGTH))
