"""Whether the mean plane of a bed is mirror enough for one ping, or bounces need planes of their own.

Over gentle relief, or at long pulses, the legs off the mean plane and off the planes fitted to each bounce cannot be
told apart. What is quicker with one plane for all asks here first.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines.sampling import reach
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.local_planes import level_course, local_course
from insonify.propagation.rays import Rays
from insonify.scene.scene import Scene
from insonify.sonar.footprint import two_way_width
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

DISTANCES, BEARINGS = 48, 5
"""Where legs are tried: distances in the window, bearings over twice the width of the beam [1]."""
MOST = 0.25
"""Part of the resolution, and of the beam, that the mean plane may be off [1]."""
SHARE = 0.95
"""Share of the legs tried that must be as good [1]."""
_ELEVATIONS = np.radians(np.arange(-90, 90.1, 0.5))


@dataclass(frozen=True, slots=True)
class MeanPlaneError:
    """How far legs off the mean plane are from those off local planes, at one ping; 95 % of legs have less."""

    delay: float
    """Of one leg, as part of the one-way time that the pulse resolves, slant resolution over sound speed [1]."""
    azimuth: float
    """Horizontal change of direction at the sonar, as part of the width of the finest two-way beam [1]."""
    elevation: float
    """Vertical change of direction at the sonar, as part of the height of the two-way beam [1]."""

    @property
    def small(self) -> bool:
        """Whether all three are below a quarter."""
        return max(self.delay, self.azimuth, self.elevation) < MOST


def mean_plane_serves(scene: Scene, choice: PathChoice, stance: Stance, rays: Rays) -> bool:
    """Whether the mean plane of the bed is mirror enough for the seabed's multiples at one ping.

    Args:
        scene: The scene.
        choice: Which paths are followed.
        stance: The sonar at this ping.
        rays: How sound travels in the scene.

    Returns:
        True for a flat bed, and where no family that reaches the bed bounces off it before.
    """
    return mean_plane_error(scene, choice, stance, rays).small


def mean_plane_error(scene: Scene, choice: PathChoice, stance: Stance, rays: Rays) -> MeanPlaneError:
    """What the mean plane gets wrong at one ping, from legs tried over the window and the beam.

    Args:
        scene: The scene.
        choice: Which paths are followed.
        stance: The sonar at this ping.
        rays: How sound travels in the scene.
    """
    bed = scene.seabed.bed
    kept = families_for("seabed", choice.followed)
    bounced = [name for name in kept if "B" in name]
    if bed is None or bed.span[0] == bed.span[1] or not bounced:
        return MeanPlaneError(0.0, 0.0, 0.0)
    place, low, high = stance.transmit_place, *bed.span
    heard = reach(stance, bed.depth, rays, kept, rise=max(bed.depth - low, high - bed.depth))
    if heard.farthest < 0:
        return MeanPlaneError(0.0, 0.0, 0.0)
    width = two_way_width(stance.transmit_beams, stance.receive_beams)
    distance, turn = np.meshgrid(
        np.linspace(max(heard.nearest, heard.farthest / DISTANCES), heard.farthest, DISTANCES),
        stance.bearing + width * np.linspace(-1, 1, BEARINGS),
    )
    ground = place[:2] + np.stack([distance * np.cos(turn), distance * np.sin(turn)], axis=-1).reshape(-1, 2)
    points = np.column_stack([ground, bed.depth_at(*ground.T)])
    points = points[np.isfinite(points[:, 2])]
    off = np.concatenate([_differences(name, place, points, scene, stance) for name in bounced])
    if not len(off):
        return MeanPlaneError(0.0, 0.0, 0.0)
    delay, azimuth, elevation = np.quantile(off, SHARE, axis=0)
    resolved = stance.pulse.finest_resolution(stance.sound_speed)
    return MeanPlaneError(float(delay / resolved), float(azimuth / width), float(elevation / beam_height(stance)))


def _differences(name: str, place: Floats, points: Floats, scene: Scene, stance: Stance) -> Floats:
    """Change of length [m], of azimuth and of elevation [rad] of the legs that are there by both planes, (n, 3)."""
    bed = scene.seabed.bed
    assert bed is not None  # asked only for relief
    level = level_course(name, place, points, bed.depth)
    local = local_course(name, place, points, bed, stance.wavelength)
    both = level.there & local.there
    one, other = level.departure[both], local.departure[both]
    turned = np.arctan2(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0], np.sum(one[:, :2] * other[:, :2], axis=1))
    risen = np.arcsin(np.clip(other[:, 2], -1, 1)) - np.arcsin(np.clip(one[:, 2], -1, 1))
    # near the vertical an azimuth means little
    turned *= np.hypot(one[:, 0], one[:, 1])
    return np.abs(np.stack([(local.length - level.length)[both], turned, risen], axis=-1))


def beam_height(stance: Stance) -> float:
    """Full height of the two-way beam between half-power elevations, in the vertical plane of its bearing [rad].

    Args:
        stance: The sonar at one ping.
    """
    ahead = np.cos(_ELEVATIONS)
    ways = np.stack([ahead * np.cos(stance.bearing), ahead * np.sin(stance.bearing), np.sin(_ELEVATIONS)], axis=-1)
    power = (stance.transmit_beams.gain(ways) * stance.receive_beams.gain(ways)) ** 2
    heard = power[0] >= power[0].max() / 2
    return float(max(np.ptp(_ELEVATIONS[heard]), np.radians(0.5)))
