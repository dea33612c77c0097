"""Bodies from files: triangles as other people's programs write them, turned and checked once at the door.

Reading is left to trimesh, which is only imported where a mesh is read (the extra `targets`).
Faults of a file are reported with its name and the fix: what cannot be simulated is an error, what can but
may not be what was meant is a warning.
"""

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.data_file import install_advice, require_regular_file
from insonify.scene.mesh_header import require_declared_content
from insonify.scene.mesh_names import NAMED, NamedFaces, named_faces
from insonify.scene.triangle_surfaces import Triangles
from insonify.validity import PhysicsWarning

SUFFIXES = (".stl", ".obj", ".ply", ".glb", ".gltf")
"""Kinds of file that are read."""
Y_UP = (".glb", ".gltf")
"""Kinds whose standard puts y up: Khronos, glTF 2.0 specification, section 3.4."""
MAX_TRIANGLES = 5_000_000
MAX_FILE_BYTES = 2 << 30
"""Most bytes of a file: five million triangles in text."""
LARGEST, LARGE, SMALL, SMALLEST = 1000.0, 300.0, 0.03, 1e-3
"""Longest side of a body: more is refused, more is doubted, less is doubted, less is refused [m]."""
_MERGED = 1e-7  # corners this close, as a part of the whole, are one
_TURN = {
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
    """The surface in a file, remarks on it, and the names of its faces."""

    surface: Triangles
    remarks: tuple[str, ...]
    names: tuple[frozenset[str], ...]
    """Names of each set of triangles in the file."""
    row: NDArray[np.int64]
    """Set of each triangle, shape (t,)."""


def mesh_triangles(file: str, up: str | None, scale: float, sha256: str | None) -> Triangles:
    """The surface in a file, in body axes and metres; faces of an open surface are there once for each side.

    Args:
        file: Path of an STL, OBJ, PLY or GLB file.
        up: Axis that points up, "z" or "y"; None: that of the file format.
        scale: Metres in one unit of the file [m].
        sha256: Fingerprint of the file: another content is read again.

    Raises:
        MeshError: It cannot be read, or holds no body; with the way out.
    """
    return _read(file, up, scale, sha256, False).surface


def mesh_parts(
    file: str, up: str | None, scale: float, sha256: str | None, names: tuple[str, ...]
) -> tuple[Triangles, NDArray[np.int64]]:
    """The surface in a file, and the last of some names that each of its triangles has there.

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
    known, part_of_face = frozenset[str]().union(*content.names), np.full(len(content.row), -1)
    for number, name in enumerate(names):
        if name not in known:
            listed = ", ".join(sorted(known)) or "none at all"
            raise MeshError(
                f"{file} has no group, object or material {name!r}; it has {listed}.", f"parts.{number}.name"
            )
        part_of_face[
            np.isin(content.row, [row for row, part_names in enumerate(content.names) if name in part_names])
        ] = number
    return content.surface, part_of_face


def mesh_warnings(file: str, up: str | None, scale: float, sha256: str | None) -> None:
    """Warn of what is doubtful about a mesh: holes, faces without area, a size that few things have.

    Args:
        file: Path of the file.
        up: Axis that points up, as in `mesh_triangles`.
        scale: Metres in one unit of the file [m].
        sha256: Fingerprint of the file.
    """
    for remark in _read(file, up, scale, sha256, False).remarks:
        warnings.warn(f"{file}: {remark}", PhysicsWarning, stacklevel=2)


@lru_cache(maxsize=16)
def _read(file: str, up: str | None, scale: float, sha256: str | None, named: bool) -> MeshContent:
    """The surface, remarks on it, and with `named` the names of its faces."""
    path = Path(file)
    vertices, faces, names, row = _loaded(path, file, named=named)
    if not len(faces):
        raise MeshError(f"{file} holds no triangles. Export the body as a mesh of triangles.")
    if len(faces) > MAX_TRIANGLES:
        raise MeshError(f"{file} has {len(faces)} triangles; {MAX_TRIANGLES} is the most. Simplify the mesh.")
    if faces.min() < 0 or faces.max() >= len(vertices):
        first = int(np.argmax(((faces < 0) | (faces >= len(vertices))).any(axis=1)))
        raise MeshError(f"{file}: triangle {first} has the corners {', '.join(map(str, faces[first]))}, and the file "
                        f"has corners 0 to {len(vertices) - 1}. It is damaged: export it again.")  # fmt: skip
    if not np.isfinite(vertices[faces]).all():
        bad = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise MeshError(f"{file}: corner {bad} is {vertices[bad]}, not three finite numbers. Mend the mesh.")
    turn = _TURN[up or ("y" if path.suffix.lower() in Y_UP else "z")]
    surface = Triangles(vertices * scale @ turn.T, faces)
    surface = Triangles(surface.vertices[np.unique(faces)], np.unique(faces, return_inverse=True)[1].reshape(-1, 3))
    remarks = _sizes(file, surface)
    try:
        surface, kept, more = repaired(surface)
    except MeshError as fault:
        raise MeshError(f"{file}: {fault}") from None
    return MeshContent(surface.centred(), tuple(remarks + more), names, row[kept])


def _loaded(path: Path, file: str, *, named: bool) -> NamedFaces:
    """Corners and faces as they stand in the file, with `named` in the order of their names."""
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
    """Keep trimesh's log to itself: the error reports what it could not read."""
    log = logging.getLogger("trimesh")
    was = log.level
    log.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log.setLevel(was)


def _read_by(trimesh: Any, path: Path) -> Any:
    """The mesh in a file; text whose names or comments are not in UTF-8 is read too, of which only numbers matter."""
    try:
        return trimesh.load_mesh(path, process=False)
    except ImportError:  # trimesh needs charset_normalizer, which may be missing, for the encoding of a text
        text = path.read_bytes().decode("latin-1")
    return trimesh.load_mesh(io.BytesIO(text.encode()), file_type=path.suffix[1:].lower(), process=False)


def _sizes(file: str, surface: Triangles) -> list[str]:
    """Warning on a size that few things have; a size that no target has is refused."""
    length, width, height = surface.high - surface.low
    longest = float(max(length, width, height))
    size = f"is {length:.4g} m long, {width:.4g} m wide and {height:.4g} m high"
    if longest > LARGEST:
        raise MeshError(f"{file} {size}; {LARGEST:g} m is the most. If it is drawn in millimetres, write scale: 0.001 "
                        "(in centimetres 0.01, in inches 0.0254).", "scale")  # fmt: skip
    if longest < SMALLEST:
        raise MeshError(
            f"{file} {size}: too small to be seen. If it is drawn in kilometres, write scale: 1000.", "scale"
        )
    if longest > LARGE:
        return [f"the body {size}. If it is drawn in millimetres, write scale: 0.001"]
    if longest < SMALL:
        return [f"the body {size}. If it is drawn in metres times a thousand, write a larger scale, such as 1000"]
    return []


def repaired(surface: Triangles) -> tuple[Triangles, NDArray[np.int64], list[str]]:
    """A surface whose faces have an area and look outwards, their rows before, and remarks on what was not so.

    Corners at one position become one. A closed surface that looks inwards is turned inside out. An open surface, or
    one whose faces disagree, gets every face once for each side: the side that faces the sonar scatters.

    Raises:
        MeshError: No face has an area.
    """
    extent = float(np.max(surface.high - surface.low))
    grid = np.round((surface.vertices - surface.low) / (extent * _MERGED)).astype(np.int64)
    _, first, row = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    merged = Triangles(surface.vertices[first], row.reshape(-1)[surface.faces])
    flat = merged.area <= 1e-14 * extent**2
    if flat.all():
        raise MeshError("no triangle of the mesh has an area. Export it again.")
    solid, kept = Triangles(merged.vertices, merged.faces[~flat]), np.flatnonzero(~flat)
    remarks = [f"{flat.sum()} of {flat.size} triangles have no area and are left out"] if flat.any() else []
    open_edges, odd_edges = edge_defects(solid.faces)
    if open_edges or odd_edges:
        gaps, odd = f"{open_edges} edges belong to one face only", f"{odd_edges} edges join faces that disagree"
        remarks.append(
            f"the surface is not closed: {gaps if open_edges else odd}. Both sides of every face scatter, and what is "
            "inside may echo through the gaps; close the mesh if it should be solid"
        )
        both = np.concatenate([solid.faces, solid.faces[:, ::-1]])
        return Triangles(solid.vertices, both), np.tile(kept, 2), remarks
    return (solid if solid.volume > 0 else Triangles(solid.vertices, solid.faces[:, ::-1])), kept, remarks


def edge_defects(faces: NDArray[np.int64]) -> tuple[int, int]:
    """Number of edges that belong to one face only, and of other edges not traversed once in each sense.

    Args:
        faces: Rows of the corners of each triangle, shape (t, 3).
    """
    start, stop = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    most = int(faces.max()) + 1
    key = np.minimum(start, stop) * most + np.maximum(start, stop)
    _, row, count = np.unique(key, return_inverse=True, return_counts=True)
    sense = np.bincount(row, weights=np.where(start < stop, 1, -1))
    return int((count == 1).sum()), int(((count > 1) & (sense != 0)).sum())
