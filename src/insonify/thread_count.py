"""Number of threads: as given, or one for each core."""

import os
from numbers import Integral
from typing import Any


def thread_count(threads: Any) -> int:
    """Number of threads to use [1].

    Args:
        threads: Number of threads; None: one for each core.

    Raises:
        ValueError: It is no whole number of 1 or more.

    Example:
        >>> thread_count(2)
        2
    """
    if threads is None:
        return os.cpu_count() or 1
    if not isinstance(threads, Integral) or isinstance(threads, bool) or threads < 1:
        raise ValueError(f"threads is {threads!r}; give a whole number of 1 or more, or None for one on each core")
    return int(threads)
