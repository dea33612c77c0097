"""Machine code that no longer says what its source says is thrown away before it can run.

The compiler keeps each kernel's machine code on disk, stamped with the file that the kernel stands in. A kernel that
calls another file's kernel holds a copy of it, and would go on running the old copy when only that other file changes:
after an upgrade in place, or a change to a callee. So each file of kernels is stamped here with all that it draws on.
"""

import hashlib
import json
import os
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

STAMPS = "kernels.json"
_TOUCHED = "touched"
_DRAWS_ON = re.compile(r"^\s*from (insonify[\w.]*) import \(?([^)#\n]*)", re.MULTILINE)
_COMPILED = re.compile(r"\bnumba\b")


def forget_stale_kernels(package: Path) -> list[str]:
    """Delete the machine code of kernels whose own source, or that of a kernel they may call, has changed.

    Args:
        package: Folder of the package; nothing is done where it cannot be written to.

    Returns:
        Files of kernels whose machine code was dropped, relative to the package.
    """
    kept = package / "__pycache__" / STAMPS
    try:
        before = json.loads(kept.read_text())
    except (OSError, ValueError):
        before = {}
    touched = _touched(package)
    if before.get(_TOUCHED) == touched:
        return []
    stamps = {**dict(_stamps(package)), _TOUCHED: touched}
    stale = [name for name, stamp in stamps.items() if name != _TOUCHED and before.get(name) != stamp]
    try:
        for name in stale:
            source = package / name
            for code in (source.parent / "__pycache__").glob(f"{source.stem}.*.nb?"):
                code.unlink(missing_ok=True)
        kept.parent.mkdir(exist_ok=True)
        fresh = kept.with_name(f"{STAMPS}.{os.getpid()}")
        fresh.write_text(json.dumps(stamps))
        fresh.replace(kept)
    except OSError:  # a read-only installation keeps no machine code beside its sources either
        return []
    return stale


def _touched(package: Path) -> str:
    """When and how long each source file is: two milliseconds that mostly save reading them."""
    digest = hashlib.blake2b(digest_size=12)
    for folder, within, files in os.walk(package):
        within[:] = sorted(name for name in within if name != "__pycache__")
        for name in sorted(files):
            if name.endswith(".py"):
                seen = os.stat(os.path.join(folder, name))
                digest.update(f"{folder}/{name} {seen.st_mtime_ns} {seen.st_size}\n".encode())
    return digest.hexdigest()


def _stamps(package: Path) -> Iterator[tuple[str, str]]:
    """Each file of kernels, with a digest of all the files of kernels that it draws on, itself included."""
    text = {
        path: source
        for path in sorted(package.rglob("*.py"))
        if _COMPILED.search(source := path.read_text(encoding="utf-8"))
    }

    @cache
    def neighbours(path: Path) -> frozenset[Path]:
        named = (
            (package / Path(*module.split(".")[1:]) / part.strip().split(" ")[0]).with_suffix(".py")
            for module, parts in _DRAWS_ON.findall(text[path])
            for part in ["__module__", *parts.split(",")]
        )
        return frozenset(
            found
            for name in named
            for found in (name, name.parent.with_suffix(".py"))
            if found in text and found != path
        )

    for path in text:
        reached, frontier = {path}, {path}
        while frontier:
            frontier = {other for near in frontier for other in neighbours(near)} - reached
            reached |= frontier
        digest = hashlib.blake2b(digest_size=12)
        for near in sorted(reached):
            digest.update(text[near].encode())
        yield str(path.relative_to(package)), digest.hexdigest()
