"""Kirchhoff's integral over a smooth face by brute force: small patches, exact spherical ways, no closed form."""

import numpy as np

from insonify.simulator import arrivals
from oracles.scenes import nominal

SPEED, DEPTH = 1500.0, 20.0
ROUGH = {"law": "lambert", "strength_db": -150}
"""A law too weak to be received beside a smooth face."""


def image(family, source):
    """Depth of the source's image and sign of what its mirrors leave, R_b = 0.35."""
    depth, left = source, 1.0
    for letter in family.replace("D", ""):
        depth = -depth if letter == "S" else 2 * DEPTH - depth
        left *= -1.0 if letter == "S" else 0.35
    return depth, left


def upright_face(width, height, east, bottom, frequency, per_wave=8):
    """Middles of square patches of a face that looks west: places (n, 3), and their area [m^2]."""
    side = SPEED / frequency / per_wave
    rows, columns = int(np.ceil(height / side)), int(np.ceil(width / side))
    north = ((np.arange(columns) + 0.5) / columns - 0.5) * width
    depth = bottom - (np.arange(rows) + 0.5) / rows * height
    n, z = np.meshgrid(north, depth)
    return np.stack([n.ravel(), np.full(n.size, east), z.ravel()], axis=1), width * height / n.size


def brute(places, area, normal, out, back, frequency, source=(0.0, 0.0, 11.0), receiver=None):
    """Pressure re the source at 1 m by one pair of families: every patch's ways are its own, both mirrors counted.

    Places of shape (n, 3); normal (3,) or (n, 3); absorption is none.
    """
    k = 2 * np.pi * frequency / SPEED
    lengths, cosines, left = [], [], 1.0
    for family, end in ((out, source), (back, source if receiver is None else receiver)):
        depth, sign = image(family, end[2])
        ray = np.array([end[0], end[1], depth]) - places
        length = np.linalg.norm(ray, axis=1)
        lengths.append(length)
        cosines.append(np.sum(ray * normal, axis=1) / length)
        left *= sign
    lit = (cosines[0] > 0) & (cosines[1] > 0)
    patch = 1j * frequency / SPEED * (cosines[0] + cosines[1]) / 2 * np.exp(-1j * k * (lengths[0] + lengths[1]))
    return complex(left * area * np.sum((patch / (lengths[0] * lengths[1]))[lit]))


def flashes(target, max_reflections=0, *, frequency=100e3, window=(0.0, 0.24), facing=None, **changes):
    """Pressure re the source at 1 m of a smooth target, before beams, by pair of families: from the engine's arrivals.

    Args:
        target: Changes to a smooth target of hardly any rough echo.
        max_reflections: Most bounces of a leg.
        frequency: Carrier [Hz].
        window: Recorded [s].
        facing: Keep only facets whose place this gives, from (n, 3) to (n,).
        changes: Other changes of the nominal scene.
    """
    settings = {"face_reflection_coefficient": 1.0, "scattering": ROUGH, **target}
    pulse = {"kind": "cw", "frequency": frequency, "duration": 0.2e-3, "taper": "tukey", "taper_fraction": 0.2}
    fixed = {
        "water": {"noise_level_db": None, "absorption_db_per_m": 0.0},
        "track": {"window": window},
        "sonar": {"pulse": pulse},
        "line": {"length": 0.1},
        "paths": {"contributions": ["target"], "max_reflections": max_reflections},
    }
    rows = arrivals(nominal(targets=[settings], **{**fixed, **changes}))
    # rough points have random phases and are beneath notice
    rows = rows if facing is None else rows.take(facing(rows.position))
    turned = rows.amplitude.astype(complex) * np.exp(-2j * np.pi * np.mod(frequency * rows.delay, 1.0))
    found = {}
    for pair in sorted(set(zip(rows.transmit_family.tolist(), rows.receive_family.tolist(), strict=True))):
        mine = (rows.transmit_family == pair[0]) & (rows.receive_family == pair[1])
        found[pair] = complex(turned[mine].sum())
    return found
