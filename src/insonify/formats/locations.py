"""Locations of recordings: folders, and URLs of object stores."""

import re
from pathlib import Path


def is_url(path: str | Path) -> bool:
    """Return True for the URL of an object store, such as s3://bucket/harbour.zarr.

    Args:
        path: Folder of a recording, or a URL.

    Raises:
        ValueError: A `Path` was made of a URL, and has lost a slash.
    """
    if isinstance(path, Path) and re.match(r"[a-z][a-z0-9+.-]+:[/\\]", str(path)):
        raise ValueError(f"{path}: a Path keeps one slash of a URL. Give the URL as text")
    return "://" in str(path)


def location(text: str) -> str | Path:
    """Location of a recording as typed: the URL of an object store, or a folder.

    Args:
        text: Folder or URL.
    """
    return text if is_url(text) else Path(text)
