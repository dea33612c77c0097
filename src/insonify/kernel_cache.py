"""Delete cached machine code whose sources have changed, before it can run.

The compiler keeps each kernel's machine code on disk, stamped with the file that the kernel stands in. A kernel that
calls another file's kernel holds a copy of it, and would go on running the old copy when only that other file changes:
after an upgrade in place, or a change to a callee. So each file of kernels is stamped here with all that it draws on.

The stamps stand with the machine code, wherever numba keeps it: in a folder that the user named (NUMBA_CACHE_DIR),
beside the sources, or in the user's own cache where the sources cannot be written to. Each location has its own
stamps, so that whatever is loaded was made from the sources as they are.
"""

import hashlib
import importlib.util
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

STAMP_FILE = "kernels.json"
_TIMESTAMPS_KEY = "touched"
_IMPORT_PATTERN = re.compile(r"^\s*from (insonify[\w.]*) import (?:\(([^)]*)\)|([^(#\n]*))", re.MULTILINE)
_NUMBA_PATTERN = re.compile(r"\b(?:numba|insonify\.jit)\b")


def delete_stale_kernels(package: Path) -> list[str]:
    """Delete the machine code of kernels whose own source, or that of a kernel they may call, has changed.

    Returns:
        Files of kernels whose machine code was dropped, relative to the package; none where no folder for machine code
        can be written to.
    """
    beside = cache_folder(package)
    stamped = beside(package) / STAMP_FILE
    try:
        stored_stamps = json.loads(stamped.read_text())
    except (OSError, ValueError):
        stored_stamps = {}
    touched = _timestamps_digest(package)
    if stored_stamps.get(_TIMESTAMPS_KEY) == touched:
        return []
    stamps = {**dict(_source_digests(package)), _TIMESTAMPS_KEY: touched}
    stale = [name for name, stamp in stamps.items() if name != _TIMESTAMPS_KEY and stored_stamps.get(name) != stamp]
    try:
        for name in stale:
            source = package / name
            for code in beside(source.parent).glob(f"{source.stem}.*.nb?"):
                code.unlink(missing_ok=True)
        stamped.parent.mkdir(parents=True, exist_ok=True)
        fresh = stamped.with_name(f"{STAMP_FILE}.{os.getpid()}")
        fresh.write_text(json.dumps(stamps))
        fresh.replace(stamped)
    except OSError:
        return []
    return stale


def cache_folder(package: Path) -> Callable[[Path], Path]:
    """Folder in which numba keeps the machine code of a folder of sources, as numba 0.61 to 0.68 choose it.

    Args:
        package: Folder of the package; where its own machine code can be written, that of its parts can be, too.
    """
    named, order = _numba_cache_settings()
    locations: dict[str, Callable[[Path], Path]] = {"InTree": lambda folder: folder / "__pycache__"}
    if named:
        locations = {"UserProvided": partial(_cache_subfolder, Path(named)), **locations}
    if order:  # the user's own choice among numba's classes of locations
        locations = {name: locations[name] for name in order if name in locations}
    for location in locations.values():
        if _is_writable(location(package)):
            return location
    return partial(_cache_subfolder, user_cache("numba"))


def _numba_cache_settings() -> tuple[str, list[str]]:
    """Folder that the user named for machine code, and cache locators in order of preference; empty: numba's defaults.

    Numba's configuration is read where it has been imported, or reads a file of settings; importing it takes a second.
    """
    if "numba" in sys.modules or Path(".numba_config.yaml").exists():
        from numba.core import config

        settings: dict[str, Any] = vars(config)
        named, classes = settings.get("CACHE_DIR"), settings.get("CACHE_LOCATOR_CLASSES")
    else:
        named, classes = os.environ.get("NUMBA_CACHE_DIR"), os.environ.get("NUMBA_CACHE_LOCATOR_CLASSES")
    return named or "", [name.strip().partition("CacheLocator")[0] for name in (classes or "").split(",") if name]


def _cache_subfolder(root: Path, folder: Path) -> Path:
    """Folder for the machine code of a folder of sources, in a location that many packages share."""
    path = os.path.abspath(folder)
    return root / f"{os.path.basename(path)}_{hashlib.sha1(path.encode(), usedforsecurity=False).hexdigest()}"


def user_cache(program: str) -> Path:
    """The user's folder of a program's files that can be made again.

    It is determined by the module of numba that has its own, loaded without importing numba.

    Args:
        program: Name of the program.
    """
    numba = importlib.util.find_spec("numba")
    assert numba is not None and numba.origin is not None
    spec = importlib.util.spec_from_file_location("_appdirs", Path(numba.origin).parent / "misc" / "appdirs.py")
    assert spec is not None and spec.loader is not None
    appdirs = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(appdirs)
    return Path(appdirs.AppDirs(appname=program, appauthor=False).user_cache_dir)


def _is_writable(folder: Path) -> bool:
    """Return True if files can be made in a folder, which is made where it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _timestamps_digest(package: Path) -> str:
    """Times and size of each source file, as a digest: two milliseconds that mostly save reading them.

    The time at which the system last changed a file counts too: installers may set the other to that of a release.
    """
    digest = hashlib.blake2b(digest_size=12)
    for folder, within, files in os.walk(package):
        within[:] = sorted(name for name in within if name != "__pycache__")
        for name in sorted(files):
            if name.endswith(".py"):
                seen = os.stat(os.path.join(folder, name))
                digest.update(f"{folder}/{name} {seen.st_mtime_ns} {seen.st_ctime_ns} {seen.st_size}\n".encode())
    return digest.hexdigest()


def _source_digests(package: Path) -> Iterator[tuple[str, str]]:
    """Each file of kernels, with a digest of all that its machine code holds.

    That is every file of kernels that it draws on, itself included, the plain files that these import from, since
    machine code holds their constants as numbers, and the file that sets how all are compiled.
    """
    text = {path: path.read_text(encoding="utf-8") for path in sorted(package.rglob("*.py"))}
    settings = text.pop(package / "jit.py", "")
    kernels = {path for path, source in text.items() if _NUMBA_PATTERN.search(source)}

    @cache
    def neighbours(path: Path) -> frozenset[Path]:
        named = (
            (package / Path(*module.split(".")[1:]) / part.strip().split(" ")[0]).with_suffix(".py")
            for module, *parts in _IMPORT_PATTERN.findall(text[path])
            for part in ["__module__", *",".join(parts).split(",")]
            if part.strip()
        )
        return frozenset(
            candidate
            for name in named
            for candidate in (name, name.parent.with_suffix(".py"))
            if candidate in text and candidate != path
        )

    for path in sorted(kernels):
        reached, frontier = {path}, {path}
        while frontier:
            frontier = {other for near in frontier for other in neighbours(near) & kernels} - reached
            reached |= frontier
        digest = hashlib.blake2b(settings.encode(), digest_size=12)
        for near in sorted(reached.union(*(neighbours(near) for near in reached))):
            digest.update(text[near].encode())
        yield str(path.relative_to(package)), digest.hexdigest()
