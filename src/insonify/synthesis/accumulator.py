"""Interface of the sums over a ping's path pairs: pressures, intensities, labels or levels."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

Mapper = Callable[..., Iterable[Any]]
"""Function that maps as `map` does, possibly by several threads."""


@dataclass(frozen=True, slots=True)
class Requirements:
    """Properties of the scatterers and path pairs that an accumulator sums."""

    quadrature: bool = True
    """True: quadrature points, for an expectation; false: random scatterers."""
    negligible_pairs: bool = True
    """True: every pair of legs; false: pairs that importance sampling keeps."""
    rays: bool = False
    """True: energies of traced rays instead of path pairs."""
    fast_reverberation: bool = False
    """True: samples of the seabed from the fast reverberation are accepted, where it applies."""
    origins: bool = False
    """True: such samples come with the positions and occluders that labels need."""
    max_scatterers_per_cell: float = math.inf
    """Points in a resolution cell beyond which further ones do not matter [1]."""
    approximate_edges: bool = False
    """True: diffraction around targets without weak ripples and fine details, see `knife_edge.diffract_at_edges`."""


class Accumulator(Protocol):
    """Sum over the path pairs of one ping; the buffer that it fills belongs to the caller, one for each thread."""

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""

    def empty(self) -> Any:
        """A buffer without any arrival; buffers add with `+=`."""

    def add(self, buffer: Any, pairs: Any, /) -> None:
        """Add the path pairs of one block of scatterers to a buffer."""

    def time_series(self, buffer: Any, run: Mapper = map, /) -> Any:
        """The result over time of all that a buffer holds; `run` maps as `map` does, possibly by several threads."""
