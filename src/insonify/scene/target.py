"""Targets: objects in the scene.

An upright box, a point, and solids: triangulated bodies that may lean, be buried, or come from a file. All but points
scatter from their faces and cast shadows.
"""

from typing import Annotated, Any, ClassVar, Literal, Self, TypeGuard, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from insonify.data_file import DataFile, Fingerprint, require_unchanged
from insonify.model import Coordinate, Decibels, Model, field_error
from insonify.scattering.lambert import Lambert
from insonify.scene import triangle_surfaces
from insonify.scene.body import Body, Dimensions, Size
from insonify.scene.mesh_file import MeshError, mesh_parts, mesh_triangles, mesh_warnings
from insonify.scene.shape_library import PRESETS, preset_triangles
from insonify.scene.triangle_surfaces import Triangles


class Box(Body):
    """A box: rough faces that scatter by Lambert's law, and a body that casts shadows.

    Example:
        >>> crate = Box(position=(10, 40), size=("2 m", "1 m", "0.5 m"), heading="30 deg")
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[crate]).body_depths, 2).tolist()  # top and base [m]
        [19.5, 20.0]
    """

    shape: Literal["box"] = "box"
    label: str = "box"
    size: Dimensions
    """Length along the heading, width across it, height [m]."""

    @property
    def is_upright(self) -> bool:
        """True if the box neither leans nor is buried, so that it needs no triangles."""
        return not (self.pitch or self.roll or self.burial or self.burial_depth)

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return triangle_surfaces.block(*self.size)


class PointTarget(Model):
    """A point that scatters equally in all directions and casts no shadow.

    Example:
        >>> PointTarget(position=(10, 40, 15), target_strength_db="-20 dB").target_strength_db
        -20.0
    """

    shape: Literal["point"] = "point"
    label: str = "point"
    position: tuple[Coordinate, Coordinate, Coordinate]
    """North and east [m], and depth [m]."""
    target_strength_db: Annotated[Decibels, Field(ge=-200, le=100)] = 0.0
    """Target strength [dB re 1 m^2]."""


class Sphere(Body):
    """A sphere.

    Example:
        >>> ball = Sphere(position=(10, 40), diameter="1 m", base_depth="15 m")
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[ball]).body_depths, 2).tolist()  # top and base [m]
        [14.0, 15.0]
    """

    reflects_legs: ClassVar[bool] = False
    shape: Literal["sphere"] = "sphere"
    label: str = "sphere"
    diameter: Size
    """Diameter [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return triangle_surfaces.sphere(self.diameter)


class Cylinder(Body):
    """A circular cylinder with its axis along the heading, or vertical at a pitch of 90 degrees.

    Example:
        >>> mine = Cylinder(position=(10, 40), length="2 m", diameter="0.5 m", burial=0.4)
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[mine]).body_depths, 2).tolist()  # top and base [m]
        [19.7, 20.0]
    """

    reflects_legs: ClassVar[bool] = False
    shape: Literal["cylinder"] = "cylinder"
    label: str = "cylinder"
    length: Size
    """Length of its axis [m]."""
    diameter: Size
    """Diameter [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return triangle_surfaces.cylinder(self.length, self.diameter)


class Cone(Body):
    """A circular cone that stands on its base.

    Example:
        >>> cone = Cone(position=(10, 40), height="0.5 m", diameter="1 m")
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[cone]).body_depths, 2).tolist()  # top and base [m]
        [19.5, 20.0]
    """

    reflects_legs: ClassVar[bool] = False
    shape: Literal["cone"] = "cone"
    label: str = "cone"
    height: Size
    """Height from base to point [m]."""
    diameter: Size
    """Diameter of the base [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return triangle_surfaces.with_axis_up(triangle_surfaces.frustum(self.height, self.diameter, 0.0))


class TruncatedCone(Body):
    """A truncated circular cone that stands on its base.

    Example:
        >>> manta = TruncatedCone(position=(10, 40), height="0.4 m", diameter="1 m", top_diameter="0.5 m")
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[manta]).body_depths, 2).tolist()  # top and base [m]
        [19.6, 20.0]
    """

    reflects_legs: ClassVar[bool] = False
    shape: Literal["truncated_cone"] = "truncated_cone"
    label: str = "truncated_cone"
    height: Size
    """Height from base to top [m]."""
    diameter: Size
    """Diameter of the base [m]."""
    top_diameter: Size
    """Diameter of the top [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        frustum = triangle_surfaces.frustum(self.height, self.diameter, self.top_diameter)
        return triangle_surfaces.with_axis_up(frustum)


class Plate(Body):
    """A horizontal plate; at a pitch or roll of 90 degrees it stands on an edge.

    Example:
        >>> wall = Plate(position=(10, 40), length="4 m", width="3 m", roll="90 deg")
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[wall]).body_depths, 2).tolist()  # top and base [m]
        [17.0, 20.0]
    """

    shape: Literal["plate"] = "plate"
    label: str = "plate"
    length: Size
    """Length along the heading [m]."""
    width: Size
    """Width across the heading [m]."""
    thickness: Size = 0.01
    """Thickness [m]."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return triangle_surfaces.block(self.length, self.width, self.thickness)


class MeshPart(Model):
    """Scattering of the faces of a mesh that have one name in its file."""

    name: Annotated[str, Field(min_length=1)]
    """Name of a group, an object or a material of an OBJ file; of a node, a mesh or a material of a GLB file."""
    scattering: Lambert | None = None
    """Scattering law of these faces for their rough part; None: that of the body."""
    face_reflection_coefficient: Annotated[float, Field(ge=-1, le=1)] | None = None
    """Pressure reflection coefficient of their smooth part [1], 0 for rough faces; None: that of the body."""


class Mesh(Body):
    """A body of triangles from a file: STL, OBJ, PLY or GLB (glTF), in metres unless scaled.

    Example:
        >>> import trimesh
        >>> _ = trimesh.creation.box((2000.0, 1000.0, 500.0)).export("crate.stl")
        >>> crate = Mesh(file="crate.stl", scale=0.001, position=(10, 40))
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[crate]).body_depths, 2).tolist()  # top and base [m]
        [19.5, 20.0]
    """

    shape: Literal["mesh"] = "mesh"
    label: str = "mesh"
    file: DataFile
    """Path of the file; beside the scenario file, unless it starts from the root."""
    up: Literal["z", "y"] | None = None
    """Axis of the file that points up; None: y in GLB and glTF files, by their standard, z in all others."""
    scale: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """Metres in one unit of the file [m]: 0.001 for a drawing in millimetres."""
    parts: tuple[MeshPart, ...] = ()
    """Faces that scatter otherwise than the body, by their names in an OBJ or GLB file; where several names apply to a
    face, the last. One object in labels."""
    sha256: Fingerprint = None
    """Fingerprint of the file, filled in when it is read; a file that has changed since is refused."""

    @model_validator(mode="after")
    def _check_file(self) -> Self:
        require_unchanged(self.file, self.sha256)
        try:
            mesh_triangles(self.file, self.up, self.scale, self.sha256)
            if self.parts:
                self.parted_triangles()
        except MeshError as fault:
            raise field_error(fault.field, None, str(fault)) from None
        mesh_warnings(self.file, self.up, self.scale, self.sha256)
        return self

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        return self.parted_triangles()[0] if self.parts else mesh_triangles(self.file, self.up, self.scale, self.sha256)

    def parted_triangles(self) -> tuple[Triangles, NDArray[np.int64]]:
        """Surface, and for each triangle the row of its part, -1 for none."""
        names = tuple(part.name for part in self.parts)
        return mesh_parts(self.file, self.up, self.scale, self.sha256, names)


class MeshFaces(Mesh):
    """The faces of one part of a mesh, or of none: a solid of one law that lies as the whole mesh does."""

    whole: Mesh
    """The mesh with all its faces."""
    part: int
    """Row among its parts; -1 for faces of none."""

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        surface, row = self.parted_triangles()
        return surface.part(row == self.part)


def solids_of_one_law(solid: "Solid") -> "tuple[Solid, ...]":
    """The faces of each part of a mesh and those of none, each as a solid; any other solid itself."""
    if not isinstance(solid, Mesh) or not solid.parts or isinstance(solid, MeshFaces):
        return (solid,)
    _, row = solid.parted_triangles()
    values, solids = {name: getattr(solid, name) for name in Mesh.model_fields}, list[Solid]()
    for number in np.unique(row).tolist():
        entry = solid.parts[number] if number >= 0 else MeshPart(name=solid.label or "mesh")
        laws = {
            name: getattr(solid, name) if getattr(entry, name) is None else getattr(entry, name)
            for name in ("scattering", "face_reflection_coefficient")
        }
        solids.append(MeshFaces.model_construct(**{**values, **laws, "whole": solid, "part": number}))
    return tuple(solids)


def whole_solid(solid: "Solid") -> "Solid":
    """The mesh that some faces belong to; any other solid itself."""
    return solid.whole if isinstance(solid, MeshFaces) else solid


def key_label(solid: "Solid") -> str:
    """Label in the random keys of a solid's points: that of the body, and of faces of a mesh with their name."""
    if isinstance(solid, MeshFaces) and solid.part >= 0:
        return f"{solid.label}/{solid.whole.parts[solid.part].name}"
    return solid.label


class LibraryTarget(Body):
    """A shape from the library of typical objects, see `insonify.scene.shape_library`.

    Example:
        >>> drum = LibraryTarget(name="drum", position=(10, 40))
        >>> np.round(Scene(seabed=Seabed(depth="20 m"), targets=[drum]).body_depths, 2).tolist()  # top and base [m]
        [19.43, 20.0]
    """

    shape: Literal["library"] = "library"
    """The word library; or, instead of it and the name, the name itself, as in `shape: drum`."""
    label: str = ""
    """Name of the object in labels and arrivals; default: its name in the library."""
    name: Literal[PRESETS]  # type: ignore[valid-type]
    """Name of a shape of the library; left out where it is given as the shape."""
    size: Dimensions | None = None
    """Length, width and height to which the shape is scaled [m]; None: those of the library."""
    variant: Annotated[int, Field(ge=0, le=2**31)] = 0
    """Number of the rock [1]; other shapes have one variant, 0."""

    @model_validator(mode="before")
    @classmethod
    def _label_from_name(cls, data: Any) -> Any:
        return {"label": data["name"], **data} if isinstance(data, dict) and "name" in data else data

    @model_validator(mode="after")
    def _check_variant(self) -> Self:
        if self.variant and self.name != "rock":
            raise field_error(
                "variant", str(self.variant), f"is for rocks; there is one {self.name} only. Leave it out."
            )
        return self

    def triangles(self) -> Triangles:
        """Surface in its own axes, see `Body`."""
        surface = preset_triangles(self.name, self.variant)
        return surface if self.size is None else surface.scaled(np.array(self.size) / (surface.high - surface.low))


def _library_target_from_name(value: Any) -> Any:
    """A library target given by its name as its shape: `shape: drum`."""
    if isinstance(value, dict) and value.get("shape") in PRESETS and "name" not in value:
        return {**value, "shape": "library", "name": value["shape"]}
    return value


Solid = Box | Sphere | Cylinder | Cone | TruncatedCone | Plate | Mesh | LibraryTarget
"""Targets that are made of triangles, a box only if it leans or is buried; one entry registers a shape."""
SHAPES: dict[str, type[Body]] = {kind.__name__: kind for kind in get_args(Solid)}
"""Solids by the names of their classes."""
Target = Annotated[
    Annotated[Solid | PointTarget, Field(discriminator="shape")], BeforeValidator(_library_target_from_name)
]


def shape_name(target: Target) -> str:
    """Shape of a target as a file names it: of a target of the library its name there."""
    return target.name if isinstance(target, LibraryTarget) else target.shape


def is_solid(target: Any) -> TypeGuard[Solid]:
    """Return True if a target is made of triangles: everything but points and upright boxes."""
    return isinstance(target, Body) and not (isinstance(target, Box) and target.is_upright)
