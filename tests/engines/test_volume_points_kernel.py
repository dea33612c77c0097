"""Claims about even points of the water: gains at points, and which points are kept with what volume."""

import numpy as np
import pytest

from insonify.engines import _volume_points_kernel as kernel
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.volume import VolumeScatterers
from insonify.simulator import build_simulator
from oracles.scenes import nominal

DEPTH, BOTTOM = 11.0, 20.0
PLANAR = {"kind": "planar", "length": None, "width": 0.3, "height": 0.1}


def scene(families, **changes):
    """Scattering water about a sonar whose transmitter and receiver differ and stand apart."""
    longest = max(map(len, families)) if families != ("D",) else 0
    return nominal(
        field="incoherent", water={"volume_strength_db": -70}, track={"window": (0.0, 0.04)},
        transmit=PLANAR, receive={**PLANAR, "width": 0.4, "offset": (0.5, 0.0, 0.3)},
        paths={"max_reflections": longest, "families": families},
        sonar={"mounting": {"bearing": "90 deg", "tilt": "15 deg"}}, **changes,
    )  # fmt: skip


def suspended(scenario):
    """The water's scatterers of the first ping."""
    simulator = build_simulator(scenario)
    side = simulator.ping_geometry(0)
    seen = ping_scatterers(scenario.scene, scenario.paths, 1, side, simulator.engine.rays, quadrature=True)
    return VolumeScatterers(scenario.scene, scenario.paths, 1, side, seen.resolution)


def gain_by_images(geometry, families, position):
    """Largest product over families of the magnitudes of both beams towards the image of each point, (n,)."""
    gains = []
    for name in families:
        product = np.ones(len(position))
        for end, beams in (
            (geometry.transmit_position, geometry.transmit_beams), (geometry.receive_position, geometry.receive_beams),
        ):  # fmt: skip
            # unfold the path: mirror the point in the boundaries, from the sonar outwards
            depth, mirrors = position[:, 2].copy(), {"S": 0.0, "B": BOTTOM}
            for letter in reversed(name if name != "D" else ""):
                depth = 2 * mirrors[letter] - depth
            ray = np.column_stack([position[:, :2] - end[:2], depth - end[2]])
            product *= np.abs(beams.gain(ray / np.linalg.norm(ray, axis=1)[:, None])).max(axis=0)
        gains.append(product)
    return np.max(gains, axis=0)


@pytest.mark.parametrize("families", [("D",), ("D", "S"), ("B", "SB"), ("D", "S", "BS")])
def test_gains_at_points_are_those_of_the_images(families):
    """Never less than the largest gain by any family, and at most 20 % more in half of the main lobe."""
    water = suspended(scene(families))
    rng = np.random.default_rng(2)
    position = rng.uniform([-15, -5, 0.5], [15, 28, BOTTOM - 0.5], (100_000, 3))
    geometry = water.ping_geometry
    beams = geometry.transmit_beams.kernel_majorants, geometry.bounding_receive_beams.kernel_majorants
    found = np.empty(len(position))
    kernel.two_way_gains(position, water._straight_paths, *beams, found)
    exact = gain_by_images(geometry, families, position)
    assert np.all(found >= exact - 1e-12)
    main = exact > 0.3 * exact.max()
    assert main.sum() > 10
    assert np.median(found[main] / exact[main]) < 1.2


def test_relief_widens_the_gain_of_bottom_bounces_alone():
    """With ripples of 0.4 m, gains by B are as large or larger than without, those by S are the same."""
    rng = np.random.default_rng(2)
    position = rng.uniform([-15, -5, 0.5], [15, 28, BOTTOM - 0.5], (500, 3))
    relief = {"relief": {"kind": "ripples", "wavelength": 3.0, "height": 0.4}}
    for name, wider in (("S", False), ("B", True)):
        gains = []
        for seabed in ({}, relief):
            water = suspended(scene((name,), seabed=seabed))
            geometry, found = water.ping_geometry, np.empty(len(position))
            beams = geometry.transmit_beams.kernel_majorants, geometry.bounding_receive_beams.kernel_majorants
            kernel.two_way_gains(position, water._straight_paths, *beams, found)
            gains.append(found)
        assert np.all(gains[1] >= gains[0])
        assert np.any(gains[1] > 1.01 * gains[0]) == wider


def test_points_kept_stand_for_all_points():
    """In each of eight ranges the volume times any smooth function is that of all points: to 4 %, by few of them."""
    sums, counts = [], []
    for chosen in (True, False):
        scenario = scene(("D",))
        water = suspended(scenario.with_({"paths.importance_sampling": chosen}))
        position, volume, number = water._tile_points(*water._tiles())
        assert len(np.unique(number)) == len(number)
        slant = np.linalg.norm(position - water.ping_geometry.transmit_position, axis=1)
        weight = volume * (2 + np.sin(position @ [0.3, 0.2, 0.4]))
        sums.append(np.histogram(slant, np.linspace(4, 28, 9), weights=weight)[0])
        counts.append(len(position))
    np.testing.assert_allclose(sums[0], sums[1], rtol=0.04)
    assert counts[0] < 0.35 * counts[1]
