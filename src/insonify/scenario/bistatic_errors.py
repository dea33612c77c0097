"""Errors of receivers on a platform of their own: combinations that cannot be simulated, and pings out of step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from insonify.model import field_error

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts
    from insonify.sonar.track import Track

CLOCK = ("interval", "window", "stop_and_hop")
"""Fields of a receiver's track that are those of the transmitter's: times of pings and windows."""


def with_transmitter_clock(written: Any, track: Track | None) -> Any:
    """A receiver's track as it was written, with the transmitter's clock and number of pings where it has none.

    Args:
        written: Values of the scenario file.
        track: The transmitter's; None where that is at fault itself.
    """
    if not isinstance(written, dict) or track is None:
        return written
    return {**{name: getattr(track, name) for name in CLOCK}, "pings": track.ping_count, **written}


def clock_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of a receiver's track that does not keep the transmitter's times: no other check is possible before."""
    track, other = scenario.track, scenario.receiver_track
    if other is None:
        return
    for name in CLOCK:
        if getattr(other, name) != getattr(track, name):
            yield field_error(f"receiver_track.{name}", None, f"differs from track.{name}, and the receiver keeps the "
                          "transmitter's time. Leave it out, or write the same.")  # fmt: skip
    if other.ping_count != track.ping_count:
        yield field_error("receiver_track.pings", f"{other.ping_count}", "pings, and the track has "
                      f"{track.ping_count}. Leave `pings` out, or write {track.ping_count}.")  # fmt: skip


def bistatic_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors in the settings of a receiver on a second platform."""
    sonar = scenario.sonar
    if scenario.receiver_track is None:
        if sonar.receive_mounting is not None:
            yield field_error("sonar.receive_mounting", None, "is for a receiver on a platform of its own. Give that a "
                          "receiver_track, or leave receive_mounting out.")  # fmt: skip
        return
    if sonar.sides is not None:
        yield field_error("sonar.sides", f"[{', '.join(sonar.sides)}]", "transmit and receive on one platform, and "
                      "receiver_track gives the receiver another. Leave `sides` out and give one mounting, or leave "
                      "receiver_track out.")  # fmt: skip
    if scenario.paths.geometry == "slice":
        yield field_error("paths.geometry", "slice", "is one vertical plane through one platform. Write geometry: 3d, "
                      "or leave receiver_track out.")  # fmt: skip
    if scenario.paths.engine == "tracer":
        yield field_error("paths.engine", "tracer", "transmits and receives on one platform. Write engine: eigenrays, "
                      "or leave receiver_track out.")  # fmt: skip
