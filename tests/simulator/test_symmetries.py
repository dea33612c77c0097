"""What physics does not depend on, the simulator does not depend on.

Where north is, which end transmits and which receives.
"""

from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.propagation.families import bounce_sequence, families_reaching, families_up_to, image_depth, is_family
from insonify.propagation.image_sources import image_legs
from insonify.records.arrivals import Arrivals, concatenate_arrivals, no_arrivals
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget
from insonify.simulator import arrivals, levels, simulate
from oracles.scenes import nominal, point
from oracles.time_series import relative_rms

DEPTH = 20.0
COORDINATE = st.floats(-300, 300, allow_nan=False)
IN_THE_WATER = st.floats(0.2, DEPTH - 0.2, allow_nan=False)
PLACE = st.tuples(COORDINATE, COORDINATE, IN_THE_WATER)
SHORT = {"window": (0.198, 0.206)}


def one_point(place: tuple[float, float, float]) -> Scatterers:
    """A point target as the scatterer it is."""
    return point_scatterer(PointTarget(position=place))


def backwards(family: str) -> str:
    """The same path walked from its other end: its bounces in reverse order."""
    return bounce_sequence(family)[::-1] or "D"


@settings(max_examples=60)
@given(PLACE, PLACE, st.sampled_from(families_up_to(4)), st.floats(-1, 1))
def test_a_path_is_the_same_from_either_end(
    one: tuple[float, float, float], other: tuple[float, float, float], family: str, reflection: float
) -> None:
    """Reciprocity: ends exchanged and bounces reversed, a leg keeps its delay, amplitude, bounces and directions."""
    scene = Scene(seabed={"depth": DEPTH, "reflection": reflection})
    there = image_legs(scene, np.array(one), one_point(other), (family,), 1e5)
    back = image_legs(scene, np.array(other), one_point(one), (backwards(family),), 1e5)
    np.testing.assert_allclose(there.delay, back.delay, rtol=1e-12)
    np.testing.assert_allclose(there.amplitude, back.amplitude, rtol=1e-9, atol=1e-15)
    if there.delay[0, 0] > 1e-3 / 1500:
        np.testing.assert_allclose(there.departure, -back.arrival, atol=1e-9)
        np.testing.assert_allclose(there.arrival, -back.departure, atol=1e-9)


@settings(max_examples=60)
@given(PLACE, PLACE, st.sampled_from(families_up_to(3)), st.floats(1350, 1650), st.floats(1.01, 1.2))
def test_delays_shrink_as_sound_gets_faster(
    one: tuple[float, float, float], other: tuple[float, float, float], family: str, speed: float, factor: float
) -> None:
    """The way is geometry alone: delay times sound speed is one length, spreading its reciprocal."""
    legs = [
        image_legs(Scene(water={"sound_speed": c}), np.array(one), one_point(other), (family,), 1e5)
        for c in (speed, min(1700.0, speed * factor))
    ]
    length = [leg.delay * c for leg, c in zip(legs, (speed, min(1700.0, speed * factor)), strict=True)]
    np.testing.assert_allclose(length[0], length[1], rtol=1e-12)
    np.testing.assert_allclose(legs[0].spreading * length[0], 1, rtol=1e-12)
    np.testing.assert_array_equal(legs[0].departure, legs[1].departure)


@given(st.integers(0, 8))
def test_every_order_brings_two_families_that_start_apart(order: int) -> None:
    """2 n + 1 names, all different, all alternating, of each length one that starts up and one that starts down."""
    names = families_up_to(order)
    assert len(names) == len(set(names)) == 2 * order + 1
    assert all(is_family(name) for name in names)
    for count in range(1, order + 1):
        assert {name[0] for name in names if name != "D" and len(name) == count} == {"S", "B"}


@given(st.integers(0, 8), st.sampled_from(["seabed", "surface", "target"]))
def test_a_boundary_keeps_the_families_that_do_not_end_on_it(order: int, boundary: str) -> None:
    """Of 2 n + 1, n + 1 on a boundary, all on a target; order kept, and requesting twice changes nothing."""
    kept = families_reaching(boundary, families_up_to(order))
    assert len(kept) == (2 * order + 1 if boundary == "target" else order + 1)
    assert families_reaching(boundary, kept) == kept
    assert list(kept) == [name for name in families_up_to(order) if name in kept]


@given(st.sampled_from(families_up_to(6)), IN_THE_WATER, st.floats(1, 50))
def test_an_image_lies_a_whole_number_of_periods_away(family: str, source: float, more: float) -> None:
    """Each pair of bounces moves the image by twice the depth; an odd one turns it over (Allen & Berkley 1979)."""
    depth = source + more
    image, n = image_depth(family, source, depth), len(bounce_sequence(family))
    turned = source if n % 2 == 0 else -source
    periods = (image - turned) / (2 * depth)
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert abs(round(periods)) <= n // 2 + 1


def some_arrivals(random: np.random.Generator, rows: int) -> Arrivals:
    """Arrivals of no meaning, each row unlike all others."""

    def column(name: str) -> np.ndarray:
        if name in ("position", "departure", "arrival"):
            return random.random((rows, 3))
        if name == "amplitude":
            return random.random(rows).astype(np.complex64)
        if name == "band_absorption":
            bands = 2 if rows else no_arrivals().band_absorption.shape[1]  # without paths, any number
            return random.random((rows, bands)).astype(np.float32)
        if name in ("transmit_family", "receive_family", "object"):
            return random.choice(["D", "S", "BS", "box"], rows)
        return random.permutation(rows) if name == "group" else random.random(rows)

    return Arrivals(*(column(field.name) for field in fields(Arrivals)))


def alike(one: Arrivals, other: Arrivals) -> bool:
    """Every column of both is the same."""
    return all(np.array_equal(getattr(one, field.name), getattr(other, field.name)) for field in fields(Arrivals))


@settings(max_examples=40)
@given(st.integers(0, 30), st.integers(0, 30), st.integers(0, 2**32 - 1))
def test_arrivals_cut_in_two_and_joined_are_what_they_were(rows: int, cut: int, seed: int) -> None:
    """Taking rows and joining them undo one another, in any column, for any rows; what is empty adds nothing."""
    random = np.random.default_rng(seed)
    whole = some_arrivals(random, rows)
    assert alike(concatenate_arrivals([whole.take(slice(0, cut)), whole.take(slice(cut, None))]), whole)
    assert alike(concatenate_arrivals([no_arrivals(), whole, no_arrivals()]), whole)
    order = random.permutation(rows)
    assert alike(whole.take(order).take(np.argsort(order)), whole)
    mask = random.random(rows) < 0.5
    assert len(whole.take(mask)) + len(whole.take(~mask)) == len(whole)


@settings(max_examples=6)
@given(st.floats(-200, 200), st.floats(-200, 200), st.floats(-np.pi, np.pi))
def test_a_scene_moved_as_a_whole_sounds_the_same(north: float, east: float, turn: float) -> None:
    """Sonar, buoy and box moved and turned together: the same delays and amplitudes to 1e-9 and single precision."""

    def moved(place: tuple[float, ...]) -> tuple[float, ...]:
        c, s = np.cos(turn), np.sin(turn)
        x, y, *z = place
        return (north + c * x - s * y, east + s * x + c * y, *z)

    def ping(shift: bool) -> Arrivals:
        put = moved if shift else tuple
        box = {"shape": "box", "label": "box", "position": put((-1.3, 150.0)), "size": (2.0, 1.0, 1.0),
               "heading": 0.2 + (turn if shift else 0.0)}  # fmt: skip
        return arrivals(
            nominal(
                targets=[point(*put((1.0, 148.0, 15.0))), box],
                paths={"max_reflections": 1, "contributions": ["target"]},
                track={"position": put((0.0, 0.0, 11.0)), "heading": turn if shift else 0.0, "window": (0.19, 0.21)},
            )
        )

    here, there = ping(False), ping(True)
    # a leg that grazes an edge may be cut by the last bit of a turned coordinate
    assert abs(len(here) - len(there)) <= 2
    if len(here) == len(there):
        np.testing.assert_allclose(there.delay, here.delay, rtol=0, atol=1e-12)
        np.testing.assert_allclose(there.amplitude, here.amplitude, rtol=2e-5, atol=1e-12)


def test_a_lattice_that_moves_with_its_world_keeps_its_echoes() -> None:
    """A bed, a box and a ship 1 km away and turned by 1 rad: pressure within 1e-3 of the same bits of the draw."""
    turn, away = 1.0, (800.0, -600.0)
    here = simulate(nominal(track=SHORT, paths={"beam_cutoff_db": -40})).pressure.values
    there = simulate(
        nominal(
            track={**SHORT, "position": (*away, 11.0), "heading": turn},
            seabed={"depth": DEPTH, "scatterer_grid": {"origin": away, "heading": turn}},
            paths={"beam_cutoff_db": -40},
        )
    ).pressure.values
    assert relative_rms(there, here) < 1e-3


@pytest.mark.parametrize("field", ["coherent", "incoherent"])
def test_six_decibels_are_a_factor_of_two_in_pressure(field: str) -> None:
    """20 log10 2 more source level: pressure doubled, intensity quadrupled, to single precision; speckle and all."""
    twice = 20 * np.log10(2)
    quiet, strong = (
        simulate(nominal(field=field, track=SHORT, sonar={"source_level_db": level},
                         paths={"geometry": "slice"}))
        for level in (200.0, 200.0 + twice)
    )  # fmt: skip
    name, factor = ("pressure", 2) if field == "coherent" else ("intensity", 4)
    assert relative_rms(strong[name].values, factor * quiet[name].values) < 1e-6


@pytest.mark.parametrize("strength", [-27.0, -17.0])
def test_ten_decibels_of_scattering_are_a_factor_in_energy(strength: float) -> None:
    """Lambert's strength scales the bed's pressure by its root, in one and the same speckle."""
    base, other = (
        simulate(nominal(track=SHORT, seabed={"depth": DEPTH, "scattering": {"strength_db": s}},
                         paths={"geometry": "slice"})).pressure.values
        for s in (-37.0, strength)
    )  # fmt: skip
    assert relative_rms(other, base * 10 ** ((strength + 37) / 20)) < 1e-6


def test_two_targets_sound_as_one_and_the_other() -> None:
    """The wave equation is linear: pressures of two buoys add, sample by sample, to single precision."""
    buoys = [point(0, 149, 15, label="one"), point(0.5, 150.5, 17, label="other")]
    values = {"track": SHORT, "paths": {"contributions": ["target"]}}
    alone = [simulate(nominal(targets=[buoy], **values)).pressure.values for buoy in buoys]
    both = simulate(nominal(targets=buoys, **values)).pressure.values
    assert relative_rms(both, alone[0] + alone[1]) < 2e-6


def test_transmitter_and_receiver_may_change_places() -> None:
    """Two unlike omnidirectional ends, exchanged: the same arrivals with out and back exchanged, the same sound."""
    ends = ({"kind": "point", "length": None, "offset": (2.0, 0.0, -1.0)},
            {"kind": "point", "length": None, "offset": (-1.0, 0.5, 2.0)})  # fmt: skip
    values = {"targets": [point(0, 150, 15)], "track": SHORT, "paths": {"contributions": ["target"]}}
    one = nominal(transmit=ends[0], receive=ends[1], **values)
    other = nominal(transmit=ends[1], receive=ends[0], **values)
    assert relative_rms(simulate(one).pressure.values, simulate(other).pressure.values) < 1e-6
    forth, back = (arrivals(values) for values in (one, other))
    delays = {(a, b): t for a, b, t in zip(forth.transmit_family, forth.receive_family, forth.delay, strict=True)}
    for a, b, t in zip(back.transmit_family, back.receive_family, back.delay, strict=True):
        assert delays[b, a] == pytest.approx(t, abs=1e-12)


def test_a_mirrored_world_is_received_by_the_other_side() -> None:
    """East and west exchanged, starboard becomes port: a buoy's echo is the same."""
    right, left = (
        simulate(nominal(targets=[point(1.0, side * 150, 15)], track=SHORT, paths={"contributions": ["target"]},
                         sonar={"mounting": {"bearing": side * np.pi / 2}}))
        for side in (1, -1)
    )  # fmt: skip
    assert relative_rms(left.pressure.values, right.pressure.values) < 1e-6


def test_twice_the_path_is_twelve_decibels_less() -> None:
    """40 log10 2 in water that takes nothing: a point at 30 m and at 60 m, straight ahead of the sonar."""
    level = [
        levels(
            nominal(
                water={"absorption_db_per_m": 0.0},
                targets=[point(0, away, 11)],
                track={"window": (away / 750 - 1e-3, away / 750 + 1e-3)},
                paths={"max_reflections": 0, "contributions": ["target"]},
            )
        )
        .level_db.sel(contribution="target", pair="all")
        .max()
        for away in (30.0, 60.0)
    ]
    assert float(level[0] - level[1]) == pytest.approx(40 * np.log10(2), abs=0.05)
