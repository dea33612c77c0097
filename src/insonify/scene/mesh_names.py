"""Names that the faces of a mesh have in its file.

Groups, objects and materials in OBJ, nodes, meshes and materials in glTF; other formats have none.
"""

import io
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

NAMED = (".obj", ".glb", ".gltf")
"""Kinds of file whose faces may have names."""
_KEYWORDS = ("o", "g", "usemtl")


class NamedFaces(NamedTuple):
    """Triangles of a file with their names."""

    vertices: NDArray[np.float64]
    """Corners in units of the file, shape (v, 3)."""
    faces: NDArray[np.int64]
    """Rows of the corners of each triangle, shape (t, 3)."""
    names: tuple[frozenset[str], ...]
    """Names of each set of triangles."""
    row: NDArray[np.int64]
    """Set of each triangle, shape (t,)."""


def named_faces(trimesh: Any, path: Path) -> NamedFaces:
    """Triangles of an OBJ or glTF file with the names that they have there.

    Args:
        trimesh: The module.
        path: The file.
    """
    names: dict[str, frozenset[str]] = {}
    if path.suffix.lower() == ".obj":
        text, names = _numbered_objects(path.read_bytes().decode("utf-8", errors="replace"))
        scene = trimesh.load_scene(io.BytesIO(text.encode()), file_type="obj", process=False, split_objects=True)
    else:
        scene = trimesh.load_scene(path, process=False)
    vertices, faces, face_names, count = [], [], list[frozenset[str]](), 0
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        vertices.append(mesh.vertices @ transform[:3, :3].T + transform[:3, 3])
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
        material = getattr(getattr(mesh.visual, "material", None), "name", None)
        face_names.append(names.get(key) or frozenset(name for name in (node, key, material) if name))
    row = np.repeat(np.arange(len(faces)), [len(part) for part in faces])
    return NamedFaces(np.concatenate(vertices), np.concatenate(faces).astype(np.int64), tuple(face_names), row)


def _numbered_objects(text: str) -> tuple[str, dict[str, frozenset[str]]]:
    """OBJ text with one numbered object for each combination of object, groups and material, and their names."""
    current, numbers = dict.fromkeys(_KEYWORDS, ""), dict[tuple[str, ...], int]()
    lines, open_number = list[str](), -1
    for line in text.replace("\\\n", " ").splitlines():
        keyword, _, rest = line.strip().partition(" ")
        if keyword in current:
            current[keyword] = rest.strip()
        elif keyword == "f":
            number = numbers.setdefault(tuple(current.values()), len(numbers))
            lines += [f"o {number}"] * (number != open_number) + [line]
            open_number = number
        elif keyword.startswith("v"):
            lines.append(line)
    names = {
        str(number): frozenset(name for name in (object_name, *group.split(), group, material) if name)
        for (object_name, group, material), number in numbers.items()
    }
    return "\n".join(lines), names
