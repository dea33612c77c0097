"""Targets: objects in the scene.

An upright box, a point, and solids: triangulated bodies that may lean, be buried, or come from a file. All but points
scatter from their faces and cast shadows.
"""

from typing import Annotated, Any, Literal, Self, TypeGuard

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from insonify.data_file import DataFile, Fingerprint, require_unchanged
from insonify.model import Decibels, Metres, Model, Radians, field_error
from insonify.scattering.lambert import Lambert
from insonify.scene.mesh_file import MeshError, mesh_parts, mesh_triangles, mesh_warnings
from insonify.scene.shape_library import PRESETS
from insonify.scene.terrain.scour import ScourDimensions

Size = Annotated[Metres, Field(gt=0, le=1000)]
Dimensions = tuple[Size, Size, Size]


class _Body(Model):
    """Fields of every target but points: position, attitude, burial, scattering."""

    position: tuple[Metres, Metres] = Field(
        json_schema_extra={"fix": "Write north and east; the depth of a body is its base_depth"}
    )
    """North and east of the target's middle [m]."""
    base_depth: Metres | None = None
    """Depth of the lowest point [m]; None: the target lies on the seabed."""
    heading: Radians = 0.0
    """Compass heading of the target's forward axis [rad]."""
    pitch: Annotated[Radians, Field(ge=-np.pi / 2, le=np.pi / 2)] = 0.0
    """Pitch, forward end up positive [rad]: 90 degrees puts a cylinder on its end."""
    roll: Annotated[Radians, Field(ge=-np.pi, le=np.pi)] = 0.0
    """Roll, starboard side down positive [rad]."""
    burial: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Fraction of the target's height that is below the seabed [1]."""
    burial_depth: Annotated[Metres, Field(ge=0, le=1000)] = 0.0
    """Depth of the lowest point below the seabed, instead of `burial` [m]."""
    scour: ScourDimensions | None = None
    """Scour pit around the target, such as `{depth: 0.2 m, width: 0.5 m}`; None: none."""
    scattering: Lambert = Lambert(strength_db=-10.0)
    """Scattering law of the rough part of the faces."""
    face_reflection_coefficient: Annotated[float, Field(ge=-1, le=1)] | None = None
    """Pressure reflection coefficient of the smooth part of the faces, which reflects specularly [1]: 1 for a rigid
    body, -1 for one filled with air; None: rough faces only."""

    @model_validator(mode="after")
    def _check_depth_or_burial(self) -> Self:
        if self.base_depth is not None and (self.burial or self.burial_depth):
            word = "burial" if self.burial else "burial_depth"
            raise field_error(word, f"{getattr(self, word):g}", "is for a target on the seabed, but base_depth is "
                          "given. Leave one of the two out.")  # fmt: skip
        if self.base_depth is not None and self.scour is not None:
            raise field_error("scour", None, "is for a target on the seabed, but base_depth is given. Leave one of the "
                          "two out.")  # fmt: skip
        if self.burial and self.burial_depth:
            raise field_error("burial_depth", f"{self.burial_depth:g} m", "repeats burial. Leave one out.")
        return self


class Box(_Body):
    """A box: rough faces that scatter by Lambert's law, and a body that casts shadows."""

    shape: Literal["box"] = "box"
    label: str = "box"
    size: Dimensions
    """Length along the heading, width across it, height [m]."""

    @property
    def is_upright(self) -> bool:
        """True if the box neither leans nor is buried, so that it needs no triangles."""
        return not (self.pitch or self.roll or self.burial or self.burial_depth)


class PointTarget(Model):
    """A point that scatters equally in all directions and casts no shadow."""

    shape: Literal["point"] = "point"
    label: str = "point"
    position: tuple[Metres, Metres, Metres]
    """North, east and depth [m]."""
    target_strength_db: Annotated[Decibels, Field(ge=-200, le=100)] = 0.0
    """Target strength [dB re 1 m^2]."""


class Sphere(_Body):
    """A sphere."""

    shape: Literal["sphere"] = "sphere"
    label: str = "sphere"
    diameter: Size
    """Diameter [m]."""


class Cylinder(_Body):
    """A circular cylinder with its axis along the heading, or vertical at a pitch of 90 degrees."""

    shape: Literal["cylinder"] = "cylinder"
    label: str = "cylinder"
    length: Size
    """Length of its axis [m]."""
    diameter: Size
    """Diameter [m]."""


class Cone(_Body):
    """A circular cone that stands on its base."""

    shape: Literal["cone"] = "cone"
    label: str = "cone"
    height: Size
    """Height from base to point [m]."""
    diameter: Size
    """Diameter of the base [m]."""


class TruncatedCone(_Body):
    """A truncated circular cone that stands on its base."""

    shape: Literal["truncated_cone"] = "truncated_cone"
    label: str = "truncated_cone"
    height: Size
    """Height from base to top [m]."""
    diameter: Size
    """Diameter of the base [m]."""
    top_diameter: Size
    """Diameter of the top [m]."""


class Plate(_Body):
    """A horizontal plate; at a pitch or roll of 90 degrees it stands on an edge."""

    shape: Literal["plate"] = "plate"
    label: str = "plate"
    length: Size
    """Length along the heading [m]."""
    width: Size
    """Width across the heading [m]."""
    thickness: Size = 0.01
    """Thickness [m]."""


class MeshPart(Model):
    """Scattering of the faces of a mesh that have one name in its file."""

    name: Annotated[str, Field(min_length=1)]
    """Name of a group, an object or a material of an OBJ file; of a node, a mesh or a material of a GLB file."""
    scattering: Lambert | None = None
    """Scattering law of these faces for their rough part; None: that of the body."""
    face_reflection_coefficient: Annotated[float, Field(ge=-1, le=1)] | None = None
    """Pressure reflection coefficient of their smooth part [1], 0 for rough faces; None: that of the body."""


class Mesh(_Body):
    """A body of triangles from a file: STL, OBJ, PLY or GLB (glTF), in metres unless scaled."""

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
                names = tuple(part.name for part in self.parts)
                mesh_parts(self.file, self.up, self.scale, self.sha256, names)
        except MeshError as fault:
            raise field_error(fault.field, None, str(fault)) from None
        mesh_warnings(self.file, self.up, self.scale, self.sha256)
        return self


class MeshFaces(Mesh):
    """The faces of one part of a mesh, or of none: a solid of one law that lies as the whole mesh does."""

    whole: Mesh
    """The mesh with all its faces."""
    part: int
    """Row among its parts; -1 for faces of none."""


def solids_of_one_law(solid: "Solid") -> "tuple[Solid, ...]":
    """The faces of each part of a mesh and those of none, each as a solid; any other solid itself."""
    if not isinstance(solid, Mesh) or not solid.parts or isinstance(solid, MeshFaces):
        return (solid,)
    _, row = mesh_parts(solid.file, solid.up, solid.scale, solid.sha256, tuple(part.name for part in solid.parts))
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


class LibraryTarget(_Body):
    """A shape from the library of typical objects, see `insonify.scene.shape_library`."""

    shape: Literal["library"] = "library"
    label: str = ""
    """Label of the target; by default its name."""
    name: Literal[PRESETS]  # type: ignore[valid-type]
    """Name of a shape of the library."""
    size: Dimensions | None = None
    """Length, width and height to which the shape is scaled [m]; None: those of the library."""
    variant: Annotated[int, Field(ge=0, le=2**31)] = 0
    """Number of the rock; other shapes have one variant, 0."""

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


def _library_target_from_name(value: Any) -> Any:
    """A library target given by its name as its shape: `shape: drum`."""
    if isinstance(value, dict) and value.get("shape") in PRESETS and "name" not in value:
        return {**value, "shape": "library", "name": value["shape"]}
    return value


Solid = Sphere | Cylinder | Cone | TruncatedCone | Plate | Mesh | LibraryTarget | Box
"""Targets that are made of triangles; a box only if it leans or is buried."""
Target = Annotated[
    Annotated[
        Box | PointTarget | Sphere | Cylinder | Cone | TruncatedCone | Plate | Mesh | LibraryTarget,
        Field(discriminator="shape"),
    ],
    BeforeValidator(_library_target_from_name),
]


def shape_name(target: Target) -> str:
    """Shape of a target as a file names it: of a target of the library its name there."""
    return target.name if isinstance(target, LibraryTarget) else target.shape


def is_solid(target: Any) -> TypeGuard[Solid]:
    """Return True if a target is made of triangles: everything but points and upright boxes."""
    return isinstance(target, _Body) and not (isinstance(target, Box) and target.is_upright)
