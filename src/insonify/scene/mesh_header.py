"""Check of the headers of mesh files, before memory is allocated for what they declare.

The header of a file of some hundred bytes may declare billions of vertices. Every vertex and every face of a PLY file
takes at least one byte; the number of values of a binary glTF file is in its description, which is JSON.
"""

import json
import struct
from pathlib import Path
from typing import Any

GLB_HEAD, GLB_CHUNK = 12, 8
"""Lengths of the header of a binary glTF file and of one of its chunks [bytes]."""
MAX_NUMBERS = 60_000_000
"""Largest number of values in all arrays of a glTF file: 12 for each of five million triangles."""
_PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}


def require_declared_content(path: Path) -> None:
    """Refuse a mesh file whose header declares more than the file can contain.

    Args:
        path: The file; formats without such a header are accepted.

    Raises:
        ValueError: The header declares too much; with the file, the number and the limit.
    """
    kind = path.suffix.lower()
    if kind == ".ply":
        _ply(path)
    elif kind == ".glb":
        _glb(path)
    elif kind == ".gltf":
        _gltf(path, path.read_bytes())


def _ply(path: Path) -> None:
    """Refuse a PLY file with more elements in its header than bytes."""
    size = path.stat().st_size
    with path.open("rb") as file:
        for line in file:
            words = line.split()
            if words[:1] == [b"end_header"]:
                return
            if words[:1] == [b"element"] and len(words) == 3:
                try:
                    count = int(words[2])
                except ValueError:
                    text = line.decode("latin-1").strip()
                    raise ValueError(f"{path}: {text!r} gives no number. Export it again.") from None
                if not 0 <= count <= size:
                    name = words[1].decode("latin-1")
                    raise ValueError(f"{path}: its header promises {count} of {name}, and the file has {size} bytes. "
                                     "It is damaged or cut short: export it again.")  # fmt: skip


def _glb(path: Path) -> None:
    """Refuse a binary glTF file that is cut short, or whose description is refused."""
    with path.open("rb") as file:
        head = file.read(GLB_HEAD + GLB_CHUNK)
        if len(head) < GLB_HEAD + GLB_CHUNK or head[:4] != b"glTF":
            raise ValueError(f"{path}: no binary glTF, or cut short. Export it again.")
        length = struct.unpack("<I", head[GLB_HEAD : GLB_HEAD + 4])[0]
        if length > path.stat().st_size:
            raise ValueError(f"{path}: its description has {length} bytes, more than the file. Export it again.")
        _gltf(path, file.read(length))


def _gltf(path: Path, description: bytes) -> None:
    """Refuse a glTF description (JSON) of more than `MAX_NUMBERS` values."""
    try:
        accessors = json.loads(description).get("accessors", [])
        numbers = sum(_numbers(accessor) for accessor in accessors)
    except (ValueError, TypeError, AttributeError, KeyError, RecursionError):
        raise ValueError(f"{path}: its description is no glTF. It is damaged: export it again.") from None
    if not 0 <= numbers <= MAX_NUMBERS:
        raise ValueError(f"{path}: it promises {numbers:.4g} numbers; {MAX_NUMBERS} is the most. Simplify the mesh.")


def _numbers(accessor: dict[str, Any]) -> int:
    """Number of values that the description of an array of a glTF file declares, stored or not."""
    count = accessor["count"]
    if not isinstance(count, int) or count < 0 or accessor["componentType"] not in _BYTES:
        raise ValueError
    return count * _PARTS[accessor["type"]]
