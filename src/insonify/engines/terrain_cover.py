"""Fraction of the seabed that terrain hides from the sonar; where it is large, fast reverberation is not valid.

Fast reverberation takes one terrain profile for each radial, allocates samples over a flat seabed, and ends paths
abruptly behind crests. Where ridges hide much of the seabed, the few visible patches dominate the echo, and the error
of its level averaged over 2 ms grows from 0.1 dB to several dB.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry

MAX_HIDDEN_FRACTION = 0.1
"""Largest fraction of the seabed in the window, hidden by terrain, for which fast reverberation is used [1]."""
BEARINGS = (-0.08, -0.04, 0.0, 0.04, 0.08)
"""Bearings of the profiles re the boresight [rad]."""
SAMPLES = 4096
"""Largest number of samples of a profile."""


def hidden_fraction(terrain: SeabedTerrain, ping_geometry: PingGeometry) -> float:
    """Fraction of the window's distances at which terrain occludes direct paths from the transmitter [1].

    Slant ranges of the window are taken as horizontal distances.

    Args:
        terrain: The terrain.
        ping_geometry: The sonar at one ping.
    """
    north, east, depth = ping_geometry.transmit_position
    nearest, farthest = (ping_geometry.sound_speed * delay / 2 for delay in ping_geometry.recorded_delays)
    step = max(terrain.heightmap_cell_size, farthest / SAMPLES)
    distance: NDArray[np.float64] = np.arange(step, farthest, step)
    if not len(distance):
        return 0.0
    bearing = np.arctan2(ping_geometry.boresight[1], ping_geometry.boresight[0]) + np.array(BEARINGS)[:, None]
    sample = terrain.relief.sample(north + distance * np.cos(bearing), east + distance * np.sin(bearing))
    launch = (terrain.depth - np.asarray(sample.height) - depth) / distance
    hidden = launch > np.minimum.accumulate(launch, axis=1)
    return float(hidden[:, distance > min(nearest, farthest - step) - step].mean())
