"""Sine and cosine of a number of cycles, as arithmetic that compilers turn into vector code.

A carrier of 100 kHz has turned 27 000 times when an echo comes back after 0.27 s. The whole
turns are removed in float64, where they are exact; what is left is small, and float32 does.
A call into the maths library would make a loop run one number at a time, so here are polynomials.
"""

import numpy as np

from insonify.jit import njit

# Minimax fits over a quarter turn y either side of zero, in powers of y^2, by iterated weighted
# least squares: sin(2 pi y) / y to 3e-9, cos(2 pi y) to 2e-10; float32 rounding is what remains.
_S0, _S1, _S2, _S3, _S4 = (np.float32(c) for c in (6.28318516, -41.34165503, 81.60100413, -76.54978348, 39.53671477))
_C0, _C1, _C2, _C3, _C4, _C5 = (
    np.float32(c) for c in (1.0, -19.73920855, 64.93934663, -85.45357167, 60.14401583, -24.9822425)
)
_ONE = np.float32(1)
_TWO = np.float32(2)
_HALF = np.float32(0.5)


@njit(inline="always")
def sincos_cycles(cycles: float) -> tuple[np.float32, np.float32]:
    """Sine and cosine of an angle counted in cycles.

    Args:
        cycles: Angle [cycles], a float64 scalar, whole turns included.

    Returns:
        (sin, cos) of 2 pi cycles [1], float32 scalars, each within 2e-7 while |cycles| < 1e8.
    """
    # Half turns come out, in float64: both functions change sign, and the polynomials see a quarter turn at most.
    half = np.floor(2.0 * cycles + 0.5)
    y = np.float32(cycles - 0.5 * half)
    odd = np.float32(half - 2.0 * np.floor(0.5 * half))
    return _sincos_of_quarter(y, odd)


@njit(inline="always")
def sincos_of_few(cycles: np.float32) -> tuple[np.float32, np.float32]:
    """Sine and cosine of a few cycles in float32: (sin, cos) of 2 pi cycles [1], float32 scalars.

    Args:
        cycles: Angle [cycles], a float32 scalar.
    """
    half = np.floor(_TWO * cycles + _HALF)
    return _sincos_of_quarter(cycles - _HALF * half, half - _TWO * np.floor(_HALF * half))


@njit(inline="always")
def _sincos_of_quarter(y: np.float32, odd: np.float32) -> tuple[np.float32, np.float32]:
    """Sine and cosine of a quarter turn y at most either side of zero [cycles], negated for odd 1."""
    sign = _ONE - _TWO * odd
    t = y * y
    sine = y * (_S0 + t * (_S1 + t * (_S2 + t * (_S3 + t * _S4))))
    cosine = _C0 + t * (_C1 + t * (_C2 + t * (_C3 + t * (_C4 + t * _C5))))
    return sign * sine, sign * cosine
