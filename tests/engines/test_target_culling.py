"""Points that face the sonar, against the angle between a face's normal and the ray from an image of each end."""

import numpy as np
import pytest

from insonify.engines.target_culling import facing

RNG = np.random.default_rng(3)
POINTS, IMAGES = RNG.uniform(-5, 5, (500, 3)), RNG.uniform(-30, 30, (2, 3, 3))
NORMALS = RNG.normal(size=(500, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)


def ray_elevation(image: np.ndarray) -> np.ndarray:
    """Angle of the rays from an image above the planes of the faces [rad]."""
    ray = image - POINTS
    return np.pi / 2 - np.arccos(np.sum(ray * NORMALS, axis=1) / np.linalg.norm(ray, axis=1))


@pytest.mark.parametrize("deviation", [0.0, 0.05])
def test_a_point_faces_some_image_of_each_end(deviation: float) -> None:
    """One image of the transmitter and one of the receiver above the face, or less below it than rays may deviate."""
    above = [np.any([ray_elevation(image) > -np.arcsin(deviation) for image in end], axis=0) for end in IMAGES]
    found = facing(POINTS, NORMALS, IMAGES, max_deviation=deviation)
    np.testing.assert_array_equal(found, above[0] & above[1])
    assert 0.3 < found.mean() < 0.95 and not np.array_equal(found, above[0])


def test_points_are_kept_up_to_a_margin_below_their_faces() -> None:
    """A horizontal face and a sonar 2 um above, in, and below its plane: only the last is beyond a margin of 1 um."""
    down, position = np.array([[0.0, 0.0, -1.0]]), np.array([[0.0, 0.0, 10.0]])
    for depth, margin, expected in ((10 - 2e-6, 0.0, True), (10.0, 0.0, False), (10.0, 1e-6, True),
                                    (10 + 2e-6, 1e-6, False), (10 + 2e-6, 3e-6, True)):  # fmt: skip
        image = np.array([[50.0, 0.0, depth]])
        assert facing(position, down, [image], margin=margin).item() is expected, depth


def test_without_images_no_point_is_faced() -> None:
    """An end whose images are all out of reach receives nothing."""
    assert not facing(POINTS, NORMALS, [IMAGES[0], np.empty((0, 3))]).any()
