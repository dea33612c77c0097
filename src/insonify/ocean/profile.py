"""Sound-speed profile: knots joined by straight lines.

Sound speed that is linear in depth bends rays into arcs of circles, so that the ray solvers
use the profile without a fit.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.profile_smoothing import round_corners
from insonify.ocean.sound_speed import sound_speed

Floats = NDArray[np.float64]

SLOWEST, FASTEST = 1300.0, 1700.0
"""Smallest and largest sound speed of natural water [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class SoundSpeedProfile:
    """Speed of sound at increasing depths, linear in between.

    Example:
        >>> thermocline = SoundSpeedProfile(depth=[0.0, 10.0, 20.0], speed=[1520.0, 1520.0, 1505.0])
        >>> thermocline
        SoundSpeedProfile: 3 knots, 0-20 m, 1505.0-1520.0 m/s
        >>> thermocline.at([5.0, 15.0]).tolist(), thermocline.gradient(15.0).tolist()
        ([1520.0, 1512.5], -1.5)
        >>> SoundSpeedProfile.from_temperature_salinity([0.0, 20.0], temperature=[18.0, 12.0], salinity=35.0)
        SoundSpeedProfile: 2 knots, 0-20 m, 1496.9-1515.6 m/s
    """

    depth: Floats
    """Depths of the knots, increasing [m], shape (n,), n >= 2."""
    speed: Floats
    """Sound speed at the knots [m/s], shape (n,)."""

    def __post_init__(self) -> None:
        """Refuse depths that do not increase, and speeds that no natural water has."""
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
        """Profile computed from measured temperature and salinity.

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
        """Sound speed [m/s], constant above the first and below the last knot.

        Args:
            depth: Depth [m], any shape.

        Returns:
            Sound speed [m/s], same shape; at a knot exactly the knot's.
        """
        return np.asarray(np.interp(np.asarray(depth, dtype=float), self.depth, self.speed))

    def gradient(self, depth: ArrayLike) -> Floats:
        """Gradient of sound speed with depth [1/s].

        Args:
            depth: Depth [m], any shape.

        Returns:
            Gradient of the layer that contains each depth [1/s], same shape. At a knot, that of the layer
            below; at the last knot, that of the layer above; outside the profile, 0.
        """
        z = np.asarray(depth, dtype=float)
        slopes = np.diff(self.speed) / np.diff(self.depth)
        layer = np.searchsorted(self.depth, z, side="right") - 1
        inside = (z >= self.depth[0]) & (z <= self.depth[-1])
        return np.where(inside, slopes[np.clip(layer, 0, slopes.size - 1)], 0.0)

    def require_depth(self, water_depth: float) -> None:
        """Refuse a profile that does not reach from the surface to the seabed.

        Args:
            water_depth: Deepest water of the scene [m].

        Raises:
            ValueError: The profile begins below the surface or ends above the seabed; the message gives the remedy.
        """
        advice = f"Measure the rest, or hold the end values with profile.extended({water_depth:g})."
        if self.depth[0] > 0:
            raise ValueError(f"the sound-speed profile begins at {self.depth[0]:g} m, not at the surface. {advice}")
        if self.depth[-1] < water_depth:
            raise ValueError(
                f"the sound-speed profile ends at {self.depth[-1]:g} m; the water is {water_depth:g} m deep. {advice}"
            )

    def extended(self, water_depth: float) -> Self:
        """Extend the profile from the surface to the seabed, with the speeds of its ends.

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
        """Round the corners of the profile, so that the gradient has no jumps.

        Each corner becomes a parabola, cut into thin layers; see `insonify.ocean.profile_smoothing.round_corners`.

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
            f"SoundSpeedProfile has {depth.size} knot(s); give at least two. "
            "For water of one speed, give that speed at the surface and at the seabed."
        )


def _check_values(depth: Floats, speed: Floats) -> None:
    for name, column in (("depth", depth), ("speed", speed)):
        broken = np.flatnonzero(~np.isfinite(column))
        if broken.size:
            raise ValueError(f"SoundSpeedProfile.{name}[{broken[0]}] is {column[broken[0]]}; give a number.")
    not_deeper = np.flatnonzero(np.diff(depth) <= 0)
    if not_deeper.size:
        i = int(not_deeper[0])
        raise ValueError(
            f"SoundSpeedProfile.depth[{i + 1}] is {depth[i + 1]:g} m after {depth[i]:g} m; "
            "depths must increase downward. Sort the rows, and keep one of each depth."
        )
    impossible = np.flatnonzero((speed < SLOWEST) | (speed > FASTEST))
    if impossible.size:
        i = int(impossible[0])
        raise ValueError(
            f"SoundSpeedProfile.speed[{i}] is {speed[i]:g} m/s; water carries sound at {SLOWEST:g} to "
            f"{FASTEST:g} m/s. Are the columns exchanged, or the unit not m/s?"
        )
