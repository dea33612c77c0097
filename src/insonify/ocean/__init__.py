"""The water between the sonar and everything it can hear."""

from insonify.ocean.absorption import absorption_db_per_m
from insonify.ocean.water import Water

__all__ = ["Water", "absorption_db_per_m"]
