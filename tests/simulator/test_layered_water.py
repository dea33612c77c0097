"""Pings through layered water: what must not change, whatever the profile, and what must."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, levels, simulate
from insonify.synthesis.arrival_weights import arrival_weights
from oracles.scenes import nominal, point

THERMOCLINE = [[0, 1510.0], [8, 1510.0], [14, 1490.0], [20, 1490.0]]
CHANNEL = [[0, 1505.0], [11, 1495.0], [20, 1501.0]]
TARGETS = [point(0, 150, 19.0), point(2, 148, 12.0, label="buoy"), point(-1, 152, 4.0, label="float")]
ONLY = {"contributions": ["target"]}
WINDOW = {"window": (0.195, 0.225)}


def scene(profile=THERMOCLINE, **settings):
    """Points in layered water, received by the nominal sonar."""
    water = {"noise_level_db": None, **({"profile": profile} if isinstance(profile, list | str) else profile)}
    base = {"targets": TARGETS, "paths": ONLY, "track": WINDOW}
    return nominal(water=water, **{**base, **settings})


def received(scenario):
    """Pressure of the first ping and channel."""
    return simulate(scenario)["pressure"].values[0, 0]


def off(found, expected):
    """Relative rms difference."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


@pytest.mark.parametrize("profile", [THERMOCLINE, CHANNEL])
def test_exchanging_the_ends_changes_nothing(profile):
    """Reciprocity in layered water: transmitter above, receiver below, and the other way round."""
    ends = {"offset": (0.0, 0.0, -2.0)}, {"offset": (0.0, 0.3, 1.5)}
    one = received(scene(profile, transmit=ends[0], receive=ends[1]))
    other = received(scene(profile, transmit=ends[1], receive=ends[0]))
    assert off(other, one) < 1e-4


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
@pytest.mark.parametrize("water", [{}, {"profile": THERMOCLINE}], ids=["even", "thermocline"])
def test_exchanging_the_ends_finds_the_same_scatterers(water, field):
    """A box on sand, its soft shadow, arrays of two lengths 3.5 m apart in depth and 0.8 m ahead: 1e-4.

    Nothing may be evaluated at one end that is not evaluated at the other: how deep they swim, how slow the water is
    there, from where a distance is counted.
    """
    ends = {"length": 0.3, "offset": (0.5, 0.0, -2.0)}, {"length": 0.1, "offset": (-0.3, 0.3, 1.5)}
    settings = {
        "targets": [{"shape": "box", "position": (0.0, 30.0), "size": (2.0, 1.0, 1.0)}],
        "field": field,
        "track": {"window": (0.035, 0.045)},
        "paths": {"contributions": ["seabed", "target"], "edge_diffraction": "knife-edge", "scatterers_per_cell": 1},
    }
    both = [scene(water, transmit=a, receive=b, **settings) for a, b in (ends, ends[::-1])]
    one, other = (next(iter(simulate(scenario).data_vars.values())).values[0, 0] for scenario in both)
    assert np.linalg.norm(one) > 0
    assert off(other, one) < 1e-4


@pytest.mark.parametrize("profile", [THERMOCLINE, CHANNEL])
def test_a_knot_on_a_straight_line_is_no_knot(profile):
    """A layer cut in two is the same water; so is a profile that goes on below the bed."""
    rows = sorted([*profile, [4.0, float(np.interp(4.0, *np.array(profile).T))], [30.0, 1480.0]])
    bed = float(np.interp(20.0, *np.array(profile).T))
    rows = [row for row in rows if row[0] <= 20] + [[20.0 + 1e-9, bed], [30.0, 1480.0]]
    assert off(received(scene(rows)), received(scene(profile))) < 1e-5


def test_a_table_and_its_rows_are_the_same_water(tmp_path, monkeypatch):
    """Read from a file beside the scenario or written out: the same bits."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cast.csv").write_text("depth,speed\n" + "".join(f"{z},{c}\n" for z, c in THERMOCLINE))
    np.testing.assert_array_equal(received(scene("cast.csv")), received(scene()))


def test_rounding_of_a_hair_changes_hardly_anything_and_more_changes_more():
    """Corners rounded within a millimetre, and within two metres."""
    plain, hair, soft = (
        received(scene({"profile": THERMOCLINE, **({"smoothing": s} if s else {})})) for s in (None, 1e-3, 2.0)
    )
    assert off(hair, plain) < 0.05 < off(soft, plain)


def test_water_of_one_speed_written_as_a_profile_is_the_same_water():
    """No layer, no bending: images, to the bit."""
    written = received(scene([[0, 1500.0], [20, 1500.0]]))
    np.testing.assert_array_equal(written, received(scene({"sound_speed": 1500.0})))


def test_a_nearly_constant_profile_is_nearly_the_same_water():
    """1e-9 m/s over the depth: 1e-6 of the sound."""
    nearly = received(scene([[0, 1500.0], [20, 1500.000000001]]))
    assert off(nearly, received(scene({"sound_speed": 1500.0}))) < 1e-4


@pytest.mark.parametrize("profile", [THERMOCLINE, CHANNEL])
def test_the_scene_may_be_moved_as_a_whole(profile):
    """Sonar and targets moved and turned together: the same sound."""
    turn, away = 0.7, np.array([500.0, -200.0])
    c, s = np.cos(turn), np.sin(turn)

    def moved(place):
        north, east, depth = place
        return (c * north - s * east + away[0], s * north + c * east + away[1], depth)

    there = [{**target, "position": moved(target["position"])} for target in TARGETS]
    track = {**WINDOW, "position": moved((0.0, 0.0, 11.0)), "heading": turn}
    assert off(received(scene(profile, targets=there, track=track)), received(scene(profile))) < 1e-5


def test_the_arrivals_add_up_to_the_recording():
    """Every row of the list, with the pulse at its delay: the sound."""
    scenario = scene()
    paths, simulator = arrivals(scenario), build_simulator(scenario)
    here = simulator.ping_geometry(0)
    time = simulate(scenario)["time"].values
    weight = arrival_weights(paths, here)
    whole = sum(w * here.pulse.samples(time - t) for w, t in zip(weight, paths.delay, strict=True))
    assert off(received(scenario), whole) < 1e-5


def test_each_family_can_be_switched_off_and_they_add_up():
    """Direct alone, surface alone and both: pairs of the two are what is left over."""
    both, direct, surface = (
        arrivals(scene(paths={**ONLY, "families": families, "max_reflections": 1}))
        for families in (["D", "S"], ["D"], ["S"])
    )
    mixed = both.transmit_family != both.receive_family
    assert len(both) == len(direct) + len(surface) + mixed.sum()
    np.testing.assert_allclose(np.sort(both.delay[~mixed]), np.sort(np.concatenate([direct.delay, surface.delay])))


def test_the_expected_level_is_the_sum_of_its_causes():
    """In layered water as in any other: powers of contributions add to the total."""
    curves = levels(scene(field="incoherent"))["level_db"]
    power = 10 ** (curves / 10)
    contributions = power.sel(contribution=["seabed", "surface", "target", "noise"], pair="all").sum("contribution")
    floor = 1e-8 * float(power.max())  # far below the echoes the filter's ringing may be less than nothing, and is cut
    np.testing.assert_allclose(contributions, power.sel(contribution="total", pair="all"), rtol=1e-6, atol=floor)


def test_threads_do_not_matter():
    """One, two and five cores: the same bits; and simulations beside one another share nothing."""
    scenario = scene(
        seabed={}, paths={"contributions": ["target", "seabed"], "max_reflections": 1}, track={"window": (0.19, 0.2)}
    )
    expected = simulate(scenario, threads=1)["pressure"].values
    for threads in (2, 5):
        np.testing.assert_array_equal(simulate(scenario, threads=threads)["pressure"].values, expected)
    with ThreadPoolExecutor(3) as pool:
        for found in pool.map(lambda _: simulate(scenario)["pressure"].values, range(3)):
            np.testing.assert_array_equal(found, expected)


def test_slow_water_between_makes_sound_late():
    """Every speed 1 % lower, rays unchanged: every delay 1 % longer."""
    slow = [[z, c / 1.01] for z, c in THERMOCLINE]
    here, there = (np.sort(arrivals(scene(p, track={"window": (0.19, 0.24)})).delay) for p in (THERMOCLINE, slow))
    np.testing.assert_allclose(there, here * 1.01, rtol=1e-9)


def test_in_a_channel_a_point_at_its_axis_has_more_than_one_direct_ray():
    """The list numbers them, and their delays differ."""
    deep = [[0, 1540.0], [10, 1480.0], [20, 1540.0]]
    paths = arrivals(
        scene(deep, targets=[point(0, 160, 10.5)], paths={**ONLY, "families": ["D"]}, track={"window": (0.2, 0.23)})
    )
    assert paths.transmit_branch.max() >= 1
    outward = {int(b): float(d) for b, d in zip(paths.transmit_branch, paths.delay, strict=True)}
    assert len(set(np.round(list(outward.values()), 12))) == len(outward)
    assert {name for row in range(len(paths)) for name in paths.ray_names(row)} >= {"D", "D2"}
