"""Columns of the array of radials: one row for each radial, nine numbers."""

COSINE = 0
"""Cosine of the bearing in the frame of the seabed's height map [1]."""
SINE = 1
"""Sine of that bearing [1]."""
CELL_WIDTH = 2
"""Angular width of the seabed cells that the radial represents [rad]."""
BEAM_SPREAD = 3
"""Angular width over which the bearings of the beams are distributed [rad]; 0: all in the middle."""
START = 4
"""Smallest horizontal distance that is received [m]."""
STOP = 5
"""Largest horizontal distance that is received [m]."""
FIRST_SAMPLE = 6
"""Distance of the first sample in steps of the radial [1]."""
NUMBER = 7
"""Number of the radial, from which its quasirandom numbers follow."""
STRIDE = 8
"""Steps of the radials' frame in one step of this radial [1]."""
