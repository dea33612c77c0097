"""Pictures of what was simulated, for people who read sonar: axes with units, one colour for one cause.

Everything is drawn with matplotlib onto figures of our own; no display and no global state is needed.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.drawing.absorption import absorption
    from insonify.drawing.geometry import geometry
    from insonify.drawing.labels import labels
    from insonify.drawing.laws import laws, lobe, sediment
    from insonify.drawing.levels import levels
    from insonify.drawing.profile import profile
    from insonify.drawing.rays import rays
    from insonify.drawing.recording import recording
    from insonify.drawing.relief import relief
    from insonify.drawing.scene import scene
    from insonify.drawing.sea import sea
    from insonify.drawing.spikes import spikes

__all__ = [
    "absorption",
    "geometry",
    "labels",
    "laws",
    "levels",
    "lobe",
    "profile",
    "rays",
    "recording",
    "relief",
    "scene",
    "sea",
    "sediment",
    "spikes",
]

_HOMES = {name: {"lobe": "laws", "sediment": "laws"}.get(name, name) for name in __all__}
"""Modules of the functions: each is imported when it is first used, for a picture of one kind needs few of them."""


class _Drawing(ModuleType):
    """This package; a function that has the name of its module stands before it, however the module was imported."""

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
