"""Error of taking beams and absorption at a few frequencies of the band only, and a message for `check`."""

from dataclasses import dataclass

from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator
from insonify.sonar.band_error import MAX_ERROR_DB, SUB_BAND_COUNTS, BandError
from insonify.sonar.shared_directions import share_directions


@dataclass(frozen=True, slots=True)
class SubBandError:
    """Error of a recording because beams and absorption are not taken at every frequency."""

    sub_bands: int
    """Number of sub-bands of the recording."""
    error_db: float
    """Their rms error relative to the rms of the sound [dB]."""
    sufficient_count: int | None
    """Number that `auto` takes; None: none up to the largest has a small enough error."""

    def summary(self) -> str:
        """Message on the error; empty where the scenario needs no change."""
        if self.error_db <= MAX_ERROR_DB:
            return ""
        has = "one frequency serves" if self.sub_bands == 1 else f"{self.sub_bands} frequencies serve"
        text = f"{has} the whole band, which is {self.error_db:.0f} dB off: beams and absorption change across it"
        if self.sufficient_count is None:
            return f"{text}; no number of sub-bands up to {SUB_BAND_COUNTS[-1]} reaches {MAX_ERROR_DB:.0f} dB"
        return (
            f"{text}; sonar.receiver.sub_bands: auto, here {self.sufficient_count}, would reach {MAX_ERROR_DB:.0f} dB "
            "or less"
        )


def estimate_sub_band_error(scenario: Scenario) -> SubBandError:
    """Estimate the error of a scenario's sub-bands.

    Args:
        scenario: The scenario; its first ping is evaluated.
    """
    geometry = build_simulator(scenario).ping_geometries(0)[0]
    error = BandError(
        scenario.sonar.side_sonars[0], geometry.pulse, scenario.water, geometry.sound_speed,
        geometry.window[1] * geometry.sound_speed,
        shared=geometry.elements is None and share_directions(geometry.transmit_beams, geometry.receive_beams),
    )  # fmt: skip
    chosen = max(1, len(geometry.sub_bands))
    own = error.error_db(chosen)
    return SubBandError(chosen, own, chosen if own <= MAX_ERROR_DB else error.sufficient_count)
