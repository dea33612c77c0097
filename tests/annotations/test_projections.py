"""Claims about where masks lie: true coordinates in each projection, shadows by their geometry, tiles that add up."""

import itertools
from functools import cache

import numpy as np
import pytest

import insonify
from insonify.annotations import labelled_images
from insonify.annotations.annotation import annotations
from insonify.formats.label_store import open_labels
from insonify.formats.store_description import StoreError
from insonify.recording_run import record
from oracles.few_of import few_of
from oracles.surveys import MOTION, UTM, plane, sidescan

HIGHLIGHT, SHADOW, GHOST = range(3)
ABOVE = 4.0
"""Height of the sonar above the bed, 1 m below the surface [m]."""
WALLS = {"high": (1.0, 9.0), "low": (0.5, -9.0)}
"""Height, and east of the middle, of walls 1.1 m along the track that are 1 m thick and 1.2 m long [m]."""
QUIET = {"water": {"sound_speed": 1500.0, "noise_level_db": None}}
ONE_BOUNCE = {"max_reflections": 1, "contributions": ("seabed", "target"), "edge_diffraction": "none",
              "scatterers_per_cell": 1}  # fmt: skip
"""Paths by one reflection, to few points: masks are found in expected levels, which fewer points give as well."""


@few_of(
    (0, 2), ("slopes", "heading", "across"), [(None, 200.0, -7.5), ((0.0, 0.25), 200.0, -7.5), ((0.2, -0.2), 30.0, 6.0)]
)
def test_a_known_target_lies_on_its_true_coordinates(tmp_path, slopes, heading, across):
    """A point on a flat bed and on slopes, to either side: the middle of its mask is within a pixel in all three."""
    pytest.importorskip("rasterio")
    point, along = np.array([3.0, 7.0]), 1.23
    depth = 10.0 if slopes is None else 10 + float(point @ slopes)
    target = {"shape": "point", "label": "p", "position": (*point, depth - 0.02), "target_strength_db": -30.0}
    bed = {"depth": 10.0} if slopes is None else {"relief": [plane(tmp_path, *slopes)], "depth": 10.0}
    bed |= {"scattering": {"law": "lambert", "strength_db": -27.0}}
    forward = np.array([np.cos(np.radians(heading)), np.sin(np.radians(heading))])
    start = point - along * forward - across * np.array([-forward[1], forward[0]])
    track = {"heading": f"{heading} deg", "start": (*start, 6.0), "interval": 0.05, "window": (0.0, 0.013)}
    scenario = sidescan(targets=[target], pings=26, seabed=bed, track={**track, "motion": {}}, **QUIET)
    record(scenario, tmp_path / "a.zarr", with_labels=True, threads=1)
    slant = np.hypot(across, depth - 0.02 - 6.0)
    earth = (0.0, 0.0) if slopes is None else UTM
    expected = {
        "slant": (along, np.sign(across) * slant), "ground": (along, across), "mosaic": earth + point,
    }  # fmt: skip
    for projection, place in expected.items():
        (image,) = labelled_images(tmp_path / "a.zarr", projection)
        cells = np.nonzero(image.layers[HIGHLIGHT] == 1)
        for axis, inside, true in zip((image.rows, image.columns), cells, place, strict=True):
            pixel = np.median(np.abs(np.diff(axis.values)))
            assert abs(axis.values[inside].mean() - true) <= pixel, (projection, axis.name)
        assert 1 <= len(cells[0]) < 200 and not image.layers[[SHADOW, GHOST]].any()
        assert abs(image.views[1]["slant_range_m"] - slant) < 0.05
        assert abs(image.views[1]["ground_range_m"] - abs(across)) < 0.05
    right = np.sign(across) * np.array([-forward[1], forward[0]])
    ray = np.array([*(abs(across) * right), depth - 6.0])
    upright = np.array([*(-np.array(slopes or (0.0, 0.0))), 1.0])  # normal of the plane, downwards
    angle = np.arcsin(ray @ upright / np.linalg.norm(ray) / np.linalg.norm(upright))
    assert abs(image.views[1]["grazing_deg"] - np.degrees(angle)) < 0.3


@pytest.fixture(scope="module")
def walls(tmp_path_factory):
    """Two walls on a flat bed, on either side of a track to the north, with one reflection."""
    folder = tmp_path_factory.mktemp("walls")
    targets = [
        {"shape": "box", "label": label, "position": (1.1, east), "size": (1.2, 1.0, height),
         "scattering": {"strength_db": -5.0}}
        for label, (height, east) in WALLS.items()
    ]  # fmt: skip
    scenario = sidescan(
        targets=targets, pings=12, seabed={"depth": 5.0, "scattering": {"law": "lambert", "strength_db": -27.0}},
        track={"heading": 0.0, "start": (0.0, 0.0, 1.0), "interval": 0.1, "window": (0.0, 0.019), "motion": {}},
        paths=ONE_BOUNCE, **QUIET,
    )  # fmt: skip
    return record(scenario, folder / "walls.zarr", with_labels=True, threads=1)


@cache
def whole_image(recording, projection="slant"):
    """The one image of a recording."""
    (image,) = labelled_images(recording, projection)
    return image


@pytest.mark.parametrize(("instance", "height", "side"), [(1, 1.0, 1), (2, 0.5, -1)])
def test_a_shadow_ends_where_its_geometry_has_it(walls, instance, height, side):
    """On a flat bed a shadow is h r / (H - h) long behind an edge of height h at range r; without diffraction."""
    edge = 9.5
    length = height * edge / (ABOVE - height)
    starts = {"slant": np.hypot(edge, ABOVE - height)}
    tips = {"slant": np.hypot(edge + length, ABOVE), "ground": edge + length, "mosaic": edge + length}
    for projection, tip in tips.items():
        image = whole_image(walls, projection)
        row = int(np.argmin(np.abs(image.rows.values - 1.1)))
        shadow = image.columns.values[image.layers[SHADOW, row] == instance] * side
        pixel = np.diff(image.columns.values)[-1]
        assert abs(shadow.max() + pixel / 2 - tip) <= pixel, projection
        if projection in starts:  # from there on the wall itself has no echo
            assert shadow.max() - shadow.min() > 0.9 * (tip - starts[projection])
        rows = image.rows.values[(image.layers[SHADOW] == instance).any(axis=1)]
        assert 0.5 - 0.3 < rows.min() < 0.5 + 0.3 and 1.7 - 0.3 < rows.max() < 1.7 + 0.3  # no wider than the wall


def test_highlights_are_the_faces_that_the_sonar_reaches(walls):
    """In slant range from the upper near edge to the upper far one; nearer than the wall in ground range (layover)."""
    image = whole_image(walls)
    row = int(np.argmin(np.abs(image.rows.values - 1.1)))
    for instance, (height, side) in enumerate(((1.0, 1), (0.5, -1)), start=1):
        own = image.columns.values[image.layers[HIGHLIGHT, row] == instance] * side
        half_pulse = 0.1e-3 * 750 / 2
        assert abs(own.min() - np.hypot(8.5, ABOVE - height)) < 2 * half_pulse
        assert abs(own.max() - np.hypot(9.5, ABOVE - height)) < 2 * half_pulse
    ground = whole_image(walls, "ground")
    own = ground.columns.values[ground.layers[HIGHLIGHT, row] == 1]
    assert own.min() == pytest.approx(np.sqrt(np.hypot(8.5, 3) ** 2 - ABOVE**2), abs=0.08)


def test_a_ghost_lies_over_the_shadow(walls):
    """Halfway between the direct path and that by the surface's image; the class map has the ghost, COCO both."""
    image = whole_image(walls)
    row = int(np.argmin(np.abs(image.rows.values - 1.1)))
    ghost = image.columns.values[image.layers[GHOST, row] == 1]
    direct, reflected = (np.hypot(8.5, ABOVE + 1 - 1.0 + sign * 1.0) for sign in (-1, 1))
    assert ghost.max() > (direct + reflected) / 2 > image.columns.values[image.layers[HIGHLIGHT, row] == 1].min()
    both = (image.layers[GHOST] == 1) & (image.layers[SHADOW] == 1)
    assert both.sum() > 50 and (image.classes[both] == 1 + GHOST).all() and (image.instances[both] == 1).all()
    found = {part.kind: part for part in annotations(image) if part.instance == 1}
    assert set(found) == {1, 2, 3}
    assert (found[2].mask(both.shape) & found[3].mask(both.shape)).any()


@pytest.mark.parametrize("projection", ["slant", "ground", "mosaic"])
def test_tiles_add_up_to_the_whole(walls, projection):
    """Each cell with a sample is in a tile, with the levels, labels and coordinates of the whole image."""
    whole = whole_image(walls, projection)
    size = (16, 100)
    tiles = list(labelled_images(walls, projection, size, first_index=5))
    covered = np.zeros(whole.image.shape, int)
    for tile in tiles:
        assert tile.image.shape == tuple(np.minimum(size, whole.image.shape))
        rows, columns = (
            slice(first, first + count) for first, count in zip(tile.offset, tile.image.shape, strict=True)
        )
        np.testing.assert_array_equal(tile.image, whole.image[rows, columns])
        np.testing.assert_array_equal(tile.expected, whole.expected[rows, columns])
        np.testing.assert_array_equal(tile.layers, whole.layers[:, rows, columns])
        np.testing.assert_array_equal(tile.rows.values, whole.rows.values[rows])
        np.testing.assert_array_equal(tile.columns.values, whole.columns.values[columns])
        covered[rows, columns] += 1
    assert (covered[~np.isnan(whole.image)] >= 1).all()
    assert len({tile.name for tile in tiles}) == len(tiles) and min(tile.index for tile in tiles) >= 5
    assert all(low.index < high.index for low, high in itertools.pairwise(tiles))


def test_parts_of_a_recording_and_memory_have_the_same_labels(walls):
    """A recording in memory with its labels gives the images of its folder; without them it is refused."""
    recording, labels = insonify.open_recording(walls), open_labels(walls)
    (image,), (same,) = labelled_images(walls), labelled_images(recording.load(), labels=labels.load())
    np.testing.assert_array_equal(image.layers, same.layers)
    np.testing.assert_array_equal(image.image, same.image)
    with pytest.raises(StoreError, match="--labels"):
        labelled_images(recording)


def test_a_view_is_that_of_the_nearest_ping(walls):
    """Range, grazing angle and altitude of the walls by trigonometry; each has the sonar abeam, on its own side."""
    for projection in ("slant", "mosaic"):
        image = whole_image(walls, projection)
        for instance, aspect in ((1, 270.0), (2, 90.0)):
            view = image.views[instance]
            assert view["altitude_m"] == ABOVE and view["ground_range_m"] == pytest.approx(9.0, abs=0.01)
            assert view["grazing_deg"] == pytest.approx(np.degrees(np.arctan2(ABOVE, 9.0)), abs=0.05)
            assert view["aspect_deg"] == pytest.approx(aspect, abs=1.5)
        assert image.conditions["altitude_m"] == ABOVE and image.conditions["scattering_law"] == "lambert"


def test_a_fan_of_beams_gives_an_image_of_each_ping(tmp_path):
    """A point ahead, to starboard, is in the row of its range and the column of its bearing, far ranges above."""
    bearing, slant = np.radians(8.0), 12.0
    down = 4.0 - 0.02
    position = np.sqrt(slant**2 - down**2) * np.array([np.cos(bearing), np.sin(bearing)])
    target = {"shape": "point", "label": "p", "position": (*position, 6.0 + down), "target_strength_db": 0.0}
    beams = tuple(np.radians(np.arange(-20.0, 21.0, 2.0)))
    wide, fan = ({"kind": "planar", "width": width, "height": 0.01} for width in (0.005, 0.15))
    base = sidescan(targets=[target], pings=2, **QUIET)
    sonar = base.sonar.model_dump() | {
        "transmit": wide, "receive": {**fan, "steer": beams}, "sides": None, "mounting": {"bearing": 0, "tilt": 0.3},
    }  # fmt: skip
    track = {"kind": "static", "position": (0.0, 0.0, 6.0), "window": (0.0, 0.02), "pings": 2}
    scenario = sidescan(targets=[target], sonar=sonar, **QUIET).with_("track", track)
    record(scenario, tmp_path / "fan.zarr", with_labels=True, threads=1)
    images = list(labelled_images(tmp_path / "fan.zarr"))
    assert [image.pings.tolist() for image in images] == [[0], [1]] and images[0].columns.units == "rad"
    for image in images:
        assert image.rows.values[0] > image.rows.values[-1]
        rows, columns = np.nonzero(image.layers[HIGHLIGHT] == 1)
        assert image.rows.values[rows].mean() == pytest.approx(slant, abs=0.05)
        cone = np.arcsin(position[1] / slant)  # of a line of elements, whose beams are cones about it
        strongest = columns[np.argmax(image.expected[rows, columns])]
        assert image.columns.values[strongest] == pytest.approx(cone, abs=np.radians(1.0))
    with pytest.raises(StoreError, match="Choose the projection slant"):
        labelled_images(tmp_path / "fan.zarr", "ground")


def test_sidelobes_of_a_fan_are_not_annotated(tmp_path):
    """A strong point and a wide box: highlights in all beams, annotated where a uniform aperture's main lobe has them.

    Main lobes reach down to -12 dB. By way of the bed (highlight) and of the surface (ghost) the point is nearer to
    the boresight.
    """
    width, point, depth = 0.15, np.array([11.0, -3.0, 7.0]), 7.0
    targets = [
        {"shape": "point", "label": "point", "position": tuple(point), "target_strength_db": 20.0},
        {"shape": "box", "label": "box", "position": (7.0, 1.0), "size": (0.5, 2.0, 0.5),
         "scattering": {"strength_db": -5.0}},
    ]  # fmt: skip
    beams = np.radians(np.arange(-30.0, 30.5, 1.0))
    wide, fan = ({"kind": "planar", "width": size, "height": 0.005} for size in (0.003, width))
    base = sidescan(targets=targets, pings=1, **QUIET)
    sonar = base.sonar.model_dump() | {
        "transmit": wide, "receive": {**fan, "steer": tuple(beams)}, "sides": None, "mounting": {"bearing": 0},
    }  # fmt: skip
    track = {"kind": "static", "position": (0.0, 0.0, depth), "window": (0.0, 0.022), "pings": 1}
    scenario = sidescan(targets=targets, sonar=sonar, paths=ONE_BOUNCE, **QUIET).with_("track", track)
    record(scenario, tmp_path / "fan.zarr", with_labels=True, threads=1)
    (image,) = labelled_images(tmp_path / "fan.zarr")
    labels = open_labels(tmp_path / "fan.zarr")
    wavelength = 1500.0 / scenario.sonar.pulse.frequency

    def in_main_lobe(*cosines):
        """Beams within -12 dB of any cosine between two."""
        missed = np.abs(np.sin(beams) - np.clip(np.sin(beams), min(cosines), max(cosines)))
        return set(np.flatnonzero(np.sinc(width / wavelength * missed) * (missed < wavelength / width) >= 10**-0.6))

    corners = [np.array([7 + x, 1 + y, z - depth]) for x in (-0.25, 0.25) for y in (-1, 1) for z in (9.5, 10)]
    expected = {
        ("point", HIGHLIGHT): in_main_lobe(-3 / np.hypot(11, 3), -3 / np.linalg.norm([11, 3, 6])),
        ("box", HIGHLIGHT): in_main_lobe(*(corner[1] / np.linalg.norm(corner) for corner in corners)),
        ("point", GHOST): in_main_lobe(-3 / np.hypot(11, 3), -3 / np.linalg.norm([11, 3, 14])),
    }
    for (name, row), channels in expected.items():
        instance = image.instance_names.index(name) + 1
        assert set(np.nonzero((image.layers[row] == instance).any(axis=0))[0]) <= channels
    found = set(np.nonzero((image.layers[HIGHLIGHT] == 1).any(axis=0))[0])
    assert found == expected["point", HIGHLIGHT] and len(found) < 8
    assert labels["highlight"].values[0].any(axis=-1).sum() > 50 and len(expected["box", HIGHLIGHT]) > 15


@pytest.mark.slow
def test_a_target_that_is_passed_twice_has_two_boxes_and_one_place(tmp_path):
    """There and back with roll, pitch and yaw: one mask on either side in the waterfall, one on the mosaic."""
    target = {"shape": "point", "label": "p", "position": (2.0, 7.0, 9.98), "target_strength_db": -28.0}
    track = {"kind": "waypoints", "waypoints": ((0.8, 0.0, 6.0), (3.2, 0.0, 6.0), (0.8, 0.0, 6.0)), "turn_radius": 0.0,
             "speed": 2.0, "interval": 0.05, "window": (0.0, 0.013), "motion": MOTION}  # fmt: skip
    scenario = sidescan(targets=[target], **QUIET).with_("track", track)
    record(scenario, tmp_path / "a.zarr", with_labels=True, threads=1)
    for projection in ("slant", "ground"):
        (image,) = labelled_images(tmp_path / "a.zarr", projection)
        boxes = [part for part in annotations(image) if part.area > 5]
        sides = {np.sign(image.columns.values[part.corner[1]]) for part in boxes}
        along = sorted(image.rows.values[part.corner[0] + part.inside.shape[0] // 2] for part in boxes)
        assert len(boxes) == 2 and sides == {-1.0, 1.0}, projection
        np.testing.assert_allclose(along, [1.2, 3.6], atol=0.6)  # three rms of yaw (12 cm) and pitch (14 cm) at 7 m
    (image,) = labelled_images(tmp_path / "a.zarr", "mosaic")
    (part,) = annotations(image)
    rows, columns = np.nonzero(part.mask(image.image.shape))
    place = image.rows.values[rows].mean(), image.columns.values[columns].mean()
    np.testing.assert_allclose(place, [2.0, 7.0], atol=abs(np.diff(image.rows.values[:2])[0]))
