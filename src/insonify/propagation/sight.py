"""What the ground hides from a sonar in layered water: launch angles from the exact solver, shadows from one sweep.

Bottom bounces are off one plane, as everywhere in this package: that of the fitted bed. The ground itself may stand
above it and hide things, its own bounce points among them, or lie below it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import CAUSTICS, COLUMNS, MOST, SIN_LAUNCH, TURNS, solve_points
from insonify.propagation.families import DIRECT, bounces, is_family
from insonify.propagation.fan import bounce_ranges
from insonify.propagation.horizon import Horizon, horizon
from insonify.propagation.layers import Column, column
from insonify.validity import number, numbers

Floats = NDArray[np.float64]


def ground_in_sight(
    profile: SoundSpeedProfile, *, source_depth: float, ranges: ArrayLike, ground: ArrayLike,
    plane: float | None = None, families: Sequence[str] = ("D", "S", "BS"),
) -> dict[str, Horizon]:  # fmt: skip
    """The cells of an uneven seabed that each family of paths reaches, by rays as they bend.

    Every segment of a path is tested: the last one by a sweep over the ground, the earlier ones by whether their
    bounce point is seen. Of several rays of one family to a cell the one that turns least is followed, before it
    has touched a caustic; paths that bounce are followed as far as they do not turn in the water as well.

    Args:
        profile: Sound speed over depth; must cover the deepest ground.
        source_depth: Depth of the sonar [m].
        ranges: Horizontal distances of the cells along an azimuth, increasing [m], shape (n,).
        ground: Depth of the seabed there [m], shape (..., n), one row for each azimuth.
        plane: Depth of the plane that bottom bounces are off [m]; by default the mean depth of the ground.
        families: Families wanted.

    Returns:
        Visibility by family, shape of `ground`. A family whose last bounce is off the bottom reaches ground above
        the plane only.

    Raises:
        ValueError: The profile ends above the ground, the sonar is not above it, or a value means nothing.
    """
    reach = numbers("ranges", ranges, "m", 0.0, gaps=False)
    depth = numbers("ground", ground, "m", 0.0, above=True, gaps=False)
    if depth.shape[-1:] != reach.shape:
        raise ValueError(f"ground has shape {depth.shape}; give (..., {reach.size}), a depth for each range.")
    for name in families:
        if not is_family(name):
            raise ValueError(f"{name!r} is not a path family; write D, or letters S and B in turn, such as BS.")
    bed = float(np.mean(depth)) if plane is None else number("plane", plane, "m", 0.0, above=True)
    source = number("source_depth", source_depth, "m", 0.0, bed)
    whole = column(profile, max(bed, float(depth.max())))
    sight = _Sight(source, reach, depth, whole, column(profile, bed))
    return {name: sight.along(name) for name in families}


@dataclass(frozen=True, slots=True)
class _Sight:
    """One sonar over one ground: launch angles and shadows, each found once."""

    source: float
    ranges: Floats
    ground: Floats
    whole: Column
    """The water down to the deepest ground."""
    flat: Column
    """The water down to the plane."""
    known: dict[tuple[str, str], Floats] = field(default_factory=dict)
    parts: dict[tuple[str, str], Horizon] = field(default_factory=dict)

    def along(self, family: str) -> Horizon:
        """What is seen of the ground by all segments of a family."""
        string = bounces(family)
        before = [self.part(string[:k] or DIRECT, letter) for k, letter in enumerate(string)]
        aim = self.launch(family, "B")
        return horizon(self.ranges, aim, family=family, bounce=self.bounce(family, "B"), before=before)

    def part(self, family: str, target: str) -> Horizon:
        """What the last segment of a family sees of the ground (B) or of the surface (S)."""
        if (family, target) not in self.parts:
            self.parts[family, target] = horizon(
                self.ranges, self.launch(family, "B"), family=family, points=self.launch(family, target),
                bounce=self.bounce(family, target),
            )  # fmt: skip
        return self.parts[family, target]

    def bounce(self, family: str, target: str) -> Floats | None:
        """Ranges of the bounces of the rays to a target, shape (bounces, ..., n)."""
        count = len(bounces(family))
        if count == 0:
            return None
        sines = self.launch(family, target)
        water = self.flat if "B" in family else self.whole
        found = bounce_ranges(water, self.source, sines.ravel(), count, farthest=2 * float(self.ranges[-1]) + 1)
        return found.reshape(count, *sines.shape)

    def launch(self, family: str, target: str) -> Floats:
        """Sine of the launch angle of the rays to a target, NaN where there is none, shape of the ground."""
        if (family, target) not in self.known:
            depth = self.ground if target == "B" else np.zeros_like(self.ground)
            self.known[family, target] = self._launch(family, depth)
        return self.known[family, target]

    def _launch(self, family: str, depth: Floats) -> Floats:
        if "B" not in family:
            return self._solved(self.whole, family, depth)
        plane = self.flat.water_depth
        if family.endswith("B"):
            return np.where(depth <= plane, self._solved(self.flat, family, np.minimum(depth, plane)), np.nan)
        # beyond the plane the ray runs on, but the solver's water ends: its mirror point leads as far the other way
        above = self._solved(self.flat, family, np.where(depth > plane, 2 * plane - depth, depth))
        below = depth > plane
        if not below.any():
            return above
        on = self._solved(self.flat, family, np.where(below, plane, depth))
        return np.where(below, 2 * on - above, on)

    def _solved(self, water: Column, family: str, depth: Floats) -> Floats:
        """Sines from the exact solver."""
        points = np.ascontiguousarray(depth).ravel()
        far = np.broadcast_to(self.ranges, depth.shape).ravel().copy()
        string = bounces(family)
        rays = np.empty((points.size, MOST, COLUMNS))
        count, status = np.zeros(points.size, np.int64), np.zeros(points.size, np.uint8)
        solve_points(
            water.depth,
            water.speed,
            water.plane,
            self.source,
            len(string),
            string.startswith("S"),
            points,
            far,
            rays,
            count,
            status,
        )
        turns = np.where(rays[:, :, CAUSTICS] == 0, rays[:, :, TURNS], np.inf)
        turns[np.arange(MOST) >= count[:, None]] = np.inf
        if string:
            turns[turns > 0] = np.inf  # of rays that turn about a bounce the order is another one
        first = np.argmin(turns, axis=1)
        row = np.arange(points.size)
        sine = np.where(np.isfinite(turns[row, first]), rays[row, first, SIN_LAUNCH], np.nan)
        return np.asarray(sine.reshape(depth.shape))
