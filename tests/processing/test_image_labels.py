"""Labels on an image lie where geometry puts highlight and shadow, on both sides, whatever the platform does."""

import numpy as np
import pytest
import xarray as xr

from insonify.processing import image_labels, sidescan
from insonify.records.labels import COLUMNS, NO_ROW, label_dataset
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator, label_ping, simulate

DEPTH, SPEED, PULSE = 12.0, 1500.0, 0.1e-3
HEIGHT, THICK = 1.5, 1.0
"""Of the boxes, and how far they reach away from the track [m]."""
NEAR = {-1: 20.0, 1: 30.0}
"""Distance of the near face of each box, port and starboard [m]."""


def heaving():
    """Three pings over a level bed from a platform that heaves by decimetres, a box to either side."""
    array = {"kind": "planar", "width": 0.5, "height": 0.02}
    boxes = [
        {"shape": "box", "label": "port" if side < 0 else "starboard", "position": (0.0, side * (near + THICK / 2)),
         "size": (12.0, THICK, HEIGHT)}
        for side, near in NEAR.items()
    ]  # fmt: skip
    return Scenario.model_validate({
        "seed": 5, "field": "incoherent", "water": {"noise_level_db": None}, "targets": boxes,
        "seabed": {"depth": DEPTH, "scattering": {"law": "lambert", "strength_db": -27}},
        "surface": {"scattering": None}, "paths": {"max_reflections": 0},
        "sonar": {
            "source_level_db": 220, "pulse": {"kind": "cw", "frequency": 100e3, "duration": PULSE}, "transmit": array,
            "receive": array, "mounting": {"bearing": np.pi / 2, "tilt": 0.3}, "sides": ["port", "starboard"],
        },
        "track": {"kind": "line", "start": (-0.5, 0.0, 6.0), "heading": 0.0, "speed": 1.0, "pings": 3, "interval": 0.5,
                  "window": (0.0, 0.062), "motion": {"heave": {"rms": 0.5, "period": 3.0}}},
    })  # fmt: skip


@pytest.fixture(scope="module")
def seen():
    """The image on the ground, and its labels."""
    scenario = heaving()
    simulator = build_simulator(scenario)
    parts = [label_ping(simulator, ping) for ping in range(3)]
    masks = label_dataset(parts, simulator.label_names, simulator.grid.time, np.arange(3))
    recording = simulate(scenario)
    altitude = DEPTH - recording["logged_position" if "logged_position" in recording else "position"].values[:, 2]
    assert np.ptp(altitude) > 0.1
    image = sidescan(recording, geometry="ground", gain="none", altitude=altitude)
    return masks, image, image_labels(masks, image)


def stretch(mask, across):
    """Nearest and farthest distance at which a mask is set [m]."""
    return np.abs(across[mask]).min(), np.abs(across[mask]).max()


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("ping", [0, 1, 2])
def test_highlight_and_shadow_lie_where_geometry_predicts(seen, side, ping):
    """The top edge of the face comes to lie nearer than the box, its shadow ends where the ray over its back lands.

    Box from x to x + d, height h, sonar H above the bed: highlight from sqrt(x^2 + (H - h)^2 - H^2), shadow to
    (x + d) H / (H - h); each later by up to a pulse, or earlier by what the
    receiver rings, less than two.
    """
    _, image, shown = seen
    across, here = image["across"].values, np.sign(image["across"].values) == side
    up, near = float(image["altitude"].values[ping]), NEAR[side]
    assert float(shown["altitude"].values[ping]) == up
    late = SPEED * PULSE / 2 * 1.1  # of slant range; a little more on the ground
    face = np.sqrt(near**2 + (up - HEIGHT) ** 2 - up**2)
    first, _ = stretch(shown["highlight"].values[ping] & here, across)
    assert face - 2 * late <= first <= face + late
    end = (near + THICK) * up / (up - HEIGHT)
    begin, last = stretch(shown["shadow"].values[ping] & here, across)
    assert end - late <= last <= end + late
    back = np.sqrt((near + THICK) ** 2 + (up - HEIGHT) ** 2 - up**2)
    assert back - late <= begin <= near + THICK + 3 * late
    dark = shown["shadow"].values[ping] & here
    row = list(shown["object"].values).index("port" if side < 0 else "starboard")
    assert (shown["shadowing_object"].values[ping][dark] == row).all()
    # the ground in the shadow is where the axis states, a pulse's length apart
    east = shown["position"].values[ping][dark][:, 1]
    np.testing.assert_allclose(east, across[dark], atol=2 * late)


def test_the_bed_is_where_the_axis_states(seen):
    """Away from the boxes the mean place of a cell is half a pulse nearer than its distance; grazing is atan(H/x)."""
    _, image, shown = seen
    across = image["across"].values
    plain = (np.abs(across) > 8) & (np.abs(across) < 17)
    for ping in range(3):
        assert not (shown["shadow"] | shown["highlight"] | shown["ghost"]).values[ping][plain].any()
        np.testing.assert_allclose(shown["position"].values[ping][plain][:, 1], across[plain], atol=0.12)
        up = float(image["altitude"].values[ping])
        np.testing.assert_allclose(
            shown["grazing"].values[ping][plain], np.arctan2(up, np.abs(across[plain])), rtol=0.02
        )


def test_levels_and_intensities_share_the_change_of_range(seen):
    """An incoherent recording without noise is its own expected intensity, over the bed: 0.5 dB rms a cell."""
    _, image, shown = seen
    plain = (np.abs(image["across"].values) > 8) & (np.abs(image["across"].values) < 17)
    level = 10 * np.log10(shown["expected_intensity"].values[:, plain])
    off = level - image["level_db"].values[:, plain]
    assert np.sqrt(np.mean(off**2)) < 0.5 and abs(np.mean(off)) < 0.1


def test_in_slant_range_a_cell_is_a_sample(seen):
    """Without a change of range every column is copied, port turned about."""
    masks, _, _ = seen
    recording = simulate(heaving())
    image = sidescan(recording, geometry="slant", gain="none", altitude=6.0)
    expected = image_labels(masks, image)
    count = masks.sizes["time"]
    for name in ("highlight", "shadow", "shadowing_object", "strongest_object", "grazing", "expected_intensity"):
        # running sums keep 1e-15 of the strongest sample
        fine = {"rtol": 1e-5, "atol": 1e-12 * float(masks["expected_intensity"].max()), "err_msg": name}
        np.testing.assert_allclose(expected[name].values[:, :count], masks[name].values[:, 0, ::-1], **fine)
        np.testing.assert_allclose(expected[name].values[:, count:], masks[name].values[:, 1], **fine)
    np.testing.assert_array_equal(expected["position"].values[:, count:], masks["position"].values[:, 1])


def made_up(samples=400):
    """Labels of one ping of which single samples are marked, and an image of coarse cells."""
    masks = xr.Dataset(coords={"ping": [0], "time": np.arange(samples) * 1e-4, "object": ["seabed", "surface", "box"],
                              "pair": ["D-D"], "axis": ["north", "east", "depth"]})  # fmt: skip
    sizes = {"ping": 1, "channel": 1, "time": samples, "object": 3, "pair": 1, "axis": 3}
    for name, (dims, kind, _, _) in COLUMNS.items():
        masks[name] = dims, np.zeros([sizes[dim] for dim in dims], kind)
    across = (np.arange(20) + 0.5) * 0.75  # ten samples of slant range each
    image = xr.Dataset(
        {"level_db": (("ping", "across"), np.zeros((1, 20)))},
        coords={"ping": [0], "across": across, "altitude": ("ping", [0.0]), "channel": ("across", np.zeros(20, int))},
        attrs={"geometry": "ground", "sound_speed": SPEED},
    )
    return masks, image


def test_masks_are_those_of_the_majority_or_of_any():
    """Three of ten samples are no majority, six are; one is any. The edge sample counts by its part."""
    labelled, image = made_up()
    shadow = labelled["shadow"].values[0, 0]
    shadow[52:55] = shadow[72:78] = True  # cells span samples 0.5 to 10.5, and so on
    most, some = (image_labels(labelled, image, masks=way)["shadow"].values[0] for way in ("majority", "any"))
    assert np.flatnonzero(most).tolist() == [7] and np.flatnonzero(some).tolist() == [5, 7]
    with pytest.raises(ValueError, match="masks is 'most'; choose one of majority, any"):
        image_labels(labelled, image, masks="most")


def test_objects_are_voted_for_and_energies_kept():
    """The object of most of a cell wins; intensity times length is kept by the change of cells."""
    masks, image = made_up()
    masks["strongest_object"].values[0, 0, 30:38] = 2
    masks["expected_intensity"].values[0, 0] = np.random.default_rng(2).exponential(size=400)
    shown = image_labels(masks, image)
    assert shown["strongest_object"].values[0].tolist() == [0, 0, 0, 2] + [0] * 16
    energy = masks["expected_intensity"].values[0, 0]
    expected = energy[1:200].sum() + 0.5 * (energy[0] + energy[200])
    assert 10 * shown["expected_intensity"].values.sum() == pytest.approx(expected, rel=1e-5)


def test_what_is_not_there_is_no_object():
    """A ping without labels, one without an altitude, and cells beyond the recording."""
    masks, image = made_up(samples=100)
    shown = image_labels(masks, image)
    assert (shown["strongest_object"].values[0, 10:] == NO_ROW).all() and np.isnan(
        shown["distance"].values[0, 10:]
    ).all()
    undone = image_labels(masks.assign(done=("ping", [False])), image)
    unknown = image_labels(masks, image.assign_coords(altitude=("ping", [np.nan])))
    for none in (undone, unknown):
        assert (none["strongest_object"].values == NO_ROW).all() and not none["shadow"].values.any()
        assert np.isnan(none["expected_intensity"].values).all()
