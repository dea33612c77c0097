"""A slice is the whole scene seen through one beam: the same levels, one scatterer's breadth of it at a time."""

import numpy as np
import pytest
import xarray as xr

from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, levels, simulate
from oracles.scenes import nominal, point

WATER = {"noise_level_db": None, "absorption_db_per_m": 0.035}
GEOMETRIES = ("slice", "3d")
LATE = {"window": (0.17, 0.19)}


def both(paths: dict[str, object] | None = None, **settings: object) -> tuple[Scenario, Scenario]:
    """The same scenario as a slice and as a whole."""
    flat, whole = (nominal(water=WATER, paths={**(paths or {}), "geometry": name}, **settings) for name in GEOMETRIES)
    return flat, whole


def mean_power(curves: xr.Dataset, contribution: str, pair: str = "all", window: tuple[float, float] = (0, 1)) -> float:
    """Mean of one curve over a part of its window [uPa^2]."""
    level = curves.level_db.sel(contribution=contribution, pair=pair).sel(time=slice(*window)).values
    return float(np.mean(10 ** (level / 10)))


@pytest.mark.parametrize("contribution", ["seabed", "surface"])
def test_each_pair_of_legs_is_as_strong_in_a_slice_as_in_the_whole(contribution: str) -> None:
    """Six curves of a boundary: the footprint at the geometric mean of both legs, within 0.3 dB over 20 ms.

    The beam of the slice is as wide as the whole one's energy; what is left is the draw of places in two dimensions
    (0.15 dB) and the beam that differs between a steep and a flat leg of one pair.
    """
    rough = {"surface": {"scattering": {"strength_db": -30}}} if contribution == "surface" else {}
    flat, whole = (
        levels(scenario)
        for scenario in both({"contributions": [contribution], "beam_cutoff_db": -40}, track=LATE, **rough)
    )
    pairs = [str(name) for name in whole.pair.values]
    assert len(pairs) == 7
    for pair in pairs:
        ratio = mean_power(flat, contribution, pair) / mean_power(whole, contribution, pair)
        assert 10 * np.log10(ratio) == pytest.approx(0, abs=0.3), pair


def test_a_point_on_the_axis_is_the_same_sound_in_a_slice() -> None:
    """A target has no breadth to lose: all 25 paths, bit by bit, when only the target is received."""
    scenarios = both({"contributions": ["target"]}, targets=[point(0, 140, 15)], track={"window": (0.18, 0.22)})
    flat, whole = (simulate(scenario).pressure.values for scenario in scenarios)
    assert np.abs(whole).max() > 0
    np.testing.assert_array_equal(flat, whole)


WALLS = {
    "broadside": {"size": (8.0, 1.0, 1.0)},
    "narrower than the beam": {"size": (0.3, 1.0, 1.0)},
    "end on": {"size": (1.0, 8.0, 1.0), "heading": np.pi / 2},
}


@pytest.mark.parametrize("wall", WALLS)
def test_a_wall_echoes_as_strong_in_a_slice_as_in_the_whole(wall: str) -> None:
    """Direct echo of a box facing the beam, wider or narrower than it: the part that the beam covers, to 0.5 dB.

    A wide wall fills the energy width of the beam; a narrow one stands whole on the axis, where the beam is flat.
    """
    echo = {"window": (0.1995, 0.2035)}
    flat, whole = (
        levels(scenario)
        for scenario in both({"max_reflections": 0, "contributions": ["target"]}, box=WALLS[wall], track=echo)
    )
    assert 10 * np.log10(mean_power(flat, "target") / mean_power(whole, "target")) == pytest.approx(0, abs=0.5)


def test_a_turned_box_shows_a_slice_the_face_that_the_beam_strikes() -> None:
    """Turned by 30 degrees the near face still faces the sonar, and every point of the section lies in the plane."""
    flat, whole = both(
        {"contributions": ["target"], "max_reflections": 0}, box={"size": (8.0, 2.0, 1.0), "heading": 0.5}
    )
    simulator = build_simulator(flat)
    here = simulator.ping_geometry(0)
    points = [pairs.scatterers for pairs in simulator.engine.all_pairs(here)]
    place = np.concatenate([p.position for p in points])
    assert np.abs(place[:, 0]).max() < 1e-9
    # the chord of the plane through a box 2 m deep, turned by 0.5 rad: 2 / cos 0.5
    assert np.ptp(place[:, 1]) == pytest.approx(2 / np.cos(0.5), rel=0.01)
    received = arrivals(flat)
    assert received.delay.min() == pytest.approx(arrivals(whole, window=(0.19, 0.21)).delay.min(), abs=4e-3)


def test_a_box_beside_the_plane_is_not_cut_by_the_slice() -> None:
    """Three metres off the axis the plane misses it; the whole scene receives it through a side lobe."""
    aside = {"position": (3.0, 150.5), "size": (2.0, 1.0, 1.0)}
    flat, whole = both({"contributions": ["target"], "max_reflections": 0}, box=aside, track={"window": (0.195, 0.21)})
    assert len(arrivals(flat)) == 0
    assert len(arrivals(whole)) > 0


def test_the_shadow_of_a_wide_wall_is_as_long_in_a_slice() -> None:
    """A wall 40 m wide and 2 m high at 100 m: dark from 101 to 128 m of ground by similar triangles, lit beyond.

    9 m above the bed the ray over the far edge of the top lands at 101 * 9 / 7 = 129.9 m: dark to 173 ms.
    """
    wall = {"position": (0.0, 100.5), "size": (40.0, 1.0, 2.0)}
    scenarios = both({"contributions": ["seabed"], "max_reflections": 0}, box=wall, track={"window": (0.13, 0.19)})
    clear = both({"contributions": ["seabed"], "max_reflections": 0}, track={"window": (0.13, 0.19)})
    end = 2 * np.hypot(101 * 9 / 7, 9) / 1500
    for shaded, free in zip(scenarios, clear, strict=True):
        dark, light = levels(shaded), levels(free)
        for window, least, most in (((0.137, end - 5e-4), -300, -40), ((end + 5e-4, 0.189), -1.5, 1.5)):
            power = mean_power(dark, "seabed", window=window) / mean_power(light, "seabed", window=window)
            assert least < 10 * np.log10(power + 1e-30) < most, window


def test_a_slice_follows_its_beam() -> None:
    """Mounted 110 degrees clockwise from the bow of a ship heading north, the plane points at 110."""
    scenario = nominal(
        water=WATER,
        sonar={"mounting": {"bearing": np.radians(110)}},
        paths={"geometry": "slice", "contributions": ["seabed"]},
        track={"window": (0.1, 0.102)},
    )
    found = arrivals(scenario)
    bearing = np.degrees(np.arctan2(found.position[:, 1], found.position[:, 0]))
    np.testing.assert_allclose(bearing, 110.0, atol=1e-6)


def test_a_slice_of_two_beams_is_refused() -> None:
    """Bearing needs the third dimension."""
    with pytest.raises(ValueError, match="has one beam, but the sonar steers 2"):
        nominal(receive={"steer": [0.0, 0.1]}, paths={"geometry": "slice"})
