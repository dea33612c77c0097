"""How sound travels between the sonar and a point."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from insonify.propagation.eigenray import eigenrays
    from insonify.propagation.eigenray_record import Eigenrays

_HOME = {"Eigenrays": "eigenray_record", "eigenrays": "eigenray"}

__all__ = ["Eigenrays", "eigenrays"]


def __getattr__(name: str) -> Any:
    # On demand: the kernels are slow to import, and settings live in this package too.
    if name in _HOME:
        return getattr(importlib.import_module(f"insonify.propagation.{_HOME[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
