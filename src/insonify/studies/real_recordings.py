"""Real recordings beside simulated ones: what the engine predicts of instruments that it was not fitted to."""

from pathlib import Path

from insonify.studies import harbour_angular_response, harbour_echo_trains
from insonify.studies.page import write_page

INTRODUCTION = """Public recordings of real instruments are simulated from their own settings (`insonify
scenario-from`), with one sediment fitted at one frequency and everything else predicted. Differences are shown as they
are, with the spread that few pings have. The recordings, an EK80 echosounder and an EM2042 multibeam, are test data of
themachinethatgoesping/echosounders (MPL-2.0). `insonify study real-recordings -o docs/validation --recordings FOLDER`
writes this page anew from a folder with the files.

The simulations take sediment laws, water and interfaces as the documentation describes them; nothing was tuned to
these files but the fitted sediment and the reflection coefficient of the ship's hull."""
FILES = (harbour_echo_trains.FILE, harbour_angular_response.FILE)
"""Names of the recordings."""


def write(folder: Path, recordings: Path) -> list[Path]:
    """Run the study.

    Args:
        folder: Folder of the page `real-recordings.md` and its pictures.
        recordings: Folder of the recordings, `FILES`.

    Returns:
        Files written, the page first.

    Raises:
        FileNotFoundError: A recording is missing.
    """
    missing = [name for name in FILES if not (recordings / name).is_file()]
    if missing:
        raise FileNotFoundError(
            f"{recordings} has no {missing[0]}. Give the folder of the recordings: --recordings DIR"
        )
    sections = [
        harbour_echo_trains.section(harbour_echo_trains.evaluate(recordings)),
        harbour_angular_response.section(harbour_angular_response.evaluate(recordings)),
    ]
    return write_page(folder / "real-recordings.md", "Real recordings and simulated ones", INTRODUCTION, sections)
