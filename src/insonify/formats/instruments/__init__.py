"""Recordings of real instruments, each format in a file of its own, behind one interface."""

from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.open_instrument import open_instrument

__all__ = ["InstrumentFile", "open_instrument"]
