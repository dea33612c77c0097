"""Choice of the reader of a file by its content, and by its suffix where the content is damaged."""

from importlib import import_module
from pathlib import Path

from insonify.data_file import require_regular_file
from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.other_files import programs_advice
from insonify.formats.store_description import StoreError

READERS: tuple[str, ...] = (
    "kmall.KmallFile",
    "kongsberg_all.KongsbergAllFile",
    "xtf.XtfFile",
    "simrad_ek80.SimradEk80File",
    "blueprint_oculus.BlueprintOculusFile",
    "sound_metrics_aris.SoundMetricsArisFile",
)
"""Module and class of each format; one line registers a format."""
_HEAD = 2048


def open_instrument(path: str | Path) -> InstrumentFile:
    """Open a recording of a real instrument: its datagrams are indexed, and read on demand.

    Args:
        path: The file.

    Raises:
        StoreError: It is missing, empty, or of no format that is read.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> path = insonify.export(insonify.simulate(scenario, pings=[0, 1]), "line.xtf")
        >>> file = insonify.open_instrument(path)
        >>> file.format, dict(file.groups)
        ('XTF', {'port': 2, 'starboard': 2})
        >>> dict(file.read("port").sizes)
        {'ping': 2, 'sample': 1750}
    """
    try:
        require_regular_file(path, 1 << 62)
        with Path(path).open("rb") as file:
            head = file.read(_HEAD)
    except FileNotFoundError:
        raise StoreError(f"{path}: there is no such file") from None
    except ValueError as fault:
        raise StoreError(str(fault)) from None
    readers = instrument_formats()
    suffix = Path(path).suffix.lower()
    by_suffix = [reader for reader in readers if suffix in reader.suffixes]
    for reader in (*by_suffix, *readers):
        if reader.matches(head):
            return reader(path)
    if by_suffix:
        return by_suffix[0](path)
    if head and (advice := programs_advice(path)) is not None:
        raise StoreError(advice)
    known = "; ".join(f"{reader.format} ({', '.join(reader.suffixes)})" for reader in readers)
    start = head[:8].hex(" ") or "the file is empty"
    raise StoreError(f"{path}, byte 0: no format that is read ({start}). Give one of: {known}")


def instrument_formats() -> tuple[type[InstrumentFile], ...]:
    """Readers of all formats."""
    pairs = (entry.split(".") for entry in READERS)
    return tuple(getattr(import_module(f"insonify.formats.instruments.{module}"), name) for module, name in pairs)
