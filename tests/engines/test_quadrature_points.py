"""Even points sampled by the beams: the same ground in fewer points, whichever ping came before."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.engines.engine_caches import EngineCaches
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.simulator import build_simulator
from oracles.scenes import nominal

BOX = {"label": "box", "position": (0.0, 80.0), "size": (6.0, 1.0, 1.0)}


def points(importance_sampling=True, caches=None, ping=0, box=None, **changes):
    """Positions and areas of all even points of the seabed, with the sonar's geometry."""
    made = {
        "track": {"window": (0.08, 0.12)},
        "paths": {"importance_sampling": importance_sampling, "contributions": ["seabed"]},
        **changes,
    }
    ready = build_simulator(nominal(box=box, **made))
    here, engine = ready.ping_geometry(ping), ready.engine
    blocks = ping_scatterers(
        engine.scene, engine.path_settings, 1, here, engine.rays, quadrature=True, caches=caches
    ).blocks()
    found = [block() for block in blocks]
    place, area = (np.concatenate([getattr(one, name) for one in found]) for name in ("position", "area"))
    return place, area, here, ready


def received(place, area, here):
    """Energy that the two-way beam takes of ground, by distance, in bins of 1 m."""
    way = place - here.transmit_position
    slant = np.linalg.norm(way, axis=1)
    way /= slant[:, None]
    gain = here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0]
    return np.histogram(slant, np.arange(62.0, 88.0), weights=gain**2 * area)[0]


def test_few_points_hold_the_energy_of_all():
    """Of a 1.5 m line's ground a quarter of the points and less: each metre of range within 0.01 dB, all to 0.001 dB.

    A sixth would do here (0.003 dB); beams that are steered apart receive by side lobes, and want the quarter.
    """
    whole, some = points(importance_sampling=False), points()
    assert len(some[0]) < len(whole[0]) / 4.5
    ratio = 10 * np.log10(received(*some[:3]) / received(*whole[:3]))
    assert np.abs(ratio).max() < 0.01 and abs(ratio.mean()) < 0.001


def test_the_points_left_stand_for_all_the_ground():
    """Areas add up to those of all points: to 2 %, though far out one point represents a thousand."""
    whole, some = points(importance_sampling=False), points()
    assert some[1].sum() == pytest.approx(whole[1].sum(), rel=0.02)
    assert some[1].max() > 20 * whole[1].max()


def test_points_do_not_depend_on_what_was_kept_of_other_pings():
    """The third ping by itself, and after two others of the same attitude elsewhere: bit for bit the same."""
    line = {"kind": "line", "start": (-3.3, 0.7, 11.0), "speed": 2.0, "pings": 3, "interval": 0.3, "heading": 0.3,
            "window": (0.08, 0.12)}  # fmt: skip
    scenario = nominal(paths={"contributions": ["seabed"]})
    ready = build_simulator(type(scenario).model_validate({**scenario.model_dump(exclude_unset=True), "track": line}))
    engine, held = ready.engine, EngineCaches()
    for ping in range(3):
        blocks = ping_scatterers(
            engine.scene, engine.path_settings, 1, ready.ping_geometry(ping), engine.rays, quadrature=True, caches=held
        ).blocks()
        after = [block().position for block in blocks]
    fresh = ping_scatterers(
        engine.scene, engine.path_settings, 1, ready.ping_geometry(2), engine.rays, quadrature=True
    ).blocks()
    for one, other in zip(after, fresh, strict=True):
        np.testing.assert_array_equal(one, other().position)


def test_ranges_of_a_targets_shadow_keep_more_points():
    """A box in the beam: three times the points in the shadow behind it, no more in front of it."""
    bare, boxed = points(), points(box=BOX)

    def count(found, near, far):
        slant = np.linalg.norm(found[0] - found[2].transmit_position, axis=1)
        return np.sum((slant > near) & (slant < far))

    assert count(boxed, 82.0, 86.0) > 3 * count(bare, 82.0, 86.0)
    assert count(boxed, 62.0, 76.0) == count(bare, 62.0, 76.0)
    aside = points(box={**BOX, "position": (80.0, 0.0)})
    assert len(aside[0]) == len(bare[0])


def test_a_sonar_that_turns_has_other_points():
    """Attitude is part of what is kept: beams that turned do not reuse the points of those before."""
    held, turn = EngineCaches(), {"sonar": {"mounting": {"bearing": 1.75}}}
    before, after, fresh = points(caches=held), points(caches=held, **turn), points(**turn)
    np.testing.assert_array_equal(after[0], fresh[0])
    assert before[0].shape != after[0].shape or not np.array_equal(before[0], after[0])


def test_a_sonar_elsewhere_reaches_the_same_points_moved():
    """Two metres on, to rounding error: the same offsets and areas."""
    one = points()
    way = np.array([2.0, 1.0, 0.0])
    here = replace(
        one[2], transmit_position=one[2].transmit_position + way, receive_position=one[2].receive_position + way
    )
    engine = one[3].engine
    moved = [
        block()
        for block in ping_scatterers(engine.scene, engine.path_settings, 1, here, engine.rays, quadrature=True).blocks()
    ]
    np.testing.assert_allclose(np.concatenate([each.position for each in moved]), one[0] + way, atol=1e-9)


def test_sparse_points_are_few_right_below_the_sonar():
    """The first 25 cm of slant range have fewer points than the next 75 cm, and their energy to 0.3 dB.

    The point below the sonar is received by all sectors alike; the rings about it are not.
    """
    made = {
        "track": {"window": (0.0, 0.06)},
        "sonar": {"pulse": {"kind": "cw", "frequency": "100 kHz", "duration": "0.1 ms"}},
    }
    found = []
    for chosen in ({"scatterers_per_cell": 1.5}, {"importance_sampling": False}):
        place, area, here, _ = points(**made, paths={"contributions": ["seabed"], **chosen})
        way = place - here.transmit_position
        slant = np.linalg.norm(way, axis=1)
        way /= slant[:, None]
        weight = (here.transmit_beams.gain(way)[0] * here.receive_beams.gain(way)[0]) ** 2 * area
        edges = 9.0 + np.array([0.0, 0.25, 1.0, 3.0, 5.0, 15.0, 18.0])
        found.append((np.histogram(slant, edges)[0], np.histogram(slant, edges, weights=weight)[0]))
    (few, energy), (_, whole) = found
    assert few[0] < few[1]
    np.testing.assert_allclose(10 * np.log10(energy / whole), 0.0, atol=0.3)
