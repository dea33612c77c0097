"""Labels of a world that is turned, mirrored, emptied or lit otherwise: what must stay, and what must add up."""

from typing import Any

import numpy as np
import pytest

from insonify.records.labels import NO_ROW
from insonify.scenario.scenario import Scenario
from insonify.simulator import labels, simulate

PANEL = {"kind": "planar", "width": 0.4, "height": 0.02}
DEPTH, SONAR, SPEED, PULSE = 10.0, 4.0, 1500.0, 0.1e-3
CRATE = {"shape": "box", "label": "crate", "position": [0.0, 15.0], "size": [6.0, 1.0, 1.2]}
POST = {"shape": "box", "label": "post", "position": [0.0, 24.0], "size": [6.0, 0.5, 0.8]}
LABELLED: dict[str, Any] = {
    "seed": 2,
    "field": "incoherent",
    "water": {"noise_level_db": None},
    "surface": {"scattering": None},
    "seabed": {"depth": DEPTH, "scattering": {"law": "lambert", "strength_db": -27}, "reflection": 0.35},
    "sonar": {
        "source_level_db": 220, "pulse": {"kind": "cw", "frequency": 1e5, "duration": PULSE}, "transmit": PANEL,
        "receive": PANEL, "mounting": {"bearing": np.pi / 2, "tilt": 0.3}, "sides": ["port", "starboard"],
    },
    "track": {"kind": "static", "position": [0.0, 0.0, SONAR], "window": [0.0, 0.042]},
    "paths": {"max_reflections": 1, "edge_diffraction": "none"},
}  # fmt: skip


def scenario_of(targets=(CRATE, POST), **changes: Any):
    """Labels of one ping of the scene with other parts."""
    whole = {**LABELLED, "targets": list(targets)}
    whole |= {name: {**LABELLED[name], **part} for name, part in changes.items()}
    return labels(Scenario.model_validate(whole))


@pytest.fixture(scope="module")
def seen():
    """Two crates to starboard, one behind the other, nothing to port."""
    return scenario_of()


def when(slant):
    """Time at which a way out and back of some length is received, by the middle of the pulse [s]."""
    return 2 * np.asarray(slant) / SPEED + PULSE / 2


def at(message, slant):
    """Sample of a slant range."""
    return int(np.argmin(np.abs(message.time.values - when(slant))))


def test_objects_and_nothing_else_make_up_what_is_expected(seen):
    """Energies of the objects sum to the expectation; without targets there is none of theirs, nor a mask."""
    whole = seen.expected_intensity.values
    np.testing.assert_allclose(seen.object_intensity.values.sum(axis=1), whole, rtol=1e-5, atol=1e-9 * whole.max())
    bare = scenario_of(())
    assert list(bare.object.values) == ["seabed", "surface", "boundary echo"]
    for mask in ("highlight", "shadow", "ghost"):
        assert not bare[mask].values.any(), mask
    assert (bare.shadowing_object.values == NO_ROW).all()


def test_port_receives_none_of_what_is_to_starboard(seen):
    """Panels 0.4 m wide that look away: no mask to port, the bed is strongest, and it is the bed of no targets."""
    for mask in ("highlight", "shadow", "ghost"):
        assert not seen[mask].values[0].any(), mask
        assert seen[mask].values[1].any(), mask
    after = seen.time.values > when(DEPTH - SONAR + 1)
    assert (seen.strongest_object.values[0, after] == 0).all()
    bare = scenario_of(())
    own = seen.object_intensity.sel(object="seabed").values[0]
    alone = bare.object_intensity.sel(object="seabed").values[0]
    np.testing.assert_allclose(own, alone, rtol=1e-4, atol=1e-9 * own.max())


def test_each_shadow_lies_behind_its_own_crate(seen):
    """By similar triangles: up to (its back) H / (H - h), H the sonar's height; of that crate.

    It begins with the ground that is as far away as the top's back edge, which lies under the crate.
    """
    height = DEPTH - SONAR
    names = list(seen.object.values)
    for body in (CRATE, POST):
        back, top = body["position"][1] + body["size"][1] / 2, body["size"][2]
        end = back * height / (height - top)
        dark = seen.shadow.values[1] & (seen.shadowing_object.values[1] == names.index(body["label"]))
        times = seen.time.values[dark]
        assert times.min() >= when(np.hypot(back, height - top)) - PULSE
        assert times.max() == pytest.approx(when(np.hypot(end, height)), abs=PULSE)
        east = seen.position.values[1, dark, 1]
        begin = np.sqrt(back**2 + (height - top) ** 2 - height**2)
        assert east.min() == pytest.approx(begin, abs=0.2) and east.max() < end + 0.2


def test_the_ghost_of_a_crate_comes_when_its_image_predicts(seen):
    """D-S of the front's top edge and foot: half of both ways, from the sonar and its image; of the crate."""
    front = CRATE["position"][1] - CRATE["size"][1] / 2
    first, last = (
        (np.hypot(front, depth - SONAR) + np.hypot(front, depth + SONAR)) / 2 for depth in (DEPTH - 1.2, DEPTH)
    )
    span = slice(at(seen, first), at(seen, last) + 1)
    assert seen.ghost.values[1, span].mean() > 0.8
    pair = [str(seen.pair.values[row]) for row in seen.strongest_pair.values[1, span]]
    label = seen.strongest_object.values[1, span]
    assert np.mean([name == "D-S" for name in pair]) > 0.8
    assert np.mean(label == list(seen.object.values).index("crate")) > 0.8


def test_masks_exclude_each_other(seen):
    """A sample is a highlight, a shadow, a ghost, or none; a shadow has a occluder_row, and nothing else has one."""
    masks = np.stack([seen[name].values for name in ("highlight", "shadow", "ghost")])
    assert masks[:2].sum(axis=0).max() == 1 and (masks[0] & masks[2]).sum() == 0
    np.testing.assert_array_equal(seen.shadowing_object.values != NO_ROW, seen.shadow.values)


def test_levels_shift_and_labels_stay_when_the_sonar_is_stronger(seen):
    """20 dB more source level: a hundred times every intensity, and the same masks, objects, pairs and places."""
    strong = scenario_of(sonar={"source_level_db": 240})
    for name in ("expected_intensity", "object_intensity", "pair_intensity"):
        part = seen[name].values
        np.testing.assert_allclose(strong[name].values, 100 * part, rtol=1e-4, atol=1e-7 * part.max())
    strong_part = seen.expected_intensity.values > 1e-6 * seen.expected_intensity.values.max()
    for name in ("highlight", "shadow", "ghost", "shadowing_object", "strongest_object", "strongest_pair"):
        np.testing.assert_array_equal(strong[name].values[strong_part], seen[name].values[strong_part], err_msg=name)
    positions = strong.position.values[strong_part], seen.position.values[strong_part]
    np.testing.assert_allclose(*positions, atol=3e-5)  # sums in single precision: 1e-6 of 30 m


@pytest.mark.parametrize("turn", [0.8, -2.4])
def test_labels_of_a_turned_world_are_turned_labels(seen, turn):
    """Ship, crates and lattice turned together: masks alike but for samples at their edges; places turned along."""
    c, s = np.cos(turn), np.sin(turn)
    bodies = [
        {**body, "position": [-s * body["position"][1], c * body["position"][1]], "heading": turn}
        for body in (CRATE, POST)
    ]
    other = scenario_of(bodies, track={"heading": turn}, seabed={"scatterer_grid": {"heading": turn}})
    for name in ("highlight", "shadow", "ghost", "shadowing_object", "strongest_object"):
        assert np.mean(other[name].values != seen[name].values) < 0.01, name
    place = other.position.values
    turned = np.stack([c * place[..., 0] + s * place[..., 1], c * place[..., 1] - s * place[..., 0], place[..., 2]], -1)
    there = seen.strongest_object.values == other.strongest_object.values
    there &= (seen.strongest_object.values != NO_ROW) & (seen.shadow.values == other.shadow.values)
    off = np.linalg.norm(turned - seen.position.values, axis=-1)[there]
    assert np.nanquantile(off, 0.95) < 0.05


def test_a_crate_to_port_is_labelled_as_one_to_starboard(seen):
    """East and west exchanged: the channels change places, and the sign of every place's east; edges by a sample."""
    mirrored = [{**body, "position": [0.0, -body["position"][1]]} for body in (CRATE, POST)]
    other = scenario_of(mirrored)
    for name in ("highlight", "shadow", "ghost", "strongest_object"):
        assert np.mean(other[name].values[::-1] != seen[name].values) < 0.02, name
    level = 10 * np.log10(other.expected_intensity.values[::-1] / seen.expected_intensity.values)
    received = (seen.time.values > when(8.0)) & (
        seen.expected_intensity.values > 1e-4 * seen.expected_intensity.max().item()
    )
    assert np.abs(np.median(level[received])) < 0.05 and np.nanstd(level[received]) < 1.0


def test_what_is_recorded_is_what_is_expected(seen):
    """Without noise an incoherent recording is the labels' expectation: 0.1 dB in the mean, both sides."""
    whole = {**LABELLED, "targets": [CRATE, POST]}
    received = simulate(Scenario.model_validate(whole)).intensity.values[0]
    for side in (0, 1):
        ratio = 10 * np.log10(received[side].mean() / seen.expected_intensity.values[side].mean())
        assert ratio == pytest.approx(0, abs=0.1)
