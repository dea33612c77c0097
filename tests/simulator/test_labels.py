"""Labels agree with geometry: what is received, from where, by which paths, and what hides behind what."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.engines.parts import SerialPool
from insonify.records.labels import NO_ROW
from insonify.records.legs import SEABED_OCCLUDER, LegStatus
from insonify.simulator import _engine, build_simulator, labels, levels, simulate
from insonify.synthesis.label_accumulator import POINTS
from oracles.scenes import nominal, point

HEIGHT, SPEED, PULSE = 9.0, 1500.0, 0.2e-3
"""Of the sonar above the bed [m]; of sound [m/s]; length of the pulse [s]."""
BACK = 151.0
"""Distance of the back of the nominal box [m]."""


def box(height: float = 1.0) -> dict:
    """The nominal box, wider than the beam, so that nothing is seen past its sides."""
    return {"label": "box", "size": (6.0, 1.0, height)}


@pytest.fixture(scope="module")
def whole():
    """The nominal scene with a wide box, all paths of two bounces."""
    # as many points to a cell as labels are read with
    scenario = nominal(box=box(), field="incoherent", track={"window": (0.198, 0.230)}, surface={"scattering": None},
                   paths={"scatterers_per_cell": POINTS})  # fmt: skip
    return scenario, labels(scenario)


def runs(mask, time):
    """First and last time of each stretch in which a mask is set [s]."""
    edge = np.diff(np.concatenate([[0], mask.astype(int), [0]]))
    return [(time[a], time[b - 1]) for a, b in zip(np.flatnonzero(edge > 0), np.flatnonzero(edge < 0), strict=True)]


def test_objects_add_up_to_the_incoherent_reading(whole):
    """Echoes of different objects do not interfere: they sum to the level curves' total; and to the recording.

    To 1 % of the curves, which take the same paths but add those within one pulse coherently, where labels lay their
    interference half way between; to 0.1 dB of the recording, which may take ground in cells of its own, and to 0.05
    dB of its energy.
    """
    scenario, masks = whole
    total = 10 ** (levels(scenario).level_db.sel(contribution="total", pair="all").values / 10)
    np.testing.assert_allclose(masks.object_intensity.values.sum(axis=1), masks.expected_intensity, rtol=1e-6)
    np.testing.assert_allclose(masks.expected_intensity.values[0], total, rtol=0.01)
    recorded = simulate(scenario).intensity.values[0, 0]
    assert np.median(np.abs(10 * np.log10(recorded / total))) < 0.1
    assert abs(10 * np.log10(recorded.mean() / total.mean())) < 0.05


def test_pairs_alone_are_the_level_curves(whole):
    """The same pair of families, by object here and by contribution in `levels`: to 1e-4 dB.

    Labels leave out the receiver filter's weak ringing, which is 5e-6 of a sample 33 dB below the strongest.
    """
    scenario, masks = whole
    curves = levels(scenario).level_db
    for pair in ("D-D", "D-S", "S-S", "D-BS"):
        contributions = sum(
            10 ** (curves.sel(contribution=contribution, pair=pair).values / 10)
            for contribution in ("seabed", "target")
        )
        np.testing.assert_allclose(masks.pair_intensity.sel(pair=pair).values[0], contributions, rtol=2e-5)


@pytest.mark.parametrize("height", [0.5, 1.0, 1.5])
def test_the_shadow_ends_where_the_ray_over_the_top_lands(height):
    """Ground from the back of the box to 151 H / (H - h), H the sonar's height: within half a pulse; of the box."""
    track = {"window": (0.2, 2 * BACK * HEIGHT / (HEIGHT - height) / SPEED + 2e-3)}
    masks = labels(nominal(box=box(height), paths={"max_reflections": 0}, track=track, surface={"scattering": None}))
    time, end = masks.time.values, 2 * np.hypot(BACK * HEIGHT / (HEIGHT - height), HEIGHT) / SPEED
    (first, last), *more = runs(masks.shadow.values[0], time)
    assert not more
    assert last == pytest.approx(end + PULSE / 2, abs=PULSE / 2)
    # the top of the box is a highlight up to its back, for a pulse and what it rings
    behind = 2 * np.hypot(BACK, HEIGHT - height) / SPEED
    assert behind < first < behind + 3 * PULSE
    dark = masks.shadow.values[0]
    assert (masks.shadowing_object.values[0][dark] == list(masks.object.values).index("box")).all()
    assert (masks.shadowing_object.values[0][~dark] == NO_ROW).all()


def test_ghosts_come_where_the_surface_paths_end(whole):
    """The face's D-S ghost 1.838-1.933 ms and its S-S ghost 3.677-3.867 ms after its direct echo, for a pulse each."""
    _, masks = whole
    time, ghost = masks.time.values, masks.ghost.values[0]
    direct = 2 * np.hypot(150, 8) / SPEED
    near = runs(masks.highlight.values[0], time)
    assert near[0][0] == pytest.approx(direct, abs=PULSE)
    for first, last in ((1.838e-3, 1.933e-3), (3.677e-3, 3.867e-3)):
        strong = (time > direct + first + PULSE / 4) & (time < direct + last + PULSE / 2)
        assert strong.any() and ghost[strong].all()
    assert not (ghost & masks.highlight.values[0]).any()
    assert not ghost[time < direct + 1.7e-3].any()


def test_a_place_on_the_bed_is_where_its_delay_predicts():
    """Direct on a flat bed: distance c (t - T/2) / 2 to a fifth of the pulse, east and grazing by Pythagoras."""
    scenario = nominal(paths={"max_reflections": 0}, track={"window": (0.1, 0.103)}, surface={"scattering": None})
    masks = labels(scenario).isel(channel=0)
    slant = SPEED * (masks.time.values - PULSE / 2) / 2
    np.testing.assert_allclose(masks.distance, slant, atol=0.03)
    np.testing.assert_allclose(masks.position.sel(axis="east"), np.sqrt(slant**2 - HEIGHT**2), atol=0.05)
    np.testing.assert_allclose(masks.position.sel(axis="depth"), 20, atol=1e-9)
    np.testing.assert_allclose(masks.grazing, np.arcsin(HEIGHT / slant), rtol=1e-3)


def test_a_shadow_has_a_place_though_a_multiple_fills_it(whole):
    """In the shadow the direct echo is missing: its position is the dark ground, whatever is received instead."""
    _, masks = whole
    dark = masks.shadow.values[0] & (masks.time.values > 0.204) & (masks.time.values < 0.226)
    slant = SPEED * (masks.time.values - PULSE / 2) / 2
    np.testing.assert_allclose(masks.distance.values[0][dark], slant[dark], atol=0.05)


def test_a_point_is_distinguished_from_the_seabed_by_its_label():
    """A point 16 dB above the bed owns its pulse, and the bed the rest; its place is its own, to a millimetre."""
    scenario = nominal(targets=[point(0.0, 75.0, 18.0, strength=-40.0)], paths={"max_reflections": 0},
                   track={"window": (0.099, 0.104)}, surface={"scattering": None})  # fmt: skip
    masks = labels(scenario).isel(channel=0)
    mine = masks.strongest_object.values == list(masks.object.values).index("point")
    arrival = 2 * np.hypot(75, 7) / SPEED
    first, last = runs(mine, masks.time.values)[0]
    assert first == pytest.approx(arrival, abs=PULSE) and last == pytest.approx(arrival + PULSE, abs=PULSE)
    assert (masks.highlight.values[mine]).all() and not masks.shadow.values.any()
    inside = (masks.time.values > arrival + PULSE / 4) & (masks.time.values < arrival + 3 * PULSE / 4)
    np.testing.assert_allclose(masks.position.values[inside], [[0, 75, 18]] * inside.sum(), atol=1e-3)
    assert set(masks.strongest_object.values[~mine]) == {0}


def test_ground_that_the_ground_hides_lies_in_the_shadow_of_the_seabed():
    """Legs to ground between 100 m and 101 m, marked as cut by relief: that stretch is dark, and the seabed did it."""
    scenario = nominal(paths={"max_reflections": 0}, track={"window": (0.132, 0.137)}, surface={"scattering": None})
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    reading = simulator.label_accumulator(here)
    kept = reading.empty()
    for pairs in simulator.engine.all_pairs(here, quadrature=True):
        far = np.hypot(*pairs.scatterers.position[:, :2].T)
        dark = ((far > 100) & (far < 101))[None]
        cut = replace(
            pairs.transmit_legs, status=np.where(dark, LegStatus.OCCLUDED, pairs.transmit_legs.status).astype(np.uint8),
            occluder=np.where(dark, SEABED_OCCLUDER, -1).astype(np.int16), visibility=np.where(dark, 0.0, 1.0),
        )  # fmt: skip
        reading.add(kept, replace(pairs, transmit_legs=cut, receive_legs=cut))
    masks, time = reading.time_series(kept), simulator.grid.time
    ((first, last),) = runs(masks.shadow[0], time)
    assert first == pytest.approx(2 * np.hypot(100, HEIGHT) / SPEED + PULSE / 2, abs=PULSE / 2)
    assert last == pytest.approx(2 * np.hypot(101, HEIGHT) / SPEED + PULSE / 2, abs=PULSE / 2)
    assert (masks.shadowing_object[0][masks.shadow[0]] == 0).all()


def test_before_the_first_return_there_is_no_object():
    """No path is shorter than the height of the sonar: earlier samples have no object, no place, no mask."""
    scenario = nominal(paths={"max_reflections": 0}, track={"window": (0.008, 0.014)}, surface={"scattering": None},
                   sonar={"mounting": {"tilt": np.radians(60)}})  # fmt: skip
    masks = labels(scenario).isel(channel=0)
    early = masks.time.values < 2 * HEIGHT / SPEED - 1.5e-3  # the receiver's filter rings before the echo
    late = masks.time.values > 2 * HEIGHT / SPEED + PULSE
    assert early.any() and (masks.strongest_object.values[early] == NO_ROW).all()
    assert np.isnan(masks.position.values[early]).all() and (masks.strongest_object.values[late] == 0).all()


def test_starboard_of_a_ship_heading_north_is_east():
    """A point to the east is received by the starboard channel, from the east; port receives the bed to the west."""
    planar = {"kind": "planar", "length": None, "width": 1.0, "height": 0.02}
    scenario = nominal(
        targets=[point(0.0, 30.0, 19.0)], line=planar, paths={"max_reflections": 0}, surface={"scattering": None},
        sonar={"mounting": {"bearing": np.pi / 2}, "sides": ["port", "starboard"]}, track={"window": (0.0405, 0.043)},
    )  # fmt: skip
    masks = labels(scenario)
    assert masks.highlight.values[1].any() and not masks.highlight.values[0].any()
    east = masks.position.sel(axis="east").values
    assert (east[1] > 0).all() and (east[0] < 0).all()


@pytest.mark.parametrize("labelled", [True, False], ids=["labels", "expected intensity"])
def test_coarse_edges_of_solids_keep_expectations(labelled):
    """Ripples below 0.04 beside a tyre, and details of it, are neglected: 0.05 dB rms of an expectation with them."""
    tyre = {"shape": "library", "name": "tyre", "position": [0.0, 30.0]}
    scenario = nominal(targets=[tyre], paths={"max_reflections": 1, "edge_diffraction": "knife-edge"},
                   track={"window": (0.035, 0.06)})  # fmt: skip
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    reading = simulator.label_accumulator(here) if labelled else simulator.incoherent_accumulator(here)
    levels_db = []
    assert reading.requirements.approximate_edges
    for coarse in (True, False):
        engine = replace(_engine(simulator.engine, reading.requirements, SerialPool(), None), approximate_edges=coarse)
        kept = reading.empty()
        for pairs in engine.all_pairs(here, quadrature=True):
            reading.add(kept, pairs)
        result = reading.time_series(kept)
        levels_db.append(10 * np.log10((result.expected_intensity if labelled else result)[0]))
    off = levels_db[0] - levels_db[1]
    assert off.any() and np.sqrt(np.mean(off**2)) < 0.05


def test_labels_do_not_depend_on_the_number_of_threads():
    """One thread and two give the same bits."""
    scenario = nominal(box=box(), track={"window": (0.199, 0.203)}, surface={"scattering": None})
    one, two = (labels(scenario, threads=count) for count in (1, 2))
    assert one.identical(two)


def test_masks_are_where_a_pulse_arrives():
    """Silent water has no masks: the tail of the filter, which is all that there is, is no echo."""
    strong = [point(0.0, 30.0, 19.0, strength=20.0)]
    scenario = nominal(targets=strong, surface={"scattering": None}, track={"window": (0.002, 0.043)})
    masks = labels(scenario).isel(channel=0)
    silent = masks.strongest_object.values == NO_ROW
    assert silent.sum() > 50 and masks.highlight.values.any()
    assert not (masks.highlight.values | masks.ghost.values)[silent].any()
