"""Grey picture of a labelled image: levels as bytes of a PNG file."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.annotations.labelled_image import LabelledImage, Levels

QUANTILES = (0.01, 0.999)
"""Parts of the cells that are darker than the darkest grey, and no brighter than white [1]."""
RANGE = 50.0
"""Largest span of levels, so that silent water does not take most of the greys [dB]."""
Span = tuple[float, float]


def level_span(level: Levels) -> Span:
    """Levels of the darkest grey and of white of an image alone [dB]."""
    finite = level[np.isfinite(level)]
    if not finite.size:
        return 0.0, 1.0
    low, high = (round(float(value), 2) for value in np.quantile(finite, QUANTILES))
    return max(low, round(high - RANGE, 2)), max(high, low + 1.0)


def greys(level: Levels, span: Span) -> NDArray[np.uint8]:
    """Greys of levels: 0 where nothing was recorded, 1 to 255 over the span.

    Args:
        level: Levels [dB].
        span: Levels of the darkest grey and of white [dB].
    """
    share = np.clip((np.nan_to_num(level, nan=0.0, neginf=-1e9, posinf=1e9) - span[0]) / (span[1] - span[0]), 0, 1)
    return np.where(np.isnan(level), 0, 1 + np.round(254 * share)).astype(np.uint8)


def write_png(path: Path, cells: NDArray[Any]) -> None:
    """Write cells of 8 or 16 bits as they are.

    Args:
        path: File to write.
        cells: Cells, uint8 or uint16, shape (rows, columns).
    """
    from PIL import Image

    Image.fromarray(cells).save(path)


def write_grey(image: LabelledImage, path: Path, span: Span | None) -> Span:
    """Write the levels of an image as greys.

    Args:
        image: The image.
        path: File to write.
        span: Levels of the darkest grey and of white [dB]; None: of the image alone.

    Returns:
        These levels.
    """
    used = span or level_span(image.image)
    write_png(path, greys(image.image, used))
    return used
