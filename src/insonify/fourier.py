"""Lengths of fast Fourier transforms, without the tenth of a second that loading `scipy.fft` takes."""

from functools import lru_cache


@lru_cache(maxsize=64)
def fast_length(least: int, *, real: bool = False) -> int:
    """Smallest length of a fast transform that is not shorter, as of `scipy.fft.next_fast_len`.

    Args:
        least: Number of samples to transform, at least 1.
        real: True: they are real numbers.

    Returns:
        A product of powers of 2, 3, 5; of complex numbers 7 and 11 too.
    """
    most = 1 << (least - 1).bit_length()
    odd = [1]
    for factor in (3, 5) if real else (3, 5, 7, 11):
        for one in odd:  # grows while it is read: every power of the factor
            if one * factor < most:
                odd.append(one * factor)
    return min(one << (-(-least // one) - 1).bit_length() for one in odd)
