"""Pictures of physics by name: a sediment, a sound-speed profile, the sea, the absorption of sea water."""

import math
import re
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from insonify.cli.arguments import InputError

if TYPE_CHECKING:
    from insonify.ocean.profile import SoundSpeedProfile
    from insonify.scattering.sediments import Sediment

_PHI = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+))\s*(?:phi)?")


def show_physics(what: str, out: Path, *, frequency: float = 100e3, wind: float = 7.0) -> bool:
    """Draw a piece of physics, if the words name one.

    Args:
        what: "medium sand", "sediment:1.5 phi", "sand, silt" for several; a file of a sound-speed profile (.csv);
            "sea" or "sea:7 m/s"; "absorption".
        out: Picture to write.
        frequency: Frequency of the sound, where one is needed [Hz].
        wind: Wind where the sea does not name its own [m/s].

    Returns:
        Whether it was physics; if not, nothing is drawn.

    Raises:
        InputError: No plot of that name; with the nearest names.
    """
    kind, _, detail = (part.strip() for part in what.partition(":"))
    if Path(what).suffix.lower() == ".csv":
        _profile(Path(what), out)
        return True
    if Path(what).exists():
        return False
    if not (math.isfinite(frequency) and frequency > 0):
        raise InputError(f"--frequency {frequency:g}: not a frequency; give one above 0, such as '100 kHz'")
    if kind.lower() == "sea":
        _sea(_wind(detail) if detail else wind, frequency, out)
    elif kind.lower() == "absorption" and not detail:
        from insonify import plotting

        plotting.absorption(out)
    elif kind.lower() == "sediment" or _resembles_sediment(what):
        _sediments(detail if kind.lower() == "sediment" else what, frequency, out)
    elif any(mark in what for mark in "/\\") or Path(what).suffix:
        return False
    else:
        raise InputError(_unknown(what))
    return True


def _unknown(what: str) -> str:
    """Suggestion to write instead of an unknown word."""
    from insonify.scattering.sediments import GRAIN_SIZE, STONES

    known = ["sea", "absorption", *GRAIN_SIZE, *STONES]
    near = get_close_matches(what.lower(), known, n=3, cutoff=0.4)
    meant = f"; did you mean {' or '.join(near)}?" if near else "."
    return (
        f"{what!r} is no recording, and nothing else that can be drawn{meant} Give a folder made by insonify run, "
        "a sediment such as 'medium sand' or '1.5 phi', a sound-speed profile (.csv), sea or absorption"
    )


def profile_in(file: Path) -> "SoundSpeedProfile":
    """The sound-speed profile in a table.

    Args:
        file: The table.

    Raises:
        InputError: It is not there, or cannot be read; with file, line and column.
    """
    from insonify.ocean.profile_file import read_profile

    try:
        return read_profile(file)
    except FileNotFoundError:
        raise InputError(f"{file}: there is no such file") from None
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from None
    except ValueError as error:
        message = str(error)
        raise InputError(message if str(file) in message else f"{file}: {message}") from None


def _profile(file: Path, out: Path) -> None:
    column = profile_in(file)
    from insonify import plotting

    measured = _probe(file, column.depth.size)
    plotting.profile(
        column, out, temperature=measured.get("temperature"), salinity=measured.get("salinity"), title=file.name
    )


def _probe(file: Path, knots: int) -> dict[str, list[float]]:
    """Temperature and salinity in a file that holds a good profile, where it has them at every knot."""
    from insonify.data_file import is_number, name_and_unit, table_rows

    header, *rows = (row for _, row in table_rows(file, "depth,speed"))
    columns = zip(header, *rows[-knots:], strict=True)  # a row of units may stand before the knots
    named = {name_and_unit(title, {})[0]: values for title, *values in columns if all(map(is_number, values))}
    return {name: [float(cell) for cell in named[name]] for name in ("temperature", "salinity") if name in named}


def _wind(text: str) -> float:
    from insonify.units import si

    try:
        return float(str(si(text, "speed")))
    except ValueError as error:
        raise InputError(f"sea:{text}: {error}") from None


def _sea(wind: float, frequency: float, out: Path) -> None:
    if not 0 < wind <= 60:
        raise InputError(f"sea:{wind:g} m/s: no sea to draw; give a wind above 0 and up to 60 m/s, such as sea:'7 m/s'")
    from insonify import plotting

    plotting.sea(out, wind_speed=wind, frequency=frequency)


def _resembles_sediment(what: str) -> bool:
    """Return True if each word between commas is a sediment, or a sediment misspelt, rather than a path."""
    if any(mark in what for mark in "/\\"):
        return False
    from insonify.scattering.sediments import GRAIN_SIZE, STONES

    known = [*GRAIN_SIZE, *STONES]
    return all(_named_size(word) or _resembles(word, known) for word in what.split(","))


def _named_size(word: str) -> bool:
    """Return True if a word is a grain size with its unit, such as "1.5 phi"."""
    return bool(_PHI.fullmatch(word.strip())) and word.strip().endswith("phi")


def _resembles(word: str, known: list[str]) -> bool:
    plain = word.strip().lower().replace("_", " ")
    return any(plain in name.split() for name in known) or bool(get_close_matches(plain, known, n=1, cutoff=0.6))


def _sediments(names: str, frequency: float, out: Path) -> None:
    from insonify import plotting

    beds = [_sediment(name.strip()) for name in names.split(",")]
    try:
        if len(beds) == 1:
            plotting.sediment(beds[0], out, frequency=frequency)
        else:
            plotting.laws(beds, out, frequency=frequency)
    except ValueError as error:
        raise InputError(f"{names}: {error}") from None


def _sediment(name: str) -> "Sediment":
    from insonify.scattering.sediments import Sediment

    size = _PHI.fullmatch(name)
    try:
        return Sediment.from_grain_size(float(size[1])) if size else Sediment.named(name)
    except ValueError as error:
        raise InputError(str(error)) from None
