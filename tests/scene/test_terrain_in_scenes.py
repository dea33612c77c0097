"""Relief of a scenario: one or several, cut once, grown by a seed, and refused where it is wrong."""

import numpy as np
import pytest

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.scattering.sediments import Sediment
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.terrain import PowerLaw, Ripples, RoughnessCutoff
from insonify.simulator import simulate
from oracles.scenes import nominal

FRACTAL = {"kind": "power-law", "hurst": 0.8, "rms": 0.05}
RIPPLES = {"kind": "ripples", "wavelength": 2.0, "height": 0.1}
SONAR = """
sonar:
  source_level_db: 220
  pulse: {frequency: 100 kHz, duration: 0.2 ms}
  transmit: {kind: line, length: 1.5}
  receive: {kind: line, length: 1.5, steer: 0}
"""
TRACK = "track: {kind: static, position: [0, 0, 11]}\n"


def advice(text):
    """Messages about a scenario file."""
    with pytest.raises(ScenarioError) as caught:
        parse_model(Scenario, text, name="harbour.yaml")
    return str(caught.value)


def test_one_relief_is_a_list_of_one_and_none_is_flat():
    """A relief by itself, in a list, and null."""
    assert Seabed(relief=FRACTAL) == Seabed(relief=[FRACTAL])
    assert Seabed(relief=None) == Seabed() and Seabed().terrain is None
    assert [type(kind) for kind in Seabed(relief=[FRACTAL, RIPPLES]).relief] == [PowerLaw, Ripples]


def test_a_scenario_with_relief_survives_being_written_and_read():
    """Written as YAML and read again, nothing has changed."""
    scenario = nominal(seabed={"relief": [FRACTAL, RIPPLES], "cutoff_wavelength": 1.0, "seed": 7})
    assert parse_model(Scenario, to_yaml(scenario)) == scenario


def test_reliefs_add_up_and_the_ground_is_depth_less_height():
    """Fractal and ripples together are their sum; the mean plane lies at the depth."""
    north, east = np.random.default_rng(1).uniform(-300, 300, (2, 4000))
    beds = [Seabed(relief=relief, seed=3, depth=30.0).terrain for relief in (FRACTAL, [FRACTAL, RIPPLES])]
    rippled = beds[1].depth_at(north, east) - beds[0].depth_at(north, east)
    assert np.std(rippled) == pytest.approx(Ripples(**RIPPLES).variance ** 0.5, rel=0.1)
    assert np.mean(beds[1].depth_at(north, east)) == pytest.approx(30.0, abs=0.02)
    low, high = beds[1].span
    assert low < beds[1].depth_at(north, east).min() and high > beds[1].depth_at(north, east).max()


def test_the_relief_has_the_scenarios_seed_or_its_own():
    """Another seed is other ground; a seed of its own keeps the ground while the scatterers change."""
    depth = [nominal(seed=s, seabed={"relief": FRACTAL, "seed": own}).completed_seabed.depth_at(3.0, 4.0)
             for s, own in ((1, None), (2, None), (1, 5), (2, 5))]  # fmt: skip
    assert depth[0] != depth[1] and depth[2] == depth[3] != depth[0]


def test_the_split_is_the_scenes_or_the_sediments():
    """0.5 m unless given; null requests TR 9407's cut for sediment and frequency, and Lambert's law has none."""
    assert nominal(seabed={"relief": FRACTAL}).completed_seabed.cutoff_wavelength == RoughnessCutoff().wavelength
    sand = {"relief": FRACTAL, "cutoff_wavelength": None, "scattering": {"law": "jackson", "sediment": "medium sand"}}
    expected = RoughnessCutoff.of_sediment(Sediment.named("medium sand"), 100e3, sound_speed=1500.0).wavelength
    assert nominal(seabed=sand).completed_seabed.cutoff_wavelength == expected
    assert (
        nominal(seabed={"relief": FRACTAL, "cutoff_wavelength": None}).completed_seabed.cutoff_wavelength
        == RoughnessCutoff().wavelength
    )
    assert (
        nominal(seabed={"cutoff_wavelength": None}).completed_seabed.cutoff_wavelength is None
    )  # a flat bed needs none


@pytest.mark.parametrize("per_cell", [1.0, 20.0])
def test_the_split_does_not_follow_the_sampling(per_cell):
    """Ground and map are the same however many points lie on it."""
    scenario = nominal(seabed={"relief": FRACTAL}, paths={"scatterers_per_cell": per_cell})
    bed = scenario.completed_seabed.terrain
    assert bed.relief.cutoff.wavelength == 0.5 and bed.heightmap_cell_size == 0.5 / 8
    assert bed is nominal(seabed={"relief": FRACTAL}).completed_seabed.terrain


def test_a_box_stands_on_the_ground_under_it():
    """Its base is the ground's depth at its place, not the mean plane's."""
    box = {"shape": "box", "position": (0.0, 50.0), "size": (1.0, 1.0, 1.0)}
    scene = Scene(seabed={"depth": 20.0, "relief": FRACTAL}, targets=[box])
    assert scene.bodies[0, 7] == scene.seabed.depth_at(0.0, 50.0) != 20.0


@pytest.mark.parametrize(
    ("seabed", "words"),
    [
        ("seabed: {relief: {kind: power-lw, hurst: 0.8, rms: 5 cm}}", "relief.kind: 'power-lw' is not known here"),
        ("seabed: {relief: {hurst: 0.8, rms: 5 cm}}", "relief.kind: missing; it should be one of"),
        ("seabed: {relief: {kind: power-law, hurst: 1.8, rms: 5 cm}}", "relief.hurst: 1.8 is out of range"),
        ("seabed: {relief: {kind: power-law, hurst: 0.8}}", "exactly one of strength and rms"),
        ("seabed: {relief: [{kind: ripples, hight: 5 cm}]}", "did you mean 'height'"),
        (
            "seabed: {relief: {kind: ripples}, cutoff_wavelength: 1 mm}",
            "seabed.cutoff_wavelength: 1 mm is out of range",
        ),
        ("seabed: {relief: {kind: grid, file: nowhere.tif}}", "nowhere.tif: there is no such file"),
        ("seabed: {relief: {kind: grid}}", "relief.file: missing"),
        ("seabed: {relief: 5 cm}", "seabed.relief"),
    ],
)
def test_what_is_no_relief_is_reported_with_its_line(seabed, words):
    """File, line, field and the fix."""
    message = advice(f"title: x\n{seabed}{SONAR}{TRACK}")
    assert words in message and message.startswith("harbour.yaml:2: seabed"), message


def surveyed(tmp_path, *, hole=False):
    """A seabed block on a survey of 201 x 201 m whose depths rise to the north from 21 to 19 m."""
    axis = np.arange(-100.0, 101.0)
    depth = 20 - 0.01 * axis[:, None] + 0 * axis
    if hole:
        depth[:, axis > 20] = np.nan
    np.savez(tmp_path / "survey.npz", depth=depth, north=axis, east=axis)
    grid = f"{{kind: grid, file: {tmp_path / 'survey.npz'}, origin: [0, 0]}}"
    return f"seabed: {{scattering: {{law: lambert}}, relief: {grid}}}\n"


def test_a_sonar_over_a_hole_or_below_the_mirror_is_refused(tmp_path):
    """The first such ping, its place and what to move; the plane that reflects sound lies below the sonar."""
    base = "title: x\n" + surveyed(tmp_path) + SONAR
    message = advice(base + "track: {kind: static, position: [0, 300, 11]}")
    assert "ping 0 has the platform at north 0 m, east 300 m, where the survey has a hole or ends" in message
    message = advice(base + "track: {kind: static, position: [-90, 0, 20.5]}")
    assert "seabed.depth: 20 m is the plane that reflects sound" in message
    message = advice(base + "track: {kind: static, position: [90, 0, 19.5]}")
    assert "at or below the seabed (19.1 m)" in message


def test_ground_that_was_not_surveyed_is_reported_and_stays_silent(tmp_path):
    """Half of the ground is missing: a caution names the share, and the echoes come from the other half only."""
    head = "title: x\nfield: incoherent\nwater: {noise_level_db: null}\npaths: {families: [D]}\n"
    text = head + surveyed(tmp_path, hole=True) + SONAR
    track = "track: {kind: static, position: [0, 0, 11], window: [20 ms, 100 ms]}\n"
    with pytest.warns(match="of the ground within 75 m of the track is not in the survey"):
        east = parse_model(Scenario, text + track)
    with pytest.warns(match="not in the survey"):
        west = parse_model(Scenario, text + track.replace("[0, 0, 11]", "[0, 0, 11], heading: 180 deg"))
    known, beyond = (
        simulate(scenario, threads=2).sel(time=slice(0.04, 0.09)).intensity.values.sum() for scenario in (west, east)
    )
    assert beyond < 1e-3 * known and known > 0
