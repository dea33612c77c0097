"""Directions of glint legs about those off a calm surface, and the gain of beams over them."""

import numpy as np
import pytest

from insonify.engines import _glint_spread_kernel as kernel
from insonify.engines.glint_spread import glint_spread, spread_gain_tables
from insonify.propagation.glints import SonarEnd, glint_surface
from insonify.propagation.image_sources import StraightRays
from insonify.scene.scatterers import Scatterers
from insonify.simulator import build_simulator
from insonify.sonar.array import PlanarArray
from insonify.sonar.beam import beams
from oracles.few_of import few_of
from oracles.scenes import nominal

FREQUENCY = 100e3


def departures(family, distance, wind, count=4000):
    """Elevation [rad] and bearing times cosine of it [rad] of the glints to many positions north of the sonar."""
    scene = build_simulator(
        nominal(surface={"reflection": "statistical", "wind_speed": wind, "wave_direction": 0.6})
    ).engine.scene
    position = np.column_stack([np.full(count, distance), np.zeros(count), np.full(count, 20.0)])
    up = np.zeros((count, 3))
    points = Scatterers("one", "target", None, position, up, np.ones(count), np.ones(count, complex),
                        np.arange(count, dtype=np.uint64) * np.uint64(7919) + np.uint64(5))  # fmt: skip
    place = np.array([0.0, 0.0, 11.0])
    legs = StraightRays(scene).legs(place, points, (family,), FREQUENCY)
    calm = legs.departure[0, 0]
    out, _ = glint_surface(scene, 3, FREQUENCY).legs(legs, points, SonarEnd(place, 0.0))
    glints = out.departure[[row for row, label in enumerate(out.glints.bounce_id) if label >= 0]].reshape(-1, 3)
    sense = np.sign(calm[2])
    rise = np.arcsin(sense * glints[:, 2]) - np.arcsin(sense * calm[2])
    return scene, np.sqrt(np.mean(rise**2)), np.sqrt(np.mean(glints[:, 1] ** 2))


@pytest.mark.parametrize("family", ["S", "BS", "SB"])
@pytest.mark.parametrize("distance", [20.0, 80.0])
def test_departures_spread_as_the_glints_drawn_do(family, distance):
    """Standard deviations in elevation and bearing, 8000 glints at 4 m/s: as foreseen within 25 %.

    Drawn slopes are cut at 0.4, and bounces stay between both ends: the farthest are nearer than foreseen.
    """
    scene, rise, turn = departures(family, distance, 4.0)
    spread = glint_spread(scene, FREQUENCY)
    legs = spread.legs(family, 11.0, np.array([distance]), 20.0)
    north, _, east = spread.slopes
    assert legs.elevation_change[0] * np.sqrt(north) == pytest.approx(rise, rel=0.25)
    assert legs.bearing_change[0] * np.sqrt(east) == pytest.approx(turn, rel=0.25)
    assert legs.coherent[0] ** 2 + legs.glints[0] ** 2 == pytest.approx(1.0)


def test_a_calm_has_neither_glints_nor_spread():
    """A mirror has no spread at all; a swell of a hair's breadth leaves all in the mirror's direction."""
    assert glint_spread(build_simulator(nominal()).engine.scene, FREQUENCY) is None
    hair = {"reflection": "tilted", "swell": {"height": 1e-8, "length": 30.0}}
    legs = glint_spread(build_simulator(nominal(surface=hair)).engine.scene, FREQUENCY).legs(
        "S", 11.0, np.array([75.0]), 20.0
    )
    assert legs.coherent[0] == pytest.approx(1.0, abs=1e-9)
    assert legs.glints[0] < 1e-4


@few_of((0, 3), "spread", [0.001, 0.01, 0.05, 0.3])
def test_spread_gain_tables_are_fourth_means_over_directions(spread):
    """Envelope of a 0.6 m array at 100 kHz, at 40 positions: the integral over both halves of the slopes, within 20 %.

    Spreads between those tabulated, an octave apart, are interpolated.
    """
    own = beams(PlanarArray(width=0.6, height=0.05, element="piston", columns=64, rows=1), FREQUENCY, 1500.0)
    bound, per = own.majorants[0], own.per_unit[0]
    table = spread_gain_tables(own)[0]

    def envelope(x):
        return np.interp(np.abs(x) * per, np.arange(len(bound)), bound)

    steps = np.linspace(-6, 6, 24001)
    for x in np.linspace(0.0, 0.6, 40):
        mean = np.mean([
            np.trapezoid(envelope(x + spread * part * steps) ** 4 * np.exp(-(steps**2) / 2), steps)
            for part in kernel.MIXTURE_DEVIATIONS
        ]) / np.sqrt(2 * np.pi)  # fmt: skip
        found = kernel.pattern_with_spread(table, envelope(x), per, x, spread)
        assert found == pytest.approx(mean**0.25, rel=0.2)


@pytest.mark.parametrize("element", ["omni", "cosine", "baffled"])
def test_no_glint_within_the_deviations_has_more_gain_than_the_bound(element):
    """Elements of 1 cm, 400 random departures, many beside or behind the array: every direction out to 1.5 deviations.

    A deviation of 0.03 rad in elevation and bearing; directions to first order, so within a millionth of it squared.
    """
    rng, reach, spread = np.random.default_rng(6), 1.5, 0.03
    made = beams(PlanarArray(width=0.01, height=0.01, element=element), FREQUENCY, 1500.0).rotated(
        np.linalg.qr(rng.normal(size=(3, 3)))[0]
    )
    way = rng.normal(size=(400, 3)) * [1, 1, 0.7]
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    level = np.hypot(way[:, 0], way[:, 1])
    azimuth = way[:, :2] / level[:, None]
    statistics = kernel.GlintStatistics(np.full(400, spread), np.full(400, spread), np.array([1.0, 0.0, 1.0]), reach)
    bound = np.empty(400)
    kernel.glint_bounds(way, np.zeros(400), azimuth, statistics, made.kernel_majorants, bound)
    turn = np.linspace(0, 2 * np.pi, 17)
    up = np.column_stack([-way[:, 2, None] * azimuth, level])
    right = np.column_stack([-azimuth[:, 1], azimuth[:, 0], np.zeros(400)])
    found = np.zeros(400)
    for part in (0.0, 0.5, 1.0):
        for angle in turn:
            moved = way + part * reach * spread * (np.cos(angle) * up + np.sin(angle) * right)
            moved = np.ascontiguousarray(moved / np.linalg.norm(moved, axis=1, keepdims=True))
            found = np.maximum(found, np.abs(made.gain(moved)).max(axis=0))
    assert np.all(found <= bound + 2 * (reach * spread) ** 2)
    assert np.mean((bound < 0.99) | (element == "omni")) > 0.3 and np.median(bound - found) < 0.1
