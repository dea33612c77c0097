"""No seabed occludes a ray near a bottom bounce whose Fresnel zone is wide against the relief."""

import numpy as np
import pytest

from insonify.engines.fast_reverberation._line_of_sight_kernel import (
    RadialProfile,
    mark_clear_bounces,
    mark_lit_samples,
    mark_reached_samples,
    mark_used_horizons,
    running_horizon,
)
from insonify.engines.fast_reverberation.reverberation_plan import bounce_tables
from insonify.engines.radial_tables import FamilyTable, IsovelocityChannel
from insonify.propagation.families import image_depth

FAMILIES, STEP, COUNT, DEPTH = ("D", "S", "BS", "SBS", "BSBS"), 0.05, 2000, 10.0


def tables(source: float) -> FamilyTable:
    """Families of a sonar at a depth [m]."""
    codes, rows, names = bounce_tables(FAMILIES)
    images, launches = (np.array([image_depth(name, source, DEPTH) for name in some]) for some in (FAMILIES, names))
    rising = np.array([name.endswith("B") for name in names])
    return FamilyTable(
        images, codes, rows, launches, rising, np.ones((len(FAMILIES), 2), np.complex64), np.zeros(0, np.float32), 0.0
    )


def reached(terrain: np.ndarray, channel: IsovelocityChannel, table: FamilyTable, clear: np.ndarray) -> np.ndarray:
    """Families that reach each sample of a radial, a bit for each."""
    slope, horizon = np.full((2, table.horizon_rising.size, COUNT), np.nan, np.float32)
    used = np.zeros(table.horizon_rising.size, bool)
    mark_used_horizons(clear, table, used)
    for row in np.flatnonzero(used):
        running_horizon(terrain, table.horizon_image_depths[row], table.horizon_rising[row], STEP, 0.4, (0, COUNT),
                        slope[row], horizon[row])  # fmt: skip
    profile = RadialProfile(terrain, COUNT, 0.4, STEP, slope, horizon)
    found, number = np.empty(COUNT, np.int32), np.arange(COUNT, dtype=np.int32)
    requested = np.full(COUNT, (1 << len(FAMILIES)) - 1, np.int32)
    mark_lit_samples(int(requested[0]), profile, 0, table, clear, found)
    for f in np.flatnonzero(~clear):
        mark_reached_samples(f, found, number, requested, profile, channel, table)
    return found


@pytest.mark.parametrize("wavelength", [0.004, 0.015, 0.06, 0.2])
@pytest.mark.parametrize("source", [0.5, 4.0, 9.0])
def test_families_that_no_seabed_occludes_reach_the_same_samples_without_its_test(
    wavelength: float, source: float
) -> None:
    """Blocks and single spikes as high as the relief allows that just leaves a family clear, under all of them."""
    table, without_bottom = tables(source), np.array(["B" not in name for name in FAMILIES])
    random, seen, occluded = np.random.default_rng(1), 0, False
    for rise in np.geomspace(0.003, min(0.9 * (DEPTH - source), 4.0), 24):
        channel = IsovelocityChannel(source, DEPTH, 1500.0, wavelength, (DEPTH - rise, DEPTH + rise))
        clear = np.zeros(len(FAMILIES), bool)
        mark_clear_bounces(channel, table, clear)
        assert clear[without_bottom].all() and DEPTH - rise > source
        seen += int(clear.sum() - without_bottom.sum())
        for width in (1, 3, 30):
            signs = np.repeat(random.choice([-1.0, 1.0, 1.0], COUNT // width + 1), width)[:COUNT]
            terrain = (DEPTH - rise * signs).astype(np.float32)
            tested = reached(terrain, channel, table, without_bottom)
            np.testing.assert_array_equal(reached(terrain, channel, table, clear), tested)
            occluded |= bool((reached(terrain, channel, table, np.ones(len(FAMILIES), bool)) != tested).any())
    assert seen > 3 and occluded  # higher relief does occlude


def test_relief_higher_than_the_zone_is_wide_is_tested() -> None:
    """At 4 m above the seabed and 15 mm of wavelength, the bound is 0.98 x 1.612 sqrt(0.015 x 6 x (1 - 6 / 26))."""
    table = tables(4.0)
    for rise, expected in ((0.40, True), (0.43, False)):
        clear = np.zeros(len(FAMILIES), bool)
        mark_clear_bounces(IsovelocityChannel(4.0, DEPTH, 1500.0, 0.015, (DEPTH - rise, DEPTH + rise)), table, clear)
        assert clear[2] == expected
