"""Large flat smooth faces of targets: planes with an outline, which reflect legs to other scatterers.

They are sides of boxes and plates, and flat parts of meshes: neighbouring triangles in one plane.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.smooth_faces import clip_at_seabed, smooth_triangles
from insonify.scene.solid import STANDING, seabed_depth_at
from insonify.scene.target import Solid, solids_of_one_law

Floats = NDArray[np.float64]

MIN_WAVELENGTHS = 10.0
"""Smallest mean width of a face that reflects legs [wavelengths]."""
MAX_FACES = 64
"""Largest number of faces of one target, or of each part of a mesh with a law of its own, the largest first [1]."""
COPLANAR, COPLANAR_SINE = 1e-4, 1e-6
"""Distance from a plane [m], and sine of the angle to it [1], below which triangles lie in the plane."""
UPRIGHT_SINE = 1e-6
"""Vertical component of the unit normal below which a face is upright [1]."""
STRIPS = 64
"""Number of strips into which an outline that is no rectangle, or any face over relief, is divided [1]."""
STEP_WAVELENGTHS = 0.25
"""Largest variation of upper edge, lower edge or gap over strips that become one [wavelengths]."""
FARTHEST_BED = 1e4
"""Gap below a face above which the seabed is ignored [m]."""
HALF_THICKNESS = 1e-7
"""Half of the thickness of a strip, negligible [m]."""
TOUCHING = 0.01
"""Greatest depth of the upper edge of a strip that reaches the sea surface [m]."""


class FlatFace(NamedTuple):
    """A flat smooth face.

    Its own frame has the world's origin, the first axis along the normal, the second horizontal along the face, and the
    third down along it: in that frame the face is upright.
    """

    occluder: int
    """Row of its target among the scene's occluders."""
    label: str
    """Label of its target."""
    axes: Floats
    """Normal into the water, horizontal direction along the face, direction down it: unit rows [1], shape (3, 3)."""
    distance: float
    """Distance of its plane from the world's origin along the normal [m]."""
    strips: Floats
    """Outline as boxes of negligible thickness in its own frame, see `insonify.scene.box.box_body`, shape (k, 8)."""
    gap: Floats
    """Distance from the lower edge of each strip to the seabed, along the third axis [m], shape (k,): 0 on it, infinite
    where the terrain is unknown or farther than `FARTHEST_BED`."""
    at_surface: NDArray[np.bool_]
    """True: the strip reaches the sea surface, shape (k,)."""
    triangles: Floats
    """Corners of its triangles in its own frame, along and down the face [m], shape (t, 3, 2)."""
    reflection: float
    """Pressure reflection coefficient [1]."""

    @property
    def is_upright(self) -> bool:
        """True for a vertical face; horizontal boundaries are their own images in its plane."""
        return bool(abs(self.axes[0, 2]) < UPRIGHT_SINE)

    def signed_distance(self, position: Floats) -> Floats:
        """Signed distance of positions (..., 3) from the plane [m]: positive on the side of the normal."""
        return np.asarray(position @ self.axes[0] - self.distance)

    def distance_from(self, position: Floats) -> float:
        """Least distance of a position (3,) from the bounding rectangle of the face, in its plane [m]."""
        across = self.axes[1:] @ position
        beyond = np.maximum(self.triangles.min(axis=(0, 1)) - across, across - self.triangles.max(axis=(0, 1)))
        return float(np.hypot(self.signed_distance(position), np.linalg.norm(np.maximum(beyond, 0.0))))

    def image(self, position: Floats) -> Floats:
        """Image of a position in the plane [m], shape (3,)."""
        return np.asarray(position - 2 * self.signed_distance(position) * self.axes[0])


@lru_cache(maxsize=8)
def flat_faces(scene: Scene, wavelength: float) -> tuple[FlatFace, ...]:
    """Flat smooth faces of a scene's targets under water.

    Args:
        scene: The scene.
        wavelength: Wavelength of the sound [m]: narrower faces than `MIN_WAVELENGTHS` are left out.
    """
    result: list[FlatFace] = []
    for row, solid in enumerate(scene.occluders):
        for faces in solids_of_one_law(solid):
            if faces.face_reflection_coefficient and faces.reflects_legs:
                result += _faces_of(scene, row, faces, wavelength)
    return tuple(result)


def _faces_of(scene: Scene, row: int, solid: Solid, wavelength: float) -> list[FlatFace]:
    """Faces of one target that are wide enough at a wavelength [m], the largest first."""
    corners, min_width = smooth_triangles(solid, scene.seabed), MIN_WAVELENGTHS * wavelength
    if scene.seabed.terrain is None:  # over relief, strips are cut one by one
        corners = clip_at_seabed(corners, scene.seabed)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    has_area = area > 1e-12
    corners, normal, area = corners[has_area], normal[has_area] / (2 * area[has_area, None]), area[has_area]
    is_free, faces_with_area = np.ones(len(area), bool), list[tuple[float, FlatFace]]()
    parallel, low, high = _nearly_parallel(normal)
    total = np.concatenate([[0.0], np.cumsum(area[parallel])])
    is_wide = total[high] - total[low] >= min_width**2
    for first in np.argsort(-area, kind="stable"):
        if not (is_free[first] and is_wide[first]):
            continue
        candidates = np.sort(parallel[low[first] : high[first]])
        distance = np.abs((corners[candidates] - corners[first, 0]) @ normal[first]).max(axis=1)
        slope = np.linalg.norm(np.cross(normal[candidates], normal[first]), axis=1)
        is_parallel = normal[candidates] @ normal[first] > 0
        plane = candidates[is_free[candidates] & is_parallel & (distance < COPLANAR) & (slope < COPLANAR_SINE)]
        if area[plane].sum() < min_width**2:  # smaller ones follow, but several of them may share a plane
            is_free[first] = False
            continue
        is_free[plane] = False
        for part in _connected(corners[plane]):
            triangles = plane[part]
            face = _face(scene, row, solid, corners[triangles], normal[first], wavelength)
            size = np.ptp(face.triangles.reshape(-1, 2), axis=0)
            if len(face.strips) and area[triangles].sum() >= min_width * size.max():
                faces_with_area.append((float(area[triangles].sum()), face))
    faces_with_area.sort(key=lambda item: -item[0])
    return [face for _, face in faces_with_area[:MAX_FACES]]


def _nearly_parallel(normal: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Sort triangles by their normals, so that those which may be parallel to one are neighbours.

    Args:
        normal: Unit normals, shape (n, 3).

    Returns:
        Rows of the triangles in order; for each triangle first and end of the slice of that order that holds all
        triangles within `COPLANAR_SINE` of its normal, and others; shapes (n,).
    """
    north = normal[:, 0]
    order = np.argsort(north, kind="stable")
    low = np.searchsorted(north[order], north - 2 * COPLANAR_SINE, "left")
    high = np.searchsorted(north[order], north + 2 * COPLANAR_SINE, "right")
    return order, low, high


def _connected(corners: Floats) -> list[NDArray[np.int64]]:
    """Rows of the triangles (t, 3, 3) of each part that is connected by common vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    t = len(corners)
    _, vertex = np.unique(np.round(corners.reshape(-1, 3) / COPLANAR), axis=0, return_inverse=True)
    vertex = np.ravel(vertex)
    joints = coo_array((np.ones(3 * t), (np.repeat(np.arange(t), 3), t + vertex)), shape=(t + vertex.max() + 1,) * 2)
    count, part = connected_components(joints, directed=False)
    return [rows for rows in (np.flatnonzero(part[:t] == number) for number in range(count)) if len(rows)]


def _face(
    scene: Scene, row: int, solid: Solid, corners: Floats, normal: Floats, wavelength: float
) -> FlatFace:  # fmt: skip
    """The face of connected triangles (t, 3, 3) in one plane, with strips down to the seabed."""
    horizontal = np.hypot(normal[0], normal[1])
    along = np.array([1.0, 0.0, 0.0])
    if horizontal > UPRIGHT_SINE:
        along = np.array([-normal[1], normal[0], 0.0]) / horizontal
    if abs(normal[2]) < UPRIGHT_SINE:
        normal = np.array([normal[0] / horizontal, normal[1] / horizontal, 0.0])
    down = np.cross(normal, along)
    down *= np.sign(down[2]) or 1.0
    axes = np.array([normal, along, down])
    plane = corners @ axes[1:].T
    strips = _strips(plane, divided=scene.seabed.terrain is not None)
    distance = float(np.mean(corners.reshape(-1, 3) @ normal))
    boxes = np.zeros((len(strips), 8))
    boxes[:, 0], boxes[:, 1], boxes[:, 2] = distance, (strips[:, 0] + strips[:, 1]) / 2, 1.0
    boxes[:, 4], boxes[:, 5], boxes[:, 6:] = HALF_THICKNESS, (strips[:, 1] - strips[:, 0]) / 2, strips[:, 2:]
    gap = _gap_below(boxes, axes, scene.seabed)
    boxes[:, 7] += np.minimum(gap, 0.0)
    is_exposed = boxes[:, 7] > boxes[:, 6]
    boxes, gap = boxes[is_exposed], np.maximum(gap[is_exposed], 0.0)
    at_surface = (np.stack([boxes[:, 0], boxes[:, 1], boxes[:, 6]], -1) @ axes)[:, 2] < TOUCHING
    boxes, gap, at_surface = _merge_strips(boxes, gap, at_surface, STEP_WAVELENGTHS * wavelength)
    assert solid.face_reflection_coefficient is not None
    return FlatFace(row, solid.label, axes, distance, boxes, gap, at_surface, plane, solid.face_reflection_coefficient)


def _merge_strips(
    boxes: Floats, gap: Floats, at_surface: NDArray[np.bool_], step: float
) -> tuple[Floats, Floats, NDArray[np.bool_]]:  # fmt: skip
    """Merge adjacent strips as long as no edge or gap varies by more than a step over those that become one.

    Args:
        boxes: Strips from one end of the face to the other, shape (k, 8).
        gap: Height of each above the seabed [m], shape (k,).
        at_surface: True for strips that reach the surface, shape (k,).
        step: Largest difference among the edges, or gaps, of strips that become one [m].

    Returns:
        Merged strips, with their gaps and flags; edges and gaps are means weighted by width.
    """
    if len(boxes) < 2:
        return boxes, gap, at_surface
    first, edges = [0], np.column_stack([boxes[:, 6:], np.minimum(gap, FARTHEST_BED)])
    low = high = edges[0]
    kind = np.column_stack([gap > 0, np.isinf(gap), at_surface])
    for k in range(1, len(boxes)):
        low, high = np.minimum(low, edges[k]), np.maximum(high, edges[k])
        is_separate = boxes[k, 1] - boxes[k, 5] > boxes[k - 1, 1] + boxes[k - 1, 5] + COPLANAR
        if is_separate or np.any(high - low > step) or np.any(kind[k] != kind[k - 1]):
            first.append(k)
            low = high = edges[k]
    last = [*(k - 1 for k in first[1:]), len(boxes) - 1]
    width, merged = boxes[:, 5], boxes[first].copy()
    begin, end = boxes[first, 1] - width[first], boxes[last, 1] + width[last]
    merged[:, 1], merged[:, 5] = (begin + end) / 2, (end - begin) / 2
    means = np.add.reduceat(width[:, None] * edges, first) / np.add.reduceat(width, first)[:, None]
    merged[:, 6:] = means[:, :2]
    return merged, np.where(np.isinf(gap[first]), np.inf, means[:, 2]), at_surface[first]


def _gap_below(boxes: Floats, axes: Floats, seabed: Seabed) -> Floats:
    """Distance down a face from the lower edge of each strip to the seabed [m], (k,): negative where it lies below.

    Args:
        boxes: Strips of the face in its own frame, shape (k, 8).
        axes: Axes of the face, shape (3, 3).
        seabed: The seabed; unknown terrain is infinitely far.
    """
    lower = np.stack([boxes[:, 0], boxes[:, 1], boxes[:, 7]], -1) @ axes
    gap = (seabed_depth_at(seabed, lower[:, :2]) - lower[:, 2]) / max(float(axes[2, 2]), UPRIGHT_SINE)
    gap = np.where(gap > FARTHEST_BED, np.inf, gap)  # horizontal face, or unknown terrain
    return np.nan_to_num(np.where(np.abs(gap) < STANDING, 0.0, gap), nan=np.inf)


def _strips(plane: Floats, *, divided: bool) -> Floats:
    """Vertical strips that cover an outline, in the frame of the face.

    Args:
        plane: Corners of its triangles, along and down [m], shape (t, 3, 2); holes are filled.
        divided: True: divide a rectangle into strips too, for a seabed with relief.

    Returns:
        First and last position along the face, and least and greatest down it, of each strip [m], shape (k, 4).
    """
    low, high = plane.reshape(-1, 2).min(axis=0), plane.reshape(-1, 2).max(axis=0)
    side, other = plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]
    area = np.abs(side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0]).sum() / 2
    if area > (1 - 1e-6) * np.prod(high - low) and not divided:
        return np.array([[low[0], high[0], low[1], high[1]]])
    borders = np.linspace(low[0], high[0], STRIPS + 1)
    middle = (borders[1:] + borders[:-1])[:, None, None] / 2
    start, stop = plane, np.roll(plane, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (middle - start[..., 0]) / (stop[..., 0] - start[..., 0])
        down = np.where((part >= 0) & (part <= 1), start[..., 1] + part * (stop[..., 1] - start[..., 1]), np.nan)
    down = down.reshape(STRIPS, -1)
    has_faces = np.isfinite(down).any(axis=1)
    top, base = np.nanmin(down[has_faces], axis=1), np.nanmax(down[has_faces], axis=1)
    return np.stack([borders[:-1][has_faces], borders[1:][has_faces], top, base], axis=1)
