"""How an interface answers sound: what it scatters, and what it reflects."""

from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ScatteringLaw
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment

__all__ = ["Lambert", "ScatteringLaw", "Sediment", "reflection_coefficient"]
