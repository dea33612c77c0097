"""Picture of a recording as displays show it: axes with units, colours with a scale."""

from pathlib import Path

from insonify import plotting
from insonify.demos.products import draw_product
from insonify.surveys.survey import Survey


def write_picture(survey: Survey, path: Path) -> None:
    """Draw a recording as `insonify show` does.

    Args:
        survey: The recording.
        path: File to write, .png, .pdf or .svg.
    """
    if not draw_product(survey.recording, path):
        plotting.recording(survey.recording, path)
