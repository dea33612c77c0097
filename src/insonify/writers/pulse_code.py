"""Code of a pulse in a format of another program, by the form of its modulation."""

from collections.abc import Mapping

from insonify.formats.store_description import StoreError
from insonify.sonar.modulation import Form
from insonify.surveys.survey import Survey


def pulse_code(survey: Survey, codes: Mapping[Form, int], file_format: str) -> int:
    """Code of the transmitted pulse.

    Args:
        survey: Recording.
        codes: Codes of the format, by form.
        file_format: Name of the format.

    Raises:
        StoreError: The format has no code for this form.
    """
    pulse = survey.scenario.sonar.pulse
    if pulse.form not in codes:
        known = ", ".join(codes)
        raise StoreError(f"{survey.name}: {file_format} has no code for a pulse of kind {pulse.kind}, of form "
                         f"{pulse.form}; it has {known}. Write it as netCDF (.nc)")  # fmt: skip
    return codes[pulse.form]
