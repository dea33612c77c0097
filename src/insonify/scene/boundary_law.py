"""Scattering laws that a scenario may name for the seabed and for the surface alike."""

from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ScatteringLaw

BoundaryLaw = Lambert
"""Laws by their key `law`; one entry registers a law.

A law is a frozen dataclass or model with `cross_section`, or with `at(frequency, sound_speed)`, which gives the law at
one frequency. It may have a `citation`, the source that a scenario lists."""


def infer_law_kind(value: object) -> object:
    """Add the kind of law to a mapping without it, from the keys: a strength, a sediment, a table or a wind."""
    if isinstance(value, dict) and "law" not in value:
        law_of_key = {"sediment": "jackson", "volume": "jackson", "file": "table", "wind_speed": "apl-surface"}
        return {**value, "law": next((law for key, law in law_of_key.items() if key in value), "lambert")}
    return value


def law_at(scattering: object, frequency: float, sound_speed: float) -> ScatteringLaw | CompiledLaw | None:
    """Law that a scenario names, at one frequency; None: no scattering.

    Args:
        scattering: The law in the scenario, or None.
        frequency: Frequency [Hz].
        sound_speed: Sound speed of the water at the boundary [m/s].
    """
    law = scattering.at(frequency, sound_speed) if hasattr(scattering, "at") else scattering
    assert law is None or isinstance(law, ScatteringLaw | CompiledLaw)
    return law
