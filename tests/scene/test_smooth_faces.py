"""Smooth faces as triangles and as patches: what is in the water, and how finely it is split."""

from collections import Counter

import numpy as np
import pytest

from insonify.engines.facet_subdivision import split_triangles
from insonify.engines.patch_subdivision import (
    TargetInsonification,
    clip_to_water,
    initial_patches,
    outward_normals,
    patch_terms,
    subdivide,
)
from insonify.scene.panels import panels
from insonify.scene.seabed import Seabed
from insonify.scene.smooth_faces import clip_at_seabed, smooth_triangles, water_clearance
from insonify.scene.solid import world_triangles
from insonify.scene.target import Box, Cone, Cylinder, Plate, Sphere, TruncatedCone

BED = Seabed(depth=20.0)


def area(corners):
    """Area of each triangle [m^2]."""
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2


@pytest.mark.parametrize("sunk", [0.0, 0.25, 0.9])
def test_what_has_sunk_in_is_cut_off_along_the_ground(sunk):
    """A box of 2 x 1 x 1 m: its top, and of its sides what stands above; the base is never there."""
    box = Box(position=(3.0, 50.0), size=(2.0, 1.0, 1.0), heading=0.4, burial_depth=sunk)
    left = clip_at_seabed(smooth_triangles(box, BED), BED)
    assert area(left).sum() == pytest.approx(2 + 6 * (1 - sunk))
    assert left[:, :, 2].max() <= 20 + 1e-6


def test_a_leaning_body_keeps_its_normals_where_it_is_cut():
    """Normals of a sunk, leaning cylinder's pieces are those of its whole faces, and look outwards."""
    log = Cylinder(position=(0.0, 50.0), length=2.0, diameter=0.6, pitch=0.3, roll=0.2, burial=0.4)
    initial_patches = smooth_triangles(log, BED)
    left = clip_at_seabed(initial_patches, BED)

    def normals(corners):
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return across[area(corners) > 1e-9] / (2 * area(corners)[area(corners) > 1e-9])[:, None]

    assert 0.3 < area(left).sum() / area(initial_patches).sum() < 0.9
    nearest = (normals(left) @ normals(initial_patches).T).max(axis=1)
    np.testing.assert_allclose(nearest, 1, atol=1e-6)


def facing(far, largest=np.inf):
    """A sonar that far west of the origin [m], at 100 kHz, and nothing that beams, pulse or window leave out."""
    image = np.array([[0.0, -far, 0.5]])
    return TargetInsonification((image, image), 2 * np.pi / 0.015, (), 0.04, largest, 0.0, (0.0, np.inf),
                 lambda place, radius: np.ones(len(place), bool))  # fmt: skip


def test_splitting_keeps_the_surface_and_keeps_to_its_limits():
    """A face of 2 x 1 m from 5 m and from 150 m as triangles: the same area; near the sonar, far smaller facets."""
    face = np.array([[[-1.0, 0, 0], [1, 0, 0], [1, 0, 1]], [[-1, 0, 0], [1, 0, 1], [-1, 0, 1]]])
    counts = []
    for far in (150.0, 5.0):
        found, initial_patches = split_triangles(face, facing(far))
        assert initial_patches and area(found).sum() == pytest.approx(2.0)
        sides = np.roll(found, -1, axis=1) - found
        ray = found.mean(axis=1) - [0.0, -far, 0.5]
        assert np.abs(np.einsum("tsk,tk->ts", sides, ray / np.linalg.norm(ray, axis=1)[:, None])).max() <= 0.04
        counts.append(len(found))
        ends = np.round(np.stack([found, np.roll(found, -1, axis=1)], axis=2), 9).reshape(-1, 2, 3).tolist()
        neighbours = Counter(frozenset(map(tuple, side)) for side in ends)
        assert max(neighbours.values()) == 2
        assert sum(np.ptp(list(side), axis=0).sum() for side, count in neighbours.items() if count == 1) == (
            pytest.approx(6.0)  # no corner of a facet lies within a side of another
        )
    assert counts[1] > 20 * counts[0]


@pytest.mark.parametrize("far", [1.0, 30.0])
def test_patches_cover_the_lit_half_of_a_sphere_and_no_more_than_needed(far):
    """Area of patches that face the sonar: that of the visible cap, within 3 %; at any distance a few thousand."""
    ball = Sphere(position=(0.0, 0.0), diameter=0.5, base_depth=0.75)
    (panel,) = panels(ball, BED, np.array([0.0, -far, 0.5]))
    found, complete = subdivide(panel, facing(far))
    d, _, size = patch_terms(panel, found)
    ray = np.array([0.0, -far, 0.5]) - d.position
    lit = np.einsum("nk,nk->n", ray, outward_normals(d)) > 0
    assert complete and len(size) < 4000
    assert size[lit].sum() == pytest.approx(2 * np.pi * 0.25**2 * (1 - 0.25 / far), rel=0.03)


@pytest.mark.parametrize("body", [
    Sphere(position=(0.0, 50.0), diameter=0.6), Cylinder(position=(1.0, 50.0), length=2.0, diameter=0.6, heading=0.3),
    Cone(position=(1.0, 50.0), height=1.0, diameter=0.6, pitch=0.2), Box(position=(1.0, 50.0), size=(1.0, 2.0, 0.5)),
    TruncatedCone(position=(1.0, 50.0), height=1.0, diameter=0.6, top_diameter=0.2, roll=0.3),
    Plate(position=(1.0, 50.0), length=1.0, width=0.5, thickness=0.02, roll=1.0),
])  # fmt: skip
def test_panels_are_the_surface_that_casts_the_shadow(body):
    """Every panel's middle lies on the triangles' surface, its normal looks outwards, and all areas add up to 0.2 %."""
    surface = world_triangles(body, BED)
    centre, total = (surface.low + surface.high) / 2, 0.0
    for panel in panels(body, BED, np.zeros(3)):
        pieces = initial_patches(panel)
        for _ in range(4):
            pieces = pieces.halved(np.ones(len(pieces.s), bool)).halved(np.zeros(2 * len(pieces.s), bool))
        d, _, size = patch_terms(panel, pieces)
        total += size.sum()
        assert (np.einsum("nk,nk->n", d.position - centre, outward_normals(d)) > 0).all()
        assert (d.position > surface.low - 1e-3).all() and (d.position < surface.high + 1e-3).all()
    assert total == pytest.approx(surface.area.sum(), rel=2e-3)


@pytest.mark.parametrize(("sunk", "lean"), [(0.3, 0.0), (0.3, 0.4), (0.05, -0.2)])
def test_patches_of_a_sunken_body_end_at_the_bed(sunk, lean):
    """Area above the bed of a cylinder, patch by patch, against its triangles cut by the bed: within 1 %."""
    log = Cylinder(position=(0.0, 50.0), length=2.0, diameter=0.6, burial_depth=sunk, pitch=lean)
    total = 0.0
    for panel in panels(log, BED, np.zeros(3)):
        pieces = initial_patches(panel)
        for _ in range(2):
            pieces = pieces.halved(np.ones(len(pieces.s), bool)).halved(np.zeros(2 * len(pieces.s), bool))
        kept = clip_to_water(panel, pieces, water_clearance(BED), 0.01)
        d, _, size = patch_terms(panel, kept)
        total += size.sum()
        assert d.position[:, 2].max() < 20.0
    assert total == pytest.approx(area(clip_at_seabed(smooth_triangles(log, BED), BED)).sum(), rel=0.01)
