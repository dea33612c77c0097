"""Target shape of a test: a block whose upper face is shorter than its base."""

from typing import Literal

from insonify.scene import triangle_surfaces
from insonify.scene.body import Body, Dimensions, Size
from insonify.scene.triangle_surfaces import Triangles


class Wedge(Body):
    """A block with slanting ends."""

    shape: Literal["wedge"] = "wedge"
    label: str = "wedge"
    size: Dimensions
    """Length of the base, width, height [m]."""
    top_length: Size
    """Length of the upper face [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        length, width, height = self.size
        return triangle_surfaces.wedge(length, self.top_length, width, height)
