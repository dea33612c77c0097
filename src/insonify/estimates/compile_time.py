"""Compile time of the first run of an installation: kernels that are not in numba's cache yet."""

from insonify.kernel_signatures import missing_kernels
from insonify.scenario.features import scenario_features
from insonify.scenario.scenario import Scenario


def estimate_compile_seconds(scenario: Scenario, *, labels: bool = False) -> float:
    """Processor time to compile the kernels of a run that are not in the cache [s].

    Args:
        scenario: The scenario.
        labels: True if samples are labelled.
    """
    return float(sum(kernel.seconds for kernel in missing_kernels(scenario_features(scenario, labels=labels))))
