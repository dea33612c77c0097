"""Bottom bounces of fast reverberation are reflected by the planes that the general engine fits to the terrain."""

from typing import Any

import numpy as np
import pytest

from engines.test_fast_reverberation import GROUND, SIDESCAN, made, quickly, thoroughly
from engines.test_shadows_over_relief import means, scene
from insonify.engines.fast_reverberation import fast_relief_reflections, reverberation
from insonify.engines.fast_reverberation.fast_relief_reflections import reflect_at_fitted_planes
from insonify.propagation.local_planes import local_plane_paths
from insonify.recent_results import RecentResults
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator, simulate


@pytest.mark.parametrize(("relief", "off"), [(0.02, 30.0), (0.03, 30.0), (0.03, -0.35)])
def test_open_ground_and_shadow_by_all_paths_are_those_of_the_general_engine(relief: float, off: float) -> None:
    """Any 2 ms within 0.3 dB, beside the box and behind it: reflections off the mean plane were 0.7 to 1.5 dB off."""
    families = ("D", "S", "BS")
    general = means(scene(relief, off, families, scatterers_per_cell=20.0), thoroughly)
    apart = np.abs(means(scene(relief, off, families), quickly) - general)
    assert apart.max() < 0.3


@pytest.mark.parametrize("order", [2, 4])
def test_a_wide_view_by_up_to_four_bounces_is_that_of_the_general_engine(order: int) -> None:
    """Any 2 ms of 10 m of water over 3 cm of relief within 0.35 dB, 0.1 dB rms."""
    simulator = build_simulator(made(order))
    general = build_simulator(
        made(order, paths={"max_reflections": order, "edge_diffraction": "none", "scatterers_per_cell": 20.0})
    )
    time = simulator.grid.time
    both = quickly(simulator)[0], thoroughly(general)[0]
    starts = np.arange(0.012, 0.046, 2e-3)
    quick, slow = (np.array([one[(time >= t) & (time < t + 2e-3)].mean() for t in starts]) for one in both)
    apart = 10 * np.log10(quick / slow)
    assert np.abs(apart).max() < 0.35 and apart.std() < 0.1


def test_each_leg_is_that_of_the_general_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Legs with bottom bounces, each a node: delays within 1 ns of the general engine's, directions in 1e-6.

    Off the mean plane they are late or early by 11 us rms, and leave elsewhere by 10 mrad.
    """
    monkeypatch.setattr(fast_relief_reflections, "MAX_BOUNCE_STEP", 0.0)
    simulator = build_simulator(made(4))
    here, kept = simulator.ping_geometry(0), []

    def spied(*expected: Any) -> None:
        part, legs = expected[4], expected[5]
        first, delay, departure = legs.radial_offsets, legs.delay, legs.departure
        level = delay[:, : first[-1]].copy(), departure[:, :, : first[-1]].copy()
        reflect_at_fitted_planes(*expected)
        listed = np.concatenate([part.lists.list_offsets[one] + np.arange(n) for one, n in
                                 zip(part.list_rows, np.diff(first), strict=True)])  # fmt: skip
        reach, depth = legs.range_depth[:, : first[-1]]
        points = np.stack(
            [*(here.transmit_position[:2, None] + reach * part.lists.beam_bearing[:, listed]), depth], axis=-1
        )
        kept.append((points, delay[:, : first[-1]].copy(), departure[:, :, : first[-1]].copy(), *level))

    monkeypatch.setattr(reverberation, "reflect_at_fitted_planes", spied)
    quickly(simulator)
    ((points, delay, departure, level, straight),) = kept
    count = len(points)
    law = simulator.engine.scene.seabed.law(here.frequency, 1500.0)
    assert law is not None
    up = np.tile([0.0, 0.0, -1.0], (count, 1))
    ground = Scatterers("seabed", "seabed", law, points, up, np.ones(count), np.ones(count, complex),
                        np.zeros(count, np.uint64))  # fmt: skip
    legs = simulator.engine.path_pairs(here, ground).transmit_legs
    for row, name in enumerate(legs.families):
        moved = np.flatnonzero((delay[row] != level[row]) & (legs.reflection_coefficient[row] != 0))
        assert len(moved) > 100 if name == "BS" else "B" in name or not len(moved)
        np.testing.assert_allclose(delay[row, moved], legs.delay[row, moved], rtol=0, atol=1e-9)
        np.testing.assert_allclose(departure[row][:, moved].T, legs.departure[row, moved], rtol=0, atol=1e-6)
        if name == "BS":
            assert (delay[row] - level[row])[moved].std() > 5e-6
            assert (departure - straight)[row][:, moved].std() > 5e-3


@pytest.mark.parametrize("order", [2, 4])
def test_legs_between_nodes_are_nearly_those_off_planes_of_their_own(
    order: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 ns, 0.2 mrad and 0.004 dB rms, intensities 0.001 dB rms, by planes at fewer than four samples in five."""
    simulator, found, counts = build_simulator(made(order)), [], []

    def spied(*expected: Any) -> None:
        reflect_at_fitted_planes(*expected)
        legs, size = expected[5], expected[5].radial_offsets[-1]
        columns = legs.delay[:, :size], legs.departure[:, :, :size], np.abs(legs.amplitude[:, :size])
        found.append([column.copy() for column in columns])

    def counted(family: str, position: Any, points: Any, *rest: Any) -> Any:
        counts.append(len(points))
        return local_plane_paths(family, position, points, *rest)

    monkeypatch.setattr(reverberation, "reflect_at_fitted_planes", spied)
    monkeypatch.setattr(fast_relief_reflections, "local_plane_paths", counted)
    series = [quickly(simulator)[0]]
    monkeypatch.setattr(fast_relief_reflections, "MAX_BOUNCE_STEP", 0.0)
    series.append(quickly(simulator)[0])
    half = len(counts) // 2
    assert 0 < sum(counts[:half]) < 0.8 * sum(counts[half:])
    (delay, departure, amplitude), (exact_delay, exact_departure, exact) = found
    f, n = np.nonzero((amplitude > 0) & (exact > 0) & (delay != exact_delay))
    assert len(n) > 100
    assert np.mean((amplitude > 0) != (exact > 0)) < 1e-3
    assert (delay - exact_delay)[f, n].std() < 0.06e-6
    assert (departure - exact_departure)[f, :, n].std() < 0.2e-3
    assert (20 * np.log10(amplitude[f, n] / exact[f, n])).std() < 0.004
    apart = 10 * np.log10(series[0][GROUND] / series[1][GROUND])
    assert 0 < np.sqrt(np.mean(apart**2)) < 0.001


def test_flat_beds_and_paths_without_bottom_bounces_request_no_planes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flat bed with all paths, and relief with direct and surface paths alone: no paths off fitted planes at all."""
    requested: list[Any] = []
    monkeypatch.setattr(
        "insonify.engines.fast_reverberation.fast_relief_reflections.local_plane_paths",
        lambda *expected: requested.append(expected),
    )
    quickly(build_simulator(made(2, seabed={**SIDESCAN["seabed"], "relief": None})))
    quickly(build_simulator(made(2, paths={"max_reflections": 2, "families": ["D", "S"], "edge_diffraction": "none"})))
    assert not requested


def test_bits_of_shadows_with_bottom_bounces_do_not_depend_on_threads() -> None:
    """The box over 2 cm of relief, all paths: one thread or three, anew or with all that an earlier ping has kept."""
    box = scene(0.02, 0.6, ("D", "S", "BS"))
    first = simulate(box, threads=3).intensity.values
    reverberation._PREPARED = RecentResults(8)
    np.testing.assert_array_equal(simulate(box, threads=1).intensity.values, first)
