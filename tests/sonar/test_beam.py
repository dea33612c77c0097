"""Claims about beams: tables against direct sums over the aperture, and the textbook's numbers."""

from time import process_time

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import roots_legendre

from insonify.frames import array_axes, mounting_rotation, pose_rotation
from insonify.sonar import LineArray, PlanarArray, PointTransducer, beams, grating_lobes
from insonify.sonar.aperture import element_positions, pattern, shading_weight

FREQUENCY, SPEED = 100e3, 1500.0
WAVELENGTH = SPEED / FREQUENCY
NODES = roots_legendre(400)
SHADINGS = ["uniform", "cosine", "hann", "hamming", "taylor"]


def directions(count: int, seed: int = 1) -> np.ndarray:
    """Unit vectors all over the sphere."""
    vector = np.random.default_rng(seed).normal(size=(count, 3))
    return vector / np.linalg.norm(vector, axis=1)[:, None]


def in_plane(azimuth) -> np.ndarray:
    """Unit vectors in the plane of boresight and right."""
    azimuth = np.asarray(azimuth, dtype=float)
    return np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)


def aperture_sum(cosine, axis, extent, elements, shading) -> np.ndarray:
    """Sound summed over an aperture steered by phase: one term per element, or 400 Gauss nodes if continuous."""
    if elements is None:
        node, weight = NODES
        place, weight = node / 2, weight * shading_weight(shading, node / 2)
    else:
        place = element_positions(elements)
        weight = shading_weight(shading, place)
    phase = 2j * np.pi * extent / WAVELENGTH * np.outer(cosine - axis, place)
    return (np.exp(phase) @ weight / weight.sum()).real


@pytest.mark.parametrize("elements", [None, 1, 2, 7, 64])
@pytest.mark.parametrize("shading", SHADINGS)
def test_a_line_array_is_the_sum_over_its_aperture(elements, shading):
    """Steered, shaded, continuous or discrete: tables within 1e-7 of the direct sum, in all directions."""
    array = LineArray(length=0.4, elements=elements, shading=shading, element="omni", steer=["-50 deg", 0, 0.3])
    d = directions(300)
    gain = beams(array, FREQUENCY, SPEED).gain(d)
    for row, steer in zip(gain, array.steer, strict=True):
        expected = aperture_sum(d[:, 1], np.sin(steer), 0.4, elements, shading)
        np.testing.assert_allclose(row, expected, atol=1e-7)


def test_a_planar_array_is_the_product_of_its_sides():
    """Width and height, each with its own elements, shading and steer."""
    array = PlanarArray(
        width=0.4, height=0.1, columns=40, rows=None, shading="hamming", shading_down="cosine", element="omni",
        steer="20 deg", steer_down="35 deg",
    )  # fmt: skip
    d = directions(300)
    right, down = np.radians([20, 35])
    across = aperture_sum(d[:, 1], np.cos(down) * np.sin(right), 0.4, 40, "hamming")
    below = aperture_sum(d[:, 2], np.sin(down), 0.1, None, "cosine")
    np.testing.assert_allclose(beams(array, FREQUENCY, SPEED).gain(d)[0], across * below, atol=2e-7)


def test_tables_hold_at_a_thousand_wavelengths():
    """Even for 15 m at 100 kHz the gain stays within 1e-7 of sinc."""
    u = np.random.default_rng(2).uniform(-1, 1, 2000)
    gain = beams(LineArray(length=15, element="omni"), FREQUENCY, SPEED).gain(in_plane(np.arcsin(u)))[0]
    np.testing.assert_allclose(gain, np.sinc(15 / WAVELENGTH * u), atol=1e-7)


@pytest.mark.parametrize("element", ["omni", "baffled", "cosine", "piston"])
def test_every_beam_is_one_on_its_steered_axis(element):
    """Unit gain on axis, for each steer angle and any element, wherever the platform looks."""
    steer = np.radians([-60, -10, 0, 45])
    array = PlanarArray(
        width=0.3, height=0.05, columns=50, rows=8, element=element, steer=tuple(steer), steer_down="-12 deg"
    )
    axes = array_axes(pose_rotation(0.7, 0.05, -0.1), mounting_rotation(1.2, 0.3))
    down = np.radians(-12)
    own = np.stack([np.cos(down) * np.cos(steer), np.cos(down) * np.sin(steer), np.full(4, np.sin(down))], axis=-1)
    gain = beams(array, FREQUENCY, SPEED, axes).gain(own @ axes)
    np.testing.assert_allclose(np.diag(gain), 1, atol=1e-12)


def test_turning_sonar_and_world_together_changes_nothing():
    """A direction and the array's axes, rotated by the same rotation, meet the same gain."""
    array, d = LineArray(length=1.5, steer="10 deg"), directions(200)
    turn = pose_rotation(1.1, -0.4, 0.3)
    own = beams(array, FREQUENCY, SPEED)
    np.testing.assert_allclose(own.rotated(turn.T).gain(d @ turn.T), own.gain(d), atol=1e-9)


def test_steer_is_to_the_right_of_boresight():
    """A starboard array steered +90 / 3 deg looks 30 deg aft of the beam: to the right is towards the stern."""
    axes = array_axes(pose_rotation(0.0), mounting_rotation(np.pi / 2))
    beam = beams(LineArray(length=1.5, steer="30 deg"), FREQUENCY, SPEED, axes)
    aft_of_starboard = [-np.sin(np.radians(30)), np.cos(np.radians(30)), 0]
    assert beam.gain(aft_of_starboard)[0] == pytest.approx(1)
    assert abs(beam.gain([0.5, np.sqrt(0.75), 0])[0]) < 0.02


def test_a_line_array_receives_all_elevations_alike():
    """Omnidirectional in the vertical: only the sine to the right matters."""
    elevation = np.linspace(-1.5, 1.5, 31)
    d = np.stack([np.cos(elevation), np.zeros(31), np.sin(elevation)], axis=-1)
    np.testing.assert_allclose(beams(LineArray(length=1.5), FREQUENCY, SPEED).gain(d), 1, atol=1e-12)


def test_elements_decide_what_is_behind():
    """Omni receives behind the array, a baffle does not, a cosine fades to the side."""
    d = np.array([[1, 0, 0], [-1, 0, 0], [0.6, 0, 0.8], [-0.02, 0, np.sqrt(1 - 4e-4)]])
    expected = {"omni": [1, 1, 1, 1], "baffled": [1, 0, 1, 0], "cosine": [1, 0, 0.6, 0]}
    for element, gain in expected.items():
        for array in (LineArray(length=1.0, element=element), PointTransducer(element=element)):
            np.testing.assert_allclose(beams(array, FREQUENCY, SPEED).gain(d)[0], gain, atol=1e-12)


def test_piston_elements_that_touch_make_a_continuous_aperture():
    """N abutting pistons of one pitch, unsteered, are one line: the product of their patterns is its sinc."""
    d = directions(300)
    d[:, 0] = np.abs(d[:, 0])
    discrete = beams(LineArray(length=0.6, elements=20, element="piston"), FREQUENCY, SPEED).gain(d)
    np.testing.assert_allclose(discrete[0], np.sinc(0.6 / WAVELENGTH * d[:, 1]), atol=2e-7)


def test_first_side_lobe_and_width_of_a_uniform_line():
    """First side lobe -13.26 dB, one-way -3 dB width 0.886 wavelength / length (Urick 1983, ch. 3)."""
    beam = beams(LineArray(length=1.5), FREQUENCY, SPEED)
    u = np.linspace(1, 2, 20_001) * WAVELENGTH / 1.5
    lobe = np.abs(beam.gain(in_plane(np.arcsin(u)))[0]).max()
    assert 20 * np.log10(lobe) == pytest.approx(-13.26, abs=5e-3)
    half = brentq(lambda x: beam.gain(in_plane(x))[0] ** 2 - 0.5, 0, 0.01)
    assert 2 * half == pytest.approx(0.886 * WAVELENGTH / 1.5, rel=1e-3)


@pytest.mark.parametrize(
    ("shading", "highest_db", "tolerance"),
    [("cosine", -23.0, 0.1), ("hann", -31.5, 0.1), ("hamming", -42.7, 0.5), ("taylor", -30.0, 0.6)],
)
def test_highest_side_lobe_of_each_shading(shading, highest_db, tolerance):
    """Harris (1978), table 1: -23, -32 (continuous -31.5), -43 dB; Taylor's design level -30 dB."""
    x = np.linspace(0, 30, 60_001)
    level = np.abs(pattern(x, shading)[0])
    first_null = int(np.argmax(np.diff(level) > 0))
    assert 20 * np.log10(level[first_null:].max()) == pytest.approx(highest_db, abs=tolerance)


@pytest.mark.parametrize("elements", [None, 12])
@pytest.mark.parametrize("shading", SHADINGS)
def test_the_slope_is_the_derivative(shading, elements):
    """The slope that feeds the tables, against a central difference."""
    x, step = np.linspace(-5, 5, 101), 1e-5
    ahead, behind = pattern(x + step, shading, elements)[0], pattern(x - step, shading, elements)[0]
    np.testing.assert_allclose(pattern(x, shading, elements)[1], (ahead - behind) / (2 * step), atol=1e-8)


ARRAYS = [
    LineArray(length=1.5, steer=(0.0, 0.2)),
    LineArray(length=0.3, elements=10, steer="25 deg", element="omni", shading="hann"),
    LineArray(length=0.6, elements=20, element="piston", steer=(0.1, -0.1)),
    PlanarArray(width=0.3, height=0.1, columns=30, rows=5, steer=(0, 0.5), steer_down=0.4, element="cosine"),
    PointTransducer(element="cosine"),
]


@pytest.mark.parametrize("array", ARRAYS)
@pytest.mark.parametrize("margin", [0.0, 1e-3, 0.03, 0.4, 2.0])
def test_no_beam_is_stronger_than_its_bound(array, margin):
    """In 20 directions drawn within the margin of each of 400: never above the bound; grating lobes included."""
    beam = beams(array, FREQUENCY, SPEED)
    centre = directions(400, seed=5)
    bound = beam.bound(centre, margin)
    aside = directions(400 * 20, seed=6).reshape(20, 400, 3)
    aside = aside - np.sum(aside * centre, axis=-1)[..., None] * centre
    aside /= np.linalg.norm(aside, axis=-1)[..., None]
    away = margin * np.random.default_rng(7).uniform(size=(20, 400, 1))
    near = np.cos(away) * centre + np.sin(away) * aside
    strongest = np.abs(beam.gain(near)).max(axis=(0, 1))
    assert np.all(strongest <= bound + 1e-12)


def test_the_bound_is_worth_having():
    """Far from a 1.5 m beam it falls like the side lobes' envelope, and it is one on the axis."""
    beam = beams(LineArray(length=1.5), FREQUENCY, SPEED)
    x = 1.5 / WAVELENGTH * 0.5
    assert beam.bound([1.0, 0, 0], 0.0) == pytest.approx(1, abs=1e-3)
    assert beam.bound(in_plane(np.radians(30)), 1e-4) < 1.1 / (np.pi * x)


def test_grating_lobes_stand_where_the_array_factor_repeats():
    """Half-wavelength elements have none at any steer; at 2 wavelengths they stand every 0.5 in sine."""
    close = LineArray(length=40 * WAVELENGTH / 2, elements=40, steer="60 deg")
    assert len(grating_lobes(close, FREQUENCY, SPEED)) == 0
    sparse = LineArray(length=40 * WAVELENGTH, elements=20, steer=float(np.arcsin(0.1)))
    lobes = grating_lobes(sparse, FREQUENCY, SPEED)
    np.testing.assert_allclose(np.sort(lobes[:, 0]), [-0.9, -0.4, 0.6], atol=1e-12)
    gain = beams(sparse, FREQUENCY, SPEED).gain(in_plane(np.arcsin(lobes[:, 0])))
    np.testing.assert_allclose(np.abs(gain), 1, atol=1e-6)


def test_pistons_silence_the_grating_lobes_of_an_unsteered_array():
    """The nulls of an element one pitch wide fall on the replicas; a continuous aperture has none at all."""
    touching = LineArray(length=40 * WAVELENGTH, elements=20, element="piston")
    assert len(grating_lobes(touching, FREQUENCY, SPEED)) == 0
    assert len(grating_lobes(LineArray(length=3), FREQUENCY, SPEED)) == 0
    steered = touching.steered(((0.1, 0.0),))
    assert len(grating_lobes(steered, FREQUENCY, SPEED)) > 0


def test_a_planar_array_repeats_both_ways():
    """Elements two wavelengths apart down, a third across: replicas only above and below, to the very edge."""
    panel = PlanarArray(width=0.3, height=0.12, columns=60, rows=4, element="omni")
    np.testing.assert_allclose(np.sort(grating_lobes(panel, FREQUENCY, SPEED)[:, 1]), [-1, -0.5, 0.5, 1], atol=1e-12)


@pytest.mark.parametrize(
    "array",
    [
        PlanarArray(width=80.0, height=0.03, columns=10_000, rows=1, element="piston"),
        LineArray(length=0.5, elements=100, steer=tuple(np.linspace(-1.0, 1.0, 2048))),
    ],
    ids=["elements", "beams"],
)
def test_large_arrays_are_tabulated_in_proportion_to_their_lobes(array):
    """10,000 elements of 8000 wavelengths, or 2048 beams: a second, neither a sum over elements nor pairs of beams."""
    start = process_time()
    beams(array, 150e3, 1500.0)
    grating_lobes(array, 150e3, 1500.0)
    assert process_time() - start < 3


def test_the_bound_of_a_thousand_beams_costs_as_much_as_that_of_some():
    """1001 beams in order of their angles: less than 30 times the time of one; in any order the same bits."""
    steer = tuple(np.linspace(-1.0, 1.0, 1001))
    centre, seconds = directions(20_000, seed=9), []
    many, one = (beams(PlanarArray(width=0.5, height=0.05, steer=some), FREQUENCY, SPEED) for some in (steer, 0.1))
    for beam in (many, one):
        beam.bound(centre[:1], 0.01)
        times = []
        for _ in range(3):
            start = process_time()
            beam.bound(centre, 0.01)
            times.append(process_time() - start)
        seconds.append(min(times))
    assert seconds[0] < 30 * seconds[1]
    shuffled = tuple(np.random.default_rng(8).permutation(steer))
    any_order = beams(PlanarArray(width=0.5, height=0.05, steer=shuffled), FREQUENCY, SPEED)
    np.testing.assert_array_equal(any_order.bound(centre, 0.01), many.bound(centre, 0.01))


def test_a_beam_cannot_be_steered_where_its_elements_are_insensitive():
    """A piston two wavelengths wide has its null at 30 deg: unit gain there has no meaning."""
    array = LineArray(length=40 * WAVELENGTH, elements=20, element="piston", steer="30 deg")
    with pytest.raises(ValueError, match="Steer closer to boresight"):
        beams(array, FREQUENCY, SPEED)
