"""Boundary echoes against closed forms: images, Snell's law in a gradient, Doppler, theory of rough reflection."""

from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar
from scipy.special import fresnel

from insonify.engines import relief_specular_points
from insonify.engines.eigenray_engine import EigenrayEngine
from insonify.engines.hull_reflection import rectangle_factor
from insonify.propagation.surface_water import surface_water
from insonify.propagation.wind_waves import shortest_wavenumber, wind_waves
from insonify.recording_run import record
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scattering.roughness import roughness_spectrum
from insonify.scattering.sediments import Sediment
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, labels, levels, simulate
from insonify.sonar.hull import HullPlate
from insonify.sonar.pulse import envelope
from oracles.scenes import nominal
from oracles.underway import SPEED, recorded
from synthesis.oracle import relative_rms

ECHOES = {"contributions": ["boundary echo"]}
OMNI = {"kind": "point", "element": "omni"}
MIRROR = {"scattering": None, "reflection": 0.35}
WINDOW = {"window": (1e-3, 0.06)}


def bed_only(*, order=3, paths=None, track=None, sonar=None, seabed=None, **top):
    """An omnidirectional sonar 11 m deep over a smooth bed at 20 m, with boundary echoes only."""
    ends = {end: {**OMNI, "length": None} for end in ("transmit", "receive")}
    return nominal(
        **(ends | top), paths={"max_reflections": order, **ECHOES, **(paths or {})}, track={**WINDOW, **(track or {})},
        sonar=sonar, seabed={**MIRROR, **(seabed or {})},
    )  # fmt: skip


def by_family(found):
    """Rows of arrivals by the family of the path."""
    assert set(found.receive_family) == {""} and set(found.object) == {"boundary echo"}
    return {str(name): row for row, name in enumerate(found.transmit_family)}


@pytest.mark.parametrize(
    ("family", "length", "product"),
    [("B", 18, 0.35), ("S", 22, -1), ("BS", 40, -0.35), ("SB", 40, -0.35), ("BSB", 58, -(0.35**2)), ("SBS", 62, 0.35)],
)
def test_echoes_of_the_nominal_scene_are_those_of_its_images(family, length, product):
    """12.000, 14.667, 26.667, 38.667 ms to 1e-9 s; level 220 - 20 log(2 d) + 20 log|R| - absorption to 0.001 dB."""
    scenario = bed_only()
    found = arrivals(scenario)
    row = by_family(found)[family]
    loss = 10 ** (-float(scenario.water.absorption(100e3)) * length / 20)
    assert found.delay[row] == pytest.approx(length / 1500, abs=1e-9)
    assert complex(found.amplitude[row]) == pytest.approx(product * loss / length, rel=1e-4)
    first = 1 if family.startswith("B") else -1
    np.testing.assert_allclose(found.departure[row], [0, 0, first], atol=1e-12)
    np.testing.assert_allclose(found.position[row], [0, 0, 11 + first * length / 2], atol=1e-9)


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_recorded_energies_are_those_of_the_images(field):
    """Energy of each echo = that of the received pulse times the squared pressure of its paths, to 0.05 dB.

    BS and SB arrive together in phase: 6 dB above one of them.
    """
    scenario = bed_only(field=field)
    simulator, recording = build_simulator(scenario), simulate(scenario)
    rate = simulator.grid.sample_rate
    pulse = np.sum(np.abs(simulator.pulse.samples(np.arange(-0.002, 0.002, 1 / (16 * rate)))) ** 2) / (16 * rate)
    values = recording["pressure" if field == "coherent" else "intensity"].values[0, 0]
    power, time = np.abs(values) ** (2 if field == "coherent" else 1), recording["time"].values
    for length, factor in ((18, 0.35), (22, 1.0), (40, 0.7), (58, 0.35**2)):
        inside = np.abs(time - length / 1500 - 1e-4) < 1e-3
        loss = 10 ** (-float(scenario.water.absorption(100e3)) * length / 20)
        due = pulse * (1e11 * factor * loss / length) ** 2
        assert 10 * np.log10(power[inside].sum() / rate / due) == pytest.approx(0, abs=0.05)


def test_a_vertical_ray_in_a_gradient_has_its_travel_time_and_its_tube():
    """Delay = 2 int dz / c to 1e-9 s; spreading 1 / (2 int c dz / c0): sin of the angle to the vertical grows as c."""
    speed = np.array([1520.0, 1490.0])
    scenario = bed_only(water={"profile": [[0, speed[0]], [20, speed[1]]], "absorption_db_per_m": 0.0})
    found, at = arrivals(scenario), lambda z: np.interp(z, [0, 20], speed)
    rows = by_family(found)
    for family, legs in (("B", [(11, 20)] * 2), ("S", [(0, 11)] * 2), ("BS", [(11, 20), (0, 20), (0, 11)])):
        gradient = (speed[1] - speed[0]) / 20
        delay = sum(np.log(at(low) / at(high)) / -gradient for low, high in legs)
        tube = sum((at(low) + at(high)) / 2 * (high - low) for low, high in legs) / at(11)
        assert found.delay[rows[family]] == pytest.approx(delay, abs=1e-9)
        assert found.spreading[rows[family]] == pytest.approx(1 / tube, rel=1e-6)


def test_sound_between_two_platforms_travels_straight_too():
    """D arrives at |p - q| / c with 1 / |p - q|; on one platform it is left out, its arrays apart or not."""
    there = (30.0, -20.0, 5.0)
    scenario = bed_only(order=1, receiver_track={"kind": "static", "position": there}, water={"absorption_db_per_m": 0})
    found = arrivals(scenario)
    rows, images = by_family(found), {"D": 11, "S": -11, "B": 29}
    assert set(rows) == set(images)
    for family, depth in images.items():
        length = np.linalg.norm(np.subtract(there, (0, 0, depth)))
        assert found.delay[rows[family]] == pytest.approx(length / 1500, abs=1e-9)
        assert found.spreading[rows[family]] == pytest.approx(1 / length, rel=1e-9)
        np.testing.assert_allclose(found.arrival[rows[family]][2] * length, (1 if depth > 20 else np.sign(depth)) * abs(
            depth - 5), rtol=1e-9)  # fmt: skip
    assert "D" not in by_family(arrivals(bed_only(receive={**OMNI, "length": None, "offset": (1.0, 0, 0)})))


@pytest.mark.parametrize("heading", [30, 200])
def test_the_surface_echo_between_two_platforms_is_the_same_both_ways(heading):
    """Off a swell: delays to 2e-6 s, the swell moves in 7 ms; spreading to 1 %."""
    places, rows = ((0.0, 0.0, 10.0), (0.0, 40.0, 6.0)), []
    swell = {"height": 0.4, "length": 25.0}
    for here, there in (places, places[::-1]):
        scenario = bed_only(
            order=1, seabed={"depth": 45.0, "reflection": 0.0}, track={"position": here},
            receiver_track={"kind": "static", "position": there},
            surface={"reflection": "explicit", "swell": swell, "wave_direction": f"{heading} deg"},
        )  # fmt: skip
        found = arrivals(scenario)
        by_surface = np.array(found.transmit_family) != "D"
        rows.append(np.array(sorted(zip(found.delay[by_surface], found.spreading[by_surface], strict=True))))
    assert len(rows[0]) > 0
    np.testing.assert_allclose(rows[0][:, 0], rows[1][:, 0], rtol=0, atol=2e-6)
    np.testing.assert_allclose(rows[0][:, 1], rows[1][:, 1], rtol=0.01)


@pytest.mark.parametrize("hidden", [0.15, -0.15])
def test_direct_sound_between_platforms_bends_over_a_wall_by_fresnels_integral(hidden):
    """D past the top of a wide thin wall is that of a knife edge within 0.1 dB, above the line of sight and below."""
    wall = {
        "shape": "box", "label": "wall", "position": (0.0, 20.0), "size": (80.0, 0.01, 33.0 + hidden),
        "base_depth": 45.0,
    }  # fmt: skip
    scenario = bed_only(
        order=0, seabed={"depth": 45}, targets=[wall], water={"absorption_db_per_m": 0},
        paths={"edge_diffraction": "knife-edge"},
        track={"position": (0.0, 0.0, 12.0)}, receiver_track={"kind": "static", "position": (0.0, 60.0, 12.0)},
    )  # fmt: skip
    found = arrivals(scenario)
    height = hidden * np.sqrt(2 / (1500 / 100e3) * (1 / 20 + 1 / 40))
    sine, cosine = fresnel(height)
    edge = abs((0.5 - cosine) - 1j * (0.5 - sine)) / np.sqrt(2)
    assert abs(found.amplitude[by_family(found)["D"]]) * 60 == pytest.approx(edge, rel=0.012)


@pytest.mark.parametrize("record", ["beams", "elements"])
def test_a_moving_sonar_receives_the_sound_of_a_moving_image(record):
    """B, S, BS and SB at 5 m/s, four elements or one beam: the float64 sum over emission times, 2e-3 of its rms.

    What is received at t was emitted at te, which solves te + |rx(t) - image of tx(te)| / c = t. The engine takes the
    transmitter's motion towards the receiver's position at the start, which leaves k v^2 t te / d = 1e-3 rad.
    """
    array = {"kind": "line", "length": 0.24, "elements": 4, "element": "omni"}
    track = {"kind": "line", "start": (0.0, 0.0, 11.0), "speed": 5.0, "heading": 0.3, "window": (0.0, 0.03)}
    described = bed_only(order=2).model_dump(mode="json")
    described["track"] = track
    described["water"] |= {"sound_speed": SPEED, "absorption_db_per_m": 0.0}
    described["sonar"]["receive"] = array if record == "elements" else OMNI
    described["sonar"]["receiver"] |= {"bandwidth": 20e3, "record": record}
    scenario = Scenario.model_validate(described)
    course = 5.0 * np.array([np.cos(0.3), np.sin(0.3), 0.0])
    along = np.linspace(0.09, -0.09, 4) if record == "elements" else np.zeros(1)
    rate = 1e6
    time, raw = np.arange(0, 0.032, 1 / rate), []
    for offset in along:
        receiver = np.array([0.0, 0.0, 11.0]) + course * (time[:, None] + offset / 5.0)
        total = np.zeros(len(time), complex)
        for depth, factor in ((29, 0.35), (-11, -1), (-29, -0.35), (51, -0.35)):
            image = np.array([0.0, 0.0, depth])
            emitted = np.full(len(time), -1.0)
            for _ in range(4):  # fixed point: the sonar is three hundred times slower than sound
                emitted = time - np.linalg.norm(receiver - image - course * emitted[:, None], axis=1) / SPEED
            middle = int(np.argmax(emitted > scenario.sonar.pulse.duration / 2))
            distance = SPEED * (time[middle] - emitted[middle])
            phase = np.exp(2j * np.pi * 100e3 * (emitted - time))
            total += 1e11 * factor / distance * envelope(scenario.sonar.pulse, emitted) * phase
        raw.append(total)
    due = recorded(np.array(raw), scenario, rate)
    assert relative_rms(simulate(scenario)["pressure"].values[0], due) < 2e-3


@pytest.mark.parametrize("frequency", [10e3, 20e3])
def test_a_sediment_s_own_roughness_takes_the_coherent_bottom_echo(frequency):
    """|B| = R exp(-2 (k h)^2), h^2 the spectrum's integral from the zone's wave to the sound's, by quadrature."""
    sand = {"scattering": {"law": "jackson", "sediment": "medium sand"}, "reflection": "medium sand"}
    pulse = {"pulse": {"kind": "cw", "frequency": frequency, "duration": 1e-3}, "receiver": {"bandwidth": 5e3}}
    still = {"water": {"absorption_db_per_m": 0.0}, "sonar": pulse, "order": 1}
    rough, smooth = arrivals(bed_only(seabed=sand, **still)), arrivals(bed_only(seabed={**sand, **MIRROR,
        "reflection": "medium sand"}, **still))  # fmt: skip
    bed, k = Sediment.named("medium sand"), 2 * np.pi * frequency / 1500
    zone = 2 * np.sqrt(1500 / frequency * 9 * 9 / 18)  # full width of the first Fresnel zone, 9 m below and back
    waves = np.geomspace(2 * np.pi / zone, k, 20_001)
    variance = np.trapezoid(roughness_spectrum(bed, waves) * 2 * np.pi * waves, waves)
    ratio = abs(complex(rough.amplitude[by_family(rough)["B"]] / smooth.amplitude[by_family(smooth)["B"]]))
    assert ratio == pytest.approx(np.exp(-2 * k**2 * variance), rel=1e-4)


def kirchhoff_bottom_echo(terrain, position, wavenumber, *, step, half=7.0):
    """Pressure of a smooth bed's echo re 1 m by Kirchhoff's integral over 14 m of it, faded out towards its edge."""
    across, total = np.arange(-half, half, step), 0j
    for part in np.array_split(across, 12):
        x, y = part[:, None], across[None, :]
        ground = terrain.relief.sample(position[0] + x, position[1] + y)
        down = terrain.depth - ground.height - position[2]
        distance = np.sqrt(x**2 + y**2 + down**2)
        facing = (down + x * ground.slope[..., 0] + y * ground.slope[..., 1]) / distance
        fade = np.exp(-((x**2 + y**2) ** 4) / (0.83 * half) ** 8)
        total += np.sum(fade * facing * np.exp(-2j * wavenumber * distance) / distance**2)
    return 1j * wavenumber / (2 * np.pi) * total * step**2


@pytest.mark.parametrize("tilt", [2, 8])
def test_a_tilted_bed_mirrors_from_the_foot_of_its_perpendicular(tilt, tmp_path):
    """B off a plane: 2 h cos(tilt) / c along the normal, with 1 / (2 h cos(tilt)); h the height above the ground."""
    east, slope = np.arange(-60, 60.1, 2.0), np.tan(np.radians(tilt))
    np.savez(tmp_path / "plane.npz", north=east, east=east, depth=20 + slope * east[None, :] + 0 * east[:, None])
    relief = {"relief": [{"kind": "grid", "file": str(tmp_path / "plane.npz")}], "depth": 20.0}
    found = arrivals(bed_only(order=1, seabed=relief, paths={"families": ["B"]}))
    length, normal = 18 * np.cos(np.radians(tilt)), [0.0, -np.sin(np.radians(tilt)), np.cos(np.radians(tilt))]
    assert found.delay * 1500 == pytest.approx([length], rel=1e-6)
    assert found.spreading * length == pytest.approx([1.0], rel=1e-4)
    np.testing.assert_allclose(found.departure, [normal], atol=1e-4)


SAND_WAVES = {"kind": "ripples", "wavelength": 12.0, "height": 0.4, "irregularity": 0.0, "sharpness": 0.1}
CURVED_WAVES = {"kind": "ripples", "wavelength": 5.0, "height": 0.3}


@pytest.mark.parametrize(
    ("waves", "frequency", "north", "count"),
    [
        (SAND_WAVES, 20e3, 0.0, 1),
        (SAND_WAVES, 20e3, 3.1, 1),
        (CURVED_WAVES, 20e3, 1.7, 1),
        (CURVED_WAVES, 60e3, 2.5, 3),
    ],
)
def test_sand_waves_mirror_at_every_specular_point(waves, frequency, north, count):
    """The sum of the specular points = Kirchhoff's integral over the bed, 0.3 dB and 0.1 rad; in troughs three points.

    The point between two others has touched a caustic. Level ground would have 1 / 18 m, up to 4 dB from these.
    """
    pulse = {"pulse": {"kind": "cw", "frequency": frequency, "duration": 1e-3}, "receiver": {"bandwidth": 5e3}}
    scenario = bed_only(
        order=1, seabed={"relief": [waves]}, water={"absorption_db_per_m": 0.0}, sonar=pulse,
        track={"position": (north, 0.0, 11.0)}, paths={"families": ["B"]},
    )  # fmt: skip
    found, k = arrivals(scenario), 2 * np.pi * frequency / 1500
    total = np.sum(found.amplitude * np.exp(-1j * k * 1500 * found.delay)) / 0.35
    step = 1500 / frequency / 2
    due = kirchhoff_bottom_echo(scenario.scene.seabed.terrain, (north, 0.0, 11.0), k, step=step)
    assert len(found) == count and sum(found.caustics) == (count == 3)
    assert 20 * np.log10(abs(total / due)) == pytest.approx(0, abs=0.3)
    assert np.angle(total / due) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize(
    ("wavelength", "height", "north", "count"), [(6, 0.3, 2.6, 1), (6.5, 0.5, 1.5, 1), (6, 0.3, -0.4, 3)]
)
def test_surveyed_waves_six_times_the_fresnel_zone_lose_nothing(wavelength, height, north, count, tmp_path):
    """Specular points of a surveyed bed = Kirchhoff's integral, 0.1 dB and 0.1 rad (0.4 dB in a trough): no roughness.

    The zone is 0.95 m wide at 30 kHz; only waves as short as that are left to the coherent loss.
    """
    node = np.arange(-20, 20.01, 0.1)
    depth = 20 + height / 2 * np.cos(2 * np.pi * node / wavelength + 0.4)
    np.savez(tmp_path / "waves.npz", north=node, east=node, depth=depth[:, None] + 0 * node[None, :])
    relief = {"kind": "grid", "file": str(tmp_path / "waves.npz")}
    scenario = bed_only(
        order=1, seabed={"relief": [relief], "depth": 20.0, "cutoff_wavelength": 0.25}, paths={"families": ["B"]},
        water={"absorption_db_per_m": 0.0}, track={"position": (north, 0.0, 11.0)},
        sonar={"pulse": {"kind": "cw", "frequency": 30e3, "duration": 1e-3}, "receiver": {"bandwidth": 5e3}},
    )  # fmt: skip
    found, k = arrivals(scenario), 2 * np.pi * 30e3 / 1500
    total = np.sum(found.amplitude * np.exp(-1j * k * 1500 * found.delay)) / 0.35
    due = kirchhoff_bottom_echo(scenario.scene.seabed.terrain, (north, 0.0, 11.0), k, step=0.025)
    assert len(found) == count
    assert 20 * np.log10(abs(total / due)) == pytest.approx(0, abs=0.1 if count == 1 else 0.4)
    assert np.angle(total / due) == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("gradient", [-1.5, 0.8])
@pytest.mark.parametrize("tilt", [0.01, 8.0, 20.0])
def test_a_tilted_bed_in_a_gradient_mirrors_the_ray_that_strikes_it_at_right_angles(tilt, gradient, tmp_path):
    """B off a plane: twice the least travel time to it, within 1 ns, from where that ray starts, with its tube.

    Rays are circles, the travel time a hyperbolic distance (Officer 1958, not verified). Kirchhoff's integral by its
    stationary phase, with second derivatives of the closed form by differences, has the same pressure within 0.01 dB.
    """
    east, slope = np.arange(-60, 60.1, 2.0), np.tan(np.radians(tilt))
    np.savez(tmp_path / "plane.npz", north=east, east=east, depth=20 + slope * east[None, :] + 0 * east[:, None])
    relief = {"relief": [{"kind": "grid", "file": str(tmp_path / "plane.npz")}], "depth": 20.0}
    profile = [[0.0, 1500.0], [60.0, 1500.0 + 60 * gradient]]
    water = {"profile": profile, "absorption_db_per_m": 0.0}
    found = arrivals(bed_only(order=1, seabed=relief, paths={"families": ["B"]}, water=water))

    def one_way(across, beside=0.0):
        depth = 20 + slope * across
        speeds = (1500 + gradient * 11) * (1500 + gradient * depth)
        straight = np.sqrt(across**2 + beside**2 + (depth - 11) ** 2)
        return 2 / abs(gradient) * np.arcsinh(abs(gradient) * straight / 2 / np.sqrt(speeds))

    best = minimize_scalar(one_way, bounds=(-15, 5), method="bounded", options={"xatol": 1e-10})
    assert found.delay == pytest.approx([2 * best.fun], abs=1e-9)
    # the sine of its start from the vertical: the radius of its circle, whose centre lies where sound has no speed
    still, foot = -1500 / gradient, 20 + slope * best.x
    centre = (best.x**2 + (foot - still) ** 2 - (11 - still) ** 2) / (2 * best.x)
    assert abs(found.departure[0, 1]) == pytest.approx(abs(11 - still) / np.hypot(centre, 11 - still), abs=1e-5)
    assert np.sign(found.departure[0, 1]) == np.sign(best.x)
    step, dip = 0.03, np.cos(np.radians(tilt))
    bends = [
        (one_way(best.x + step * along, step * beside) + one_way(best.x - step * along, step * beside) - 2 * best.fun)
        / step**2
        for along, beside in ((dip, 0.0), (0.0, 1.0))
    ]
    at_foot = 1500 + gradient * foot
    tube = np.sqrt((1500 + gradient * 11) * at_foot) / abs(gradient) * np.sinh(abs(gradient) * best.fun)
    assert found.spreading == pytest.approx([1 / (tube**2 * at_foot * 2 * np.sqrt(bends[0] * bends[1]))], rel=1e-3)


@pytest.mark.parametrize("family", ["B", "BS", "SB", "SBS"])
def test_sand_waves_in_hardly_layered_water_mirror_as_in_water_of_one_speed(family):
    """A gradient of 1 mm/s over 20 m: specular points of curved waves, their pressures, caustics and directions."""
    layered, straight = (
        arrivals(bed_only(
            order=len(family), seabed={"relief": [CURVED_WAVES]}, water={**water, "absorption_db_per_m": 0.0},
            track={"position": (2.5, 0.0, 11.0)}, paths={"families": [family]},
        ))
        for water in ({"profile": [[0.0, 1500.001], [20.0, 1500.0]]}, {"sound_speed": 1500.0005})
    )  # fmt: skip
    assert len(layered) == len(straight) > 1
    np.testing.assert_allclose(layered.delay, straight.delay, rtol=1e-6)
    np.testing.assert_allclose(layered.amplitude, straight.amplitude, rtol=1e-4)
    np.testing.assert_allclose(layered.departure, straight.departure, atol=1e-5)
    np.testing.assert_array_equal(layered.caustics, straight.caustics)


@pytest.mark.parametrize("gradient", [-1.5, 0.8])
@pytest.mark.parametrize(("family", "place"), [("BS", 0.0), ("SB", 0.0), ("SBS", 0.0), ("BS", -12.0)])
def test_paths_by_surface_and_tilted_bed_in_a_gradient_are_the_shortest_in_time(family, place, gradient, tmp_path):
    """Delays within 2 ns of the least sum of closed-form travel times by points of both boundaries, 8 deg of tilt.

    A surveyed depth has 1e-6 m, which is 1.3 ns.
    """
    east, slope = np.arange(-60, 60.1, 2.0), np.tan(np.radians(8.0))
    np.savez(tmp_path / "plane.npz", north=east, east=east, depth=20 + slope * east[None, :] + 0 * east[:, None])
    relief = {"relief": [{"kind": "grid", "file": str(tmp_path / "plane.npz")}], "depth": 20.0}
    water = {"profile": [[0.0, 1500.0], [60.0, 1500.0 + 60 * gradient]], "absorption_db_per_m": 0.0}
    found = arrivals(bed_only(
        order=len(family), seabed=relief, paths={"families": [family]}, water=water,
        track={"position": (0.0, place, 11.0)},
    ))  # fmt: skip

    def travel_time(across):
        corners = [(place, 11.0), *((x, 20 + slope * x if letter == "B" else 0.0)
                                    for x, letter in zip(across, family, strict=True)), (place, 11.0)]  # fmt: skip
        speeds = [1500 + gradient * depth for _, depth in corners]
        legs = zip(corners, corners[1:], speeds, speeds[1:], strict=False)
        return sum(
            2 / abs(gradient) * np.arcsinh(abs(gradient) / 2 * np.hypot(b[0] - a[0], b[1] - a[1]) / np.sqrt(u * w))
            for a, b, u, w in legs
        )

    best = minimize(travel_time, np.full(len(family), place - 3.0), tol=1e-14)
    assert found.delay == pytest.approx([best.fun], abs=2e-9)
    first = np.array([best.x[0] - place, (20 + slope * best.x[0] if family[0] == "B" else 0.0) - 11])
    straight = np.arctan2(first[1], first[0])  # the chord of the first arc, which bends by its length over the radius
    angle = np.arctan2(found.departure[0, 2], found.departure[0, 1])
    assert angle == pytest.approx(straight, abs=np.hypot(*first) * abs(gradient) / 1500 / 2 + 1e-5)
    assert found.spreading[0] * 1500 * best.fun == pytest.approx(1.0, rel=0.03)


HULL = {"length": 20.0, "width": 6.0, "reflection": 0.9}


def test_specular_points_are_searched_for_once_per_ping_and_path(monkeypatch, tmp_path):
    """Labels, both directions of SB and BS, and both sides share one search and one set of echoes."""
    searches, search, computed = [], relief_specular_points.specular_points, []
    compute = EigenrayEngine._boundary_echoes
    monkeypatch.setattr(EigenrayEngine, "_boundary_echoes", lambda *a: computed.append(a) or compute(*a))
    monkeypatch.setattr(relief_specular_points, "specular_points", lambda *a: searches.append(a) or search(*a))
    waves = {"kind": "power-law", "hurst": 0.8, "rms": 0.02}
    scene = bed_only(order=2, seabed={"relief": [waves]}, sonar={"sides": ["port", "starboard"]})
    record(scene, tmp_path / "echoes.zarr", pings=[0], with_labels=True)
    assert (len(searches), len(computed)) == (2, 1)


def all_nodes(_, shape, ground, __):
    """Every node of the square that is searched."""
    rows = np.indices(np.array(shape) - 2 * relief_specular_points.MARGIN).reshape(2, -1).T.copy()
    return np.array([ground.north, ground.east]) + (rows + relief_specular_points.MARGIN) * ground.step


@pytest.mark.parametrize(
    "relief", [{"kind": "power-law", "hurst": 0.8, "rms": 0.05}, {"kind": "ripples", "wavelength": 3.0, "height": 0.3}]
)
def test_starts_where_the_gradient_changes_sign_lose_no_specular_point(monkeypatch, relief):
    """Newton's method from every node of the search square finds the same points, to the last bit."""
    scene = build_simulator(bed_only(seabed={"relief": [relief]})).engine.scene
    water = surface_water(scene, 1500.0, False, False)
    rng, found = np.random.default_rng(3), []
    for begin in np.column_stack([rng.uniform(0, 500, (6, 2)), rng.uniform(2, 18, 6)]):
        stop, wavelength = begin + np.append(rng.uniform(-3, 3, 2), 0.0), rng.choice([0.015, 0.075])
        search = partial(relief_specular_points.specular_points, scene.seabed.terrain, begin, stop, wavelength, water)
        few = search()
        with monkeypatch.context() as patched:
            patched.setattr(relief_specular_points, "_starts", all_nodes)
            np.testing.assert_array_equal(few.position, search().position)
        found.append(len(few.length))
    assert sum(found) > 6


def afloat(d=0.6, *, order=5, size=None, **more):
    """A transducer 0.6 m deep under a hull at its own depth, in 6.6 m of water: 6 m above a smooth bed."""
    hull = {"hull": {**HULL, **(size or {})}}
    return bed_only(
        order=order, sonar=hull, seabed={"depth": 6.0 + d}, track={"position": (0.0, 0.0, d), "window": (1e-3, 0.05)},
        water={"absorption_db_per_m": 0.0}, **more,
    )  # fmt: skip


@pytest.mark.parametrize("d", [0.6, 2.5])
def test_multiples_under_a_hull_come_at_2z_and_3z_and_those_of_the_surface_later_by_its_depth(d):
    """BHB at 2 z, BHBHB at 3 z with R^2 R_h and R^3 R_h^2 over the whole length; BSB at 2 z + d; all to 1e-9 s.

    A hull much larger than the Fresnel zone leaves little of what would pass it by the surface, a small one most.
    """
    found = arrivals(afloat(d))
    rows, z = by_family(found), 6.0
    for family, way, product in (("B", z, 0.35), ("BHB", 2 * z, 0.35**2 * 0.9), ("BHBHB", 3 * z, 0.35**3 * 0.9**2)):
        assert found.delay[rows[family]] == pytest.approx(2 * way / 1500, abs=1e-9)
        assert abs(found.amplitude[rows[family]]) == pytest.approx(product / (2 * way), rel=0.05)
    past = arrivals(afloat(d, size={"length": 0.1, "width": 0.1}))
    ghost = by_family(past)
    assert past.delay[ghost["BSB"]] == pytest.approx(2 * (2 * z + d) / 1500, abs=1e-9)
    assert abs(past.amplitude[ghost["BSB"]]) == pytest.approx(0.35**2 / (2 * (2 * z + d)), rel=0.2)
    assert abs(past.amplitude[ghost["BHB"]]) < 0.15 * abs(found.amplitude[rows["BHB"]])
    assert abs(found.amplitude[rows["BSB"]]) < 0.1 * abs(past.amplitude[ghost["BSB"]])


def test_a_hull_s_size_counts_as_its_fresnel_integral():
    """BHB off a small plate = Kirchhoff's integral over it by brute force, 1 %; half a plane at its edge: one half."""
    plate = HullPlate(np.array([0.0, 0.0, 0.6]), np.eye(2), np.array([0.3, 0.2]), 1.0)
    place, wavelength = np.array([0.15, -0.1]), 0.015
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 1201), np.linspace(-0.2, 0.2, 801), indexing="ij")
    to = np.sqrt((x - place[0]) ** 2 + (y - place[1]) ** 2 + 12.0**2)
    spread = np.exp(-2j * np.pi / wavelength * 2 * (to - 12.0)) / to**2
    area = np.trapezoid(np.trapezoid(spread, y[0], axis=1), x[:, 0])
    due = 1j / wavelength * area * 24.0  # (j / lambda) of the aperture, re the mirror's 1 / 24 m
    factor = rectangle_factor(plate, place[None], np.array([12.0]), np.array([12.0]), wavelength)[0]
    assert abs(factor - due) < 0.01
    half = HullPlate(np.zeros(3), np.eye(2), np.array([1e3, 1e3]), 1.0)
    edge = rectangle_factor(half, np.array([[1e3, 0.0]]), np.array([12.0]), np.array([12.0]), wavelength)[0]
    assert abs(edge) == pytest.approx(0.5, rel=1e-3)


def test_reverberation_by_way_of_the_hull_is_that_of_its_images():
    """A point target under a hull: legs BH and BHB are straight lines from images between hull and bed, 1e-9 s.

    The direct leg keeps its bits; a target beside the surface path's passage loses it to a hull above that passage.
    """
    target = {"shape": "point", "label": "p", "position": (1.0, 0.5, 4.0), "target_strength_db": 0.0}
    scene = {"targets": [target], "paths": {"contributions": ["target"], "edge_diffraction": "knife-edge"}}
    found, z = arrivals(afloat(order=3, **scene)), 6.0
    legs = {name: row for row, name in enumerate(found.receive_family) if found.transmit_family[row] == "D"}
    assert {"D", "B", "BH", "BHB"} <= set(legs)
    aside, direct = np.hypot(1.0, 0.5), np.linalg.norm([1.0, 0.5, 3.4])
    for family, vertical, product in (("BH", 2 * z + 3.4, 0.35 * 0.9), ("BHB", 4 * z - 3.4, 0.35**2 * 0.9)):
        length = np.hypot(aside, vertical)
        assert found.delay[legs[family]] * 1500 == pytest.approx(direct + length, abs=1e-6)
        assert abs(found.amplitude[legs[family]]) == pytest.approx(product / direct / length, rel=0.1)
    surface = [abs(found.amplitude[row]) for name, row in legs.items() if name == "S"]
    assert sum(surface) < 0.1 / direct**2


def test_hull_multiples_in_layered_water_have_the_time_below_the_hull():
    """BHB = 4 int dz / c from the hull to the bed, to 1e-9 s; a profile of one speed changes nothing."""
    profile = [[0, 1480.0], [6.6, 1520.0]]
    scenario = afloat(order=3).with_("water", {"profile": profile, "absorption_db_per_m": 0.0})
    gradient, speed = 40 / 6.6, np.interp([0.6, 6.6], [0, 6.6], [1480.0, 1520.0])
    found = arrivals(scenario)
    assert found.delay[by_family(found)["BHB"]] == pytest.approx(4 * np.log(speed[1] / speed[0]) / gradient, abs=1e-9)


@pytest.mark.parametrize(
    ("down", "words"),
    [(-0.7, "at or above the sea surface"), (7.0, "at or below the seabed"), (0.2, "inside the hull")],
)
def test_a_hull_out_of_the_water_or_around_the_sonar_is_refused(down, words):
    """One line that names the key and the fix."""
    with pytest.raises(ValueError, match=words) as refused:
        afloat(size={"offset": (0.0, 0.0, down)})
    assert str(refused.value).count("sonar.hull.offset") == 1
    with pytest.raises(ValueError, match="another platform"):
        afloat(receiver_track={"kind": "static", "position": (3.0, 0.0, 0.6)})
    with pytest.raises(ValueError, match="tracer does not follow"):
        afloat(paths={"engine": "tracer"}, field="incoherent")


def test_a_target_or_relief_inside_the_hull_is_refused_at_the_ping_where_it_is():
    """Any part of a target above the underside and within its outline at some ping; targets that touch are accepted.

    A pile, a box around all of the underside, one inside, a point, a sphere through it, a quay 10 cm too near.
    """
    size = {"length": 20.0, "width": 5.0}

    def box(position, size, **more):
        return {"shape": "box", "label": "it", "position": position, "size": size, **more}

    inside = [
        box((5.0, 0.5), (1.0, 1.0, 8.0)), box((0.0, 9.0), (60.0, 60.0, 0.4), base_depth=0.59),
        box((5.0, 0.5), (1.0, 1.0, 0.2), base_depth=0.3),
        {"shape": "point", "label": "it", "position": (5.0, 2.4, 0.5)},
        {"shape": "sphere", "label": "it", "position": (5.0, 2.9), "diameter": 1.0, "base_depth": 1.1},
        box((0.0, 4.4), (60.0, 4.0, 8.0)), box((9.0, 4.5), (3.0, 3.0, 8.0), heading=np.radians(45.0)),
    ]  # fmt: skip
    for target in inside[1:]:
        with pytest.raises(ValueError, match=r"it reaches into the hull above the sonar at ping 0\. Move") as refused:
            afloat(size=size, targets=[target])
        assert str(refused.value).count("targets.0.position") == 1
    line = {"kind": "line", "start": (-30.0, 0.0, 0.6), "heading": 0.0, "speed": 2.0, "pings": 40,
            "interval": 1.0, "window": (1e-3, 0.05)}  # fmt: skip
    with pytest.raises(ValueError, match=r"at ping 13\. Move"):  # its near face is 4.5 m ahead, the bow 10 m
        afloat(size=size).with_("track", line).with_("targets", inside[:1])
    outside = [
        box((0.0, 4.5), (60.0, 4.0, 8.0)), box((12.5, 0.0), (5.0, 4.0, 8.0)), box((9.0, 5.0), (2.0, 2.0, 8.0)),
        box((11.2, 3.8), (3.0, 3.0, 8.0), heading=np.radians(45.0)),
        {"shape": "point", "label": "it", "position": (5.0, 1.0, 0.6)},
    ]  # fmt: skip
    for target in outside:
        afloat(size=size, targets=[target], paths={"contributions": ["boundary echo"]})
    waves = {"kind": "ripples", "wavelength": 30.0, "height": 12.5}
    trough = afloat(3.0, size=size).with_("track.position", (7.5, 7.5, 3.0)).with_("seabed.depth", 8.0)
    with pytest.raises(ValueError, match=r"sonar\.hull\.offset: puts the underside at or below the seabed at ping 0"):
        trough.with_("seabed.relief", [waves])


def windy(frequency, wind, contributions=("boundary echo",), **more):
    """Surface echoes of an omnidirectional sonar under a wind, without absorption."""
    pulse = {"kind": "cw", "frequency": frequency, "duration": 1e-3}
    paths = {"families": ["S"], "contributions": contributions}
    return bed_only(
        order=1, surface={"reflection": "statistical", "wind_speed": wind, **more}, paths=paths,
        sonar={"pulse": pulse, "receiver": {"bandwidth": 5e3}}, water={"absorption_db_per_m": 0.0},
    )  # fmt: skip


def test_wind_leaves_the_surface_echo_its_coherent_part_and_its_energy():
    """Coherent pressure exp(-2 Gamma^2) of the mirror's, Gamma = k sigma at normal incidence; energy of all rays 1.

    Both less the loss in bubbles. Waves above the law's own cutoff count; sigma of the same spectrum by its integral.
    """
    frequency, wind = 10e3, 3.0
    found = arrivals(windy(frequency, wind))
    loss = 10 ** (-float(bubble_loss_db(wind, frequency, np.array(np.pi / 2))) / 20)
    gamma = (
        2 * np.pi * frequency / 1500 * np.sqrt(wind_waves(wind, shortest_wavenumber(frequency, 1500.0)).variance[-1])
    )
    strongest = {int(b): abs(complex(a)) * 22 for b, a in zip(found.transmit_branch, found.amplitude, strict=True)}
    assert sum(value**2 for value in strongest.values()) == pytest.approx(loss**2, rel=0.02)
    if np.exp(-2 * gamma**2) > 1e-3:
        assert strongest[0] == pytest.approx(np.exp(-2 * gamma**2) * loss, rel=1e-4)
    facets = {"scattering": {"law": "apl-surface", "wind_speed": wind}}
    alone = arrivals(windy(frequency, wind, ("surface", "boundary echo"), **facets))
    assert not np.any(
        alone.object == "boundary echo"
    )  # the law's facets scatter what the mirror loses: no glint counts it once more


def test_labels_and_levels_name_the_boundary_echo():
    """Levels by family and labels of the samples: object, family, and the place of the bounce under the sonar."""
    scenario = bed_only()
    curves = levels(scenario)["level_db"].sel(contribution="boundary echo")
    truth = labels(scenario)
    time = truth["time"].values
    for family, delay in (("B", 12.1e-3), ("S", 14.77e-3), ("BSB", 38.77e-3)):
        sample = int(np.argmin(np.abs(time - delay)))
        assert np.isfinite(curves.sel(pair=family).values[sample])
        assert truth["object"].values[int(truth["strongest_object"].values[0, sample])] == "boundary echo"
        assert truth["pair"].values[int(truth["strongest_pair"].values[0, sample])] == family
    bounce = truth["position"].values[0, int(np.argmin(np.abs(time - 12.1e-3)))]
    np.testing.assert_allclose(bounce, [0, 0, 20], atol=0.02)
    assert not truth["highlight"].values.any()
