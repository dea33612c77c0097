"""Caches between pings: bounded, shared by threads, and bit-identical with computing anew."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify.scene.seabed import Seabed
from insonify.scene.seabed_terrain import TILE_CELLS, SeabedTerrain
from insonify.scene.terrain.array_cache import ArrayCache

RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": 0.1}


def made(value, size=100):
    """A maker of an array of one value."""
    return lambda: np.full(size, float(value))


def test_an_array_is_made_once():
    """Requested again, the same array comes back and nothing is made."""
    kept, calls = ArrayCache(10_000), []

    def make():
        calls.append(1)
        return np.arange(5.0)

    first, again = kept.get("a", make), kept.get("a", make)
    assert first is again and len(calls) == 1 and len(kept) == 1


def test_what_is_kept_cannot_be_written_to():
    """A caller that would change it for all pings to come is stopped."""
    held = ArrayCache(10_000).get("a", made(1))
    with pytest.raises(ValueError, match="read-only"):
        held[0] = 2


def test_the_least_recently_used_array_is_deleted_first():
    """Three fit; requesting the first again saves it from the fourth."""
    kept = ArrayCache(3 * 800)
    for name in "abc":
        kept.get(name, made(ord(name)))
    kept.get("a", made(0))
    kept.get("d", made(ord("d")))
    assert len(kept) == 3 and kept.bytes == 3 * 800
    assert kept.get("a", made(-1))[0] == ord("a")
    assert kept.get("b", made(-1))[0] == -1  # made anew


def test_one_array_larger_than_all_is_still_given():
    """A bound that is too small costs time, never a result."""
    kept = ArrayCache(10)
    assert kept.get("a", made(7))[0] == 7 and len(kept) == 1
    assert kept.get("b", made(8))[0] == 8 and len(kept) == 1


def test_threads_share_one_store():
    """Many threads requesting few keys get the right arrays, and the count of bytes stays true."""
    kept = ArrayCache(5 * 800)
    rng = np.random.default_rng(1)
    requested = rng.integers(0, 12, 2000)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda k: kept.get(int(k), made(k))[0], requested))
    np.testing.assert_array_equal(found, requested)
    assert kept.bytes == 800 * len(kept) <= 5 * 800


def bed(seed=1, **relief):
    """A bed of power-law relief."""
    return (
        Seabed(depth=20.0, relief={**RELIEF, **relief}, seed=seed, cutoff_wavelength=0.5)
        .completed(1, 100e3, 1500.0)
        .terrain
    )


def test_tiles_of_the_map_join():
    """The last row and column of a tile are the first of the next: no step where a shadow crosses a seam."""
    ground = bed()
    here, north, east = (ground.heightmap_synthesizer.heights(*which) for which in ((0, 0), (1, 0), (0, 1)))
    assert here.shape == (TILE_CELLS + 1, TILE_CELLS + 1)
    np.testing.assert_allclose(here[-1], north[0], atol=2e-6)
    np.testing.assert_allclose(here[:, -1], east[:, 0], atol=2e-6)


def test_the_span_holds_all_of_the_ground():
    """Nothing stands above the shallowest or lies below the deepest."""
    ground = bed(seed=5)
    north, east = np.random.default_rng(3).uniform(-2000, 2000, (2, 100_000))
    depth = ground.depth_at(north, east)
    low, high = ground.span
    assert low < depth.min() and depth.max() < high


def test_a_smooth_bed_takes_nothing_from_a_bounce_and_a_rough_one_all():
    """exp(-2 k^2 h^2 sin^2): 1 at grazing, falling with the angle and with roughness."""
    sine = np.linspace(0, 1, 50)
    zone = np.full(50, 5.0)
    gentle, rough = (bed(rms=rms).roughness_reflection_factor(sine, 0.015, zone) for rms in (1e-4, 0.5))
    assert gentle[0] == rough[0] == 1.0
    assert np.all(np.diff(gentle) <= 0) and np.all(np.diff(rough) <= 0)
    assert np.all(rough <= gentle) and rough[-1] < 1e-10 and gentle[-1] > 0.5


def test_only_waves_shorter_than_the_zone_disturb_a_bounce():
    """A larger Fresnel zone holds more roughness; a zone no longer than the sound's wave holds none."""
    ground, sine = bed(rms=0.01), np.array([0.1])
    left = [
        float(ground.roughness_reflection_factor(sine, 0.015, np.array([zone]))[0]) for zone in (0.015, 0.5, 2.0, 10.0)
    ]
    assert left[0] == 1.0 and np.all(np.diff(left) < 0)


def test_equality_of_seabeds_includes_all_parameters():
    """Two beds of one seed are the same ground; another seed is another."""
    one, same, other = bed(), bed(), bed(seed=2)
    place = np.linspace(-100, 100, 500)
    np.testing.assert_array_equal(one.depth_at(place, place), same.depth_at(place, place))
    assert np.abs(one.depth_at(place, place) - other.depth_at(place, place)).max() > 0.01
    assert isinstance(one, SeabedTerrain)
