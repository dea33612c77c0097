"""Sound speed against depth, as a diver would meet it: knots joined by straight lines.

Straight lines in depth bend rays into arcs of circles, so what stands here is what the ray
solvers take, without fitting anything in between.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.profile_smoothing import round_corners
from insonify.ocean.sound_speed import sound_speed

Floats = NDArray[np.float64]

SLOWEST, FASTEST = 1300.0, 1700.0
"""Sound speeds that some natural water has [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class SoundSpeedProfile:
    """Speed of sound at increasing depths, linear in between."""

    depth: Floats
    """Depths of the knots, increasing [m], shape (n,), n >= 2."""
    speed: Floats
    """Sound speed at the knots [m/s], shape (n,)."""

    def __post_init__(self) -> None:
        """Refuses what no water column can be."""
        for name in ("depth", "speed"):
            column = np.array(getattr(self, name), dtype=float)  # a copy: frozen means frozen
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        _check_shapes(self.depth, self.speed)
        _check_values(self.depth, self.speed)

    @classmethod
    def from_temperature_salinity(
        cls, depth: ArrayLike, temperature: ArrayLike, salinity: ArrayLike, *, model: str = "teos10"
    ) -> Self:
        """The profile behind what a lowered probe measured.

        Args:
            depth: Depths of the knots, increasing [m], shape (n,).
            temperature: Temperature in situ [degC], shape (n,) or one for all.
            salinity: Salinity [g/kg], shape (n,) or one for all.
            model: Name of the law, as in `insonify.ocean.sound_speed`.

        Returns:
            The profile; between the knots sound speed is linear, not temperature.
        """
        z = np.asarray(depth, dtype=float)
        return cls(z, np.broadcast_to(sound_speed(temperature, salinity, z, model=model), z.shape))

    def at(self, depth: ArrayLike) -> Floats:
        """Speed of sound at depths [m/s]; above the first and below the last knot, that knot's.

        Args:
            depth: Depth [m], any shape.

        Returns:
            Sound speed [m/s], same shape; at a knot exactly the knot's.
        """
        return np.asarray(np.interp(np.asarray(depth, dtype=float), self.depth, self.speed))

    def gradient(self, depth: ArrayLike) -> Floats:
        """How sound speed grows with depth [1/s].

        Args:
            depth: Depth [m], any shape.

        Returns:
            Gradient of the layer that holds each depth [1/s], same shape. At a knot, of the layer
            below; at the last knot, of the layer above; outside the profile, 0.
        """
        z = np.asarray(depth, dtype=float)
        slopes = np.diff(self.speed) / np.diff(self.depth)
        layer = np.searchsorted(self.depth, z, side="right") - 1
        inside = (z >= self.depth[0]) & (z <= self.depth[-1])
        return np.where(inside, slopes[np.clip(layer, 0, slopes.size - 1)], 0.0)

    def covers(self, water_depth: float) -> None:
        """Says whether the profile is known from the surface to the seabed.

        Args:
            water_depth: Deepest water of the scene [m].

        Raises:
            ValueError: It begins below the surface or ends above the seabed; with the way out.
        """
        advice = f"Measure the rest, or hold the end values with profile.extended({water_depth:g})."
        if self.depth[0] > 0:
            raise ValueError(f"the sound-speed profile begins at {self.depth[0]:g} m, not at the surface. {advice}")
        if self.depth[-1] < water_depth:
            raise ValueError(
                f"the sound-speed profile ends at {self.depth[-1]:g} m; the water is {water_depth:g} m deep. {advice}"
            )

    def extended(self, water_depth: float) -> Self:
        """The same profile from the surface to the seabed, the end speeds held where nothing was measured.

        Args:
            water_depth: Deepest water of the scene [m].

        Returns:
            A profile that covers the water; the same one if it did before.
        """
        z = self.depth
        if z[0] > 0:
            z = np.concatenate([[0.0], z])
        if z[-1] < water_depth:
            z = np.concatenate([z, [water_depth]])
        return self if z.size == self.depth.size else type(self)(z, self.at(z))

    def smoothed(self, length: float) -> Self:
        """The same water with its corners rounded, so that no ray meets a jump of the gradient.

        Each corner becomes a parabola, cut into thin layers; see `insonify.ocean.profile_smoothing.rounded`.

        Args:
            length: Depth within which each corner is rounded, half above and half below it [m], above 0.

        Returns:
            A profile with the same ends, and the same speed farther than length / 2 from every knot.

        Raises:
            ValueError: The length is not a number above 0 m and up to 1000 m.
        """
        return type(self)(*round_corners(self.depth, self.speed, length))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SoundSpeedProfile):
            return NotImplemented
        return np.array_equal(self.depth, other.depth) and np.array_equal(self.speed, other.speed)

    def __hash__(self) -> int:
        return hash((self.depth.tobytes(), self.speed.tobytes()))

    def __repr__(self) -> str:
        span = f"{self.depth[0]:g}-{self.depth[-1]:g} m"
        return f"SoundSpeedProfile: {self.depth.size} knots, {span}, {self.speed.min():.1f}-{self.speed.max():.1f} m/s"


def _check_shapes(depth: Floats, speed: Floats) -> None:
    if depth.ndim != 1 or depth.shape != speed.shape:
        raise ValueError(
            f"SoundSpeedProfile.depth has shape {depth.shape}, speed {speed.shape}; "
            "give two lists of the same length, one speed for each depth."
        )
    if depth.size < 2:
        raise ValueError(
            f"SoundSpeedProfile has {depth.size} knot(s); it takes two to know how speed changes. "
            "For water of one speed, give that speed at the surface and at the seabed."
        )


def _check_values(depth: Floats, speed: Floats) -> None:
    for name, column in (("depth", depth), ("speed", speed)):
        broken = np.flatnonzero(~np.isfinite(column))
        if broken.size:
            raise ValueError(f"SoundSpeedProfile.{name}[{broken[0]}] is {column[broken[0]]}; give a number.")
    back = np.flatnonzero(np.diff(depth) <= 0)
    if back.size:
        i = int(back[0])
        raise ValueError(
            f"SoundSpeedProfile.depth[{i + 1}] is {depth[i + 1]:g} m after {depth[i]:g} m; "
            "depths must increase downward. Sort the rows, and keep one of each depth."
        )
    odd = np.flatnonzero((speed < SLOWEST) | (speed > FASTEST))
    if odd.size:
        i = int(odd[0])
        raise ValueError(
            f"SoundSpeedProfile.speed[{i}] is {speed[i]:g} m/s; water carries sound at {SLOWEST:g} to "
            f"{FASTEST:g} m/s. Are the columns exchanged, or the unit not m/s?"
        )
