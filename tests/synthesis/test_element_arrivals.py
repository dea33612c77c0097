"""Claims about elements of an array that moves: each receives what the definition of a moving receiver states."""

import itertools

import numpy as np
import pytest

from insonify.frames import mounting_rotation, pose_rotation
from insonify.propagation import eigenrays
from insonify.simulator import build_simulator, simulate
from insonify.sonar.pulse import envelope
from insonify.sonar.track.motion import displacement
from oracles.arrays import HEADING, START, WINDOW, elements_scenario, line_of, some_targets
from oracles.few_of import few_of
from oracles.underway import CARRIER, SPEED, echo, recorded
from synthesis.oracle import relative_rms

RATE = 1e6
TIME = np.arange(0, WINDOW[1] + 0.01, 1 / RATE)
LONG = {"kind": "lfm", "frequency": CARRIER, "bandwidth": 8e3, "duration": 3e-3}
ROLLING = {
    "roll": {"rms": "3 deg", "period": "5 s"},
    "yaw": {"rms": "2 deg", "period": "7 s"},
    "heave": {"rms": 0.2, "period": "6 s"},
}


def platform(scenario):
    """Place and axes of the platform at any times after the start of ping 0, from its motion's own definition."""
    speed, motion = scenario.track.speed, scenario.track.motion

    def at(time):
        moved = displacement(motion, time, scenario.seed)
        zero = np.zeros_like(time)
        way = np.stack([np.cos(HEADING) + zero, np.sin(HEADING) + zero, zero], axis=1)
        place = START + speed * time[:, None] * way + np.stack([zero, zero, moved["heave"]], axis=1)
        return place, pose_rotation(HEADING + moved["yaw"], moved["pitch"], moved["roll"])

    return at


def truth(scenario, targets, elements, families=("D", "S")):
    """The sum over targets and pairs of families, element by element; elements to the right of boresight [m]."""
    at, facing = platform(scenario), mounting_rotation(np.pi / 2, 0).T
    raw, (place, axes) = np.zeros((len(elements), len(TIME)), complex), at(TIME)
    for row, right in enumerate(elements):
        held = place + axes @ facing @ np.array([0, right, 0])
        for target, out, back in itertools.product(targets, families, families):
            raw[row] += echo(
                scenario.sonar, lambda time: at(time)[0], lambda _, held=held: held, target, TIME, out=out, back=back
            )
    return recorded(raw, scenario, RATE)


@few_of(
    (2, 3),
    ("pulse", "track", "bar"),
    [
        (None, {"speed": 0.0}, 3e-6),
        (None, {}, 1e-5),
        (LONG, {}, 4e-4),
        (None, {"motion": ROLLING}, 4e-4),
    ],
    ids=["still", "straight", "long pulse", "rolling"],
)
def test_every_element_receives_what_a_moving_receiver_receives(pulse, track, bar):
    """Four elements, six targets, all pairs of D and S: float64 sum from emission times.

    Moving the echo is expanded about the pulse's middle, which leaves v^2 T^2 k / 8 R, and a rolling platform runs
    on a parabola: the bars.
    """
    targets = some_targets()
    scenario = elements_scenario(targets, pulse=pulse, track=track)
    elements = (np.arange(4) - 1.5) / 4 * 0.24
    received = simulate(scenario, threads=1).pressure.values[0]
    known = truth(scenario, targets, elements)
    assert [relative_rms(one, other) < bar for one, other in zip(received, known, strict=True)] == [True] * 4
    if track.get("speed") != 0.0:  # and stop and hop is another world
        hop = simulate(scenario.model_copy(update={"track": scenario.track.model_copy(update={"stop_and_hop": True})}))
        assert relative_rms(hop.pressure.values[0], known) > 0.1


def test_beams_of_a_moving_sonar_receive_its_doppler():
    """A point receiver recorded as a beam is its one element, moving too: the same bits but for a gain of one."""
    targets = some_targets(3)
    one = elements_scenario(targets, receive={"kind": "point", "element": "omni"})
    same = elements_scenario(targets, receive={"kind": "point", "element": "omni"}, receiver={"record": "beams"})
    assert relative_rms(simulate(same).pressure.values, simulate(one).pressure.values) < 1e-6


def test_a_tone_ahead_comes_back_higher():
    """10 ms of 100 kHz towards a point at 3 m/s: 400 Hz up (2 v f / c), within 1 %."""
    ahead = START + 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    scenario = elements_scenario(
        [ahead], pulse={"kind": "cw", "frequency": CARRIER, "duration": 10e-3}, receiver={"bandwidth": 4e3},
        receive={"kind": "point", "element": "omni"}, paths={"max_reflections": 0, "contributions": ["target"]},
    )  # fmt: skip
    received = simulate(scenario).pressure.values[0, 0]
    spectrum = np.abs(np.fft.fft(received, 1 << 17))
    peak = np.fft.fftfreq(1 << 17, 1 / scenario.sonar.receiver.sample_rate)[np.argmax(spectrum)]
    assert peak == pytest.approx(2 * 3 / SPEED * CARRIER, rel=0.01)


@pytest.mark.parametrize(("sweep", "sign"), [("up", -1), ("down", 1)])
def test_doppler_passes_for_range_in_a_compressed_sweep(sweep, sign):
    """Range-Doppler coupling: the peak moves by f_d T c / 2 B, within 5 %, nearer for a rising sweep that closes in."""
    ahead = START + 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    pulse = {"kind": "lfm", "frequency": CARRIER, "bandwidth": 8e3, "duration": 10e-3, "sweep": sweep}
    scenario = elements_scenario(
        [ahead],
        pulse=pulse,
        receive={"kind": "point", "element": "omni"},
        receiver={"bandwidth": 20e3, "matched_filter": True},
        paths={"max_reflections": 0, "contributions": ["target"]},
    )
    received = np.abs(simulate(scenario).pressure.values[0, 0])
    k = int(np.argmax(received))
    a, b, c = received[k - 1 : k + 2]
    peak = (k + 0.5 * (a - c) / (a - 2 * b + c)) / scenario.sonar.receiver.sample_rate
    middle = 2 * (30 - 3 * 5e-3) / (SPEED + 3)  # how long the pulse's middle is moving
    bias = 400 * 10e-3 * SPEED / 2 / 8e3
    assert (peak - middle) * SPEED / 2 == pytest.approx(sign * bias, rel=0.05)


def test_layered_water_bends_the_wavefronts_that_elements_receive():
    """Rays of their own to every element of a 3 x 3 panel of 0.3 m, through a thermocline: 1e-5 (seen: 4e-6)."""
    targets = some_targets(5)
    panel = {"kind": "planar", "width": 0.3, "height": 0.3, "columns": 3, "rows": 3, "element": "omni"}
    scenario = elements_scenario(
        targets, pulse={"kind": "cw", "frequency": CARRIER, "duration": 0.5e-3}, receive=panel, track={"speed": 0.0},
        water={"profile": [[0, 1520], [8, 1518], [12, 1495], [20, 1490]], "smoothing": 1.0, "noise_level_db": None,
               "absorption_db_per_m": 0.0},
    )  # fmt: skip
    here = build_simulator(scenario).ping_geometry(0)
    places = here.receive_position + here.elements.positions @ here.receive_beams.axes
    raw = np.zeros((9, len(TIME)), complex)
    for target in targets:
        for row, place in enumerate(places):
            sent, back = (_rays(scenario, end, target) for end in (here.transmit_position, place))
            for (d1, a1), (d2, a2) in itertools.product(sent, back):
                carried = a1 * a2 * np.exp(-2j * np.pi * ((CARRIER * (d1 + d2)) % 1))
                raw[row] += 1e10 * carried * envelope(scenario.sonar.pulse, TIME - d1 - d2)
    known = recorded(raw, scenario, RATE)
    received = simulate(scenario).pressure.values[0]
    error = np.array([relative_rms(one, other) for one, other in zip(received, known, strict=True)]).reshape(3, 3)
    assert error[1, 1] < 3e-6 and error.max() < 1e-5


def _rays(scenario, place, target):
    """Delays and amplitudes of D and S from one place, by exact rays."""
    found = eigenrays(
        scenario.water.profile_to_depth(20.0),
        water_depth=20.0,
        source_depth=float(place[2]),
        point_depth=float(target[2]),
        range=float(np.hypot(*(target[:2] - place[:2]))),
        families=("D", "S"),
    )
    columns = zip(found.delay, found.amplitude, found.family, found.caustics, strict=True)
    turn = {"D": 1, "S": -1}
    return [(d, a * turn[str(f)] * 1j ** int(c)) for d, a, f, c in columns if np.isfinite(d)]


def test_transmitter_and_receiver_may_change_places():
    """Reciprocity: a point source at one place and an element at another, exchanged: 1e-4, with D and S, at rest."""
    apart = (0.0, 0.4, 0.1)
    ends = [((0.0, 0.0, 0.0), apart), (apart, (0.0, 0.0, 0.0))]
    one, other = (
        simulate(
            elements_scenario(
                some_targets(), transmit={"kind": "point", "element": "omni", "offset": sent}, track={"speed": 0.0},
                receive={"kind": "elements", "element": "omni", "positions": [(0, 0, 0)], "offset": received},
            )
        ).pressure.values[0, 0]
        for sent, received in ends
    )  # fmt: skip
    assert np.linalg.norm(one) > 0 and relative_rms(one, other) < 1e-4


def test_elements_summed_with_delays_are_the_beam():
    """32 elements of half a wavelength, a target 300 m off, steered 8 degrees: -40 dB of the peak from the beam mode.

    The sum: delays for the far field and for the target's distance.
    """
    line = {"kind": "line", "length": 0.24, "elements": 32, "element": "omni"}
    steer, away = np.radians(8), 300.0
    bearing = HEADING + np.pi / 2 + np.radians(7)
    target = START + away * np.array([np.cos(bearing), np.sin(bearing), 0])
    settings = {
        "track": {"speed": 0.0, "window": (0.398, 0.404)},
        "paths": {"max_reflections": 0, "contributions": ["target"]},
    }
    each = elements_scenario([target], receive=line, **settings)
    beam = elements_scenario([target], receive={**line, "steer": (steer,)}, receiver={"record": "beams"}, **settings)
    received = simulate(each).pressure.values[0]
    rate, right = each.sonar.receiver.sample_rate, (np.arange(32) - 15.5) / 32 * 0.24
    sooner = right * np.sin(steer) / SPEED - right**2 * np.cos(steer) ** 2 / (2 * away * SPEED)
    offset = np.fft.fftfreq(received.shape[1], 1 / rate)
    late = np.exp(-2j * np.pi * np.outer(sooner, CARRIER + offset))
    summed = np.fft.ifft(np.mean(np.fft.fft(received, axis=1) * late, axis=0))
    known = simulate(beam).pressure.values[0, 0]
    assert np.abs(summed - known).max() < 1e-2 * np.abs(known).max()


def test_dead_elements_are_silent_and_gains_are_as_drawn():
    """Two of six dead: zeros. The others: the sound of perfect ones times the response drawn, 1 dB and 10 deg."""
    errors = {"gain_db": 1.0, "phase": "10 deg", "dead": [1, 4]}
    worn = elements_scenario(some_targets(3), receive=line_of(6), receiver={"errors": errors})
    fresh = elements_scenario(some_targets(3), receive=line_of(6))
    received, whole = (simulate(one).pressure.values[0] for one in (worn, fresh))
    response = build_simulator(worn).ping_geometry(0).elements.response
    assert not received[[1, 4]].any() and (response == 0).sum() == 2
    np.testing.assert_allclose(received, whole * response[:, None], atol=1e-5 * np.abs(whole).max())


def test_a_dead_element_changes_no_other():
    """Of a long line, whose broadside sector is interpolated: the others have the bits of a line without errors."""
    line = {**line_of(96), "length": 0.9}
    worn, fresh = (
        elements_scenario(some_targets(3), receive=line, **changes)
        for changes in ({"receiver": {"errors": {"dead": [40]}}}, {})
    )
    simulator = build_simulator(worn)
    assert simulator.coherent_accumulator(simulator.ping_geometry(0))._sector is not None
    received, whole = (simulate(one).pressure.values[0] for one in (worn, fresh))
    assert not received[40].any() and whole[40].any()
    np.testing.assert_array_equal(np.delete(received, 40, axis=0), np.delete(whole, 40, axis=0))


def test_elements_on_an_arc_receive_where_they_face():
    """A half-round head: a target abeam of one end is 20 dB stronger there than at the other, which faces away."""
    head = {"kind": "arc", "radius": 0.2, "arc_angle": "180 deg", "elements": 9, "element": "cosine"}
    # boresight is starboard of north-east by east: the last element faces to its right, which is astern
    astern = START - 30 * np.array([np.cos(HEADING), np.sin(HEADING), 0])
    scenario = elements_scenario(
        [astern], receive=head, track={"speed": 0.0}, paths={"max_reflections": 0, "contributions": ["target"]}
    )
    level = np.linalg.norm(simulate(scenario).pressure.values[0], axis=1)
    facing = np.linspace(-90, 90, 9)
    np.testing.assert_allclose(level / level[-1], np.clip(np.sin(np.radians(facing)), 0, None), atol=0.02)


def test_the_bits_do_not_depend_on_threads():
    """One thread and two: the same recording."""
    scenario = elements_scenario(some_targets())
    one, two = (simulate(scenario, threads=count).pressure.values for count in (1, 2))
    np.testing.assert_array_equal(one, two)
