"""Launch sampling and hits of the tracer, against sums and against every triangle and sample in turn."""

import numpy as np
import pytest

from insonify.engines.tracer.image_legs import image_legs
from insonify.engines.tracer.interaction import scattered_per_steradian, specular_direction, specular_fraction
from insonify.engines.tracer.launch_sampling import tabulated_density
from insonify.propagation.families import image_depth
from insonify.propagation.triangle_tree import nearest_hit, triangle_tree
from insonify.scattering.apl_surface import AplSurface
from insonify.scattering.compiled_law import compile_law
from insonify.scattering.lambert import Lambert
from insonify.scene import triangle_surfaces
from insonify.simulator import build_simulator
from oracles.traced import BOX, FRACTAL, scene

RNG = np.random.default_rng(7)


def thrown(**changes):
    """All rays of one ping: directions, solid angles, and the ping."""
    simulator = build_simulator(scene("tracer", **changes))
    ping = simulator.tracer.ping(simulator.ping_geometry(0))
    parts = [ping.launch_sampler.rays(1, 0, simulator.scenario.paths.rays, part, 16) for part in range(16)]
    return *(np.concatenate(column) for column in zip(*parts, strict=True)), ping


@pytest.mark.parametrize("targets", [[], [BOX]], ids=["open", "box"])
def test_rays_stand_for_the_whole_sphere(targets):
    """However unevenly rays are thrown, what they represent adds up: 4 pi, and 4 pi / 3 under cosine squared."""
    way, solid_angle, _ = thrown(targets=targets, rays=100_000)
    np.testing.assert_allclose(np.linalg.norm(way, axis=1), 1)
    assert solid_angle.sum() == pytest.approx(4 * np.pi, rel=0.02)
    for axis in range(3):
        assert np.sum(solid_angle * way[:, axis] ** 2) == pytest.approx(4 * np.pi / 3, rel=0.05)


def test_rays_carry_what_the_beam_sends():
    """Transmitted power: the sum over 200 000 rays (scatter 0.4 %) against an integral of the beam, within 1.5 %."""
    way, solid_angle, ping = thrown(rays=200_000)
    expected = np.sum(solid_angle * ping.transmit_beams.gain(way)[0] ** 2)
    u = np.linspace(-1, 1, 100_001)
    u = (u[1:] + u[:-1]) / 2
    ahead = np.stack([np.sqrt(1 - u**2), u, 0 * u], axis=-1) @ ping.launch_sampler.axes
    around = np.pi if ping.transmit_beams.element else 2 * np.pi
    assert expected == pytest.approx(around * np.sum(ping.transmit_beams.gain(ahead)[0] ** 2) * 2e-5, rel=0.015)


def test_rays_fill_what_is_received():
    """Of 10 000 rays at least four fifths leave for bed that some pair of families lets the window receive."""
    way, *_ = thrown(rays=10_000, window=(0.09, 0.12))
    climb = np.where(way[:, 2] > 0, 9.0, 31.0) / np.maximum(np.abs(way[:, 2]), 1e-9)
    further = np.where(way[:, 2] > 0, 49.0 / np.maximum(way[:, 2], 1e-9), np.inf)
    received = [(reach > 58) & (reach < 97) for reach in (climb, further)]
    assert np.mean(received[0] | received[1]) > 0.8


def test_a_table_is_its_own_inverse():
    """Positions of even parts have the density that was requested: histogram against weights."""
    weight = RNG.uniform(0, 1, 20) * (np.arange(20) != 7)
    one = tabulated_density(-1.0, 3.0, weight)
    found, _ = np.histogram(one.quantile((np.arange(100_000) + 0.5) / 100_000), np.linspace(-1, 3, 21))
    np.testing.assert_allclose(found / 100_000, weight / weight.sum(), atol=2e-5)
    np.testing.assert_allclose(one.density(np.linspace(-0.9, 2.9, 20)) * 0.2, weight / weight.sum(), rtol=1e-9)
    assert one.density(np.array([-1.5, 3.5])).max() == 0


def test_sorted_triangles_are_hit_where_each_of_them_is():
    """300 rays at a ring and a sphere: nearest hit by the sorted boxes against the smallest over all triangles."""
    parts = [
        triangle_surfaces.torus(2.0, 0.4).transformed(np.eye(3), np.array([3.0, 0, 0])),
        triangle_surfaces.sphere(1.5, steps=24),
    ]
    corners = np.concatenate([part.corners for part in parts])
    bodies = triangle_tree(corners, np.repeat([0, 1], [len(part.corners) for part in parts]))
    start = RNG.uniform(-6, 6, (300, 3))
    way = RNG.uniform(-1.5, 4.5, (300, 3)) * [1, 0.3, 0.3] - start
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    computed = 0
    for x, d in zip(start, way, strict=True):
        found, row = nearest_hit(bodies, tuple(x), tuple(d), 1e-6, 100.0)
        along = np.einsum("ij,ij->i", a - x, normal) / (normal @ d)
        place = x + along[:, None] * d
        inside = np.all(
            [np.einsum("ij,ij->i", np.cross(q - p, place - p), normal) > 0 for p, q in ((a, b), (b, c), (c, a))], axis=0
        )
        expected = np.min(np.where(inside & (along > 1e-6), along, 100.0))
        assert found == pytest.approx(expected, abs=1e-9)
        computed += row >= 0
    assert computed > 45


def test_marched_ground_is_hit_where_it_is():
    """Rays of 1 to 60 degrees over fractal ground: at the hit the ray is on the seabed, and before it nowhere under it.

    The map is bilinear with sixteen cells on the shortest wave: facets are within 0.003 rms of slopes of 0.039 rms.
    """
    simulator = build_simulator(scene("tracer", seabed={"relief": FRACTAL, "seed": 3, "cutoff_wavelength": 0.5}))
    ping, bed = simulator.tracer.ping(simulator.ping_geometry(0)), simulator.scenario.scene.seabed.terrain
    turn, dip = RNG.uniform(-np.pi, np.pi, 200), np.radians(np.geomspace(4, 60, 200))
    way = np.stack([np.cos(dip) * np.cos(turn), np.cos(dip) * np.sin(turn), np.sin(dip)], axis=-1)
    origin = np.tile([0.0, 0.0, 11.0], (200, 1))
    hits = ping.intersector.hits(origin, way, np.full(200, 150.0))
    distance, normal = hits.distance, hits.normal
    assert np.all(hits.kind == 1) and np.all(hits.body_row == -1)
    place = origin + distance[:, None] * way
    np.testing.assert_allclose(place[:, 2], bed.depth_at(place[:, 0], place[:, 1]), atol=1e-3)
    ground = bed.relief.sample(place[:, 0], place[:, 1])
    assert np.std(normal[:, :2] / normal[:, 2:] - ground.slope) < 0.003
    for x, d, far in zip(origin, way, distance, strict=True):
        path = x + np.linspace(0, far - 0.05, 400)[:, None] * d
        assert np.all(path[:, 2] < bed.depth_at(path[:, 0], path[:, 1]) + 5e-3)


def test_a_family_runs_straight_from_its_image():
    """Lengths, directions and mirrors of the nominal legs: the paper's figure 10, to 0.1 mm."""
    simulator = build_simulator(scene("tracer"))
    end, place = np.array([0.0, 0.0, 11.0]), np.array([[0.0, 150.0, 19.5]])
    changes = {"D": 150.2406, "S": 153.0694, "B": 150.3005, "SB": 153.2718, "BS": 157.6460}
    for family, length in changes.items():
        found = image_legs(simulator.scenario.scene, end, place, family, 0.015)
        assert found.length[0] == pytest.approx(length, abs=1e-4)
        assert np.sign(found.departure[0, 2]) == (-1 if family.startswith("S") else 1)
        assert found.intensity[0] == pytest.approx(0.35 ** (2 * family.count("B")))
    assert image_depth("BS", 11.0, 20.0) == -29.0


def test_laws_are_evaluated_by_directions():
    """Lambert's law, its compiled form and the sea surface's: energy over the sine of what arrives; 0 from behind."""
    into = RNG.normal(size=(500, 3))
    into /= np.linalg.norm(into, axis=1, keepdims=True)
    out = -np.roll(into, 1, axis=0)
    up = np.tile([0.0, 0.0, -1.0], (500, 1))
    lit = (into[:, 2] > 0) & (out[:, 2] < 0)
    plain = scattered_per_steradian(Lambert(-20.0), into, out, up)
    np.testing.assert_allclose(plain, np.where(lit, 0.01 * -out[:, 2], 0.0), atol=1e-12)
    np.testing.assert_allclose(
        scattered_per_steradian(compile_law(Lambert(-20.0)), into, out, up), plain, rtol=2e-3, atol=1e-6
    )
    sea = AplSurface(5.0, 30e3)
    straight = np.array([[0.0, np.cos(0.3), -np.sin(0.3)]])
    back = scattered_per_steradian(sea, straight, -straight, np.array([[0.0, 0.0, 1.0]]))
    expected = sea.cross_section(np.array([0.3]), np.array([0.3]), np.array([np.pi])) / np.sin(0.3)
    np.testing.assert_allclose(back, expected, rtol=1e-9)


def test_mirrors_turn_rays_round_and_keep_what_is_not_scattered():
    """A mirror turns the part along its normal only; a face of -10 dB scatters 31 % of what it gets."""
    way = np.array([[0.6, 0.0, 0.8]])
    np.testing.assert_allclose(specular_direction(way, np.array([[0.0, 0.0, -1.0]])), [[0.6, 0.0, -0.8]])
    assert specular_fraction(Lambert(-10.0)) == pytest.approx(1 - 0.1 * np.pi)
    assert specular_fraction(Lambert(10 * np.log10(1 / np.pi))) == pytest.approx(0, abs=1e-12)
