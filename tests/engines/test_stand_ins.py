"""Claims about functions that stand in for kernels while numba is not loaded: they agree with the kernels."""

import numpy as np
import pytest

from insonify.engines import _keep_probability_kernel, _resolution_kernel, beam_importance, resolution
from insonify.engines._gain_envelope_kernel import gain_re_threshold, max_two_way_gain
from insonify.engines.glint_spread import glint_spread
from insonify.propagation.departure_cone_kernel import DepartureAngles, departure_cones
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam import Beams, beams
from insonify.sonar.beam_kernels import beam_bounds, beam_gains, largest_gains

ARRAYS = (
    LineArray(length=1.5, element="omni"),
    LineArray(length=0.3, elements=24, element="piston", steer=(-0.2, 0.0, 0.5), shading="hann"),
    PlanarArray(width=0.4, height=0.02, element="cosine", steer=(0.1,)),
    PlanarArray(width=0.05, height=0.3, element="baffled"),
    PlanarArray(width=0.4, height=0.1, steer=tuple(np.linspace(0.9, -0.9, 101)), steer_down=0.2),
    PointTransducer(element="baffled"),
)
SCENE = """
seabed: {depth: 15 m, scattering: {law: lambert, strength_db: -30}}
surface: SURFACE
sonar:
  source_level_db: 210
  pulse: {kind: cw, frequency: 200 kHz, duration: 0.1 ms}
  transmit: {kind: planar, width: 0.1 m, height: 3 cm}
  receive: {kind: planar, width: 0.6 m, height: 2 cm, element: cosine, steer: [-20 deg, 0 deg, 25 deg]}
  mounting: {bearing: 60 deg, tilt: 15 deg}
track: {kind: static, position: [3 m, -2 m, 6 m], heading: 20 deg, roll: 3 deg, pings: 1, interval: 1 s,
        window: [0 s, 60 ms]}
paths: {max_reflections: 2}
"""


def directions(rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    """Unit vectors all around, shape (n, 3)."""
    way = rng.normal(size=(n, 3))
    return np.ascontiguousarray(way / np.linalg.norm(way, axis=1, keepdims=True))


def turned(array: LineArray | PlanarArray | PointTransducer, rng: np.random.Generator) -> Beams:
    """Beams of an array at an attitude drawn at random."""
    return beams(array, 120e3, 1500.0).rotated(np.linalg.qr(rng.normal(size=(3, 3)))[0])


@pytest.mark.parametrize("array", ARRAYS, ids=lambda array: f"{array.kind} {array.element}")
def test_gains_agree_to_the_bit(array):
    """Beams keep what gains on their axes were computed from: numba or not, the bits are the same."""
    rng = np.random.default_rng(3)
    made = turned(array, rng)
    way = np.concatenate([directions(rng), made.axes, -made.axes])
    kernel, plain = np.empty((2, made.channel_count, len(way)))
    beam_gains.dispatcher(way, made.kernel_tables, kernel)
    beam_gains._stand_in(way, made.kernel_tables, plain)
    np.testing.assert_array_equal(plain, kernel)
    for largest in (largest_gains.dispatcher, largest_gains._stand_in):
        found = np.empty(len(way))
        largest(way, made.kernel_tables, made.kernel_majorants, found)
        np.testing.assert_array_equal(found, np.abs(kernel).max(axis=0))


@pytest.mark.parametrize("array", ARRAYS, ids=lambda array: f"{array.kind} {array.element}")
def test_bounds_agree(array):
    """To rounding, but for directions so near a row's or the baffle's edge that rounding decides: one in a thousand."""
    rng = np.random.default_rng(4)
    made, way, margin = turned(array, rng), directions(rng), rng.exponential(0.1, 4000)
    kernel, plain = np.empty((2, len(way)))
    expected = way, margin, made.kernel_majorants
    beam_bounds.dispatcher(*expected, kernel)
    beam_bounds._stand_in(*expected, plain)
    assert np.mean(~np.isclose(plain, kernel, rtol=1e-12, atol=0)) < 1e-3


def test_cones_cells_and_keep_probabilities_agree():
    """Departure cones of straight rays, sizes of cells and keep probabilities of scatterers, to rounding."""
    rng = np.random.default_rng(5)
    place, centre, radius = rng.uniform(-9, 9, 3), rng.uniform(-50, 50, (500, 2)), rng.exponential(5.0, 500)
    angles = DepartureAngles(np.array([3.0, -7.5]), 0.3, 1.0, *np.empty((2, 2, 0, 0)))
    found = [(np.empty((500, 3)), np.empty(500), np.zeros(500, bool)) for _ in range(2)]
    for run, made in zip((departure_cones.dispatcher, departure_cones._stand_in), found, strict=True):
        run(angles, 1, place, centre, radius, *made)
    for kernel, plain in zip(*found, strict=True):
        np.testing.assert_allclose(plain, kernel, rtol=1e-12)
    distance = rng.uniform(0, 100, 500)
    for pulse in (0.0, 0.4):
        cell = resolution.Resolution(0.08, 0.01, 5.0, pulse).cell
        kernel, plain = np.empty((2, 500))
        _resolution_kernel.cell_areas.dispatcher(cell, distance, 8.0, kernel)
        _resolution_kernel.cell_areas._stand_in(cell, distance, 8.0, plain)
        np.testing.assert_allclose(plain, kernel, rtol=1e-12)
    gain = rng.lognormal(-2, 2, 500)
    for fewer in (0.0, 0.25):
        _keep_probability_kernel.keep_probabilities.dispatcher(gain, fewer, 0.001, kernel)
        _keep_probability_kernel.keep_probabilities._stand_in(gain, fewer, 0.001, plain)
        np.testing.assert_allclose(plain, kernel, rtol=1e-12)


@pytest.mark.parametrize("surface", ["{reflection: flat}", "{reflection: statistical, wind_speed: 5 m/s}"])
def test_beam_importance_agrees_with_and_without_a_moving_surface(surface):
    """Largest gains at all distances, and gains re their edges at positions and around them, within 1e-6."""
    scenario = parse_model(Scenario, SCENE.replace("SURFACE", surface))
    simulator = build_simulator(scenario)
    ping_geometry = simulator.ping_geometry(0)
    glints, rays, lattice = (
        glint_spread(scenario.scene, ping_geometry.frequency),
        simulator.engine.rays,
        scenario.seabed.scatterer_grid,
    )
    one = beam_importance.BeamImportance(ping_geometry, 15.0, rays, ("D", "S", "B"), lattice, 45.0, True, glints)
    out, back = one._ends
    far = beam_importance._nodes(45.0)
    sectors = np.arange(beam_importance.SECTORS) * 2 * np.pi / beam_importance.SECTORS
    expected = (
        out,
        back,
        out is back,
        far,
        ping_geometry.midpoint,
        np.array(one._axes),
        sectors,
        beam_importance.HALVINGS,
        beam_importance.FIRST_NODE,
    )
    kernel, plain = np.empty((2, len(far)))
    max_two_way_gain.dispatcher(*expected, kernel)
    max_two_way_gain._stand_in(*expected, plain)
    np.testing.assert_allclose(plain, kernel, rtol=1e-6)
    rng = np.random.default_rng(6)
    there, kernel, plain = rng.uniform(-40, 40, (1000, 2)), *np.empty((2, 1000))
    for around in (np.zeros(1000), rng.exponential(1.0, 1000)):
        gain_re_threshold.dispatcher(one._gains, there, around, kernel)
        gain_re_threshold._stand_in(one._gains, there, around, plain)
        np.testing.assert_allclose(plain, kernel, rtol=1e-6)


@pytest.mark.parametrize("element", ["baffled", "piston"])
def test_the_gain_of_one_beam_is_that_of_the_same_beam_twice(element):
    """One beam has a kernel of its own, without branches: 2000 positions, with and without a radius, to the bit."""
    text = SCENE.replace("SURFACE", "{reflection: flat}").replace("[-20 deg, 0 deg, 25 deg]", "[-20 deg]")
    text = text.replace("element: cosine", f"element: {element}, columns: 40, rows: 3")
    scenario = parse_model(Scenario, text)
    simulator = build_simulator(scenario)
    ping_geometry, lattice = simulator.ping_geometry(0), scenario.seabed.scatterer_grid
    importance = beam_importance.BeamImportance(
        ping_geometry, 15.0, simulator.engine.rays, ("D", "S", "B"), lattice, 45.0
    )
    (*out, sent, still), (*back, received, _), *others = importance._gains
    assert len(sent.steer) == len(received.steer) == 1
    both = ping_geometry.transmit_beams, ping_geometry.bounding_receive_beams
    again = [beams.subset(np.array([0, 0])).kernel_majorants for beams in both]
    rng = np.random.default_rng(8)
    there, once, twice = rng.uniform(-40, 40, (2000, 2)), *np.empty((2, 2000))
    for around in (np.zeros(2000), rng.exponential(1.0, 2000)):
        gain_re_threshold.dispatcher(importance._gains, there, around, once)
        gain_re_threshold.dispatcher(((*out, again[0], still), (*back, again[1], still), *others), there, around, twice)
        np.testing.assert_array_equal(once, twice)
        assert np.ptp(once) > 0.1
