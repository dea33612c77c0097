"""Figures of scenarios, physics and recordings: axes with units, one colour for each contribution.

All figures are drawn with matplotlib on separate `Figure` objects; no display and no global state is needed.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.plotting.absorption import absorption
    from insonify.plotting.labels import labels
    from insonify.plotting.laws import laws, lobe, sediment
    from insonify.plotting.leg_diagram import geometry
    from insonify.plotting.levels import levels
    from insonify.plotting.profile import profile
    from insonify.plotting.rays import rays
    from insonify.plotting.recording import recording
    from insonify.plotting.relief_spectrum import relief
    from insonify.plotting.scene_view import scene
    from insonify.plotting.sea_state import sea
    from insonify.plotting.spikes import spikes

__all__ = [
    "absorption", "geometry", "labels", "laws", "levels", "lobe", "profile", "rays", "recording", "relief", "scene",
    "sea", "sediment", "spikes",
]  # fmt: skip

_HOMES = {name: name for name in __all__} | {
    "geometry": "leg_diagram", "lobe": "laws", "relief": "relief_spectrum", "scene": "scene_view", "sea": "sea_state",
    "sediment": "laws",
}  # fmt: skip
"""Modules of the functions, imported on first use: a figure of one kind needs few of them."""


class _Drawing(ModuleType):
    """This package; a function takes precedence over the module of the same name, in any order of import."""

    def __getattr__(self, name: str) -> object:
        if name not in _HOMES:
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(import_module(f"{self.__name__}.{_HOMES[name]}"), name)

    def __setattr__(self, name: str, value: object) -> None:
        if name in _HOMES and isinstance(value, ModuleType):
            value = getattr(value, name)
        super().__setattr__(name, value)

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *__all__})


sys.modules[__name__].__class__ = _Drawing
