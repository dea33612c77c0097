"""Format of a test: a line of text for each ping."""

from pathlib import Path

from insonify.surveys.survey import Survey


def write_listing(survey: Survey, path: Path) -> None:
    """Write number and time of each ping."""
    path.write_text("LISTING\n" + "".join(f"{row} {time:.3f}\n" for row, time in enumerate(survey.time)))
