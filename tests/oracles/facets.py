"""A rough sea as geometry alone: what a wind's spectrum makes of a bounce, and facets that flash between two places.

Nothing of the propagation's draws: the spectrum is integrated here, and a flash is wherever a slope of the right
probability would mirror the source into the point (Kirchhoff's integral by stationary phase; Ishimaru 1978, ch. 21,
not verified: (q / q_z)^4 P(slopes) / 4 for each area, over both distances squared). The first order in slopes is that
of a plane tilted by them.
"""

from dataclasses import dataclass

import numpy as np

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily


@dataclass(frozen=True)
class Bounce:
    """A path off the surface between two depths."""

    above: float
    """Depth of the source [m]."""
    point: float
    """Depth of the point [m]."""
    away: float
    """Distance over ground [m]."""
    wavenumber: float
    """Of the sound [rad/m]."""

    @property
    def length(self) -> float:
        """Of the mirrored path [m]."""
        return float(np.hypot(self.away, self.above + self.point))

    @property
    def sine(self) -> float:
        """Of its grazing angle [1]."""
        return (self.above + self.point) / self.length


@dataclass(frozen=True)
class Sea:
    """A wind sea for one bounce; waves at an angle to the path [rad]."""

    wind: float
    bounce: Bounce
    turned: float = 0.0

    def integral(self, of) -> float:
        """Integral of the spectrum of heights times a function of wavenumber and the mean of cos^2 re the wind."""
        sea = Elfouhaily(self.wind)
        k = np.geomspace(sea.peak / 20, self.bounce.wavenumber / 3, 2000)
        angle = np.linspace(-np.pi, np.pi, 361)[:-1]
        density = np.array([ElfouhailySpreading(sea).density(angle, np.full(angle.size, one)) for one in k[::20]])
        ahead = np.interp(k, k[::20], (density @ np.cos(angle) ** 2) / density.sum(axis=1))
        return float(np.trapezoid(sea.density(k) * of(k, ahead) * k, np.log(k)))

    @property
    def variance(self) -> float:
        """Of the height [m^2]."""
        return self.integral(lambda k, ahead: np.ones(k.size))

    @property
    def quanta(self) -> float:
        """4 Gamma^2, the square of the phase's deviation [1]."""
        return 4 * (self.bounce.wavenumber * self.bounce.sine) ** 2 * self.variance

    def moment(self, later: float) -> float:
        """E[rho(t) rho*(t + later)] = exp(-4 Gamma^2 (1 - rho_eta))."""
        still = self.integral(lambda k, ahead: 1 - np.cos(np.sqrt(9.81 * k * (1 + (k / 370) ** 2)) * later))
        return float(np.exp(-self.quanta * still / self.variance))

    @property
    def slopes(self) -> tuple[float, float]:
        """Variance of the slope along the path and across it [1]."""
        along = self.integral(lambda k, ahead: k**2 * ahead)
        across = self.integral(lambda k, ahead: k**2 * (1 - ahead))
        c, s = np.cos(self.turned) ** 2, np.sin(self.turned) ** 2
        return along * c + across * s, along * s + across * c

    def first_order(self) -> tuple[float, float, float]:
        """Mean excess of the length [m], and rms of the direction at the source across and up [1], for small slopes."""
        b, (along, across) = self.bounce, self.slopes
        near = b.length * b.above / (b.above + b.point)
        far = b.length - near
        turn, together = 2 * far / b.length, 1 / near + 1 / far
        return 2 / together * (along + b.sine**2 * across), turn * b.sine * across**0.5, turn * along**0.5

    def flashes(self) -> tuple[float, float, float]:
        """The same from every place that can flash."""
        b, (along, across) = self.bounce, self.slopes
        x, y = np.linspace(-60, b.away + 110, 1361)[:, None], np.linspace(-60, 60, 481)[None, :]
        to, on = (np.stack(np.broadcast_arrays(*way), axis=-1) for way in ((x, y, -b.above), (b.away - x, -y, b.point)))
        near, far = np.linalg.norm(to, axis=-1), np.linalg.norm(on, axis=-1)
        q = on / far[..., None] - to / near[..., None]
        steep = (q[..., 0] / q[..., 2]) ** 2 / along + (q[..., 1] / q[..., 2]) ** 2 / across
        power = np.exp(-steep / 2) * np.sum(q**2, axis=-1) ** 2 / q[..., 2] ** 4 / (near * far) ** 2
        power /= power.sum()
        aside, up = to[..., 1] / near, -to[..., 2] / near
        spread = [float(np.sqrt(np.sum(power * v**2) - np.sum(power * v) ** 2)) for v in (aside, up)]
        return float(np.sum(power * (near + far))) - b.length, *spread
