"""Gridding kernel: deposits one spike on a few cells, with one polynomial per cell.

It is the "exponential of semicircle" exp(beta (sqrt(1 - (2 x / W)^2) - 1)), |x| <= W / 2 cells: for its width
it leaks almost as little into the images of the spectrum as any kernel can. Over each cell it is replaced by a
polynomial in the position of the spike between the cells. The transform of these polynomials is divided out
afterwards, so the replacement costs no accuracy.

Source of the kernel: Barnett, Magland & af Klinteberg (2019), SIAM J. Sci. Comput. 41(5).
"""

import numpy as np
from numpy.typing import NDArray

WIDTH = 7
"""Cells that one spike is deposited on."""
DEGREE = 5
"""Degree of the polynomial of each cell."""
SHAPE = 2.36 * WIDTH
"""beta of the kernel, with the least error over the flat four fifths of the output band, whose filter has a
cosine-squared roll-off beyond."""
CELLS_PER_SPIKE = 8
"""Number of cells from the first one on to which a kernel may write: the width, padded with zeros to vector lanes."""


def tap_coefficients() -> NDArray[np.float32]:
    """Polynomials of the kernel, shape (DEGREE + 1, CELLS_PER_SPIKE), constant term first.

    Cell j of a spike has the polynomial j in y, the position of the spike between cells, -1/2..1/2: the cell lies
    j - (WIDTH - 1) / 2 - y cells after the spike.
    """
    nodes = np.cos(np.pi * (np.arange(24) + 0.5) / 24) / 2
    taps = np.zeros((DEGREE + 1, CELLS_PER_SPIKE), np.float32)
    for j in range(WIDTH):
        distance = j - (WIDTH - 1) / 2 - nodes
        kernel = np.exp(SHAPE * (np.sqrt(np.maximum(0, 1 - (2 * distance / WIDTH) ** 2)) - 1))
        taps[:, j] = np.polynomial.polynomial.polyfit(nodes, kernel, DEGREE)
    return taps


def kernel_transform(frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fourier transform of the kernel at a frequency in cycles per cell [1], any shape (the kernel is even)."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    taps = tap_coefficients().astype(np.float64)
    transform = np.zeros(np.shape(frequency))
    for j in range(WIDTH):
        for node, weight in zip(nodes / 2, weights / 2, strict=True):
            height = np.polynomial.polynomial.polyval(node, taps[:, j])
            transform += weight * height * np.cos(2 * np.pi * frequency * (j - (WIDTH - 1) / 2 - node))
    return transform
