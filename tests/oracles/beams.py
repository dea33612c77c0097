"""What an array is worth towards a direction: every point of it added up, one by one, in float64.

Nothing is separable here and nothing is tabulated: the aperture is a cloud of weighted points in the world, and the
far field is the sum of their phases. Shares no code with the project.
"""

import numpy as np

NODES, WEIGHTS = np.polynomial.legendre.leggauss(160)


def turn(angle, first, second):
    """Rotation by an angle in the plane of two axes, from the first towards the second."""
    matrix = np.eye(3)
    matrix[[first, second], [first, second]] = np.cos(angle)
    matrix[second, first], matrix[first, second] = np.sin(angle), -np.sin(angle)
    return matrix


def axes(*, heading=0.0, pitch=0.0, roll=0.0, bearing=np.pi / 2, tilt=0.0):
    """Boresight, right and down of a mounted array as columns in the world, turn after turn."""
    body = turn(heading, 0, 1) @ turn(-pitch, 0, 2) @ turn(roll, 1, 2)
    return body @ turn(bearing, 0, 1) @ turn(tilt, 0, 2)


def taylor(place, nbar=4, sidelobe_db=30.0):
    """Taylor's line source of nbar nearly equal side lobes, along an aperture of unit length.

    Source: Taylor (1955), IRE Trans. Antennas Propag. 3(1), 16-28: F(m) from the zeros of the pattern.
    """
    a = np.arccosh(10 ** (sidelobe_db / 20)) / np.pi
    stretch = nbar**2 / (a**2 + (nbar - 0.5) ** 2)
    m = np.arange(1, nbar)
    zeros = 1 - (m[:, None] ** 2 / stretch) / (a**2 + (m[None, :] - 0.5) ** 2)
    others = np.where(np.eye(nbar - 1, dtype=bool), 1.0, 1 - m[:, None] ** 2 / m[None, :] ** 2)
    term = (-1.0) ** (m + 1) * zeros.prod(axis=1) / 2 / others.prod(axis=1)
    return 1 + 2 * np.cos(2 * np.pi * np.multiply.outer(place, m)) @ term


SHADING = {
    "uniform": np.ones_like,
    "cosine": lambda s: np.cos(np.pi * s),
    "hann": lambda s: np.cos(np.pi * s) ** 2,
    "hamming": lambda s: 0.54 + 0.46 * np.cos(2 * np.pi * s),
    "taylor": taylor,
}


def points(extent, count, shading):
    """Places along one side [m] and their weights: element centres, or Gauss's nodes for a continuous side."""
    if count is None:
        return NODES / 2 * extent, WEIGHTS * SHADING[shading](NODES / 2)
    place = (np.arange(count) + 0.5) / count - 0.5
    return place * extent, SHADING[shading](place)


def element_gain(kind, way, pitch, wavelength):
    """One element's result towards a direction (boresight, right, down): in front, by the cosine, or as a piston."""
    if kind == "omni":
        return 1.0
    if way[0] < 0:
        return 0.0
    if kind == "cosine":
        return way[0]
    if kind == "piston":
        return float(np.prod([_strip(p, w, wavelength) for p, w in zip(pitch, way[1:], strict=True)]))
    return 1.0


def _strip(width, cosine, wavelength):
    """Mean phase over a strip of a given width [m], by quadrature; one for no width."""
    return float(WEIGHTS / 2 @ np.cos(2 * np.pi * width / wavelength * cosine * NODES / 2)) if width else 1.0


def gain(way, frame, wavelength, steer, *, width, height=0.0, columns=None, rows=None, shading="uniform",
         shading_down="uniform", element="baffled"):  # fmt: skip
    """Amplitude of one beam towards a direction, one on its steered axis.

    Args:
        way: Unit vector from the sonar outward, in the world.
        frame: Boresight, right, down as columns in the world.
        wavelength: Wavelength of the carrier [m].
        steer: Angles to the right and down [rad].
        width: Extent to the right [m].
        height: Extent down [m]; 0 for a line.
        columns: Elements to the right; None for a continuous side.
        rows: Elements down.
        shading: Weights to the right.
        shading_down: Weights down.
        element: Directivity of one element.
    """
    right, a = points(width, columns, shading)
    down, b = points(height, rows, shading_down) if height else (np.zeros(1), np.ones(1))
    axis = np.array([0, np.cos(steer[1]) * np.sin(steer[0]), np.sin(steer[1])])
    axis[0] = np.sqrt(1 - axis @ axis)
    own = frame.T @ np.asarray(way, float)
    lag = np.add.outer(right * (own[1] - axis[1]), down * (own[2] - axis[2]))
    summed = np.sum(np.outer(a, b) * np.exp(2j * np.pi * lag / wavelength)) / (a.sum() * b.sum())
    pitch = (width / columns if columns else 0.0, height / rows if rows else 0.0)
    return summed.real * element_gain(element, own, pitch, wavelength) / element_gain(element, axis, pitch, wavelength)
