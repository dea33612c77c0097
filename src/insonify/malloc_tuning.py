"""Settings of the C library that keep freed memory for the next ping.

By default glibc returns every large array to the system and requests it again, and the system fills it with
zeros page by page: a tenth of the time of a ping, and more on a virtual machine.

Source: mallopt(3), the Linux manual pages: M_TRIM_THRESHOLD and M_MMAP_THRESHOLD.
"""

import ctypes
import sys
from functools import lru_cache

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
TRIM_THRESHOLD_BYTES = 512 << 20
"""Freed memory that is kept, at most, by each part of the heap [bytes]."""
MMAP_THRESHOLD_BYTES = 32 << 20
"""Arrays up to this size come from the heap: the most that glibc allows [bytes]."""


@lru_cache(maxsize=1)
def keep_freed_memory() -> bool:
    """Apply the settings once; True if the C library supports them (glibc), others are left unchanged."""
    if sys.platform != "linux":
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError):
        return False
    return bool(mallopt(_MMAP_THRESHOLD, MMAP_THRESHOLD_BYTES)) and bool(mallopt(_TRIM_THRESHOLD, TRIM_THRESHOLD_BYTES))
