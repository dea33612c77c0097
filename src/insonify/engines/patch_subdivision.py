"""Panels of smooth bodies as patches: halved until third-order phases, beams and pulses no longer matter on each.

A patch scatters in closed form for the directions at its middle, see `insonify.scattering.kirchhoff_patch`. Patches
without line of sight to any image of the sonar, outside the window, or below the beam cutoff are dropped while they are
still large; so the number of patches follows from one ping's reach, not from the size of the body.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.scene.panels import Panel, PanelDerivatives

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

MAX_CUBIC_PHASE = 0.01
"""Largest phase of third or fourth order over a patch that is neglected [rad]."""
MAX_NORMAL_TURN = 0.07
"""Largest angle between the normals in the middle of a patch and at its edge [rad]."""
SHALLOW = 0.1
"""Extent along a ray, re the largest permitted, up to which a patch has one delay [1]."""
MAX_MIXED_PHASE = 0.8
"""Largest mixed phase of second order, whose exponential is expanded to second order [rad]."""
TOUCHING = 1e-6
"""Height above the seabed, or depth below the surface, at which a face touches it [m]."""
MAX_PATCHES = 300_000
"""Largest number of patches of one target [1]."""


class Lobe(NamedTuple):
    """Narrowest two-way main lobe along one axis of an array."""

    axis: Floats
    """Unit vector in the world, shape (3,)."""
    width: float
    """Largest difference of direction cosines that a patch may span [1]."""


@dataclass(frozen=True, eq=False)
class TargetInsonification:
    """Images of the sonar, main lobes and window of one ping for one target; limits the size of its patches."""

    images: tuple[Floats, Floats]
    """Positions of the images of transmitter and receiver [m], shapes (f, 3)."""
    wavenumber: float
    """Largest wavenumber in the water [rad/m]."""
    lobes: tuple[Lobe, ...]
    max_range_extent: float
    """Largest extent of a patch along a ray [m]."""
    max_side: float
    """Largest side of a patch [m]."""
    max_deviation: float
    """Sine of the largest angle between rays and the straight lines from the images [1]."""
    path_length_limits: tuple[float, float]
    """Shortest and longest path from transmitter to receiver that is received [m]."""
    may_receive: Callable[[Floats, Floats], Mask]
    """Function of centres (n, 3) and radii (n,) of spheres [m]: True where the gain may reach the beam cutoff."""
    face_images: tuple[Floats, Floats] = (np.zeros((0, 3)), np.zeros((0, 3)))
    """Positions of the images of both ends in faces, which light points only, not patches [m], shapes (k, 3)."""

    @property
    def point_images(self) -> tuple[Floats, Floats]:
        """All images of transmitter and receiver that light points [m], shapes (f + k, 3)."""
        sent, received = self.face_images
        return np.concatenate([self.images[0], sent]), np.concatenate([self.images[1], received])

    def reaches(self, middle: Floats, radius: Floats) -> Mask:
        """True for spheres within the window and the beam cutoff, shape (n,).

        Args:
            middle: Centres of the spheres [m], shape (n, 3).
            radius: Their radii [m], shape (n,).
        """
        shortest, longest = np.zeros((2, len(middle)))
        for images in self.point_images:
            length = np.linalg.norm(middle - images[:, None], axis=2)
            shortest += np.maximum(length.min(axis=0) - radius, 0)
            longest += length.max(axis=0) + radius
        reached = (shortest <= self.path_length_limits[1]) & (longest >= self.path_length_limits[0])
        rows = np.flatnonzero(reached)
        reached[rows] = self.may_receive(middle[rows], radius[rows])
        return np.asarray(reached)


class Patches(NamedTuple):
    """Pieces of a panel, n of them: rectangles of its parameters s and t, each column of shape (n,)."""

    s: Floats
    """Parameter s in the middle."""
    t: Floats
    """Parameter t in the middle."""
    half_s: Floats
    """Half extent in s."""
    half_t: Floats
    """Half extent in t."""

    def take(self, rows: Mask | NDArray[np.int64]) -> "Patches":
        """The patches of some rows."""
        return Patches(*(column[rows] for column in self))

    def halved(self, along_s: Mask) -> "Patches":
        """Two patches for each: halved along s where `along_s` is True, else along t."""
        half_s = np.where(along_s, self.half_s / 2, self.half_s)
        half_t = np.where(along_s, self.half_t, self.half_t / 2)
        step_s, step_t = np.where(along_s, half_s, 0), np.where(along_s, 0, half_t)
        parts = [(self.s + side * step_s, self.t + side * step_t, half_s, half_t) for side in (-1, 1)]
        return concatenate_patches([Patches(*part) for part in parts])


def concatenate_patches(parts: list[Patches]) -> Patches:
    """Patches of several parts, one after the other."""
    if not parts:
        return Patches(*np.empty((4, 0)))
    return Patches(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def initial_patches(panel: Panel) -> Patches:
    """The few large patches that a panel begins with."""
    rows, columns, span_s, span_t = panel.first_division
    half_s, half_t = span_s / rows / 2, span_t / columns / 2
    s, t = (axis.ravel().astype(float) for axis in np.indices((rows, columns)))
    zeros = np.zeros(s.size)
    return Patches((2 * s + 1) * half_s, (2 * t + 1) * half_t, zeros + half_s, zeros + half_t)


def subdivide(panel: Panel, insonification: TargetInsonification) -> tuple[Patches, bool]:
    """Patches of a panel that one ping may receive, small enough for their closed form.

    Returns:
        The patches; True if all are small enough.
    """
    done: list[Patches] = []
    patch_count, open_ones = 0, initial_patches(panel)
    while len(open_ones.s):
        small, large, longer = by_size(panel, open_ones, insonification)
        done.append(small)
        patch_count += len(small.s)
        if patch_count + 2 * len(large.s) > MAX_PATCHES:
            return concatenate_patches([*done, large]), False
        open_ones = large.halved(longer)
    return concatenate_patches(done), True


def by_size(panel: Panel, patches: Patches, insonification: TargetInsonification) -> tuple[Patches, Patches, Mask]:
    """Patches that one ping may receive: small ones, large ones, and True where a large one is to be halved along s."""
    d = panel.at(patches.s, patches.t)
    is_receivable = _receivable(d, patches, insonification)
    patches = patches.take(is_receivable)
    along_s, along_t = _sizes(PanelDerivatives(*(part[is_receivable] for part in d)), patches, insonification)
    small = np.maximum(along_s, along_t) <= 1
    return patches.take(small), patches.take(~small), (along_s >= along_t)[~small]


def _rays(position: Floats, image: Floats) -> tuple[Floats, Floats]:
    """Directions from an image to positions, (n, 3), and distances [m], (n,)."""
    ray = position - image
    length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
    return ray / length[:, None], length


def _receivable(d: PanelDerivatives, patches: Patches, insonification: TargetInsonification) -> Mask:
    """True for patches that face both ends of the sonar, within window and beam cutoff, shape (n,)."""
    radius = np.linalg.norm(d.s, axis=1) * patches.half_s + np.linalg.norm(d.t, axis=1) * patches.half_t
    radius += np.linalg.norm(d.tt, axis=1) * patches.half_t**2 / 2
    normal = outward_normals(d)
    receivable, shortest, longest = np.ones(len(radius), bool), np.zeros(len(radius)), np.zeros(len(radius))
    # the normal turns over a patch by no more than this
    turn_along_s = np.linalg.norm(d.ss, axis=1) / np.maximum(np.linalg.norm(d.s, axis=1), 1e-300) * patches.half_s
    turn_along_t = np.where(np.linalg.norm(d.tt, axis=1) > 0, patches.half_t, 0.0)
    for images in insonification.images:
        faces_end, min_length, max_length = (
            np.zeros(len(radius), bool), np.full(len(radius), np.inf), np.zeros(len(radius)),
        )  # fmt: skip
        for position in images:
            ray, length = _rays(d.position, position)
            leeway = np.minimum(turn_along_s + turn_along_t + radius / length, np.pi / 2)
            faces_end |= -np.einsum("nk,nk->n", ray, normal) > -np.sin(leeway) - insonification.max_deviation
            min_length, max_length = np.minimum(min_length, length - radius), np.maximum(max_length, length + radius)
        receivable &= faces_end
        shortest += np.maximum(min_length, 0)
        longest += max_length
    receivable &= (shortest <= insonification.path_length_limits[1]) & (longest >= insonification.path_length_limits[0])
    rows = np.flatnonzero(receivable)
    receivable[rows] = insonification.may_receive(d.position[rows], radius[rows])
    return receivable


def outward_normals(d: PanelDerivatives) -> Floats:
    """Unit normals into the water, shape (n, 3)."""
    across = np.cross(d.t, d.s)
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300))


def _sizes(d: PanelDerivatives, patches: Patches, insonification: TargetInsonification) -> tuple[Floats, Floats]:
    """Sizes of patches along s and along t re the largest permitted [1], each of shape (n,)."""
    s, t = patches.half_s[:, None], patches.half_t[:, None]
    side_s, side_t = d.s * s, d.t * t
    length_s, length_t = np.linalg.norm(side_s, axis=1), np.linalg.norm(side_t, axis=1)
    patch_terms = [
        side_s, side_t, d.st * s * t, d.sss * s**3 / 6, d.sst * s**2 * t / 2, d.stt * s * t**2 / 2, d.ttt * t**3 / 6,
    ]  # fmt: skip
    seen, near, near_cubed, lobes = (
        np.zeros((7, len(length_s))), *np.zeros((2, len(length_s))), np.zeros((2, len(length_s))),
    )  # fmt: skip
    twist = np.zeros(len(length_s))
    for images in insonification.images:
        max_along, nearest = np.zeros((7, len(length_s))), np.full(len(length_s), np.inf)
        for position in images:
            ray, length = _rays(d.position, position)
            along = np.stack([np.einsum("nk,nk->n", ray, term) for term in patch_terms])
            max_along, nearest = np.maximum(max_along, np.abs(along)), np.minimum(nearest, length)
            for lobe in insonification.lobes:
                cosine = ray @ lobe.axis
                for row, vector in enumerate((side_s, side_t)):
                    turn = np.abs(vector @ lobe.axis - along[row] * cosine) / length
                    lobes[row] = np.maximum(lobes[row], 2 * turn / lobe.width)
        seen += max_along
        near, near_cubed = near + 1 / nearest**2, near_cubed + 1 / nearest**3
        twist += (np.abs(np.einsum("nk,nk->n", side_s, side_t)) + max_along[0] * max_along[1]) / nearest
    deep = seen[:2].copy()
    seen += insonification.max_deviation * np.stack([np.linalg.norm(term, axis=1) for term in patch_terms])
    k, sizes = insonification.wavenumber, []
    # fourth order: the radius of a round body changes along s to second order
    both = np.linalg.norm(d.sst, axis=1) * (s * t)[:, 0] ** 2 / 2
    mixed = np.maximum((seen[2] + twist) * k / MAX_MIXED_PHASE, 0)
    normal = outward_normals(d)
    for row, (own, cubic, across, half, bend) in enumerate((
        (length_s, seen[3], seen[4], patches.half_s, d.ss), (length_t, seen[6], seen[5], patches.half_t, d.tt),
    )):  # fmt: skip
        wavefront = 0.2 * own**3 * near + own**4 * near_cubed / 8
        quartic, turned = np.linalg.norm(bend, axis=1) * half**4 / 12, seen[2] * half**2 / 6
        turn = np.abs(np.einsum("nk,nk->n", bend, normal)) * half**2 / np.maximum(own, 1e-300)
        phase = k * np.maximum.reduce([cubic, across, quartic, wavefront, both, turned]) / MAX_CUBIC_PHASE
        sizes.append(
            np.maximum.reduce(
                [
                    np.cbrt(phase),
                    lobes[row],
                    deep[row] / insonification.max_range_extent,
                    2 * own / insonification.max_side,
                    turn / MAX_NORMAL_TURN,
                ]
            )
        )
    larger = length_s >= length_t
    along_s, along_t = sizes
    twisted = np.sqrt(mixed)
    return np.where(larger, np.maximum(along_s, twisted), along_s), np.where(
        larger, along_t, np.maximum(along_t, twisted)
    )


def clip_to_water(panel: Panel, patches: Patches, clear: Callable[[Floats], Floats], finest: float) -> Patches:
    """The parts of patches in the water; patches are divided at the boundary, or left out.

    Args:
        panel: What they are patches of.
        patches: The patches.
        clear: Distance of positions (n, 3) from the boundary, positive in the water [m].
        finest: Length to which an oblique cut is resolved [m].
    """
    done: list[Patches] = []
    patch_count = 0
    while len(patches.s):
        clearance = _at_corners(panel, patches, clear)
        reached = ~(clearance.max(axis=0) <= TOUCHING)
        patches, clearance = patches.take(reached), clearance[:, reached]
        free = clearance.min(axis=0) >= -TOUCHING
        d = panel.at(patches.s, patches.t)
        sides = 2 * np.stack(
            [np.linalg.norm(d.s, axis=1) * patches.half_s, np.linalg.norm(d.t, axis=1) * patches.half_t]
        )
        cut, free = _cut(patches, clearance, sides, free, finest)
        tiny = ~free & (sides.max(axis=0) <= finest)
        done += [cut.take(free), cut.take(tiny & (clearance.mean(axis=0) > 0))]
        open_ones = ~(free | tiny)
        patch_count += len(free) - int(open_ones.sum())
        patches = patches.take(open_ones)
        if patch_count + 2 * len(patches.s) > MAX_PATCHES:
            return concatenate_patches([*done, patches.take(clearance[:, open_ones].mean(axis=0) > 0)])
        patches = patches.halved((sides[0] >= sides[1])[open_ones])
    return concatenate_patches(done)


def _at_corners(panel: Panel, patches: Patches, clear: Callable[[Floats], Floats]) -> Floats:
    """Distance of the corners from a boundary [m]: at (-, -), (-, +), (+, -), (+, +) of (s, t), shape (4, n)."""
    offsets = []
    for along, across in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
        d = panel.at(patches.s + along * patches.half_s, patches.t + across * patches.half_t)
        offsets.append(clear(d.position))
    return np.array(offsets).reshape(4, -1)


def _cut(patches: Patches, clearance: Floats, sides: Floats, free: Mask, finest: float) -> tuple[Patches, Mask]:
    """Cut patches that a boundary crosses from edge to edge.

    Args:
        patches: The patches, n of them.
        clearance: Distance of their corners from the boundary, positive in the water [m], (4, n).
        sides: Lengths of their sides along s and t [m], (2, n).
        free: True for patches wholly in the water, (n,).
        finest: Length to which an oblique cut is resolved [m].

    Returns:
        The patches, of which those crossed end at the boundary; True for these and for the free ones, (n,).
    """
    columns, done = [column.copy() for column in patches], free.copy()
    for axis, (low, high) in enumerate((((0, 1), (2, 3)), ((0, 2), (1, 3)))):
        before, after = clearance[list(low)], clearance[list(high)]
        for first, last, sign in ((before, after, 1), (after, before, -1)):  # in the water at the first edge
            crossed = ~done & (first > 0).all(axis=0) & (last < 0).all(axis=0)
            fraction = first / np.where(crossed, first - last, 1.0)  # in the water, at both sides
            rows = crossed & (np.ptp(fraction, axis=0) * sides[axis] <= finest)
            in_water, half = fraction.mean(axis=0)[rows], columns[2 + axis][rows]
            columns[axis][rows] -= sign * half * (1 - in_water)
            columns[2 + axis][rows] = half * in_water
            done |= rows
    return Patches(*columns), done


def pulse_sides(
    panel: Panel, patches: Patches, insonification: TargetInsonification
) -> tuple[NDArray[np.int64], Floats]:
    """Sides between which the envelope of a pulse changes over each patch.

    Returns:
        Row of the patch of each side, shape (m,), and the side along s and t: -1, 1, or 0 for both, shape (m, 2).
    """
    d = panel.at(patches.s, patches.t)
    halves = np.stack([d.s * patches.half_s[:, None], d.t * patches.half_t[:, None]])
    deep = np.zeros((2, len(patches.s)))
    for images in insonification.images:
        rays = np.stack([_rays(d.position, position)[0] for position in images])
        deep += np.abs(np.einsum("fnk,snk->fsn", rays, halves)).max(axis=0)
    rows, side = np.arange(len(patches.s)), np.zeros((len(patches.s), 2))
    for axis in (0, 1):
        two = deep[axis, rows] > SHALLOW * insonification.max_range_extent
        far_side = side[two] + np.eye(2)[axis]
        side[two, axis] = -1.0
        rows, side = np.concatenate([rows, rows[two]]), np.concatenate([side, far_side])
    return rows, side


def patch_terms(panel: Panel, patches: Patches, side: Floats | None = None) -> tuple[PanelDerivatives, Floats, Floats]:
    """Positions and derivatives of patches, the rows of `kirchhoff_patch.TERMS`, (n, 8, 3), and areas [m^2], (n,).

    Args:
        panel: The panel.
        patches: Pieces of it.
        side: Sides whose delays they have, see `pulse_sides`, shape (n, 2); None: their middles.
    """
    d = panel.at(patches.s, patches.t)
    s, t = patches.half_s[:, None], patches.half_t[:, None]
    normal = np.cross(d.t, d.s)
    area_per_parameter = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    along_s = (np.cross(d.st, d.s) + np.cross(d.t, d.ss)) * s / area_per_parameter
    along_t = (np.cross(d.tt, d.s) + np.cross(d.t, d.st)) * t / area_per_parameter
    sides = np.zeros_like(d.position)
    if side is not None:
        sides[:, :2] = side
    rows = [d.s * s, d.t * t, d.ss * s**2 / 2, d.tt * t**2 / 2, d.st * s * t, along_s, along_t, sides]
    return d, np.stack(rows, axis=1), panel.area(*patches)
