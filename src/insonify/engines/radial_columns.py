"""Columns of the array of radials, which has one row for each radial.

* COSINE, SINE: bearing in the frame of the seabed's height map [1].
* CELL_WIDTH: angular width of the seabed cells that the radial represents [rad].
* BEAM_SPREAD: angular width over which the bearings of the beams are distributed [rad]; 0: all in the middle.
* START, STOP: smallest and largest horizontal distance that is received [m].
* FIRST_SAMPLE: distance of the first sample in steps of the radial [1].
* NUMBER: number of the radial, from which its quasirandom numbers follow.
* STRIDE: steps of the radials' frame in one step of this radial [1].
"""

COSINE, SINE, CELL_WIDTH, BEAM_SPREAD, START, STOP, FIRST_SAMPLE, NUMBER, STRIDE = range(9)
