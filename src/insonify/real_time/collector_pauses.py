"""Pauses of the garbage collector between live pings: objects that exist before them are left out of collections.

A full collection visits every object of the process: 0.1 to 0.3 s once the compiler and xarray are loaded, ten times
the time of a small ping. After a warm-up nearly all objects are there to stay.
"""

import gc
import threading

_LOCK, _HOLDERS = threading.Lock(), set[object]()


def exclude_present_objects(holder: object) -> None:
    """Collect once, then leave all objects of the process out of later collections.

    Args:
        holder: Object that gives them back with `include_all_objects`.
    """
    with _LOCK:
        _HOLDERS.add(holder)
        gc.collect()
        gc.freeze()


def include_all_objects(holder: object) -> None:
    """Collect all objects again, once every holder has given them back.

    Args:
        holder: Object given to `exclude_present_objects`; without effect for any other.
    """
    with _LOCK:
        if holder in _HOLDERS:
            _HOLDERS.remove(holder)
            if not _HOLDERS:
                gc.unfreeze()
