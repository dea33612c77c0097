"""Processor time and memory of single operations, by which `insonify.estimates.run_cost` prices a run.

Measured on an x86 core of the 2020s, and scaled by `insonify.estimates.machine_pace`; `python benchmarks/run.py
estimate` compares the sums with runs.
"""

START_SECONDS = 2.6
"""Start of a run: libraries, validation, kernels read from their cache [s]."""
PING_SECONDS = 4e-3
"""Share of each ping and side that does not depend on its scatterers [s]."""
WRITE_SECONDS, LABEL_WRITE_SECONDS = 1.5e-3, 1.8e-3
"""One ping written to disk, and its labels [s]."""
SECONDS_PER_LEG, SECONDS_PER_PAIR = 0.06e-6, 0.06e-6
"""One leg, and one pair in one channel [s]."""
SECONDS_PER_EXPECTED_PAIR = 0.2e-6, 0.07e-6
"""One pair of an expectation outside the fast path, and its energy in each channel [s]."""
SECONDS_PER_GLINT_PAIR = 0.1e-6, 4e-9
"""The same for legs off a moving surface: each of their glints makes pairs of its own [s]."""
SECONDS_PER_SECTION = 0.5e-6
"""Cross section of one pair by a law other than Lambert's [s]."""
SECONDS_PER_PAIR_APART, SECONDS_PER_SURFACE_SECTION = 1.4e-6, 5e-6
"""One pair of an expectation between two platforms, and its cross section by the surface's law of wind [s]."""
ELEMENTS_SECONDS = 0.04
"""Share of each ping and side of an array of elements [s]."""
EXPECTED_SECONDS = 0.015
"""Share of each ping and side that does not depend on its points, of an expectation outside the fast path [s]."""
SECONDS_PER_CELL = 8e-9, 3.5e-9
"""A cell of a series and each doubling of their number, coherent and expected [s]."""
SECONDS_PER_PHASOR = 2e-9
"""A row of directions or a beam at one point of an aperture, at one frequency [s]."""
SECONDS_PER_ROW_PRODUCT = 0.07e-9
"""One cell of a row of directions, weighted for one beam [s]."""
SECONDS_PER_ELEMENT, SECONDS_PER_WAVEFORM = 14e-9, 3e-9
"""One echo at one element of an array, and each shape beyond the first [s]."""
SECONDS_PER_TERRAIN_POINT = 0.36e-6
"""Height and slope of one kind of relief at one position [s]."""
SECONDS_PER_HEIGHTMAP_NODE = 9e-9, 0.15e-6, 0.2e-6
"""One octave at one node of the seabed's height map; one finer than a quarter of a cell; other relief [s]."""
SECONDS_PER_FAST_REVERBERATION, SECONDS_PER_STEP, SECONDS_PER_STEP_LEG = 1e-3, 45e-9, 18e-9
"""Terrain by the fast reverberation path: for any ping, for each step along a radial, for each leg to it [s]."""
SECONDS_PER_FIT, SECONDS_PER_GLINT = 2.2e-6, 1.7e-6
"""One leg off the planes of its own bounces, over relief, and the glints of one [s]."""
SECONDS_PER_WAVE, SECONDS_PER_WAVE_NODE, SECONDS_PER_BOUNCE_ROW = 4.3e-9, 50e-9, 5e-6
"""One of a surface's explicit waves at one node of the search for bounce points, the paths to the node, and one bounce
point of a leg beyond the first [s]."""
SECONDS_PER_REFRACTED_WAVE_LEG, SECONDS_PER_WAVE_LEG_KNOT = 20e-6, 1.5e-6
"""More of it in layered water, and for each knot of the profile [s]."""
SECONDS_PER_HULL_FACTOR, SECONDS_PER_FACE_LEG = 0.3e-6, 1.2e-6
"""Part of one leg that passes a hull or is reflected by it, and one leg off a smooth face with its size [s]."""
SECONDS_PER_REFRACTED_LEG = 0.5e-6
"""One leg of refracted rays, more than a straight one [s]."""
SECONDS_PER_DIFFRACTING_COLUMN, SECONDS_PER_DIFFRACTING_BOX = 10e-9, 120e-9
"""One leg diffracted by one column of a solid's silhouette, and by one upright box [s]."""
SECONDS_PER_DELAY = 0.15e-6
"""Random delay of one leg in inhomogeneous water [s]."""
SECONDS_PER_RAY = 6.5e-6
"""One ray of the tracer, followed to its end [s]."""
SECONDS_PER_PIECE = 1.8e-6
"""One of the pieces into which bodies are divided, once, before points are placed on them [s]."""
LABEL_SWATH_SECONDS, SECONDS_PER_LABEL_STEP_LEG = 2e-3, 0.09e-6
"""Labels of the seabed by the fast path, more than its energies: for any ping and side, for each leg to a step [s]."""
SECONDS_PER_LABEL = 0.15e-6
"""One pair in one channel, labelled [s]."""
SECONDS_PER_SLICE_PING = 0.02
"""One ping of a slice without its points [s]."""

SECONDS_PER_FACET, SECONDS_PER_SPECULAR_PAIR = 11e-6, 0.15e-6
"""One facet of a smooth target, split from its face, and one of its pairs in one channel [s]."""

BYTES_OF_PROGRAM = 310e6
"""Python with the libraries and kernels of a run."""
BYTES_PER_PING = 800
"""Poses of a ping at the start, middle and end of its window, its entries in masks and its job."""
BYTES_PER_TILE = 2500
"""A tile of the seabed while the tiles of a ping are searched for, and as a block in waiting."""
BYTES_OF_RELIEF = 80e6
"""Caches of the terrain."""
BYTES_PER_FACET, BYTES_PER_FACET_IN_SPLIT = 275, 350
"""One facet of a smooth target during the ping, and more while the faces of its target are split."""
BYTES_PER_TRIANGLE = 430
"""One triangle of a solid while the tree of all triangles is built."""
BYTES_PER_PIECE = 350
"""One piece of a body while it is cut up."""

FILE_BYTES, PING_FILE_BYTES = 28e3, 60.0
"""Files of a recording that do not grow with it, and those that each ping adds."""
PACKED, TIME_COMPRESSION_RATIO, POSE_COMPRESSION_RATIO = 0.93, 0.55, 0.9
"""Size after compression re before: samples of sound, the time axis, and the columns of each ping [1]."""
LABEL_FILE_BYTES = 20e3
"""Files of labels that do not grow with them."""
LABEL_COMPRESSION_RATIO = 0.3
"""Size of labels after compression re before [1]."""
