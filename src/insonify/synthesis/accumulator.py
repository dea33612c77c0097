"""Interface of the sums over a ping's path pairs: pressures, intensities, labels or levels."""

from typing import Any, Protocol


class Accumulator(Protocol):
    """Sum over the path pairs of one ping; the buffer that it fills belongs to the caller, one for each thread."""

    @property
    def wants_quadrature(self) -> bool:
        """True: quadrature points, for an expectation; false: random scatterers."""

    def empty(self) -> Any:
        """A buffer without any arrival; buffers add with `+=`."""

    def add(self, buffer: Any, pairs: Any) -> None:
        """Add the path pairs of one block of scatterers to a buffer."""

    def time_series(self, buffer: Any) -> Any:
        """The result over time of all that a buffer holds."""
