"""Echoes of ground with relief: a flat bed's where it is flat, the sum of its facets where it is not."""

import numpy as np
import pytest

from insonify.engines.ping_scatterers import ping_scatterers
from insonify.ocean.water import Water
from insonify.scattering import Sediment
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain.array_cache import ArrayCache
from insonify.simulator import arrivals, build_simulator, simulate
from oracles import handbook_bottom
from oracles.roughness import roughness_rms
from oracles.scenes import nominal

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05, "outer_scale": 20.0}
FAR = {"window": (0.16, 0.2)}


def received(**changes):
    """Time and series of one ping of the nominal scene."""
    found = simulate(nominal(**changes), threads=2)
    series = found.pressure if "pressure" in found else found.intensity
    return found.time.values, series.values[0, 0]


def detrended_std_db(intensity, time):
    """Fluctuation of a level about a smooth curve [dB]."""
    level = 10 * np.log10(intensity)
    return float(np.std(level - np.polyval(np.polyfit(time, level, 3), time)))


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_relief_of_no_height_is_a_flat_bed_bit_for_bit(field):
    """Nothing is rounded, hidden or lost by requesting ground that is flat."""
    relief = {"relief": {"kind": "ripples", "height": 0.0, "wavelength": 2.0}}
    _, flat = received(field=field, track=FAR)
    _, same = received(field=field, track=FAR, seabed=relief)
    np.testing.assert_array_equal(flat, same)


def test_a_fractal_bed_flickers_and_a_flat_one_does_not():
    """The A-scan of the expectation at 120 to 150 m: above 3 dB for 5 cm rms, below 0.2 dB for none."""
    for seabed, low, high in (({}, 0.0, 0.2), ({"relief": FRACTAL}, 3.0, 12.0)):
        time, intensity = received(field="incoherent", seabed=seabed, track={"window": (0.15, 0.21)},
                                paths={"families": ["D"]})  # fmt: skip
        inner = (time > 0.16) & (time < 0.2)
        assert low <= detrended_std_db(intensity[inner], time[inner]) < high


def test_more_points_do_not_change_the_mean():
    """Twice and four times the points on the same ground: the mean over 25 m of bed within 0.1 dB."""
    seabed = {"relief": FRACTAL, "cutoff_wavelength": 0.5}
    mean = [
        10
        * np.log10(received(field="incoherent", seabed=seabed, track=FAR, paths={"scatterers_per_cell": n})[1].mean())
        for n in (5.0, 10.0, 20.0)
    ]
    assert np.ptp(mean) < 0.1


def test_relief_moved_with_its_world_gives_the_same_echoes():
    """Scatterer grid, ship and relief 1 km away and turned by 1 rad: pressure within 1e-3 of the same draw."""
    lattice = {"origin": (800.0, -600.0), "heading": 1.0}
    still = received(seabed={"relief": FRACTAL}, track=FAR)[1]
    place = {"position": (800.0, -600.0, 11.0), "heading": 1.0}
    moved = received(seabed={"relief": FRACTAL, "scatterer_grid": lattice}, track={**FAR, **place})[1]
    assert np.linalg.norm(moved - still) < 1e-2 * np.linalg.norm(still)


def test_the_mean_over_gentle_relief_is_that_of_its_lit_facets():
    """Direct echoes of 12 m of bed, against a sum over a plain grid of facets with rays walked one by one: 0.2 dB.

    The oracle shares the seabed's heights and Lambert's law, but neither points, slices nor sectors.
    """
    scenario = nominal(seabed={"relief": FRACTAL, "cutoff_wavelength": 1.0}, paths={"families": ["D"]},
                       field="incoherent",
                       track={"window": (0.13, 0.16)})  # fmt: skip
    simulator = build_simulator(scenario)
    here, bed = simulator.ping_geometry(0), scenario.scene.seabed.terrain
    east = np.arange(0.1, 112.0, 0.04)
    north = np.arange(-4.0, 4.0, 0.05)
    expected = _facet_sum(bed, here.transmit_position, north, east, (100.0, 112.0))
    computed = 0.0
    for pairs in simulator.engine.all_pairs(here, quadrature=True):
        place = pairs.scatterers.position
        inside = (np.abs(place[:, 0]) < 4.0 * place[:, 1] / 112.0) & (place[:, 1] > 100.0) & (place[:, 1] < 112.0)
        computed += np.sum((np.abs(pairs.transmit_legs.amplitude[0]) ** 2 * pairs.strength[0])[inside] ** 2)
    assert 10 * np.log10(computed / expected) == pytest.approx(0.0, abs=0.2)


def _facet_sum(bed, sonar, north, east, window_east):
    """Sum over a grid of facets of mu sin^2 / L^4 with absorption, each lit or not by the ray along its own bearing."""
    n, e = np.meshgrid(north, east, indexing="ij")
    n = n * e / window_east[1]  # a fan of bearings; its cells grow with the distance
    found = bed.relief.sample(n, e)
    depth, distance = bed.depth - found.height, np.hypot(n, e)
    launch = (depth - sonar[2]) / distance
    lit = launch <= np.minimum.accumulate(launch, axis=1)
    stretch = np.sqrt(1 + np.sum(found.slope**2, axis=-1))
    length = np.hypot(distance, depth - sonar[2])
    sine = (n * found.slope[..., 0] + e * found.slope[..., 1] + depth - sonar[2]) / length / stretch
    area = np.gradient(north)[:, None] * np.gradient(east) * e / window_east[1] * stretch
    loss = 10 ** (-Water().absorption(1e5) * length / 10)
    echo = np.where(lit & (sine > 0), 10**-2.7 * sine**2 * area / length**4 * loss**2, 0.0)
    return echo[:, (east > window_east[0])].sum()


def test_a_facet_lies_and_faces_as_the_ground_does():
    """Positions are on the seabed, normals are its gradient's, areas are the cell's over the normal's vertical part."""
    scenario = nominal(seabed={"relief": FRACTAL}, track=FAR)
    simulator = build_simulator(scenario)
    here, bed = simulator.ping_geometry(0), scenario.scene.seabed.terrain
    points = simulator.engine.blocks(here)[0]()
    north, east, depth = points.position.T
    np.testing.assert_allclose(depth, bed.depth_at(north, east), atol=1e-9)
    step = 1e-4
    slope = np.stack([(bed.depth_at(north + step, east) - bed.depth_at(north - step, east)) / (2 * step),
                      (bed.depth_at(north, east + step) - bed.depth_at(north, east - step)) / (2 * step)])  # fmt: skip
    np.testing.assert_allclose(points.normal[:, :2].T / -points.normal[:, 2], slope, atol=1e-6)
    level = build_simulator(nominal(track=FAR)).engine.blocks(here)
    known = {
        int(key): area for p in (block() for block in level) for key, area in zip(p.scatterer_id, p.area, strict=True)
    }
    area = np.array([known.get(int(key), np.nan) for key in points.scatterer_id])
    both = np.isfinite(area)
    assert both.sum() > 1000
    np.testing.assert_allclose(points.area[both], area[both] / -points.normal[both, 2], rtol=1e-9)


def test_what_is_kept_changes_nothing():
    """Ground evaluated anew and cached ground are bit-identical; the store loses the oldest beyond its bound."""
    scenario = nominal(seabed={"relief": FRACTAL}, track=FAR)
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    seen = ping_scatterers(scenario.scene, scenario.paths, 1, here, simulator.engine.rays)
    first, again = (block() for block in (seen.blocks()[0], seen.blocks()[0]))
    np.testing.assert_array_equal(first.position, again.position)
    bed = scenario.scene.seabed.terrain
    fresh = SeabedTerrain(bed.depth, bed.relief)
    np.testing.assert_array_equal(fresh.heightmap_synthesizer.heights(3, 4), bed.heightmap_synthesizer.heights(3, 4))
    store = ArrayCache(100)
    made = []
    for key in (1, 2, 1, 3, 1, 2):
        store.get(key, lambda key=key: made.append(key) or np.zeros(6))
    assert made == [1, 2, 3, 2] and store.bytes <= 100 and len(store) == 2


def test_roughness_takes_from_a_bottom_bounce_what_rayleigh_predicts():
    """B legs lose exp(-2 k^2 h^2 sin^2), h the rms height between the bounce's mirror and the wave."""
    changes = {"targets": [{"shape": "point", "position": (0.0, 100.0, 11.0)}], "track": {"window": (0.1, 0.2)},
               "paths": {"contributions": ["target"], "families": ["B"]}}  # fmt: skip
    rough = {"kind": "power-law", "hurst": 0.8, "rms": 0.01, "outer_scale": 20.0}
    plain, over = (arrivals(nominal(seabed=bed, **changes)) for bed in ({}, {"relief": rough}))
    sine, k, bed = 18 / np.hypot(18, 100), 2 * np.pi / 0.015, nominal(seabed={"relief": rough}).scene.seabed.terrain
    half = np.sqrt(0.015 * np.hypot(18, 100) / 4) / sine
    height = roughness_rms(bed.relief, 2 * np.pi / (2 * half * np.sqrt(sine)), k)
    left = abs(over.reflection_coefficient[0]) / abs(plain.reflection_coefficient[0])  # out and back
    assert left == pytest.approx(np.exp(-4 * (k * height * sine) ** 2), rel=0.02)
    assert 0.05 < left < 0.95


def strength_db(seabed, grazing, seed):
    """Backscattering strength of a ring of bed, by its direct echo next to that of a flat Lambert bed [dB]."""
    arrival = 2 * 9.0 / np.sin(grazing) / 1500
    point = {"kind": "point", "length": None}
    level = []
    for bed in ({}, seabed):
        time, intensity = received(
            field="incoherent", seed=seed, seabed=bed, transmit=point, receive=point, paths={"families": ["D"]},
            sonar={"pulse": {"kind": "cw", "frequency": 30e3, "duration": 0.5e-3}},
            track={"window": (arrival - 1e-3, arrival + 1e-3)},
        )  # fmt: skip
        level.append(10 * np.log10(intensity[np.abs(time - arrival) < 0.6e-3].mean()))
    return level[1] - level[0] - 27 + 20 * np.log10(np.sin(grazing))


@pytest.mark.slow
@pytest.mark.parametrize(("grazing_deg", "tolerance"), [(8.0, 0.8), (20.0, 0.5)])
def test_a_sediments_relief_and_its_law_are_the_handbooks_composite_bed(grazing_deg, tolerance):
    """Medium sand at 30 kHz, split where TR 9407 splits: its composite level at 8 and 20 degrees, through the engine.

    Under a flat bed with the same law the level at 8 degrees is 2 dB too dark. A ring 1 m wide at 64 m has some 800
    independent facets: 0.3 dB.
    """
    sand, grazing = Sediment.named("medium sand"), np.radians(grazing_deg)
    relief = {"kind": "power-law", "exponent": sand.spectral_exponent, "strength": sand.spectral_strength}
    law = {"law": "jackson", "sediment": "medium sand"}
    found = strength_db({"scattering": law, "relief": relief, "cutoff_wavelength": None}, grazing, 1)
    page = handbook_bottom.of_sediment(sand, 30e3, 1500.0)
    assert found == pytest.approx(10 * np.log10(handbook_bottom.composite(page, grazing_deg)), abs=tolerance)
    if grazing_deg < 10:
        assert strength_db({"scattering": law}, grazing, 1) < found - 1.5


def test_the_default_cutoff_follows_the_frequency():
    """Medium sand at 100 kHz and 5 degrees: the composite level of TR 9407 within 1 dB, one realisation.

    A cutoff of 0.5 m, right at 30 kHz, is 4 dB too weak there.
    """
    sand, law = Sediment.named("medium sand"), {"law": "jackson", "sediment": "medium sand"}
    relief = {"kind": "power-law", "exponent": sand.spectral_exponent, "strength": sand.spectral_strength}
    array = {"kind": "line", "length": 0.03}

    def level(seabed):
        _, intensity = received(
            field="incoherent", seabed=seabed, transmit=array, receive=array,
            paths={"families": ["D"], "beam_cutoff_db": -20}, track={"window": (0.134, 0.141)},
        )  # fmt: skip
        return 10 * np.log10(intensity.mean())

    lambert = level({}) + 27 - 20 * np.log10(9 / (0.1375 * 750))
    page = handbook_bottom.of_sediment(sand, 100e3, 1500.0)
    composite = 10 * np.log10(handbook_bottom.composite(page, np.degrees(np.arcsin(9 / (0.1375 * 750)))))
    assert level({"scattering": law, "relief": relief}) - lambert == pytest.approx(composite, abs=1.0)
    assert level({"scattering": law, "relief": relief, "cutoff_wavelength": 0.5}) - lambert < composite - 3


def test_a_target_in_the_shadow_of_a_bank_is_not_received(tmp_path):
    """A surveyed bank 3 m high at 40 m: a point 1 m above the seabed has no echo at 45 m, and one at 90 m."""
    east = np.arange(-20.0, 121.0, 0.5)
    depth = 20 - np.maximum(0, 3 - 2 * np.abs(east - 40)) + np.zeros((61, 1))
    np.savez(tmp_path / "bank.npz", depth=depth, north=np.linspace(-15, 15, 61), east=east)
    relief = {"kind": "grid", "file": str(tmp_path / "bank.npz"), "origin": (0.0, 0.0)}
    for place, received_there in ((45.0, False), (90.0, True)):
        point = {"shape": "point", "position": (0.0, place, 19.0)}
        with pytest.warns(match="not in the survey"):
            scenario = nominal(
                seabed={"relief": relief, "depth": 20.0}, targets=[point], track={"window": (0.04, 0.14)},
                paths={"families": ["D"], "contributions": ["target"]},
            )  # fmt: skip
        assert (len(arrivals(scenario)) == 1) == received_there


def test_ripples_across_the_beam_are_seen_as_bands():
    """Ripples of 2 m across the beam: the A-scan's strongest period along the seabed is 2 m."""
    ripples = {"kind": "ripples", "wavelength": 2.0, "height": 0.08, "direction": np.pi / 2, "irregularity": 0.0}
    time, intensity = received(field="incoherent", seabed={"relief": ripples}, track={"window": (0.055, 0.11)},
                            paths={"families": ["D"]})  # fmt: skip
    ground = np.sqrt((time * 750) ** 2 - 81)
    even = np.arange(45.0, 77.0, 0.05)
    level = np.interp(even, ground, 10 * np.log10(intensity))
    level -= np.polyval(np.polyfit(even, level, 3), even)
    spectrum = np.abs(np.fft.rfft(level * np.hanning(even.size)))
    assert np.fft.rfftfreq(even.size, 0.05)[np.argmax(spectrum)] == pytest.approx(0.5, abs=0.04)
    assert level.std() > 2


def test_one_thread_and_two_give_the_same_bits_over_relief():
    """Ground and shadows are made when they are first requested, by whichever thread comes first."""
    scenario = nominal(seabed={"relief": FRACTAL, "seed": 77}, track=FAR)
    one, two = (simulate(scenario, threads=threads).pressure.values for threads in (1, 2))
    np.testing.assert_array_equal(one, two)
