"""The tracer and the eigenray engine find paths by separate code: where both are valid, their intensities agree."""

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, labels, simulate
from oracles.scenes import nominal, point
from oracles.traced import BOX, FRACTAL, apart_db, curves, scene

RIPPLES = {"kind": "ripples", "height": 0.05, "wavelength": 2.0}
CYLINDER = {"shape": "cylinder", "length": 2.0, "diameter": 0.6, "heading": 0.1, "position": (0.0, 75.3)}
BACK = {"scatterer_grid": {"origin": (800.0, -600.0), "heading": 1.0}}


def assert_agree(tolerance_db, weak_db=90.0, whole=True, **changes):
    """Both engines on one scene: every pair of families within a tolerance in the mean over the window."""
    ours, theirs = curves(scene("tracer", **changes)), curves(scene("eigenrays", **changes))
    strongest_mean = max(power.mean() for power in theirs.values())
    expected = {key for key, power in theirs.items() if power.mean() > strongest_mean * 10 ** (-weak_db / 10)}
    expected -= set() if whole else {key for key in expected if key[1] == "all"}
    assert expected <= set(ours)
    apart = {key: apart_db(ours[key], theirs[key]) for key in expected}
    assert max(np.abs(list(apart.values()))) < tolerance_db, apart
    return apart


@pytest.mark.parametrize("law", [{"law": "lambert", "strength_db": -27.0}, {"sediment": "medium sand"}])
def test_a_flat_bed_sounds_the_same_by_rays_and_by_images(law):
    """Six pairs of D, S and BS, 68 to 90 m: within 0.02 dB each for 40 000 rays (their own scatter is 0.003 dB)."""
    apart = assert_agree(0.02, seabed={"scattering": law})
    assert len([key for key in apart if key[0] == "seabed"]) == 7


def test_a_bed_with_a_mirror_of_its_own_material_sounds_the_same():
    """Bottom bounces take the sediment's reflection at their own angle, and order 3 brings ten pairs to the seabed."""
    apart = assert_agree(0.03, seabed={"reflection": "medium sand"}, paths={"max_reflections": 3})
    assert len([key for key in apart if key[0] == "seabed"]) == 11


def test_the_surface_reverberates_the_same():
    """A rough surface of -20 dB: pairs of D, B and SB."""
    assert_agree(
        0.02, surface={"scattering": {"law": "lambert", "strength_db": -20.0}}, paths={"contributions": ["surface"]}
    )


@pytest.mark.parametrize(("target", "base_depth"), [(BOX, 12.0), (CYLINDER, None)], ids=["box", "cylinder"])
def test_targets_sound_the_same_and_cast_the_same_shadows(target, base_depth):
    """A box in mid-water and a cylinder on the seabed, fifteen pairs with surface and bed each: within 0.1 dB.

    The engine lays three points on a range cell of a face; this is its error more than the rays' (0.02 dB).
    """
    apart = assert_agree(0.1, targets=[{**target, "base_depth": base_depth}])
    assert len([key for key in apart if key[0] == "target"]) == 16


def test_a_shadow_is_as_deep_and_as_long():
    """Behind a box 6 m wide: direct echoes in the shadow's time are lower by 40 dB, and the same within 0.3 dB.

    What is left there is side lobes, so none of them may be left out.
    """
    wide = {**BOX, "size": (6.0, 1.0, 1.0)}
    paths = {"families": ["D"], "contributions": ["seabed"], "beam_cutoff_db": -80.0}
    changes = {"window": (0.1035, 0.112), "paths": paths}
    free, shaded = (curves(scene("tracer", targets=t, **changes))["seabed", "D-D"] for t in ([], [wide]))
    theirs = curves(scene("eigenrays", targets=[wide], **changes))["seabed", "D-D"]
    assert apart_db(shaded, free) < -40
    assert apart_db(shaded, theirs) == pytest.approx(0, abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("relief", "tolerance_db"), [({**FRACTAL, "rms": 0.001}, 0.03), (FRACTAL, 0.15), (RIPPLES, 0.1)],
    ids=["1 mm", "5 cm", "ripples"],
)  # fmt: skip
def test_uneven_ground_sounds_the_same(relief, tolerance_db):
    """Fractal ground and ripples, pair by pair: hits on marched ground against points on it behind terrain_occlusion.

    Direct and surface paths: bottom bounces have planes of their own by one engine, and the mean plane by the other.
    """
    assert_agree(
        tolerance_db,
        weak_db=45.0,
        seabed={"relief": relief, "seed": 3, "cutoff_wavelength": 0.5},
        rays=20_000,
        window=(0.09, 0.105),
        paths={"max_reflections": 1},
    )


def test_a_ripple_is_received_where_it_lies():
    """Curves over time, in cells of 0.5 ms: the tracer follows each crest of fractal ground within 0.5 dB rms."""
    bed = {"relief": FRACTAL, "seed": 3, "cutoff_wavelength": 0.5}
    changes = {"window": (0.09, 0.11), "seabed": bed, "paths": {"families": ["D"]}}
    ours, theirs = (
        curves(scene(engine, rays=100_000, **changes))["seabed", "all"] for engine in ("tracer", "eigenrays")
    )
    cells = len(ours) // 40
    ours, theirs = (power[: 40 * cells].reshape(40, cells).mean(axis=1) for power in (ours, theirs))
    level = 10 * np.log10(ours)
    assert (
        np.std(10 * np.log10(ours / theirs))
        < 0.5
        < np.std(level - np.polyval(np.polyfit(range(40), level, 1), range(40)))
    )


def test_a_point_is_received_by_every_two_way_path():
    """A point half a metre above the seabed: 15 pairs, each the engine's to 1e-5; reciprocal ones add up fourfold."""
    apart = assert_agree(
        1e-4, targets=[point(0.0, 75.0, 19.5)], rays=1000, paths={"contributions": ["target"]}, whole=False
    )
    assert len(apart) == 15


def test_ends_that_stand_apart_lose_the_gain_of_reciprocal_paths():
    """A receiver 5 cm above the transmitter: pair D-S falls by its interference, as far as the engine states."""
    together, apart = (
        curves(scene("tracer", receive={"offset": (0.0, 0.0, z)}))["seabed", "D-S"] for z in (0.0, -0.05)
    )
    theirs = curves(scene("eigenrays", receive={"offset": (0.0, 0.0, -0.05)}))["seabed", "D-S"]
    assert abs(apart_db(apart, together)) > 0.3
    assert apart_db(apart, theirs) == pytest.approx(0, abs=0.02)


def test_jitter_takes_the_same_from_both():
    """Replicas shaken by up to half a wavelength keep 40 % of their interference, by either engine."""
    assert_agree(0.02, paths={"jitter": 0.5, "amplitude_perturbation": 0.3})


def test_a_scene_moved_as_a_whole_sounds_the_same():
    """Scatterer grid, ship, relief and box 1 km away and turned by 1 rad: the same rays hit the same, within 1e-3."""
    bed, box = {"relief": FRACTAL, "seed": 3}, {**BOX, "position": (0.0, 75.5)}
    still = simulate(scene("tracer", rays=5000, seabed=bed, targets=[box]), threads=2).intensity.values
    c, s = np.cos(1.0), np.sin(1.0)
    place = (800.0 - s * 75.5, -600.0 + c * 75.5)
    track = {"position": (800.0, -600.0, 11.0), "heading": 1.0}
    changes = {"seabed": {**bed, **BACK}, "targets": [{**box, "position": place, "heading": 1.0}], "track": track}
    moved = simulate(scene("tracer", rays=5000, **changes), threads=2).intensity.values
    # a ray that grazes a crest or an edge may go the other way for a rounding
    assert np.linalg.norm(moved - still) < 1e-3 * np.linalg.norm(still)


def test_threads_do_not_change_a_bit():
    """One thread or two: the same bits over relief, a scatterer that fetches the seabed."""
    scenario = scene("tracer", rays=5000, seabed={"relief": FRACTAL, "seed": 3}, targets=[BOX])
    one, two = (simulate(scenario, threads=n).intensity.values for n in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_rays_scatter_about_one_mean_and_less_the_more_there_are():
    """Cells of 1 ms, eight seeds each: errors of 4000 and 64 000 rays differ by more than a factor of 4."""

    def spread(rays):
        found = np.array([
            curves(scene("tracer", rays=rays, seed=seed, paths={"families": ["D"]}))["seabed", "all"]
            for seed in range(1, 9)
        ])  # fmt: skip
        cells = found[:, : 30 * (found.shape[1] // 30)].reshape(8, 30, -1).mean(axis=2)
        return np.mean(np.std(cells, axis=0) / cells.mean(axis=0))

    few, many = spread(4000), spread(64_000)
    assert many < few / 4 and many < 0.01


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"field": "coherent"}, "rays have none"),
        ({"paths": {"engine": "tracer", "geometry": "slice"}}, "launches rays in all directions"),
    ],
)
def test_what_rays_cannot_trace_is_refused_with_a_remedy(changes, message):
    """Phases, refracted rays and slices are the other engine's."""
    with pytest.raises(ValueError, match=message):
        nominal(**{"field": "incoherent", "paths": {"engine": "tracer"}, **changes})


def test_rays_are_no_list_of_paths():
    """Arrivals are evaluated of the other engine; the error states how."""
    with pytest.raises(ValueError, match="engine: eigenrays"):
        arrivals(scene("tracer"))


def test_each_side_and_each_ping_has_rays_of_its_own():
    """Two sides over a box to starboard, two pings: its echo is on that side; pings differ by less than 0.05 dB."""
    changes = {"sonar": {"sides": ["port", "starboard"]}, "track": {"pings": 2}}
    found = simulate(scene("tracer", rays=20_000, targets=[BOX], **changes), threads=2).intensity.values
    assert found.shape[:2] == (2, 2)
    level = 10 * np.log10(found.mean(axis=2))
    assert np.all(level[:, 1] - level[:, 0] > 3)
    assert np.all(np.abs(level[1] - level[0]) < 0.05) and np.all(found[0] != found[1])


def test_labels_are_those_of_the_other_engine():
    """Labels of object and position do not depend on the engine: bit-identical."""
    ours, theirs = (labels(scene(engine, targets=[BOX], window=(0.09, 0.105))) for engine in ("tracer", "eigenrays"))
    for name in theirs:
        np.testing.assert_array_equal(ours[name].values, theirs[name].values)


def test_the_other_engine_is_the_default():
    """Nothing changes without the option."""
    assert nominal().paths.engine == "eigenrays"
    assert build_simulator(nominal()).tracer is None
