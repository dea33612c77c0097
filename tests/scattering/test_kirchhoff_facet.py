"""Smooth facets: the closed form of a triangle, and what plates of them send back."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering.kirchhoff_facet import SERIES_RANGE, KirchhoffFacet, corner_phasor, mean_phasor, side_phasor

phases = st.floats(-60.0, 60.0)
UP = np.array([0.0, 0.0, -1.0])


def gordon(corners, wave):
    """Integral of exp(j wave . x) over a plane polygon by Gordon's sum over its edges [m^2]: no triangle in it."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    across = np.cross(normal, wave - (wave @ normal) * normal)
    edges = np.roll(corners, -1, axis=0) - corners
    middles = corners + edges / 2
    ends = (edges @ across) * np.exp(1j * middles @ wave) * np.sinc(edges @ wave / 2 / np.pi)
    return ends.sum() / (1j * (across @ across))


def plate(width, height, at=(0.0, 0.0, 0.0)):
    """A level plate, seen from above, as two triangles: corners (2, 3, 3), its middle at a place [m]."""
    x, y = width / 2, height / 2
    square = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0.0]]) + at
    return square[[[0, 1, 2], [0, 2, 3]]]


def sent_back(corners, out, back, k, reflection=1.0):
    """Far field of triangles re the origin, for directions of travel towards them."""
    middle = corners.mean(axis=1)
    n = len(corners)
    flat = np.full((1, n), np.inf)
    echo = KirchhoffFacet(reflection).echoes(
        corners - middle[:, None], np.tile(UP, (n, 1)), np.tile(out, (1, n, 1)), np.tile(back, (1, n, 1)), flat, flat,
        np.full(n, k),
    )[0]  # fmt: skip
    return complex(np.sum(echo * np.exp(-1j * k * middle @ (out + back))))


def towards(grazing, azimuth=0.0):
    """Direction of travel down to a level plate."""
    level = np.cos(grazing)
    return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(grazing)])


@given(phases, phases, phases)
@settings(max_examples=60)
def test_the_closed_form_is_the_integral_over_the_triangle(a, b, c):
    """Mean of exp(j phase) over a triangle: Gauss' rule in both directions, 80 nodes each; within 1e-10."""
    node, weight = np.polynomial.legendre.leggauss(80)
    s, t = np.meshgrid((node + 1) / 2, (node + 1) / 2, indexing="ij")  # a square folded into the triangle
    area = np.outer(weight, weight) / 4 * s * 2
    expected = np.sum(area * np.exp(1j * (a * (1 - s) + b * s * (1 - t) + c * s * t)))
    assert mean_phasor(a, b, c) == pytest.approx(expected, abs=1e-10)


@given(phases, phases, phases)
@settings(max_examples=60)
def test_the_parts_of_nodes_are_the_integral_weighted_by_their_shape_functions(a, b, c):
    """Mean of exp(j phase) times u (2 u - 1) of the first corner, and 4 u v: Gauss' rule, within 1e-9."""
    node, weight = np.polynomial.legendre.leggauss(80)
    s, t = np.meshgrid((node + 1) / 2, (node + 1) / 2, indexing="ij")
    area = np.outer(weight, weight) / 4 * s * 2
    u, v = 1 - s, s * (1 - t)
    phasor = np.exp(1j * (a * u + b * v + c * s * t))
    assert corner_phasor(a, b, c) == pytest.approx(np.sum(area * u * (2 * u - 1) * phasor), abs=1e-9)
    assert side_phasor(a, b, c) == pytest.approx(np.sum(area * 4 * u * v * phasor), abs=1e-9)


@given(phases, phases, phases)
@settings(max_examples=60)
def test_the_parts_of_the_six_nodes_add_up_to_the_whole(a, b, c):
    """Shape functions sum to 1: within 1e-9, also where phases are equal or almost."""
    for phase in ((a, b, c), (a, a, c), (a, a + 1e-9, a - 1e-7), (a, a + 0.3, b)):
        turns = [tuple(np.roll(phase, -turn)) for turn in range(3)]
        parts = [part(*turn) for turn in turns for part in (corner_phasor, side_phasor)]
        assert sum(parts) == pytest.approx(mean_phasor(*phase), abs=1e-9)


def test_corners_of_equal_phase_are_no_special_case():
    """Where phases meet, two or all three, and where the series takes over, nothing jumps: within 1e-13."""
    for base in ([0.0, 0.0, 0.0], [3.0, 3.0, 3.0], [0.0, 0.0, 40.0], [7.0, -5.0, 7.0]):
        for tiny in (0.0, 1e-15, 1e-9):
            moved = mean_phasor(base[0], base[1] + tiny, base[2] - tiny)
            assert moved == pytest.approx(mean_phasor(*base), abs=1e-8 * (tiny > 1e-12) + 1e-13)
    for middle in (0.0, 0.2, SERIES_RANGE):
        below, above = (mean_phasor(1.0, 1 + middle, 1 + SERIES_RANGE + step) for step in (-1e-13, 1e-13))
        assert below == pytest.approx(above, abs=1e-12)
    assert mean_phasor(0.0, 0.0, 0.0) == 1


@pytest.mark.parametrize("wave", [(30.0, 11.0, 5.0), (0.02, 300.0, -40.0), (-900.0, 4.0, 0.0)])
def test_a_polygon_is_gordons_sum_over_its_edges(wave):
    """A pentagon cut into three triangles, against the sum over its five edges: within 1e-12 m^2."""
    turn = 2 * np.pi * np.arange(5) / 5
    corners = np.stack([np.cos(turn), 0.4 * np.sin(turn), 0 * turn], axis=1)
    fan = corners[[[0, k, k + 1] for k in (1, 2, 3)]]
    area = np.linalg.norm(np.cross(fan[:, 1] - fan[:, 0], fan[:, 2] - fan[:, 0]), axis=1) / 2
    expected = np.sum(area * [mean_phasor(*corner) for corner in fan @ np.array(wave)])
    assert expected == pytest.approx(gordon(corners, np.array(wave)), abs=1e-12)


def test_a_plate_in_the_far_field_flashes_as_its_area_over_the_wavelength():
    """Target strength 20 log(A / wavelength) at normal incidence, exactly; a quarter turn ahead of the ways' phase."""
    down = towards(np.pi / 2)
    echo = sent_back(plate(0.6, 0.4), down, down, 2 * np.pi / 0.015)
    assert echo == pytest.approx(1j * 0.24 / 0.015, rel=1e-12)
    assert sent_back(plate(0.6, 0.4), down, down, 2 * np.pi / 0.015, -0.5) == pytest.approx(-0.5 * echo)


@pytest.mark.parametrize("off_deg", [0.3, 1.1, 2.0, 7.0, 31.0])
def test_off_normal_a_plate_falls_as_a_sinc(off_deg):
    """Monostatic: (A / wavelength) cos(off) sinc(2 width sin(off) / wavelength), the textbook's pattern."""
    off, wavelength = np.radians(off_deg), 0.015
    way = towards(np.pi / 2 - off)
    expected = 0.24 / wavelength * np.cos(off) * np.sinc(2 * 0.6 * np.sin(off) / wavelength)
    assert sent_back(plate(0.6, 0.4), way, way, 2 * np.pi / wavelength) == pytest.approx(1j * expected, abs=1e-10)


def test_swapping_source_and_receiver_changes_nothing():
    """Reciprocity in any two directions; and nothing comes from behind."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        out, back = (towards(*rng.uniform((0.05, -3), (1.5, 3))) for _ in range(2))
        there, again = (sent_back(plate(1.0, 0.3), *ways, 400.0) for ways in ((out, back), (back, out)))
        assert there == pytest.approx(again, rel=1e-12)
        assert sent_back(plate(1.0, 0.3), out, -back, 400.0) == 0


def test_a_wide_plate_is_an_image_source():
    """Facets of a wide plate, each with its own spherical ways, give 1 / (2 distance) with the image's phase.

    A plate of 8 x 8 m faded out towards its edges, 20 m away, wavelength 0.1 m: within 1 %.
    """
    distance, k, side, steps = 20.0, 2 * np.pi / 0.1, 8.0, 160
    grid = (np.arange(steps) + 0.5) / steps * side - side / 2
    middle = np.stack([*np.meshgrid(grid, grid), np.zeros((steps, steps))], -1).reshape(-1, 3)
    half = plate(side / steps, side / steps)
    total = 0.0
    for corners in half:
        place = middle + corners.mean(axis=0)
        ray = place - np.array([0, 0, -distance])
        length = np.linalg.norm(ray, axis=1)
        way = (ray / length[:, None])[None]
        shape = np.broadcast_to(corners - corners.mean(axis=0), (len(place), 3, 3)).copy()
        up, curved = np.tile(UP, (len(place), 1)), length[None]
        echo = KirchhoffFacet().echoes(shape, up, way, way, curved, curved, np.full(len(place), k))[0]
        fade = np.prod((1 - (2 * place[:, :2] / side) ** 8) ** 2, axis=1)
        total += np.sum(fade * echo * np.exp(-2j * k * length) / length**2)
    assert total == pytest.approx(np.exp(-2j * k * distance) / (2 * distance), abs=0.01 / (2 * distance))
