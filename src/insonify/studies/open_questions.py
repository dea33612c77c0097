"""Open questions of the paper: whether coherence is worth it, what multipath does, what inhomogeneous water costs.

The paper illustrated coherent effects in two dimensions and left their consequences for images to further work.
"""

from pathlib import Path

from insonify.studies import aperture_in_inhomogeneous_water, coherent_model, multipath_contrast
from insonify.studies.page import write_page

DRAWS, WATERS = 60, 20
"""Random seabeds of each coherent model, and random waters of each kind [1]."""
INTRODUCTION = """The paper ([README](../../README.md)) modelled a sidescan sonar without phase and showed coherent
effects in two dimensions. It left open what a coherent model in three dimensions would change. Here the engine shows
with one scene under three models, with one scene under many reflections, and with a synthetic aperture in water that is
not homogeneous. `insonify study open-questions -o docs/validation` writes this page anew."""


def write(folder: Path) -> list[Path]:
    """Run the study.

    Args:
        folder: Folder of the page `open-questions.md` and its pictures.

    Returns:
        Files written, the page first.
    """
    sections = [
        coherent_model.section(coherent_model.evaluate(DRAWS)),
        multipath_contrast.section(multipath_contrast.evaluate()),
        aperture_in_inhomogeneous_water.section(aperture_in_inhomogeneous_water.evaluate(WATERS)),
    ]
    return write_page(folder / "open-questions.md", "Open questions of the paper", INTRODUCTION, sections)
