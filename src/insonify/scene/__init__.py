"""The scene: seabed, surface, targets, and their scatterers.

The parts of a scenario's scene are here by name: `from insonify.scene import Box, Seabed, Surface`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from insonify.scene.scatterer_grid import ScattererGrid as ScattererGrid
    from insonify.scene.scene import Scene as Scene
    from insonify.scene.seabed import Seabed as Seabed
    from insonify.scene.surface import Surface as Surface
    from insonify.scene.target import Box as Box
    from insonify.scene.target import Cone as Cone
    from insonify.scene.target import Cylinder as Cylinder
    from insonify.scene.target import LibraryTarget as LibraryTarget
    from insonify.scene.target import Mesh as Mesh
    from insonify.scene.target import Plate as Plate
    from insonify.scene.target import PointTarget as PointTarget
    from insonify.scene.target import Sphere as Sphere
    from insonify.scene.target import TruncatedCone as TruncatedCone
    from insonify.scene.texture import Texture as Texture

_HOMES = {
    "PointTarget": "target", "ScattererGrid": "scatterer_grid", "Scene": "scene", "Seabed": "seabed",
    "Surface": "surface", "Texture": "texture",
}  # fmt: skip

__all__ = [
    "Box", "Cone", "Cylinder", "LibraryTarget", "Mesh", "Plate", "PointTarget", "ScattererGrid", "Scene", "Seabed",
    "Sphere", "Surface", "Texture", "TruncatedCone",
]  # fmt: skip


def __getattr__(name: str) -> object:
    """Load a public name when it is first used."""
    if name in _HOMES:
        return getattr(import_module(f"insonify.scene.{_HOMES[name]}"), name)
    if name[:1].isupper() and name in (shapes := import_module("insonify.scene.target").SHAPES):
        return shapes[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Every public name, loaded or not."""
    return sorted(__all__)
