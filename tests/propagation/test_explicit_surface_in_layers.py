"""Legs off drawn waves in layered water, against closed forms of water with one gradient, searched point by point."""

import numpy as np
import pytest

from insonify.propagation.explicit_surface import explicit_surface_legs, explicit_waves, find_bounce_points
from insonify.propagation.glints import SonarEnd
from insonify.propagation.propagation_model import RayDomain
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget
from oracles.few_of import few_of

BED, PLACE, FAR = 20.0, np.array([0.0, 0.0, 11.0]), (0.0, 150.0, 19.5)
GRADIENTS = [-1.0, -0.2, 0.3]
AT_TOP = 1500.0


def scene(gradient, height=0.3, length=20.0, **top):
    """Water of one gradient under one long-crested wave that runs east."""
    profile = [[0.0, AT_TOP], [BED, AT_TOP + BED * gradient]]
    surface = {"reflection": "explicit", "swell": {"height": height, "length": length}, "wave_direction": np.pi / 2}
    return Scene(surface=surface, water={"profile": profile}, seabed={"depth": BED}, **top)


def legs(where, family="S", *, target=FAR, time=0.0, frequency=1e5):
    """Legs of one family off a calm surface, and those off the waves out and back."""
    rays = propagation_model_for(where, RayDomain((PLACE[2],), False, (0.0, BED), 500.0))
    point = point_scatterer(PointTarget(position=target))
    calm = rays.legs(PLACE, point, (family,), frequency)
    return calm, *explicit_surface_legs(calm, where, 1, point, frequency, SonarEnd(PLACE, time))


def travel_time(gradient, distance, depth, up):
    """Time from a depth to a height of the surface: hyperbolic distance up to the mean surface, a straight line above.

    T = 2 / |g| asinh(|g| d / (2 sqrt(c1 c2))), Officer (1958), not verified; the crossing by golden section.
    """

    def below(across, z):
        speeds = np.sqrt((AT_TOP + gradient * depth) * (AT_TOP + gradient * z))
        return 2 / abs(gradient) * np.arcsinh(abs(gradient) * np.hypot(across, depth - z) / 2 / speeds)

    time = below(distance, np.maximum(-up, 0.0))
    proud = up > 0
    far, crest = distance[proud], up[proud]

    def whole(across):
        return below(across, 0.0) + np.hypot(far - across, crest) / AT_TOP

    low, high, ratio = np.maximum(far - 200 * crest, 0.0), far.copy(), (np.sqrt(5) - 1) / 2  # steeper than 0.3 deg
    for _ in range(33):  # to ten micrometres: the time is stationary there
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        first = whole(a) < whole(b)
        low, high = np.where(first, low, a), np.where(first, b, high)
    time[proud] = whole((low + high) / 2)
    return time


def stationary(where, gradient, time):
    """Every distance east at which the S path is stationary, and its travel time, on a lattice of 5 mm."""
    waves = explicit_waves(where.surface, 1, BED).waves
    east = np.arange(0.5, FAR[1] - 0.5, 0.005)

    def way(x):
        arrival = time + travel_time(gradient, np.abs(x), PLACE[2], np.zeros_like(x))
        up = waves[4, 0] * np.cos(2 * np.pi * (waves[1, 0] * x + waves[2, 0] * arrival + waves[3, 0]))
        return travel_time(gradient, np.abs(x), PLACE[2], up) + travel_time(gradient, np.abs(FAR[1] - x), FAR[2], up)

    slope = (way(east + 1e-3) - way(east - 1e-3)) / 2e-3
    turns = np.flatnonzero(np.sign(slope[1:]) != np.sign(slope[:-1]))
    part = slope[turns] / (slope[turns] - slope[turns + 1])
    found = east[turns] + part * 0.005
    return found, way(found)


@pytest.mark.parametrize("gradient", GRADIENTS)
@pytest.mark.parametrize("time", [0.0, 1.7])
def test_every_stationary_point_of_the_travel_time_is_a_leg(gradient, time):
    """All of them and no others, each at its place within 2 cm and with its travel time within 2 ns."""
    where = scene(gradient)
    point = point_scatterer(PointTarget(position=FAR))
    sea = explicit_waves(where.surface, 1, BED)
    found = find_bounce_points(sea, "S", point, SonarEnd(PLACE, time), where, 1e5, is_transmit_leg=True)
    rows = found.points[0, : found.bounce_count[0]]
    east, when = stationary(where, gradient, time)
    bright = rows[rows[:, 11] == 0]
    np.testing.assert_allclose(np.sort(bright[:, 1]), np.sort(east), atol=0.02)
    _, out, _ = legs(where, time=time)
    clear = out.visibility[:, 0] > 0
    assert np.sum(clear) >= len(east)
    for one in when:
        assert np.min(np.abs(out.delay[clear, 0] - one)) < 2e-9


@pytest.mark.parametrize("family", ["S", "BS", "SB", "BSB"])
@pytest.mark.parametrize("gradient", GRADIENTS)
def test_a_calm_is_a_mirror(family, gradient):
    """Waves of a nanometre change no leg, its level and phase included."""
    calm, *moved = legs(scene(gradient, 1e-9), family)
    for way in moved:
        assert way.delay.shape == calm.delay.shape == (1, 1)
        np.testing.assert_allclose(way.delay, calm.delay, rtol=1e-10)
        np.testing.assert_allclose(way.departure, calm.departure, atol=1e-6)
        np.testing.assert_allclose(way.arrival, calm.arrival, atol=1e-6)
        np.testing.assert_allclose(way.amplitude, calm.amplitude, rtol=1e-5)


@few_of((0,), ("gradient", "time"), [(-1.0, 2.0), (0.3, 0.0)])
def test_the_legs_sum_to_the_integral_over_the_surface(gradient, time):
    """Kirchhoff's integral along a long-crested wave, across it by its stationary phase: the legs' sum within 0.6 %.

    Pressure |g| / (sqrt(c1 c2) sinh(|g| T)) re 1 m: rays are geodesics of a hyperbolic space, in which areas grow so.
    """
    where, frequency = scene(gradient, 0.06, 30.0), 4e5
    waves, east = explicit_waves(where.surface, 1, BED).waves, np.arange(-8.0, 158.0, 8e-4)
    arrival = time + travel_time(gradient, np.abs(east), PLACE[2], np.zeros_like(east))
    phase = 2 * np.pi * (waves[1, 0] * east + waves[2, 0] * arrival + waves[3, 0])
    up, slope = waves[4, 0] * np.cos(phase), -waves[4, 0] * 2 * np.pi * waves[1, 0] * np.sin(phase)
    total, cosine, amplitude, across = 0.0, 0.0, 1.0, 0.0
    for at in (PLACE, np.array(FAR)):
        far, step = np.abs(east - at[1]), 1e-2
        when = travel_time(gradient, far, at[2], up)
        ends = (travel_time(gradient, np.abs(far + side), at[2], up) for side in (step, -step))
        p = np.subtract(*ends) / 2 / step
        c1, c2 = AT_TOP + gradient * at[2], AT_TOP - gradient * np.minimum(up, 0.0)
        total, across = total + when, across + AT_TOP * p / np.maximum(far, step)
        cosine = cosine + (np.sqrt(np.maximum(1 / c2**2 - p**2, 0.0)) - p * np.sign(east - at[1]) * slope) * AT_TOP / 2
        amplitude = amplitude * abs(gradient) / np.sqrt(c1 * c2) / np.sinh(abs(gradient) * when)
    fade = 0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(east - east[0], east[-1] - east) / 5.0, 0, 1))
    k = 2 * np.pi * frequency / AT_TOP
    beside = np.sqrt(2 * np.pi / (k * across)) * np.exp(-0.25j * np.pi)
    integral = 1j * k / 2 / np.pi * 8e-4 * np.sum(fade * beside * amplitude * cosine * np.exp(-1j * k * AT_TOP * total))
    calm, out, _ = legs(where, time=time, frequency=frequency)
    kept = out.visibility[:, 0] > 0
    pressure = (out.spreading * out.caustic)[kept, 0] * np.exp(-2j * np.pi * frequency * out.delay[kept, 0])
    assert abs(pressure.sum() / integral - 1) < 0.006
    assert abs(abs(pressure.sum()) / calm.spreading[0, 0] - 1) > 0.05  # the waves focus


@pytest.mark.parametrize("depth", [6.0, 15.0])
def test_rays_that_turn_keep_the_bounce_of_a_calm(depth):
    """A duct over 400 m: the ray that turns before the surface or after it is not changed by waves of 10 cm."""
    calm, out, _ = legs(scene(1.0, 0.1), target=(0.0, 400.0, depth))
    assert (calm.departure[0, 0, 2] > 0) != (calm.arrival[0, 0, 2] < 0)
    (row,) = np.flatnonzero(out.visibility[:, 0] > 0)
    assert out.delay[row, 0] == calm.delay[0, 0]
    assert out.amplitude[row, 0] == calm.amplitude[0, 0]
