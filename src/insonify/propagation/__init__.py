"""Propagation of sound between the sonar and points in the scene."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from insonify.propagation.eigenray import eigenrays
    from insonify.propagation.eigenray_record import Eigenrays

_HOME = {"Eigenrays": "eigenray_record", "eigenrays": "eigenray"}

__all__ = ["Eigenrays", "eigenrays"]


def __getattr__(name: str) -> Any:
    # Loaded on first use: the kernels are slow to import, and settings are in this package too.
    if name in _HOME:
        return getattr(importlib.import_module(f"insonify.propagation.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
