"""Receiver behind the hydrophones: its band, noise, gain, conversion and matched filter.

The band is flat about the pulse's centre frequency and rolls off over an eighth of its width at each side. The
recording's sample rate, 1.25 times the band, therefore contains all frequencies that pass.
"""

from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from insonify.model import Hertz, Metres, Model, Seconds
from insonify.sonar.electronics import AnalogToDigitalConverter, Crosstalk, ReceiverGain, SelfNoise
from insonify.sonar.hydrophones import ElementErrors

FULL_TO_FLAT_BANDWIDTH = 1.25
"""Full width of the receiver's response over its flat width, and sample rate over band [1]."""


class Receiver(Model):
    """The receiver chain: a band about the centre frequency, noise, gain, conversion, matched filter.

    Example:
        >>> receiver = Receiver(bandwidth="40 kHz", matched_filter=True)
        >>> receiver.sample_rate
        50000.0
    """

    bandwidth: Hertz = Field(default=20e3, gt=0, le=10e6)
    """Flat two-sided band about the centre frequency [Hz]."""
    record: Literal["beams", "elements"] = "beams"
    """Channels of the recording: each beam, or each element of the receive array, to be steered afterwards."""
    errors: ElementErrors = ElementErrors()
    """Errors of the elements, where they are recorded."""
    synthetic_aperture: Annotated[Metres, Field(gt=0, le=1000)] | None = None
    """Length of track over which pings will be focused [m]; determines the sampling of the seabed; None: not
    focused."""
    sub_bands: Annotated[int, Field(ge=1, le=32)] | Literal["auto"] = "auto"
    """Number of frequencies across the band at which beams and absorption are evaluated [1], for pressures; auto:
    as many as keep the error of reverberation below -30 dB; 1: the band's centre only, in less time. For 24 or more
    beams that differ in horizontal steering alone, horizontal patterns are evaluated at every frequency, unless
    this is 1, and auto keeps the error below -40 dB."""
    matched_filter: bool = False
    """True: the recording is the matched filter's output, with peaks at the echoes' delays."""
    self_noise: SelfNoise | None = None
    """Noise of the receiver itself; None: no self-noise."""
    crosstalk: Crosstalk | None = None
    """Signals that couple into channels from the transmitter and from other channels; None: no crosstalk."""
    blanking: Annotated[Seconds, Field(ge=0, le=1e3)] | None = None
    """Time after the end of transmission until which the receiver is blanked [s]; None: never blanked."""
    gain: ReceiverGain | None = None
    """Gain before the converter; None: 0 dB at all times."""
    adc: AnalogToDigitalConverter | None = None
    """Analog-to-digital converter, which clips and rounds; None: pressures are recorded without either."""

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages behind the hydrophones that are present, in the order in which a signal passes them.

        Gain is not among them, since it is divided out again.
        """
        chain = ("crosstalk", "blanking", "adc")
        return tuple(name for name in chain if getattr(self, name) is not None)

    @property
    def sample_rate(self) -> float:
        """Complex samples per second of the recording [Hz]."""
        return FULL_TO_FLAT_BANDWIDTH * self.bandwidth


def response(receiver: Receiver, offset: ArrayLike) -> NDArray[np.float64]:
    """Amplitude response of the receiver's band [1]; real, hence without delay.

    Args:
        receiver: The receiver.
        offset: Frequency relative to the centre [Hz], any shape.

    Returns:
        1 up to half the band, then a raised cosine down to 0 at 0.625 of the band, shape of `offset`.

    Example:
        >>> response(Receiver(bandwidth="20 kHz"), [0.0, 10e3, 11.25e3, 12.5e3]).round(3).tolist()
        [1.0, 1.0, 0.5, 0.0]
    """
    edge = (np.abs(np.asarray(offset, dtype=float)) / receiver.bandwidth - 0.5) / (FULL_TO_FLAT_BANDWIDTH / 2 - 0.5)
    return np.asarray(np.cos(np.pi / 2 * np.clip(edge, 0, 1)) ** 2)
