"""Recording format of a test: a line of text for each ping."""

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np
import xarray as xr

from insonify.formats.instruments.instrument_file import Instrument, InstrumentFile, Setting


class ListingFile(InstrumentFile):
    """Number and time of each ping."""

    format = "listing of a test"
    suffixes = (".listing",)
    kinds: ClassVar[Mapping[str, str]] = {"line": "number and time of a ping"}

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True for the first line of a listing."""
        return head.startswith(b"LISTING")

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        offset = 8
        for line in self._bytes(offset, self._size - offset).splitlines(keepends=True):
            yield offset, len(line), "line", float(line.split()[1])
            offset += len(line)

    @property
    def instrument(self) -> Instrument:
        """Not stated."""
        return Instrument()

    @property
    def groups(self) -> Mapping[str, int]:
        """One group."""
        return {"pings": len(self.datagrams.time)}

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Times of some pings."""
        return xr.Dataset({"time": ("ping", np.asarray(self.datagrams.time[pings]))})

    def settings(self) -> tuple[Setting, ...]:
        """None."""
        return ()
