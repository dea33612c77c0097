"""From the frozen nouns back to a scenario file, losing nothing."""

import yaml
from pydantic import BaseModel


def to_yaml(scenario: BaseModel) -> str:
    """A scenario as YAML, every value in SI; reading it back gives an equal scenario.

    Floats are written with all their digits. The order of keys is that of the nouns.

    Args:
        scenario: Any noun.
    """
    values = scenario.model_dump(mode="json")
    return str(yaml.safe_dump(values, sort_keys=False, default_flow_style=None, allow_unicode=True, width=120))
