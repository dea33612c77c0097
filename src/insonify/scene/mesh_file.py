"""Meshes of targets from files, converted to body axes and metres, and checked.

Files are read by trimesh, which is imported only when a mesh is read (the extra `targets`). A message has the name of
the file and the fix: an error for a mesh that cannot be simulated, a warning for one that is probably unintended.
"""

import io
import logging
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.data_file import install_advice, require_regular_file
from insonify.scene.mesh_header import require_declared_content
from insonify.scene.mesh_names import NAMED, NamedFaces, named_faces
from insonify.scene.triangle_surfaces import Triangles
from insonify.validity import PhysicsWarning

SUFFIXES = (".stl", ".obj", ".ply", ".glb", ".gltf")
"""File formats that are read."""
Y_UP = (".glb", ".gltf")
"""Formats whose standard has y up: Khronos, glTF 2.0 specification, section 3.4."""
MAX_TRIANGLES = 5_000_000
"""Largest number of triangles of a mesh."""
MAX_FILE_BYTES = 2 << 30
"""Largest size of a file: five million triangles in text [bytes]."""
MAX_SIZE, LARGE_SIZE, SMALL_SIZE, MIN_SIZE = 1000.0, 300.0, 0.03, 1e-3
"""Longest side of a body [m]: above the first an error, above the second a warning, below the third a warning, below
the last an error."""
_MERGE_TOLERANCE = 1e-7  # distance of corners that are one, re the size of the body
_BODY_AXES = {
    "z": np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]),  # x forward, y to port, z up
    "y": np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]),  # z forward, x to port, y up
}


class MeshError(ValueError):
    """A file that cannot be a target, with the field of the scenario that is wrong."""

    def __init__(self, message: str, field: str = "file") -> None:
        """Store the message and the key that it belongs to."""
        super().__init__(message)
        self.field = field


class MeshContent(NamedTuple):
    """Surface in a file, remarks on it, and the names of its faces."""

    surface: Triangles
    """Surface in body axes and metres."""
    remarks: tuple[str, ...]
    """Texts of warnings."""
    names: tuple[frozenset[str], ...]
    """Names of each set of triangles in the file."""
    row: NDArray[np.int64]
    """Set of each triangle, shape (t,)."""


def mesh_triangles(file: str, up: str | None, scale: float, sha256: str | None) -> Triangles:
    """Surface in a file, in body axes and metres; an open surface has every face once for each side.

    Args:
        file: Path of an STL, OBJ, PLY or GLB file.
        up: Axis that points up, "z" or "y"; None: that of the file format.
        scale: Metres in one unit of the file [m].
        sha256: SHA-256 digest of the file, by which its content is cached.

    Raises:
        MeshError: The file cannot be read, or has no body; with the fix.
    """
    return _read(file, up, scale, sha256, False).surface


def mesh_parts(
    file: str, up: str | None, scale: float, sha256: str | None, names: tuple[str, ...]
) -> tuple[Triangles, NDArray[np.int64]]:
    """Surface in a file, and for each of its triangles the last of some names that it has in the file.

    Args:
        file: Path of an OBJ or GLB file.
        up: Axis that points up, as in `mesh_triangles`.
        scale: Metres in one unit of the file [m].
        sha256: Fingerprint of the file.
        names: Names of groups, objects or materials.

    Returns:
        The surface, and rows of the names, -1 for triangles with none of them, shape (t,).

    Raises:
        MeshError: A name is not in the file; with those that are.
    """
    content = _read(file, up, scale, sha256, True)
    names_in_file, part_of_face = frozenset[str]().union(*content.names), np.full(len(content.row), -1)
    for number, name in enumerate(names):
        if name not in names_in_file:
            listed = ", ".join(sorted(names_in_file)) or "none at all"
            raise MeshError(
                f"{file} has no group, object or material {name!r}; it has {listed}.", f"parts.{number}.name"
            )
        part_of_face[
            np.isin(content.row, [row for row, part_names in enumerate(content.names) if name in part_names])
        ] = number
    return content.surface, part_of_face


def mesh_warnings(file: str, up: str | None, scale: float, sha256: str | None) -> None:
    """Warn of doubtful properties of a mesh: holes, faces without area, an unusual size.

    Args:
        file: Path of the file.
        up: Axis that points up, as in `mesh_triangles`.
        scale: Metres in one unit of the file [m].
        sha256: Fingerprint of the file.
    """
    for remark in _read(file, up, scale, sha256, False).remarks:
        warn_caller(f"{file}: {remark}", PhysicsWarning)


@lru_cache(maxsize=16)
def _read(file: str, up: str | None, scale: float, sha256: str | None, named: bool) -> MeshContent:
    """Content of a mesh file, cached, with the names of faces if `named`; other arguments as in `mesh_triangles`."""
    path = Path(file)
    vertices, faces, names, row = _load(path, file, named=named)
    if not len(faces):
        raise MeshError(f"{file} holds no triangles. Export the body as a mesh of triangles.")
    if len(faces) > MAX_TRIANGLES:
        raise MeshError(f"{file} has {len(faces)} triangles; {MAX_TRIANGLES} is the most. Simplify the mesh.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        first = int(np.argmax(((faces < 0) | (faces >= len(vertices))).any(axis=1)))
        raise MeshError(f"{file}: triangle {first} has the corners {', '.join(map(str, faces[first]))}, and the file "
                        f"has corners 0 to {len(vertices) - 1}. It is damaged: export it again.")  # fmt: skip
    if not np.isfinite(vertices[faces]).all():
        corner = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise MeshError(f"{file}: corner {corner} is {vertices[corner]}, not three finite numbers. Mend the mesh.")
    body_axes = _BODY_AXES[up or ("y" if path.suffix.lower() in Y_UP else "z")]
    surface = Triangles(vertices * scale @ body_axes.T, faces)
    surface = Triangles(surface.vertices[np.unique(faces)], np.unique(faces, return_inverse=True)[1].reshape(-1, 3))
    remarks = _size_remarks(file, surface)
    try:
        surface, rows, further = repaired(surface)
    except MeshError as fault:
        raise MeshError(f"{file}: {fault}") from None
    return MeshContent(surface.centred(), tuple(remarks + further), names, row[rows])


def _load(path: Path, file: str, *, named: bool) -> NamedFaces:
    """Corners and faces in units of the file, sorted by their names if `named`."""
    if path.suffix.lower() not in SUFFIXES:
        raise MeshError(f"{file} is not a kind of mesh that is read; export it as one of {', '.join(SUFFIXES)}.")
    if not path.is_file():
        raise MeshError(f"{file}: there is no such file. Paths start at the scenario file's folder.")
    try:
        import trimesh
    except ImportError:
        raise MeshError(f"{file} cannot be read without trimesh. Install it: {install_advice('targets')}") from None
    try:
        require_regular_file(path, MAX_FILE_BYTES)
        require_declared_content(path)
    except ValueError as fault:
        raise MeshError(str(fault)) from None
    try:
        with _silence_trimesh():
            if named and path.suffix.lower() in NAMED:
                return named_faces(trimesh, path)
            mesh = _read_by(trimesh, path)
        faces = np.asarray(mesh.faces, np.int64).reshape(-1, 3)
        vertices = np.asarray(mesh.vertices, float).reshape(-1, 3)
        return NamedFaces(vertices, faces, (frozenset(),), np.zeros(len(faces), np.int64))
    except Exception as error:  # a reader of foreign files may fail in any way
        reason = " ".join(str(error).split())[:120]
        raise MeshError(f"{file} cannot be read as {path.suffix[1:].upper()}: {reason or type(error).__name__}. "
                        "Export it again.") from None  # fmt: skip


@contextmanager
def _silence_trimesh() -> Iterator[None]:
    """Context in which trimesh's log is off, since the error has the reason."""
    log = logging.getLogger("trimesh")
    previous_level = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(previous_level)


def _read_by(trimesh: Any, path: Path) -> Any:
    """The mesh in a file; text with names or comments in another encoding than UTF-8 is read as Latin-1."""
    try:
        return trimesh.load_mesh(path, process=False)
    except ImportError:  # trimesh needs charset_normalizer, which may be missing, for the encoding of a text
        text = path.read_bytes().decode("latin-1")
    return trimesh.load_mesh(io.BytesIO(text.encode()), file_type=path.suffix[1:].lower(), process=False)


def _size_remarks(file: str, surface: Triangles) -> list[str]:
    """Warnings on an unusual size of a body; an impossible size is an error."""
    length, width, height = surface.high - surface.low
    longest = float(max(length, width, height))
    size = f"is {length:.4g} m long, {width:.4g} m wide and {height:.4g} m high"
    if longest > MAX_SIZE:
        raise MeshError(f"{file} {size}; {MAX_SIZE:g} m is the most. If it is drawn in millimetres, write scale: 0.001 "
                        "(in centimetres 0.01, in inches 0.0254).", "scale")  # fmt: skip
    if longest < MIN_SIZE:
        raise MeshError(
            f"{file} {size}: too small to be seen. If it is drawn in kilometres, write scale: 1000.", "scale"
        )
    if longest > LARGE_SIZE:
        return [f"the body {size}. If it is drawn in millimetres, write scale: 0.001"]
    if longest < SMALL_SIZE:
        return [f"the body {size}. If it is drawn in metres times a thousand, write a larger scale, such as 1000"]
    return []


def repaired(surface: Triangles) -> tuple[Triangles, NDArray[np.int64], list[str]]:
    """Repair a surface: outward faces with an area, their rows in the original surface, and remarks on the changes.

    Corners at one position become one. A closed surface with inward normals is turned inside out. An open surface, or
    one with inconsistent normals, gets every face once for each side: the side that faces the sonar scatters.

    Raises:
        MeshError: No face has an area.
    """
    extent = float(np.max(surface.high - surface.low))
    grid = np.round((surface.vertices - surface.low) / (extent * _MERGE_TOLERANCE)).astype(np.int64)
    _, first, row = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    merged = Triangles(surface.vertices[first], row.reshape(-1)[surface.faces])
    no_area = merged.area <= 1e-14 * extent**2
    if no_area.all():
        raise MeshError("no triangle of the mesh has an area. Export it again.")
    valid, rows = Triangles(merged.vertices, merged.faces[~no_area]), np.flatnonzero(~no_area)
    remarks = [f"{no_area.sum()} of {no_area.size} triangles have no area and are left out"] if no_area.any() else []
    open_edges, odd_edges = edge_defects(valid.faces)
    if open_edges or odd_edges:
        gaps, twisted = (
            f"{open_edges} edges belong to one face only",
            f"{odd_edges} edges join faces that disagree",
        )
        remarks.append(
            f"the surface is not closed: {gaps if open_edges else twisted}. Both sides of every face scatter, and "
            "what is inside may echo through the gaps; close the mesh if it should be solid"
        )
        both = np.concatenate([valid.faces, valid.faces[:, ::-1]])
        return Triangles(valid.vertices, both), np.tile(rows, 2), remarks
    return (valid if valid.volume > 0 else Triangles(valid.vertices, valid.faces[:, ::-1])), rows, remarks


def edge_defects(faces: NDArray[np.int64]) -> tuple[int, int]:
    """Number of edges that belong to one face only, and of other edges not traversed once in each sense.

    Args:
        faces: Rows of the corners of each triangle, shape (t, 3).
    """
    start, stop = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    vertex_count = int(faces.max()) + 1
    key = np.minimum(start, stop) * vertex_count + np.maximum(start, stop)
    _, row, count = np.unique(key, return_inverse=True, return_counts=True)
    sense = np.bincount(row, weights=np.where(start < stop, 1, -1))
    return int((count == 1).sum()), int(((count > 1) & (sense != 0)).sum())
