"""Bounding cylinders of targets: no point that a shadow reaches is left out."""

import numpy as np
import pytest

from insonify.propagation import knife_edge, solid_shadows
from insonify.propagation.bounding_cylinders import bounding_cylinders, edge_clearance, points_near_cylinders
from insonify.propagation.image_sources import image_legs
from insonify.propagation.knife_edge import diffract_at_edges
from insonify.propagation.knife_edge_kernel import edge_fresnel_number
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

SONAR = np.array([1.0, -2.0, 12.0])
TARGETS = (
    {"shape": "box", "position": (20, 30), "size": (4, 2, 1), "heading": 0.5},
    {"shape": "sphere", "position": (-15, 40), "diameter": 2},
    {"shape": "cylinder", "position": (5, 8), "length": 3, "diameter": 1},
)


@pytest.mark.parametrize("number", [1.0, 6.0, 12.0, 30.0])
def test_an_edge_so_far_off_has_at_least_its_fresnel_number(number: float) -> None:
    """Any edge along legs of 1 to 300 m, 100 kHz: 2000 drawn places, and the two ends."""
    rng, wave = np.random.default_rng(3), 0.015
    for length in (1.0, 30.0, 300.0):
        off = edge_clearance(length, wave, number)
        for behind in (0.0, length, *(length * rng.random(2000))):
            assert edge_fresnel_number(off, behind, length, wave) >= number


@pytest.mark.parametrize("families", [("D", "S"), ("D",)], ids="-".join)
@pytest.mark.parametrize("highest", [20.0, 5.0], ids=["seabed", "water"])
def test_shadows_are_the_same_if_every_point_is_looked_at(
    families: tuple[str, ...], highest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """4000 places, one below the sonar: statuses, and pressures diffracted around each, to the last bit."""
    rng = np.random.default_rng(5)
    place = np.append(rng.uniform(-90, 90, (4000, 2)), rng.uniform(highest, 20.0, (4000, 1)), axis=1)
    place[0] = *SONAR[:2], 20.0
    up = np.tile([0.0, 0.0, -1.0], (4000, 1))
    points = Scatterers("seabed", "seabed", None, place, up, np.ones(4000), np.ones(4000, complex), np.arange(4000))
    scene = Scene(seabed={"depth": 20.0}, targets=TARGETS)

    def received() -> Legs:
        return diffract_at_edges(image_legs(scene, SONAR, points, families, 1e5), points, SONAR, scene, 0.015)

    assert 0 not in np.concatenate(points_near_cylinders(scene, SONAR, place, 5.0))
    from_above, direct = (points_near_cylinders(scene, SONAR, place, direct=direct) for direct in (False, True))
    assert all(set(few) < set(many) for few, many in zip(direct, from_above, strict=True))
    quick = received()

    def all_points(_: Scene, __: object, points: np.ndarray, *___: object, targets: slice = slice(None),
                   direct: bool = True) -> list[np.ndarray]:  # fmt: skip
        """Every point for every one of some targets."""
        return [np.arange(len(points))] * len(TARGETS[targets])

    for module in (knife_edge, solid_shadows):
        monkeypatch.setattr(module, "points_near_cylinders", all_points)
    slow = received()
    assert 300 < np.count_nonzero(np.any(quick.visibility != 1, axis=0)) < 3000
    for name in ("visibility", "status", "occluder"):
        np.testing.assert_array_equal(getattr(quick, name), getattr(slow, name))


def test_a_rim_holds_all_of_its_target() -> None:
    """A sphere of 2 m, half a metre into the bed or not: radius as its box seen from above, top and base as it lies."""
    north, east, radius, top, base = bounding_cylinders(Scene(seabed={"depth": 20.0}, targets=(TARGETS[1],)))[0]
    assert (north, east) == pytest.approx((-15, 40), abs=1e-9)
    assert 1.0 <= radius <= np.sqrt(2) + 1e-9
    assert (top, base) == pytest.approx((18, 20), abs=1e-6)
