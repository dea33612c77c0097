"""Claims about a receiver on a platform of its own: ellipses, exchange of the ends, one track written twice."""

import itertools

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from insonify.formats.zarr_store import open_recording
from insonify.processing import beam_recording, compressed_recording, synthetic_aperture_image
from insonify.recording_run import record
from insonify.scenario.load import parse_model
from insonify.scenario.platform_poses import receiver_seed
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.simulator import arrivals, build_simulator, labels, simulate
from insonify.sonar.track import true_poses
from insonify.validity import PhysicsWarning
from oracles.beams import axes
from oracles.underway import SPEED, echo, recorded
from synthesis.oracle import relative_rms

TRANSMITTER, RECEIVER = np.array([0.0, 0.0, 11.0]), np.array([30.0, -20.0, 5.0])
TARGETS = [(40.0, 10.0, 15.0), (25.0, 30.0, 12.0), (-10.0, 22.0, 18.0)]
POINT = {"kind": "point", "element": "omni"}
LINE = {"kind": "line", "length": 0.2}
TONE = {"kind": "cw", "frequency": 100e3, "duration": 0.2e-3}
STAYS = {"kind": "static", "position": tuple(TRANSMITTER), "window": (0.0, 0.06)}
STATIC_RECEIVER = {"kind": "static", "position": tuple(RECEIVER)}
GOES = {"kind": "line", "start": tuple(TRANSMITTER), "speed": 4.0, "heading": 0.3, "window": (0.0, 0.08)}
FOLLOWS = {"kind": "line", "start": tuple(RECEIVER), "speed": 7.0, "heading": 2.0}
SAND = {"depth": 20.0, "scattering": {"law": "lambert", "strength_db": -27.0}, "reflection": 0.35}
DIRECT = {"families": ["D"]}


def scenario_of(*, sonar=None, **top):
    """Point echoes in silent water that takes nothing, between two platforms that stay."""
    points = [
        {"shape": "point", "label": f"p{row}", "target_strength_db": 0.0, "position": place}
        for row, place in enumerate(TARGETS)
    ]
    described = {
        "water": {"sound_speed": SPEED, "absorption_db_per_m": 0.0, "noise_level_db": None},
        "seabed": {"depth": 20.0}, "targets": points, "track": STAYS, "receiver_track": STATIC_RECEIVER,
        "paths": {"contributions": ["target"], "families": ["D", "S"]}, "seed": 3,
        "sonar": {"source_level_db": 200, "pulse": TONE, "transmit": POINT, "receive": POINT,
                  "receiver": {"bandwidth": 20e3}, **(sonar or {})},
        **top,
    }  # fmt: skip
    return Scenario(**described)


def test_echoes_lie_on_ellipses():
    """Delay = (|p - transmitter| + |p - receiver|) / c, to 1e-12 s; pressure falls with the product of both."""
    found = arrivals(scenario_of(paths={"contributions": ["target"], **DIRECT}, track={**STAYS, "window": (0.0, 0.1)}))
    ways = np.array([[np.linalg.norm(np.subtract(end, place)) for end in (TRANSMITTER, RECEIVER)] for place in TARGETS])
    order, rows = np.argsort(ways.sum(axis=1)), np.argsort(found.delay)
    np.testing.assert_allclose(found.delay[rows], ways.sum(axis=1)[order] / SPEED, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.abs(found.amplitude).ravel()[rows], 1 / ways.prod(axis=1)[order], rtol=1e-5)


@pytest.mark.parametrize("record_of", ["beams", "elements"])
def test_both_ends_move_for_themselves(record_of):
    """Transmitter at 4 m/s, receiver at 7 m/s on another course, D and S: the float64 sum from emission times, 1e-5.

    Each array hangs at a place of its own on its own platform.
    """
    arms = np.array([0.5, -0.3, 0.4]), np.array([-0.2, 0.6, 0.1])
    array = {"kind": "line", "length": 0.24, "elements": 4, "element": "omni"} if record_of == "elements" else POINT
    receiver = {"bandwidth": 20e3, "record": record_of}
    ends = {"transmit": {**POINT, "offset": tuple(arms[0])}, "receive": {**array, "offset": tuple(arms[1])}}
    scenario = scenario_of(sonar={**ends, "receiver": receiver}, track=GOES, receiver_track=FOLLOWS)
    rate = 1e6
    time = np.arange(0, GOES["window"][1] + 0.01, 1 / rate)

    def line(track, arm, right=0.0):
        ahead = np.array([np.cos(track["heading"]), np.sin(track["heading"]), 0.0])
        axes = np.array([ahead, [-ahead[1], ahead[0], 0.0], [0.0, 0.0, 1.0]])
        start = np.asarray(track["start"]) + (arm - [right, 0, 0]) @ axes
        return lambda t: start + track["speed"] * np.asarray(t)[:, None] * ahead

    rights = [0.0] if record_of == "beams" else (np.arange(4) - 1.5) * 0.06  # an array that looks to starboard
    raw = np.zeros((len(rights), len(time)), complex)
    for row, right in enumerate(rights):
        for place, out, back in itertools.product(TARGETS, "DS", "DS"):
            sends, received_at = line(GOES, arms[0]), line(FOLLOWS, arms[1], right)
            raw[row] += echo(scenario.sonar, sends, received_at, place, time, out=out, back=back)
    assert relative_rms(simulate(scenario).pressure.values[0], recorded(raw, scenario, rate)) < 1e-5


def test_turning_platforms_swing_their_own_arms():
    """Both platforms roll, pitch and yaw, each array a metre off its reference point, D and S: the sum, 1e-4.

    What is left is the parabola's cubic remainder. A receiver on the other array's arm would be wrong by 0.4, a
    transmitter, which swings for the pulse's own length only, by 2e-3.
    """
    arms = np.array([0.9, -0.5, 0.4]), np.array([-0.6, 1.0, 0.3])
    sways = (
        {"roll": {"rms": 0.1, "period": 8.0}, "yaw": {"rms": 0.06, "period": 9.0}},
        {"pitch": {"rms": 0.08, "period": 7.0}, "yaw": {"rms": 0.1, "period": 8.0}},
    )
    tracks = [{**track, "motion": motion} for track, motion in zip((GOES, FOLLOWS), sways, strict=True)]
    receiver = {"kind": "line", "length": 0.24, "elements": 4, "element": "omni", "offset": tuple(arms[1])}
    ends = {"transmit": {**POINT, "offset": tuple(arms[0])}, "receive": receiver}
    scenario = scenario_of(
        sonar={**ends, "receiver": {"bandwidth": 20e3, "record": "elements"}}, track=tracks[0], receiver_track=tracks[1]
    )

    def swung(track, seed, arm):
        moments, there = np.linspace(-0.01, 0.1, 45), []
        for moment in moments:
            pose = true_poses(track, seed=seed, after=moment)
            leans = {"heading": pose.heading[0], "pitch": pose.pitch[0], "roll": pose.roll[0]}
            there.append(pose.position[0] + axes(bearing=0.0, **leans) @ arm)
        return CubicSpline(moments, there)

    rate, sends = 1e6, swung(scenario.track, scenario.seed, arms[0])
    time = np.arange(0, GOES["window"][1] + 0.01, 1 / rate)
    rows, raw = [0, 2], np.zeros((2, len(time)), complex)
    for row, right in enumerate((np.array(rows) - 1.5) * 0.06):  # an array that looks to starboard
        receiver = swung(scenario.receiver_track, receiver_seed(scenario), arms[1] - [right, 0, 0])
        for place, out, back in itertools.product(TARGETS, "DS", "DS"):
            raw[row] += echo(scenario.sonar, sends, receiver, place, time, out=out, back=back)
    error = relative_rms(simulate(scenario).pressure.values[0, rows], recorded(raw, scenario, rate))
    assert error < 1e-4


def test_elements_wait_as_long_as_the_water_at_the_receiver_predicts():
    """1510 m/s at the transmitter, 1490 at the receiver: an element's delay is that of a receiver at its place.

    To 20 ns, 2 thousandths of a cycle; the transmitter's speed would be wrong by 0.8 us at 0.09 m.
    """
    water = {"noise_level_db": None, "profile": [[0, 1510], [8, 1510], [12, 1490], [20, 1490]]}
    common = {"water": water, "paths": {"contributions": ["target"], **DIRECT}, "targets": [
        {"shape": "point", "label": "p", "target_strength_db": 0.0, "position": (60.0, 8.0, 17.0)}]}  # fmt: skip
    receiver = {"kind": "line", "length": 0.24, "elements": 4, "element": "omni"}
    shallow = {**STAYS, "position": (0.0, 0.0, 4.0), "window": (0.0, 0.09)}
    many = scenario_of(
        sonar={"receive": receiver, "receiver": {"bandwidth": 20e3, "record": "elements"}}, track=shallow,
        receiver_track={"kind": "static", "position": (5.0, 20.0, 16.0)}, **common,
    )  # fmt: skip
    for channel, right in enumerate((np.arange(4) - 1.5) * 0.06):
        one = scenario_of(
            track=shallow, receiver_track={"kind": "static", "position": (5.0 - right, 20.0, 16.0)}, **common
        )
        assert arrivals(many, channel=channel).delay[0] == pytest.approx(arrivals(one).delay[0], abs=2e-8)


@pytest.mark.parametrize(
    ("field", "water", "contributions", "ground"),
    [
        ("coherent", {"sound_speed": SPEED}, ["seabed", "target"], {}),
        ("incoherent", {"sound_speed": SPEED}, ["seabed", "target"], {}),
        ("coherent", {"profile": [[0, 1510], [8, 1508], [12, 1492], [20, 1490]]}, ["target"], {}),
        ("coherent", {"sound_speed": SPEED}, ["seabed"], {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}),
    ],
    ids=["speckle", "expectation", "thermocline", "rough ground"],
)
def test_transmitter_and_receiver_may_be_exchanged(field, water, contributions, ground):
    """Platforms, arrays and mountings exchanged, over sand with all bounces: the same series, relative rms 1e-4."""
    faces, receiver = {"bearing": 0.4, "tilt": 0.2}, {"bearing": 1.9, "tilt": -0.1}
    arrays = {"transmit": {**LINE, "length": 0.05}, "receive": POINT, "mounting": faces, "receive_mounting": receiver}
    common = {"field": field, "water": {"noise_level_db": None, **water}, "seabed": SAND | ground,
              "paths": {"contributions": contributions, "max_reflections": 2, "scatterers_per_cell": 1}}  # fmt: skip
    swapped = {"transmit": POINT, "receive": arrays["transmit"], "mounting": receiver, "receive_mounting": faces}
    clock = {"window": (0.03, 0.05)}
    one = scenario_of(sonar=arrays, track={**STAYS, **clock}, **common)
    other = scenario_of(
        sonar=swapped,
        track={**STATIC_RECEIVER, **clock},
        receiver_track={"kind": "static", "position": tuple(TRANSMITTER)},
        **common,
    )
    received, again = (next(iter(simulate(scenario).data_vars.values())).values[0] for scenario in (one, other))
    assert np.linalg.norm(received) > 0
    assert relative_rms(again, received) < 1e-4


def test_one_track_written_twice_is_one_platform():
    """A receiver's track that is the transmitter's: the same bits, and a recording of one platform."""
    both = scenario_of(track=GOES, receiver_track={name: GOES[name] for name in ("kind", "start", "speed", "heading")})
    alone = scenario_of(track=GOES, receiver_track=None)
    one, other = simulate(both), simulate(alone)
    np.testing.assert_array_equal(one.pressure, other.pressure)
    assert "receiver_position" not in one
    beside = scenario_of(
        track=GOES, receiver_track={**FOLLOWS, "start": (0.0, 0.0, 11 + 1e-9), "speed": 4.0, "heading": 0.3}
    )
    assert build_simulator(beside).platforms.is_bistatic
    assert relative_rms(simulate(beside).pressure.values[0], other.pressure.values[0]) < 1e-5


@pytest.mark.parametrize("bounce", ["tilted", "explicit"])
def test_the_receive_leg_reaches_the_sea_when_sound_gets_there(bounce):
    """A transmitter 300 m off, a target 40 m away: D-S comes later by 2 eta sin(grazing) / c, eta 0.2 s on.

    A swell of 2 cm by 40 m, at the mirror's bounce point and the moment when sound from the transmitter comes by: to
    5 % of the greatest change; by the moment of an echo from the receiver's own place a quarter of it would be missed.
    """
    target, sends, receiver = np.array([0.0, 40.0, 15.0]), np.array([0.0, -300.0, 11.0]), np.array([0.0, 0.0, 11.0])
    length, height = 40.0, 0.02
    surface = {"reflection": bounce, "swell": {"length": length, "height": height}, "wave_direction": np.pi / 2}
    about = {
        "targets": [{"shape": "point", "label": "p", "target_strength_db": 0.0, "position": tuple(target)}],
        "track": {"kind": "static", "position": tuple(sends), "window": (0.2, 0.3), "interval": 0.7, "pings": 6},
        "receiver_track": {"kind": "static", "position": tuple(receiver)},
    }  # fmt: skip
    part = receiver[2] / (receiver[2] + target[2])
    slant = np.hypot(40.0, receiver[2] + target[2])
    late = (np.linalg.norm(target - sends) + (1 - part) * slant) / SPEED
    wave = 2 * np.pi / length
    for ping in range(6):
        moved, still = (arrivals(scenario_of(surface=sea, **about), ping=ping) for sea in (surface, {}))
        by_sea = [
            found.delay[(found.transmit_family == "D") & (found.receive_family == "S")][0] for found in (moved, still)
        ]
        eta = height / 2 * np.cos(wave * part * 40.0 - np.sqrt(9.81 * wave) * (0.7 * ping + late))
        most = height * (receiver[2] + target[2]) / slant / SPEED
        assert by_sea[0] - by_sea[1] == pytest.approx(eta / (height / 2) * most, abs=0.05 * most)


def test_a_ring_of_sand_is_the_sonar_equation():
    """Lambert's bed between two platforms: intensity = E integral mu sin sin / (r1 r2)^2 over the ellipse's ring.

    The integral by a float64 sum over 4e6 squares of the bed, in rings of 0.4 ms; within 0.1 dB each.
    """
    seabed_only = scenario_of(
        field="incoherent", seabed=SAND, targets=[], paths={"contributions": ["seabed"], **DIRECT}
    )
    received, pulse = simulate(seabed_only), build_simulator(seabed_only).pulse
    x, y, step = np.arange(-45, 75, 0.06), np.arange(-70, 50, 0.06), 0.06
    north, east = np.meshgrid(x + step / 2, y + step / 2, indexing="ij")
    ways, product = 0.0, 1.0
    for end in (TRANSMITTER, RECEIVER):
        height = 20 - end[2]
        away = np.sqrt((north - end[0]) ** 2 + (east - end[1]) ** 2 + height**2)
        ways, product = ways + away, product * height / away**3
    rings = np.arange(0.032, 0.0585, 0.4e-3)
    scattered = 1e20 * 10**-2.7 * step**2 * product
    energy = np.histogram((ways / SPEED).ravel(), rings, weights=scattered.ravel())[0]
    time = np.linspace(pulse.start, pulse.stop, 20001)
    power = np.abs(pulse.samples(time)) ** 2
    late = np.trapezoid(time * power, time) / np.trapezoid(power, time)
    expected = energy * np.trapezoid(power, time) / np.diff(rings)
    summed = np.concatenate([[0], np.cumsum(received.intensity.values[0, 0])]) * np.diff(received.time.values)[0]
    found = np.diff(np.interp(rings + late, np.append(received.time.values, np.inf)[: len(summed)], summed)) / np.diff(
        rings
    )
    np.testing.assert_allclose(10 * np.log10(found / expected), 0, atol=0.1)


def test_speckle_between_two_platforms_has_the_expected_energy():
    """Mean of |coherent|^2 over 16 seeds and 15 ms, some 1000 cells of speckle, is the expectation within 0.4 dB."""
    there = {"seabed": SAND, "targets": [], "paths": {"contributions": ["seabed"], "scatterers_per_cell": 2, **DIRECT},
             "track": {**STAYS, "window": (0.035, 0.05)}}  # fmt: skip
    expected = simulate(scenario_of(field="incoherent", **there)).intensity.values.mean()
    found = [np.mean(np.abs(simulate(scenario_of(seed=seed, **there)).pressure.values) ** 2) for seed in range(1, 17)]
    assert 10 * np.log10(np.mean(found) / expected) == pytest.approx(0, abs=0.4)


def test_a_recording_states_where_its_receiver_was(tmp_path):
    """Both platforms' poses, true and as logged, in memory and on disk; the file reads back as the same scenario."""
    errors = {"navigation_errors": {"north": {"offset": 2.0}}}
    scenario = scenario_of(track={**GOES, "pings": 3}, receiver_track={**FOLLOWS, **errors})
    assert parse_model(Scenario, to_yaml(scenario)) == scenario
    held = simulate(scenario, pings=[0, 2])
    stored = open_recording(record(scenario, tmp_path / "two.zarr", pings=[0, 2]))
    for name in ("position", "receiver_position", "logged_receiver_position", "receiver_attitude"):
        np.testing.assert_array_equal(
            stored[name].values[[0, -1]] if len(stored.ping) == 3 else stored[name], held[name]
        )
    way = 7.0 * 0.6 * np.array([np.cos(2.0), np.sin(2.0), 0])
    np.testing.assert_allclose(held.receiver_position[1], RECEIVER + way)
    np.testing.assert_allclose(held.logged_receiver_position - held.receiver_position, [[2.0, 0, 0]] * 2)


def test_labels_include_the_ellipse():
    """An object's echo between two platforms is labelled at its own place, at its ellipse's delay."""
    scenario = scenario_of(paths={"contributions": ["target"], **DIRECT}, field="incoherent")
    found = labels(scenario)
    place = TARGETS[0]
    delay = sum(np.linalg.norm(np.subtract(end, place)) for end in (TRANSMITTER, RECEIVER)) / SPEED
    here = found.isel(channel=0).sel(time=delay + 0.1e-3, method="nearest")
    np.testing.assert_allclose(here["position"], place, atol=1e-3)
    assert here["distance"] == pytest.approx(np.linalg.norm(RECEIVER - place), rel=1e-5)


@pytest.mark.parametrize(
    ("wrong", "advice"),
    [
        ({"paths": {"geometry": "slice"}}, "paths.geometry: slice is one vertical plane"),
        ({"paths": {"engine": "tracer"}, "field": "incoherent"}, "paths.engine: tracer transmits and receives on one"),
        (
            {"sonar": {"sides": ["port", "starboard"], "transmit": LINE, "receive": LINE}},
            "sonar.sides: .* one platform",
        ),
        ({"receiver_track": {**STATIC_RECEIVER, "pings": 3}}, "receiver_track.pings: 3 pings, and the track has 1"),
        (
            {"receiver_track": {**STATIC_RECEIVER, "window": (0.0, 0.1)}},
            "receiver_track.window: differs from track.window",
        ),
        (
            {"receiver_track": {**STATIC_RECEIVER, "position": (0, 0, 25)}},
            "receiver_track.position.2: 25 m puts the receive",
        ),
        ({"receiver_track": None, "sonar": {"receive_mounting": {"tilt": 0.1}}}, "sonar.receive_mounting: is for a"),
    ],
)
def test_what_two_platforms_cannot_do_is_reported(wrong, advice):
    """Where the file is wrong, what is wrong with it, and the fix."""
    with pytest.raises(ValueError, match=advice):
        scenario_of(**wrong)


def test_a_receiver_out_of_reach_is_reported():
    """A baseline longer than the window's whole way is a caution before anything is simulated."""
    with pytest.warns(PhysicsWarning, match="receiver_track: it runs .* nothing is received"):
        scenario_of(receiver_track={"kind": "static", "position": (500.0, 0.0, 5.0)})


def test_back_projection_finds_the_target_from_two_platforms():
    """Twelve pings of two platforms that hop along: the brightest pixel is the target's, to half a pixel of 5 cm."""
    place = (25.0, 30.0, 12.0)
    one = {"shape": "point", "label": "p", "target_strength_db": 0.0, "position": place}
    pulse = {"kind": "lfm", "frequency": 100e3, "bandwidth": 15e3, "duration": 1e-3}
    clock = {"pings": 12, "interval": 0.2, "window": (0.02, 0.08), "stop_and_hop": True}
    moving_survey = scenario_of(
        targets=[one], paths={"contributions": ["target"], **DIRECT}, track={**GOES, **clock}, receiver_track=FOLLOWS,
        sonar={"pulse": pulse, "receiver": {"bandwidth": 30e3, "record": "elements"}},
    )  # fmt: skip
    received = compressed_recording(simulate(moving_survey), moving_survey.sonar.pulse)
    north, east = (centre + 0.05 * np.arange(-8, 9) for centre in place[:2])
    image = synthetic_aperture_image(received, north, east, place[2], sound_speed=SPEED, stop_and_hop=True, threads=1)
    row, column = np.unravel_index(np.argmax(np.abs(image.pressure.values)), image.pressure.shape)
    assert (north[row], east[column]) == pytest.approx(place[:2], abs=0.026)
    with pytest.raises(ValueError, match="one platform"):
        beam_recording(received, [0.0])
