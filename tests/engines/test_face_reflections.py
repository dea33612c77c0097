"""Large smooth faces of targets, off which sound is reflected on its way to and from the seabed."""

import numpy as np
import pytest

from insonify.engines.face_reflection import face_families
from insonify.explanation.sample_report import explain_sample
from insonify.propagation.knife_edge import knife_edge
from insonify.propagation.path_settings import PathSettings
from insonify.records.legs import LegStatus
from insonify.scattering.lambert import Lambert
from insonify.scene.flat_faces import flat_faces
from insonify.scene.scatterers import Scatterers
from insonify.simulator import arrivals, build_simulator, labels, levels, simulate
from oracles.scenes import nominal
from oracles.traced import apart_db, curves, scene

DULL = {"law": "lambert", "strength_db": -60}
WALL = {"shape": "box", "size": (40.0, 1.0, 20.0), "position": (0.0, 60.5), "scattering": DULL,
        "face_reflection_coefficient": 0.9}  # fmt: skip
"""A wall from the surface to the seabed; its face is 60 m to the east."""
GRADIENT = {"noise_level_db": None, "profile": [[0.0, 1530.0], [12.0, 1500.0], [20.0, 1496.0]]}


def points(*positions, boundary="seabed"):
    """Scatterers of the seabed, or in the water, at some positions."""
    n, normal = len(positions), (0.0, 0.0, -1.0) if boundary == "seabed" else (0.0, 0.0, 0.0)
    return Scatterers(
        "seabed", boundary, Lambert(strength_db=-27.0), np.array(positions, float), np.tile(normal, (n, 1)),
        np.ones(n), np.ones(n, complex), np.arange(n).astype(np.uint64),
    )  # fmt: skip


def legs_to(scatterers, *, position=(0.0, 0.0, 11.0), targets=(WALL,), frequency=100e3, paths=None, **top):
    """Transmit legs of all families up to order 3 from a position, as columns by the name of the ray."""
    chosen = {"max_reflections": 3, "face_reflections": True, **(paths or {})}
    pulse = {"kind": "cw", "frequency": frequency, "duration": 20 / frequency}
    simulator = build_simulator(nominal(
        targets=list(targets), paths=chosen, track={"position": position, "window": (0.0, 0.2)},
        transmit={"kind": "point", "length": None}, receive={"kind": "point", "length": None}, sonar={"pulse": pulse},
        **top,
    ))  # fmt: skip
    legs = simulator.engine.path_pairs(simulator.ping_geometry(0), scatterers).transmit_legs
    return dict(zip(legs.ray_names, zip(legs.delay, legs.amplitude, legs.departure, legs.status, strict=True),
                    strict=True))  # fmt: skip


@pytest.mark.parametrize("water", [{"noise_level_db": None}, GRADIENT], ids=["one speed", "layered"])
def test_a_wall_shows_the_open_scene_from_the_image_of_the_sonar(water):
    """Legs by way of a wall are those from 120 m further east without it, times R: 1e-9 s, 0.1 dB, any reflections."""
    bed = points((1.0, 20.0, 20.0), (-4.0, 45.0, 20.0), (3.0, 58.0, 20.0))
    found, free = (legs_to(bed, position=(0.0, east, 11.0), targets=targets, water=water)
                   for east, targets in ((0.0, (WALL,)), (120.0, ())))  # fmt: skip
    for name in ("D", "S", "BS"):
        via = found["F" + name.replace("D", "")]
        np.testing.assert_allclose(via[0], free[name][0], atol=1e-9)
        np.testing.assert_allclose(20 * np.log10(np.abs(via[1] / free[name][1])), 20 * np.log10(0.9), atol=0.1)
        np.testing.assert_allclose(np.angle(via[1] / free[name][1]), 0, atol=0.02)
        np.testing.assert_allclose(via[2], free[name][2] * [1, -1, 1], atol=1e-12)


def test_a_face_counts_as_one_reflection():
    """With one reflection, F; with two, FS as well; with none, or without the key, nothing."""
    allowed = [PathSettings(face_reflections=True, max_reflections=order) for order in (0, 1, 2)]
    assert [face_families(one) for one in allowed] == [(), ("D",), ("D", "S", "B")]
    assert face_families(PathSettings(max_reflections=2)) == ()


@pytest.mark.parametrize("gap", [0.001, 0.009, 0.011, 0.03])
def test_a_gap_below_a_wall_takes_what_passes_between_its_edge_and_the_image_of_the_edge(gap):
    """Legs to the seabed at its foot, less the Fresnel integral over a slot of twice the gap: 2 % of the whole leg."""
    places, wavelength = [(0.0, 55.0, 20.0), (0.0, 58.0, 20.0), (0.0, 59.5, 20.0)], 0.015
    lifted = {**WALL, "size": (40.0, 1.0, 20.0 - gap), "base_depth": 20.0 - gap}
    whole, found = (legs_to(points(*places), targets=[one], paths={"max_reflections": 1})["F"][1]
                    for one in (WALL, lifted))  # fmt: skip
    for (_, east, _), ratio in zip(places, found / whole, strict=True):
        behind, steep = 60.0 - east, np.arctan2(9.0, 120.0 - east)
        low, high = ((side * gap + behind * np.tan(steep)) * np.cos(steep) for side in (-1, 1))
        scale = np.sqrt(2 / wavelength * (np.cos(steep) / 60 + np.cos(steep) / behind))
        assert abs(ratio - (1 - knife_edge(low * scale) + knife_edge(high * scale))) < 0.02


@pytest.mark.parametrize("east", [40.0, 52.0])
def test_the_size_of_a_face_is_that_of_kirchhoffs_integral_over_it(east):
    """Reflected field of a plate 3 x 2 m at 20 kHz, in the beam, on its edge and beside it: 2 % of the full one.

    The oracle sums (cos + cos) / 2 exp(-jk (r + s)) / (r s) / lambda over the face.
    """
    plate = {"shape": "box", "size": (3.0, 1.0, 2.0), "position": (0.0, 60.5), "base_depth": 12.5, "scattering": DULL,
             "face_reflection_coefficient": 1.0}  # fmt: skip
    ends = [(north, east, depth) for north in (0.0, 1.0, 2.0, 3.1) for depth in (11.5, 12.4)]
    found = legs_to(points(*ends, boundary="water"), targets=[plate], frequency=20e3)["F"]
    k = 2 * np.pi * 20e3 / 1500
    step = 0.01
    north, depth = np.meshgrid(np.arange(-1.5, 1.5, step) + step / 2, np.arange(10.5, 12.5, step) + step / 2)
    r = np.sqrt(north**2 + 60.0**2 + (depth - 11.0) ** 2)
    for row, (x, y, z) in enumerate(ends):
        s = np.sqrt((north - x) ** 2 + (60.0 - y) ** 2 + (depth - z) ** 2)
        cosine = (60.0 / r + (60.0 - y) / s) / 2
        field = np.sum(cosine * np.exp(-1j * k * (r + s)) / (r * s)) * step**2 * 1j * k / (2 * np.pi)
        whole = np.sqrt(x**2 + (120.0 - y) ** 2 + (z - 11.0) ** 2)
        expected = field * whole * np.exp(1j * k * whole)
        loss = 10 ** (-float(build_simulator(nominal()).scenario.water.absorption(20e3)) * whole / 20)
        assert abs(found[1][row] * whole / loss - expected) < 0.02


def test_a_leaning_face_reflects_from_the_image_in_its_plane():
    """A plate pitched by 60 degrees: delay and direction of the image in its plane; no families with a boundary."""
    plate = {"shape": "plate", "length": 10.0, "width": 20.0, "position": (0.0, 40.0), "base_depth": 15.0,
             "heading": np.pi / 2, "pitch": np.pi / 3, "scattering": DULL,
             "face_reflection_coefficient": 1.0}  # fmt: skip
    found = legs_to(points((0.5, 25.0, 20.0)), targets=[plate])
    (name,) = (name for name in found if name.startswith("F"))
    delay, _, departure, _ = found[name]
    sonar, bed, normal = np.array([0.0, 0.0, 11.0]), np.array([0.5, 25.0, 20.0]), -np.array([0.0, np.sqrt(0.75), 0.5])
    face = np.array([0.0, 40.0, 15.0 - 5.0 * np.sqrt(0.75) - 0.0025]) + 0.005 * normal
    way = bed - (sonar - 2 * (sonar - face) @ normal * normal)
    assert delay[0] == pytest.approx(np.linalg.norm(way) / 1500, abs=1e-9)
    way = (way - 2 * way @ normal * normal) / np.linalg.norm(way)
    np.testing.assert_allclose(departure[0], way, atol=1e-9)


def test_other_targets_hide_what_a_face_reflects():
    """A box before the wall cuts the legs whose part before or behind the face passes through it, and no others."""
    block = {"shape": "box", "label": "block", "size": (2.0, 2.0, 6.0), "position": (0.0, 40.0), "scattering": DULL}
    bed = points((6.0, 55.0, 20.0), (0.0, 30.0, 20.0), (8.0, 30.0, 20.0))
    found, free = (legs_to(bed, targets=targets)["F"] for targets in ((WALL, block), (WALL,)))
    assert [int(one) for one in found[3]] == [LegStatus.CLEAR, LegStatus.OCCLUDED, LegStatus.CLEAR]
    np.testing.assert_allclose(found[1][[0, 2]], free[1][[0, 2]], rtol=1e-12)


FAR = {"families": None, "max_reflections": 1, "contributions": ("seabed",)}


@pytest.mark.parametrize("apart", [
    None, pytest.param((0.0, 0.0, -0.1), marks=pytest.mark.validate),
    pytest.param((0.0, 0.0, -5.0), marks=pytest.mark.validate), (0.0, -2.0, 0.0),
])  # fmt: skip
def test_a_wall_shines_as_the_tracer_has_it(apart):
    """Seabed before a wall by one reflection: every pair with the wall and the surface within 0.1 dB of the tracer.

    With both arrays at one position, where the two orders of a pair add in phase, and with arrays apart, where they
    come at other times, by other points of the wall and with other phases. Echoes from right under the sonar,
    where few strong rays return, are left out of D-F.
    """
    wall, window = {**WALL, "size": (12.0, 1.0, 19.5), "face_reflection_coefficient": 1.0}, (0.075, 0.1)
    arrays = {} if apart is None else {"receive": {"offset": apart}}
    few = {"face_reflections": True, "scatterers_per_cell": 2}
    engine = curves(scene("eigenrays", targets=[wall], window=window, paths=FAR | few, **arrays))
    traced = curves(scene("tracer", targets=[wall], window=window, rays=500_000, paths=FAR, **arrays))
    for pair in ("D-F", "S-F", "F-F", "D-S"):
        other = pair.replace("F-F", "T-T").replace("-F", "-T")
        both = traced["seabed", other], engine["seabed", pair]
        some = int((0.33 if pair == "D-F" else 1.0) * both[0].size)
        assert apart_db(*(one[:some] for one in both)) == pytest.approx(0, abs=0.1), pair


def test_the_corner_of_a_rough_bed_and_a_smooth_face_counts_once():
    """Bed and face, both smooth to the sound or nearly: the echo of the face by the bed, within 1 dB of a smooth bed's.

    The same path is one off the face that the bed scatters, D-F: with the echo of the face it would count twice, 3 dB
    more. Where targets return no sound, the bed has it.
    """

    def corner(interface: str, *contributions: str) -> dict[str, float]:
        sediment = {"scattering": {"law": "jackson", "sediment": "medium sand"}, "reflection": "medium sand"}
        found = levels(nominal(
            field="incoherent", line={"length": 0.3}, track={"window": (0.1055, 0.1125)},
            box={"position": (0.0, 82.0), "size": (1.0, 0.6, 0.8), "face_reflection_coefficient": 0.9},
            sonar={"pulse": {"frequency": 20e3, "duration": 0.5e-3}},
            seabed={"reflecting_interface": interface, **sediment},
            paths={"max_reflections": 1, "face_reflections": True, "contributions": contributions,
                   "scatterers_per_cell": 1},
        ))  # fmt: skip
        power = 10 ** (found.level_db.sel(pair="all") / 10)
        return {str(name): float(power.sel(contribution=name).mean()) for name in found.contribution.values}

    rough, smooth = (corner(interface, "seabed", "target") for interface in ("rough", "smooth"))
    assert 10 * np.log10(rough["target"] / smooth["target"]) == pytest.approx(0, abs=1.0)
    assert 10 * np.log10(rough["total"] / rough["target"]) == pytest.approx(0, abs=0.1)
    assert corner("rough", "seabed")["seabed"] > rough["target"] / 2


@pytest.mark.parametrize("field", ["incoherent", "coherent"])
def test_without_smooth_faces_nothing_changes(field):
    """The same bits with and without face reflections where faces are rough, or smooth ones narrow."""
    for smooth, size in ((None, (4.0, 1.0, 3.0)), (0.5, (0.12, 0.12, 0.12))):
        target = {"shape": "box", "size": size, "position": (0.0, 20.5), "face_reflection_coefficient": smooth}
        one, other = (
            simulate(nominal(targets=[target], field=field, track={"window": (0.02, 0.03)},
                             paths={"max_reflections": 1, "face_reflections": on}))
            for on in (True, False)
        )  # fmt: skip
        name = "pressure" if field == "coherent" else "intensity"
        np.testing.assert_array_equal(one[name].values, other[name].values)


OBLIQUE = {**WALL, "size": (20.0, 1.0, 19.5), "heading": np.pi / 4, "position": (0.0, 40.5)}
"""A wall that sends the beam, which looks east, to the north."""


def test_ground_that_only_a_face_lights_is_as_bright_as_the_tracer_has_it():
    """A wall at 45 degrees lights ground far outside the beam: F-F within 0.05 dB, sampled by importance or not."""
    window, direct = (0.06, 0.1), {**FAR, "families": ["D"]}
    traced = curves(scene("tracer", targets=[OBLIQUE], window=window, rays=100_000, paths=direct))["seabed", "T-T"]
    for sampled in (True, False):
        paths = {**direct, "face_reflections": True, "importance_sampling": sampled}
        found = curves(scene("eigenrays", targets=[OBLIQUE], window=window, paths=paths))["seabed", "F-F"]
        assert apart_db(found, traced) == pytest.approx(0, abs=0.05)


def test_importance_sampling_keeps_scatterers_that_only_a_face_lights():
    """One coherent ping off an oblique wall: fewer scatterers, and the same energy within 0.01 dB as with all."""
    energy, count = [], []
    for sampled in (True, False):
        paths = {**FAR, "families": ["D"], "face_reflections": True, "importance_sampling": sampled}
        one = scene("eigenrays", targets=[OBLIQUE], window=(0.07, 0.09), paths=paths)
        simulator = build_simulator(one.model_copy(update={"field": "coherent"}))
        count.append(sum(len(block()) for block in simulator.engine.blocks(simulator.ping_geometry(0))))
        energy.append(np.abs(simulate(simulator.scenario).pressure.values) ** 2)
    assert count[0] < 0.4 * count[1]
    assert apart_db(*energy) == pytest.approx(0, abs=0.01)


def test_labels_and_explanation_name_the_face_that_lights_a_pixel():
    """In the shadow of an oblique wall only F-F arrives: labels, arrivals and `explain` name seabed F-F, at the north.

    The sum of the arrivals is the sample within 1e-3, and their delays are those of the image of the sonar.
    """
    scenario = nominal(targets=[{**OBLIQUE, "label": "wall"}], paths={**FAR, "face_reflections": True},
                       track={"window": (0.0695, 0.0705)}, field="coherent")  # fmt: skip
    found, paths = labels(scenario).sel(time=0.07, method="nearest").squeeze(), arrivals(scenario)
    assert found["object"].values[int(found["strongest_object"])] == "seabed"
    assert found["pair"].values[int(found["strongest_pair"])] == "F-F"
    assert bool(found["shadow"]) and found["object"].values[int(found["shadowing_object"])] == "wall"
    lit = paths.take(np.array([paths.ray_names(row) == ("F", "F") for row in range(len(paths))]))
    foot = 40.5 - np.sqrt(0.5)
    image = np.array([-foot, foot, 11.0])
    distance = np.linalg.norm(lit.position - image, axis=1)
    np.testing.assert_allclose(lit.delay, 2 * distance / 1500, atol=1e-9)
    assert len(lit) > 100 and (lit.position[:, 0] > 0).all()
    page = explain_sample(simulate(scenario), 0, 0.07)
    kinds = [line for line in page.splitlines() if " arrivals, incoherent sum " in line]
    assert kinds[0].startswith("seabed F-F: ")
    levels = {line[:26].strip(): float(line.split()[-5]) for line in page.splitlines()[-3:-1]}
    assert levels["all arrivals, coherent sum"] == pytest.approx(levels["recorded"], abs=0.1)


@pytest.mark.parametrize("water", [{"noise_level_db": None}, GRADIENT], ids=["one speed", "layered"])
def test_a_target_that_only_a_face_lights_is_received(water):
    """A box north of the sonar, outside its beams: its echo by the oblique wall out and back, at the image's time."""
    box = {"shape": "box", "label": "block", "size": (1.0, 1.0, 1.0), "position": (15.0, 39.8)}
    paths = {"face_reflections": True, "families": ["D"], "max_reflections": 1, "contributions": ("target",)}
    wall = {**OBLIQUE, "size": (3.0, 1.0, 19.5)}
    found = curves(nominal(targets=[wall, box], field="incoherent", paths=paths, water=water,
                           track={"window": (0.06, 0.085)}))  # fmt: skip
    echo = found["target", "F-F"]
    strongest = 0.06 + 0.025 * int(np.argmax(echo)) / echo.size
    assert strongest == pytest.approx(2 * np.hypot(39.8 + 14.5, 8.5) / 1500, abs=1e-3)


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_a_face_out_of_reach_costs_and_changes_nothing(field):
    """A wall 400 m off, of which no echo comes within 60 ms: the scatterers and the sound are those without faces."""
    far = {"shape": "box", "label": "wall", "position": (0.0, 400.0), "size": (10.0, 2.0, 5.0),
           "face_reflection_coefficient": 0.9}  # fmt: skip
    scenes = [
        nominal(targets=[far], field=field, track={"window": (0.05, 0.06)},
                paths={"max_reflections": 1, "face_reflections": faces}) for faces in (True, False)
    ]  # fmt: skip
    simulators = [build_simulator(scene) for scene in scenes]
    counts = [
        sum(len(block()) for block in one.engine.blocks(one.ping_geometry(0), quadrature=field == "incoherent"))
        for one in simulators
    ]
    assert counts[0] == counts[1] > 0
    name = "pressure" if field == "coherent" else "intensity"
    with_faces, without = (simulate(scene)[name].values for scene in scenes)
    tolerance = 1e-6 if field == "coherent" else 0.05
    assert np.abs(with_faces - without).max() <= tolerance * np.abs(without).max()


def test_the_distance_from_a_face_is_that_of_its_nearest_point():
    """A wall of 10 m by 5 m: ahead of it, past its end and above it."""
    scene = nominal(targets=[{"shape": "box", "label": "wall", "position": (0.0, 30.0), "size": (10.0, 2.0, 5.0),
                              "face_reflection_coefficient": 0.9}])  # fmt: skip
    faces = flat_faces(build_simulator(scene).engine.scene, 0.015)
    (face,) = (one for one in faces if one.axes[0, 1] < -0.99)
    corners = face.triangles.reshape(-1, 2)
    middle = face.axes[0] * face.distance + corners.mean(axis=0) @ face.axes[1:]
    assert face.distance_from(middle + 7 * face.axes[0]) == pytest.approx(7.0)
    aside = middle + 3 * face.axes[0] + (np.ptp(corners[:, 0]) / 2 + 4) * face.axes[1]
    assert face.distance_from(aside) == pytest.approx(5.0)
    assert face.distance_from(aside + (np.ptp(corners[:, 1]) / 2 + 12) * face.axes[2]) == pytest.approx(13.0)
