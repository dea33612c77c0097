"""Files that a scenario names: where they lie, and whether they are still what they were."""

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo
from pydantic_core import PydanticCustomError

from insonify.noun import located


def _beside(value: str, info: ValidationInfo) -> str:
    folder = (info.context or {}).get("folder", "")
    return str(Path(folder, value).expanduser().absolute())


def _filled_in(value: str | None, info: ValidationInfo) -> str | None:
    if value is not None or "file" not in info.data:
        return value
    try:
        return file_digest(info.data["file"])
    except (OSError, ValueError):
        return None  # whoever reads the file says what is wrong with it


DataFile = Annotated[str, AfterValidator(_beside)]
"""A file that a scenario names: beside the scenario file (validation context `folder`), else beside the caller."""
Fingerprint = Annotated[str | None, AfterValidator(_filled_in), Field(validate_default=True)]
"""SHA-256 of the file that the field `file` above it names, filled in when it is read."""


def file_digest(file: str | Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal digits; read again only where its time or size has changed.

    Args:
        file: Its path.

    Raises:
        OSError: The file cannot be opened.
    """
    there = Path(file).stat()
    return _digest(str(file), there.st_mtime_ns, there.st_size)


@lru_cache(maxsize=64)
def _digest(file: str, changed: int, size: int) -> str:
    with Path(file).open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


EXTRAS = {"io": ("netCDF4", "rasterio"), "targets": ("trimesh",)}
"""Packages of each extra of the installation."""


def install_advice(extra: str) -> str:
    """Command that installs an extra: from a checkout the checkout's own, else its packages by their names.

    Args:
        extra: One of `EXTRAS`.
    """
    checkout = Path(__file__).parents[2]
    if (checkout / "pyproject.toml").is_file() and Path(__file__).parents[1].name == "src":
        return f"pip install '{checkout}[{extra}]'"
    return f"pip install {' '.join(EXTRAS[extra])}"


def insist_on_the_same(file: str, sha256: str | None) -> None:
    """Refuse a file that has changed since its fingerprint was taken; whoever reads it says what else is wrong.

    Args:
        file: Its path.
        sha256: The fingerprint.

    Raises:
        PydanticCustomError: It has changed.
    """
    if (fault := _changed(file, sha256)) is not None:
        raise fault


def _changed(file: str, sha256: str | None) -> PydanticCustomError | None:
    try:
        found = file_digest(file)
    except (OSError, ValueError):
        return None
    if found == sha256:
        return None
    return located("sha256", f"{str(sha256)[:12]}...", f"is not the fingerprint of {file}: the file has changed since. "
                   "Leave sha256 out to take the file as it is.")  # fmt: skip
