"""Frozen models back to a scenario file, losing nothing."""

import yaml
from pydantic import BaseModel

from insonify.diagnostics.yaml_source import plain_value

try:  # the same text in a quarter of the time, but for escapes of rare letters
    from yaml import CSafeDumper as SafeDumper
except ImportError:
    from yaml import SafeDumper  # type: ignore[assignment]


def to_yaml(scenario: BaseModel) -> str:
    """A scenario as YAML, every value in SI; reading it back gives an equal scenario.

    Floats are written with all their digits. The order of keys is that of the models.

    Args:
        scenario: Any model.
    """
    values = scenario.model_dump(mode="json")
    return str(
        yaml.dump(values, Dumper=_Quoting, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120)
    )


class _Quoting(SafeDumper):
    """Quotes every text that our reader would take for a number or a word of YAML, such as a label 1e3."""

    def represent_text(self, text: str) -> yaml.ScalarNode:
        """A text as a scalar, in double quotes where it could be mistaken."""
        mistaken = not text.isprintable() or not isinstance(plain_value(text), str)
        return self.represent_scalar("tag:yaml.org,2002:str", text, style='"' if mistaken else None)


_Quoting.add_representer(str, _Quoting.represent_text)
