"""Smooth faces as they are received: both readings of one flash, jitter, spikes, labels; both parts of one target."""

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, labels, simulate
from oracles.arrival_sum import coherent_from_arrivals
from oracles.scenes import nominal
from oracles.smooth import ROUGH

BOX = {"shape": "box", "label": "box", "position": (0.0, 150.5), "size": (2.0, 1.0, 1.0)}
WINDOW = (0.198, 0.208)


def scene(*, smooth=1.0, scattering=ROUGH, field="incoherent", heading=0.0, size=(2.0, 1.0, 1.0), **paths):
    """The nominal box alone, smooth, received about its echoes; one reflection on each leg."""
    box = {**BOX, "size": size, "face_reflection_coefficient": smooth, "scattering": scattering, "heading": heading}
    settings = {"contributions": ["target"], "max_reflections": 1, **paths}
    return nominal(targets=[box], track={"window": WINDOW}, paths=settings, field=field)


def intensity(scenario):
    """Expected intensity, or squared pressure [uPa^2]."""
    received = simulate(scenario)
    return np.abs(received.pressure.values[0, 0]) ** 2 if "pressure" in received else received.intensity.values[0, 0]


@pytest.mark.parametrize("heading", [0.0, 0.2])
def test_a_smooth_target_has_no_speckle_so_both_readings_agree(heading):
    """Expected intensity is the square of the pressure, sample by sample: facets cancel in single precision."""
    expected = intensity(scene(heading=heading))
    found = intensity(scene(heading=heading, field="coherent"))
    np.testing.assert_allclose(found, expected, atol=5e-4 * expected.max())
    assert expected.max() > 0


@pytest.mark.parametrize(("frequency", "diameter", "depth"), [(120e3, 0.4, 10.0), (120e3, 0.15, 9.4)])
def test_a_pulse_as_short_as_the_band_allows_keeps_the_strength_of_a_sphere(frequency, diameter, depth):
    """Energy re a point of 20 log10(a / 2) where the sphere is nearest, 2 / bandwidth long: within 0.25 dB."""
    radius, range_ = diameter / 2, float(np.hypot(30.0, depth - 10.0))
    nearest = [30.0 * (1 - radius / range_), 10.0 + (depth - 10.0) * (1 - radius / range_)]
    ball = {"shape": "sphere", "position": (0.0, 30.0), "diameter": diameter, "base_depth": depth + radius,
            "face_reflection_coefficient": 1.0, "scattering": ROUGH}  # fmt: skip
    strength = 20 * np.log10(radius / 2 * (range_ - radius) / range_)
    point = {"shape": "point", "position": (0.0, *nearest), "target_strength_db": strength}
    end, pulse = {"kind": "point"}, {"frequency": frequency, "duration": 12 / frequency}
    sonar = {"pulse": pulse, "transmit": end, "receive": end, "receiver": {"bandwidth": frequency / 6}}
    sound, ideal = (intensity(nominal(
        targets=[target], sonar=sonar, track={"position": (0.0, 0.0, 10.0), "window": (0.035, 0.045)},
        paths={"contributions": ["target"], "max_reflections": 0}, field="coherent",
    )).sum() for target in (ball, point))  # fmt: skip
    assert 10 * np.log10(sound / ideal) == pytest.approx(0, abs=0.25)


def test_the_mean_over_jitter_is_the_expected_intensity():
    """Replicas of pairs of rays shaken by up to a third of a wavelength, 80 pings: energy within 0.7 dB, 3 errors.

    All facets of one pair shake together: a face by itself, on the direct path alone, loses nothing.
    """
    shaken = {"jitter": 1 / 3, "size": (0.2, 0.1, 0.2)}  # small: few rough points
    expected = intensity(scene(**shaken)).sum()
    scenario = scene(field="coherent", **shaken).model_copy(update={"track": _pings(80)})
    ready = build_simulator(scenario)
    facets = [block() for block in ready.engine.blocks(ready.ping_geometry(0))]  # the same at each ping

    def energy(here):
        reading = ready.coherent_accumulator(here)
        total = reading.empty()
        for points in facets:
            reading.add(total, ready.engine.path_pairs(here, points))
        return np.sum(np.abs(reading.time_series(total)) ** 2)

    found = [energy(ready.ping_geometry(ping)) for ping in range(80)]
    assert 10 * np.log10(np.mean(found) / expected) == pytest.approx(0, abs=0.7)
    alone = scene(max_reflections=0, **shaken)
    assert intensity(alone).sum() == pytest.approx(
        intensity(scene(max_reflections=0, size=shaken["size"])).sum(), rel=1e-6
    )


def _pings(count):
    """The nominal static track, pinging more often."""
    return scene().track.model_copy(update={"pings": count})


def test_spikes_written_out_sound_like_the_ping():
    """Arrivals of facets received row by row, against blocks: within 1e-5; all of a target are one group."""
    scenario = scene(field="coherent")
    ready = build_simulator(scenario)
    rows = arrivals(scenario)
    faces = rows.take(np.abs(rows.scattering_amplitude) > 1e-6)
    assert len(np.unique(faces.group)) == 1
    assert set(faces.object) == {"box"}
    written = coherent_from_arrivals(rows, ready.ping_geometry(0), ready.grid)[0]
    received = simulate(scenario).pressure.values[0, 0]
    np.testing.assert_allclose(written, received, atol=1e-5 * np.abs(received).max())


def test_half_the_reflection_is_a_quarter_of_the_energy_and_soft_is_as_strong_as_rigid():
    """Energy goes with the square of the coefficient, whatever its sign."""
    whole, half, soft = (intensity(scene(smooth=smooth)).sum() for smooth in (1.0, 0.5, -1.0))
    assert half == pytest.approx(whole / 4, rel=1e-6)
    assert soft == pytest.approx(whole, rel=1e-6)


def test_rough_and_smooth_parts_add_as_energies():
    """Both parts of one box at once: the sum of each by itself; without `smooth` it sounds as if none were known."""
    rough = {"law": "lambert", "strength_db": -10}
    both, alone, flash = (
        intensity(scene(smooth=smooth, scattering=law)) for smooth, law in ((0.01, rough), (None, rough), (0.01, ROUGH))
    )
    np.testing.assert_allclose(both, alone + flash, rtol=1e-6)
    assert flash.sum() > 0.01 * alone.sum()


def test_the_label_of_a_flash_is_the_target_and_its_ghost_is_the_corners():
    """A smooth box on the bed: highlight where it flashes; the ghost at aa + 3.9 ms is bd's, not ab's."""
    scenario = scene(max_reflections=2)
    seen = labels(scenario)
    time = seen.time.values
    received = intensity(scenario)
    flash, ghost = np.argmax(np.where(time < 0.2015, received, 0)), np.argmax(np.where(time > 0.2035, received, 0))
    assert bool(seen.highlight.values[0, flash]) and bool(seen.ghost.values[0, ghost])
    assert time[ghost] - time[flash] == pytest.approx(3.91e-3, abs=0.15e-3)
    assert seen.position.values[0, flash, 1] == pytest.approx(150.0, abs=0.05)
    pairs = [str(seen.pair.values[seen.strongest_pair.values[0, when]]) for when in (flash, ghost)]
    assert pairs == ["D-B", "S-SB"]


def test_one_facet_alone_has_its_label_too():
    """Of a target of which a single facet is seen, each pair's energy and place are deposited as of any point."""
    ready = build_simulator(scene())
    here = ready.ping_geometry(0)
    (flat,) = (
        points
        for points in (block() for block in ready.engine.blocks(here, quadrature=True))
        if not points.has_random_phase
    )
    facet = ready.engine.path_pairs(here, flat.take(slice(0, 1)))
    reading = ready.label_accumulator(here)
    kept = reading.empty()
    reading.add(kept, facet)
    seen, (i, j) = kept.flashes["box", "D-D"].bins.sum(axis=(0, 1)), facet.pair[0]
    sent, received_weight = reading.accumulator.weights(facet)
    assert seen[0] == pytest.approx(abs(sent[0, i, 0] * received_weight[0, j, 0] * facet.strength[0, 0]) ** 2)
    relative = flat.position[0] - here.receive_position
    np.testing.assert_allclose(seen[1:4] / seen[0], relative, rtol=1e-6)  # single precision


def test_a_face_keeps_together_over_a_moving_sea():
    """The ghost of a smooth face has the same expected energy 0.1 s later, within 0.5 dB: its facets meet one sea.

    The sea turns phases within 30 ms, so facets with a sea for each would fall apart; other glints come after a second.
    """
    static = _pings(2).model_copy(update={"interval": 0.1, "window": (0.2015, 0.208)})
    settings = {"max_reflections": 2, "families": ["D", "S", "B", "SB"]}
    sea = scene(**settings).surface.model_copy(update={"reflection": "statistical", "wind_speed": 3.0})
    sound = simulate(scene(**settings).model_copy(update={"track": static, "surface": sea})).intensity.values
    before, after = sound.sum(axis=(1, 2))
    assert 10 * np.log10(after / before) == pytest.approx(0, abs=0.5)


@pytest.mark.parametrize(("length", "duration"), [(0.09, 30e-6), (0.4, 160e-6)])
def test_a_leaning_plate_sounds_like_all_its_patches(length, duration):
    """Pressure over time of a plate turned by 20 degrees, against narrow patches, each at its delay.

    The flash goes elsewhere; the plate's two ends come back, 40 or 180 us apart, of pulses of 30 or 160 us: within 3 %
    of the strongest sample. With one delay for each piece of the longer plate, its pieces' own ends came back too.
    """
    turn = np.radians(20.0)
    plate = {"shape": "box", "label": "plate", "position": (0.0, 60.0), "size": (length, 0.01, 0.3), "heading": turn,
             "base_depth": 11.15, "face_reflection_coefficient": 1.0, "scattering": ROUGH}  # fmt: skip
    pulse = {"kind": "cw", "frequency": 100e3, "duration": duration, "taper": "hann"}
    scenario = nominal(
        targets=[plate], line={"length": 0.05}, sonar={"pulse": pulse, "receiver": {"bandwidth": 4.5 / duration}},
        track={"window": (0.0794, 0.081)}, paths={"contributions": ["target"], "max_reflections": 0},
        water={"noise_level_db": None, "absorption_db_per_m": 0.0},
    )  # fmt: skip
    ready = build_simulator(scenario)
    here = ready.ping_geometry(0)
    places, normals, area = _box_patches(turn, (length, 0.01, 0.3), (0.0, 60.0, 11.0), 0.0006)
    ray = places - here.transmit_position
    length = np.linalg.norm(ray, axis=1)
    cosine = -np.sum(ray * normals, axis=1) / length
    gain = here.transmit_beams.gain(ray / length[:, None])[0] * here.receive_beams.gain(ray / length[:, None])[0]
    spike = 1j / 0.015 * np.maximum(cosine, 0) * area * gain / length**2 * np.exp(-2j * np.pi * 200e3 * length / 1500)
    time = ready.grid.time
    expected = 10**11 * sum(
        w * here.pulse.samples(time - 2 * way / 1500) for w, way in zip(spike, length, strict=True) if w != 0
    )
    received = simulate(scenario).pressure.values[0, 0]
    assert np.abs(received - expected).max() < 0.03 * np.abs(expected).max()


def _box_patches(turn, size, middle, side):
    """Patches of the upright faces of a box: places (n, 3), outward normals (n, 3), areas (n,)."""
    ahead, right = np.array([np.cos(turn), np.sin(turn), 0]), np.array([-np.sin(turn), np.cos(turn), 0])
    found = []
    for out, along, depth, width in ((right, ahead, size[1], size[0]), (ahead, right, size[0], size[1])):
        spans = (width, size[2])
        counts = int(np.ceil(width / side)), int(np.ceil(size[2] / side / 64))  # in height the phase hardly turns
        s, t = (((np.arange(n) + 0.5) / n - 0.5) * span for n, span in zip(counts, spans, strict=True))
        s, t = (part.ravel() for part in np.meshgrid(s, t))
        for sign in (1, -1):
            place = np.array(middle) + sign * out * depth / 2 + s[:, None] * along + t[:, None] * np.array([0, 0, 1.0])
            found.append((place, np.tile(sign * out, (s.size, 1)), np.full(s.size, width * size[2] / s.size)))
    return tuple(np.concatenate(column) for column in zip(*found, strict=True))


@pytest.mark.parametrize(
    ("heading", "cycles"), [(0.0, 40), (0.17, 40), (0.5, 40), (0.087, 10), (0.17, 10), (0.26, 10), (0.38, 10)]
)
def test_a_box_is_received_alike_as_a_body_and_as_a_mesh(tmp_path, heading, cycles):
    """Off the specular direction too: pressures differ by less than a fifth, energies by 0.3 dB.

    The facets of a mesh have six delays; with one for each facet they would shine off the specular direction.
    """
    length, width, height = 0.6, 0.3, 0.3
    corners = [(x, y, z) for x in (-length / 2, length / 2) for y in (-width / 2, width / 2) for z in (0, height)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    lines += ["f {} {} {} {}".format(*(row + 1 for row in face)) for face in faces]
    file = tmp_path / "box.obj"
    file.write_text("\n".join(lines))
    end, pulse = {"kind": "point"}, {"frequency": 100e3, "duration": cycles / 100e3}
    body, mesh = (
        simulate(nominal(
            targets=[{**shape, "label": "box", "position": (0.0, 15.0), "heading": heading,
                      "face_reflection_coefficient": 1.0, "scattering": ROUGH}],
            sonar={"pulse": pulse, "transmit": end, "receive": end, "receiver": {"bandwidth": 200e3 / cycles}},
            track={"position": (0.0, 0.0, 17.0), "window": (0.0185, 0.0225)},
            paths={"contributions": ["target"], "max_reflections": 0}, field="coherent",
        )).pressure.values[0, 0]
        for shape in ({"shape": "box", "size": (length, width, height)}, {"shape": "mesh", "file": str(file)})
    )  # fmt: skip
    energy, difference = (np.sum(np.abs(part) ** 2) for part in (body, body - mesh))
    assert difference < 0.05 * energy
    assert 10 * np.log10(np.sum(np.abs(mesh) ** 2) / energy) == pytest.approx(0, abs=0.3)
