"""Columns of the array of radials, which has one row for each radial.

* COSINE, SINE: of the bearing in the frame of the seabed's height map [1].
* CELL_WIDTH: angular width of the seabed cells that the radial represents [rad].
* BEAM_SPREAD: angular width over which the bearings of the beams are distributed [rad]; 0: all in the middle.
* START, STOP: smallest and largest horizontal distance of its samples [m].
* FIRST_SAMPLE: horizontal distance of the sample of index 0 from the sonar, in steps of the radial [1].
* NUMBER: number of the radial, from which its quasirandom numbers follow.
* STRIDE: step of this radial, in steps of the radials' frame (`RadialFrame.step`) [1].
"""

COSINE, SINE, CELL_WIDTH, BEAM_SPREAD, START, STOP, FIRST_SAMPLE, NUMBER, STRIDE = range(9)
