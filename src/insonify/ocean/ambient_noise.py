"""Ambient noise of the sea.

Turbulence and ships dominate below a kilohertz, wind and rain up to about 100 kHz, thermal noise
above. Each source is a published fit; they add as powers. Measured levels differ from
such curves by 5 to 10 dB, most in shallow water: give a measured spectrum where there is one.

Levels are spectrum levels of mean-square pressure, dB re 1 uPa^2/Hz, at an omnidirectional hydrophone near the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.wind import MAX_WIND
from insonify.units import intensity_ratio, level_db
from insonify.validity import require_numbers, warn_outside

Floats = NDArray[np.float64]

WIND_NOISE_RANGE = (1.0, 100e3)
"""Frequencies at which the fit to Wenz's curves of wind noise is in use [Hz]; his data end at 20 kHz."""
RAIN_NOISE_RANGE = (1e3, 50e3)
"""Frequencies at which rain noise has been measured widely [Hz]."""
TURBULENCE_RANGE = (1.0, 100.0)
"""Frequencies at which turbulence contributes [Hz]."""
SHIPPING_RANGE = (10.0, 1e3)
"""Frequencies at which distant ships contribute [Hz]."""
SIGNIFICANT_FRACTION = 0.1
"""Fraction of the total power above which a fit outside its range is warned about [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class NoiseSpectrum:
    """A measured noise spectrum, joined by straight lines of level over the logarithm of frequency.

    Example:
        >>> harbour = NoiseSpectrum(frequency=[10e3, 100e3], spectrum_level_db=[70.0, 50.0])
        >>> harbour
        NoiseSpectrum: 2 frequencies, 10-100 kHz, 50.0 to 70.0 dB re 1 uPa^2/Hz
        >>> harbour.level_db([10e3, 31.62e3]).round().tolist()
        [70.0, 60.0]
    """

    frequency: Floats
    """Frequencies, increasing [Hz], shape (n,)."""
    spectrum_level_db: Floats
    """Level at each [dB re 1 uPa^2/Hz], shape (n,)."""

    def __post_init__(self) -> None:
        """Refuse columns of different length, and frequencies that do not increase."""
        for name in ("frequency", "spectrum_level_db"):
            column = require_numbers(f"NoiseSpectrum.{name}", getattr(self, name), "", allow_nan=False).copy()
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        f, level = self.frequency, self.spectrum_level_db
        if f.ndim != 1 or f.shape != level.shape or f.size == 0:
            raise ValueError(f"NoiseSpectrum has {f.shape} frequencies and {level.shape} levels; give one for each.")
        if not (np.all(np.isfinite(f)) and np.all(f > 0) and np.all(np.diff(f) > 0) and np.all(np.isfinite(level))):
            raise ValueError("NoiseSpectrum.frequency must be positive and increase, and every level be a number.")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, NoiseSpectrum):
            return NotImplemented
        own, others = (np.stack((s.frequency, s.spectrum_level_db)) for s in (self, other))
        return np.array_equal(own, others)

    def __hash__(self) -> int:
        return hash((self.frequency.tobytes(), self.spectrum_level_db.tobytes()))

    def __repr__(self) -> str:
        f, level = self.frequency, self.spectrum_level_db
        span = f"{f[0] / 1e3:g}-{f[-1] / 1e3:g} kHz"
        return f"NoiseSpectrum: {f.size} frequencies, {span}, {level.min():.1f} to {level.max():.1f} dB re 1 uPa^2/Hz"

    def level_db(self, frequency: ArrayLike) -> Floats:
        """Measured spectrum level [dB re 1 uPa^2/Hz]; outside the band that of its nearer end, with a warning.

        Args:
            frequency: Frequency [Hz], any shape.
        """
        f = _positive(frequency)
        warn_outside("The measured noise spectrum", "frequency", f, self.frequency[0], self.frequency[-1], "Hz")
        return np.asarray(np.interp(np.log(f), np.log(self.frequency), self.spectrum_level_db))


def thermal_noise_db(frequency: ArrayLike) -> Floats:
    """Thermal noise [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.

    Source: Mellen (1952), J. Acoust. Soc. Am. 24(5), 478-480, as -15 + 20 log10 f[kHz]; equal to
    4 pi k_B T rho f^2 / c within 0.4 dB.
    Valid: any frequency of sonar; a lossless hydrophone. It dominates above 100 to 200 kHz.

    Example:
        >>> thermal_noise_db([100e3, 1e6]).tolist()
        [25.0, 45.0]
    """
    return _log(frequency, -15.0, 20.0)


def turbulence_noise_db(frequency: ArrayLike) -> Floats:
    """Turbulence noise: pressure of the eddies that pass the hydrophone [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.

    Source: Coates (1989), "Underwater Acoustic Systems", fit to Wenz (1962), J. Acoust. Soc. Am. 34(12),
    1936-1956, as quoted by Stojanovic (2007): 17 - 30 log10 f[kHz].
    Valid: 1 to 100 Hz; nothing above.

    Example:
        >>> print(turbulence_noise_db(10.0))
        77.0
    """
    warn_outside("The fit of turbulence noise", "frequency", _positive(frequency), *TURBULENCE_RANGE, "Hz")
    return _turbulence_db(frequency)


def _turbulence_db(frequency: ArrayLike) -> Floats:
    return _log(frequency, 17.0, -30.0)


def shipping_noise_db(frequency: ArrayLike, shipping: ArrayLike = 0.5) -> Floats:
    """Noise of distant ships [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.
        shipping: Shipping activity, from 0 (remote) to 1 (heavy traffic) [1], broadcast.

    Source: Coates (1989), as `turbulence_noise_db`: 40 + 20 (s - 0.5) + 26 log10 f - 60 log10(f + 0.03), f in kHz.
    Valid: 10 Hz to 1 kHz; s spans 20 dB, and a nearby ship exceeds it.

    Example:
        >>> shipping_noise_db(100.0, shipping=[0.0, 0.5, 1.0]).round().tolist()
        [57.0, 67.0, 77.0]
    """
    warn_outside("The fit of shipping noise", "frequency", _positive(frequency), *SHIPPING_RANGE, "Hz")
    return _shipping_db(frequency, shipping)


def _shipping_db(frequency: ArrayLike, shipping: ArrayLike) -> Floats:
    s = require_numbers("shipping", shipping, "", 0.0, 1.0)
    return np.asarray(_log(frequency, 40.0, 26.0) + 20 * (s - 0.5) - 60 * np.log10(_positive(frequency) / 1e3 + 0.03))


def wind_noise_db(frequency: ArrayLike, wind_speed: ArrayLike = 5.0) -> Floats:
    """Noise of breaking waves and their bubbles [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.
        wind_speed: Wind speed [m/s], broadcast.

    Source: Coates (1989), as `turbulence_noise_db`: 50 + 7.5 sqrt(w) + 20 log10 f - 40 log10(f + 0.4), f in kHz.
    Valid: 0..20 m/s, 50 Hz to 20 kHz, extended at -20 dB a decade. Other fits to the same curves differ by 5 dB
    from 10 to 50 kHz, and so do days. Above 10 m/s bubbles reduce the noise beyond 20 kHz; this fit does not.

    Example:
        >>> wind_noise_db(10e3, wind_speed=[2.5, 5.0, 10.0]).round().tolist()
        [41.0, 46.0, 53.0]
    """
    warn_outside("The fit of wind noise", "frequency", _positive(frequency), *WIND_NOISE_RANGE, "Hz")
    return _wind_db(frequency, wind_speed)


def _wind_db(frequency: ArrayLike, wind_speed: ArrayLike) -> Floats:
    w = require_numbers("wind_speed", wind_speed, "m/s", 0.0, MAX_WIND)
    warn_outside("The fit of wind noise", "wind", w, 0.0, 20.0, "m/s")
    return np.asarray(_log(frequency, 50.0, 20.0) + 7.5 * np.sqrt(w) - 40 * np.log10(_positive(frequency) / 1e3 + 0.4))


def rain_noise_db(frequency: ArrayLike, rain_rate: ArrayLike) -> Floats:
    """Rain noise: impact of drops and the bubbles that they trap [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.
        rain_rate: Rainfall [mm/h], broadcast; 0 gives -inf.

    Source: level at 5 kHz after Ma & Nystuen (2005), J. Atmos. Oceanic Technol. 22(8), 1225-1248:
    42.4 + 15.4 log10 R (coefficients not verified against print). The shape is an assumption of this project:
    constant up to 20 kHz, then -20 dB a decade, without the peak of light rain at 13 to 25 kHz (5 to 10 dB).
    Valid: 2 to 200 mm/h, 1 to 50 kHz, +-10 dB at other frequencies than 5 kHz; prefer a measured spectrum.

    Example:
        >>> rain_noise_db(5e3, rain_rate=[2.0, 10.0]).round().tolist()
        [47.0, 58.0]
    """
    warn_outside("The fit of rain noise", "frequency", _positive(frequency), *RAIN_NOISE_RANGE, "Hz")
    return _rain_db(frequency, rain_rate)


def _rain_db(frequency: ArrayLike, rain_rate: ArrayLike) -> Floats:
    rate = require_numbers("rain_rate", rain_rate, "mm/h", 0.0)
    warn_outside("The fit of rain noise", "rain", rate, 0.0, 200.0, "mm/h")
    roll_off_db = -20 * np.log10(np.maximum(_positive(frequency) / 20e3, 1.0))
    return np.asarray(42.4 + 1.54 * level_db(rate) + roll_off_db)


def noise_components_db(
    frequency: ArrayLike, *, wind_speed: ArrayLike = 5.0, shipping: ArrayLike = 0.5, rain_rate: ArrayLike = 0.0,
    spectrum: NoiseSpectrum | None = None,
) -> dict[str, Floats]:  # fmt: skip
    """Spectrum level of each noise source by name [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.
        wind_speed: Wind speed [m/s]; all arguments broadcast.
        shipping: Shipping activity, 0 to 1 [1].
        rain_rate: Rainfall [mm/h].
        spectrum: A further, measured source (shrimps, a harbour, the own ship).

    Returns:
        Levels under "thermal", "turbulence", "shipping", "wind", "rain" and, where one was given, "measured".

    Example:
        >>> levels = noise_components_db(100e3, wind_speed=5.0)
        >>> {source: f"{level:.0f} dB" for source, level in levels.items()}
        {'thermal': '25 dB', 'turbulence': '-43 dB', 'shipping': '-28 dB', 'wind': '27 dB', 'rain': '-inf dB'}
    """
    sources: dict[str, Callable[[], Floats]] = {
        "thermal": lambda: thermal_noise_db(frequency),
        "turbulence": lambda: _turbulence_db(frequency),
        "shipping": lambda: _shipping_db(frequency, shipping),
        "wind": lambda: _wind_db(frequency, wind_speed),
        "rain": lambda: _rain_db(frequency, rain_rate),
    }
    if spectrum is not None:
        sources["measured"] = lambda: spectrum.level_db(frequency)
    return {name: level() for name, level in sources.items()}


def noise_level_db(
    frequency: ArrayLike, *, wind_speed: ArrayLike = 5.0, shipping: ArrayLike = 0.5, rain_rate: ArrayLike = 0.0,
    spectrum: NoiseSpectrum | None = None,
) -> Floats:  # fmt: skip
    """Spectrum level of the ambient noise, its sources added as powers [dB re 1 uPa^2/Hz].

    Args:
        frequency: Frequency [Hz], any shape.
        wind_speed: Wind speed [m/s]; all arguments broadcast.
        shipping: Shipping activity, 0 to 1 [1].
        rain_rate: Rainfall [mm/h].
        spectrum: A further, measured source. Where the total was measured, use its `level_db` instead.

    Returns:
        Spectrum level [dB re 1 uPa^2/Hz], broadcast shape of the arguments. Warned where a fit contributes
        more than `SIGNIFICANT_FRACTION` of the power outside its range.

    Example:
        >>> noise_level_db([10e3, 100e3, 500e3], wind_speed=5.0).round().tolist()
        [46.0, 29.0, 39.0]
    """
    levels = noise_components_db(
        frequency, wind_speed=wind_speed, shipping=shipping, rain_rate=rain_rate, spectrum=spectrum
    )
    powers = {name: intensity_ratio(level) for name, level in levels.items()}
    total = np.asarray(sum(powers.values()))
    f = np.broadcast_to(np.asarray(frequency, dtype=float), total.shape)
    for name, (low, high) in {"wind": WIND_NOISE_RANGE, "rain": RAIN_NOISE_RANGE}.items():
        warn_outside(
            f"The fit of {name} noise", "frequency", f[powers[name] > SIGNIFICANT_FRACTION * total], low, high, "Hz"
        )
    return level_db(total)


def _log(frequency: ArrayLike, at_1_khz: float, per_decade: float) -> Floats:
    """Level linear in the logarithm of frequency [dB], from its value at 1 kHz [dB] and its slope [dB per decade]."""
    return np.asarray(at_1_khz + per_decade * np.log10(_positive(frequency) / 1e3))


def _positive(frequency: ArrayLike) -> Floats:
    return require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True)
