"""A scenario: everything that one simulation is made from."""

from collections.abc import Mapping
from typing import Any, Self

from pydantic import ValidationInfo, field_validator, model_validator

from insonify.caller_warning import warn_caller
from insonify.model import raise_errors
from insonify.scenario.bistatic_errors import with_transmitter_clock
from insonify.scenario.scenario_errors import scenario_errors
from insonify.scenario.scenario_parts import ScenarioParts
from insonify.scenario.scenario_warnings import scenario_warnings
from insonify.validity import PhysicsWarning


class Scenario(ScenarioParts):
    """A scenario to simulate: scene, sonar, track, paths and field.

    Example:
        >>> from insonify import scene, sonar
        >>> pulse, point = sonar.Pulse(frequency="100 kHz", duration="0.1 ms"), sonar.PointTransducer()
        >>> scenario = insonify.Scenario(
        ...     seabed=scene.Seabed(depth="20 m"),
        ...     sonar=sonar.Sonar(source_level_db="200 dB", pulse=pulse, transmit=point, receive=point),
        ...     track=sonar.StaticTrack(position=(0, 0, "12 m"), window=("0 s", "60 ms")),
        ... )
        >>> scenario.with_("seabed.depth", "30 m").seabed.depth
        30.0
    """

    @field_validator("receiver_track", mode="before")
    @classmethod
    def _copy_transmitter_timing(cls, value: Any, info: ValidationInfo) -> Any:
        return with_transmitter_clock(value, info.data.get("track"))

    def _repr_html_(self) -> str:
        """The scenario as its file, folded below its title, for notebooks."""
        from html import escape

        from insonify.scenario.write import to_yaml

        title = escape(self.title or "Scenario")
        return f"<details><summary><b>{title}</b></summary><pre>{escape(to_yaml(self))}</pre></details>"

    def with_(self, changes: str | Mapping[str, object] = "", *value: object, **by_name: object) -> Self:
        """A new scenario with some values changed, checked as a file is.

        For example ``with_("surface.wind_speed", "6 m/s")``, ``with_({"seed": 2, "targets.0.position": [5, 150]})`` or
        ``with_(seed=2, surface__wind_speed="6 m/s")``.

        Args:
            changes: Path of one value, keys and list indices joined by dots; or new values by such paths.
            value: The new value, where one path is given: in SI or with its unit, as in a file.
            by_name: More changes; two underscores stand for a dot.

        Raises:
            ScenarioError: A key is unknown (the nearest one is named) or a value is refused.
        """
        from insonify.scenario.changes import with_changes

        if isinstance(changes, str) and len(value) != (changes != ""):
            raise TypeError("with_ takes a path and its value, or a mapping of paths to values")
        if value and not isinstance(changes, str):
            raise TypeError("with_ takes no further value beside a mapping")
        requested = dict(changes) if isinstance(changes, Mapping) else {changes: value[0]} if changes else {}
        requested |= {name.replace("__", "."): new for name, new in by_name.items()}
        changed, caveats = with_changes(self, requested)
        for doubt in caveats:
            warn_caller(str(doubt), PhysicsWarning)
        return changed

    @model_validator(mode="after")
    def _check_consistency(self, info: ValidationInfo) -> Self:
        if (info.context or {}).get("recorded"):
            return self
        raise_errors(scenario_errors(self))
        scenario_warnings(self)
        return self
