"""Records passed from stage to stage: legs, pairs, arrivals, recordings."""

from insonify.records.arrivals import Arrivals
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs

__all__ = ["Arrivals", "Legs", "Pairs"]
