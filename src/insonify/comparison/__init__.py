"""Comparison of recordings, real or simulated, measure by measure; each measure is one file and one line of a list."""

from insonify.comparison.compare import compare
from insonify.comparison.result import Comparison, Finding, Value
from insonify.comparison.samples import Samples

__all__ = ["Comparison", "Finding", "Samples", "Value", "compare"]
