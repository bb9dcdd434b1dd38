"""Conditioned motion: what the regressor is evaluated on, and the band that it shares with the torque."""

from dataclasses import dataclass, field

import numpy as np

from tauscope.recording.conditioning import filters
from tauscope.recording.conditioning.common_band import OPEN_BAND_FRACTION, AllPass, BandFilter, Decimator, HarmonicBand
from tauscope.recording.conditioning.motion_source import MotionSource
from tauscope.recording.conditioning.periods import Periods, fourier_derivatives
from tauscope.recording.conditioning.uniform import Mask, Stretch
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class Motion:
    """One piece of conditioned motion with the torque that went with it."""

    time: Array  # (N,) [s]; of the first period where periods were averaged
    position: Array  # (N, n), smoothed q at the recorded rate; as are q̇, q̈
    velocity: Array
    acceleration: Array
    torque: Array  # (P, N, n), measured joint torque of every repetition; P = 1 where nothing was averaged
    measured: Mask  # (P, N, n), where that torque was measured and not filled in
    rate_hz: float  # sampling rate of all of these [Hz]
    band: BandFilter
    period: Array | None = None  # (N,), index of the period plus the part of it that is over; None where averaged
    own: slice = field(default_factory=lambda: slice(None))
    scatter: Array | None = None  # (n,), standard deviation of q from period to period [rad or m]; None: not averaged

    @property
    def repetitions(self) -> int:
        """Number of averaged periods P."""
        return len(self.torque)

    @property
    def mean_torque(self) -> Array:
        """Torque averaged over the repetitions in which it was measured, (N, n)."""
        if self.repetitions == 1:
            return self.torque[0]
        count = self.measured.sum(axis=0)
        total = np.where(self.measured, self.torque, 0.0).sum(axis=0)
        return np.where(count > 0, total / np.maximum(count, 1), self.torque.mean(axis=0))


@dataclass(frozen=True)
class Trim:
    """The band of one recording's transient motion, and the samples that it costs."""

    band: AllPass | Decimator
    cutoff_hz: float | None  # of the band [Hz]; None where it is open
    # of the motion's own smoothing, of each joint if they differ [Hz]; the rate where nothing is smoothed
    state_hz: float | Array
    margin: int

    @staticmethod
    def design(rate_hz: float, cutoff_hz: float | None, state_hz: Array | None = None) -> "Trim":
        """Band and margin; `state_hz`: (n,), cut-off of the motion's own smoothing, `state_cutoff` where None."""
        margin = 2 * filters.DIFFERENCE_MARGIN
        if cutoff_hz is None or cutoff_hz >= OPEN_BAND_FRACTION * rate_hz:
            return Trim(AllPass(rate_hz), None, rate_hz, margin)
        smoothing = state_cutoff(rate_hz, cutoff_hz) if state_hz is None else state_hz
        margin += filters.smoothing_margin(rate_hz, float(np.min(smoothing)))
        return Trim(Decimator.design(rate_hz, cutoff_hz), cutoff_hz, smoothing, margin)

    @property
    def kernel(self) -> int:
        """Samples that one output of the band rests on."""
        return len(self.band.kernel) if isinstance(self.band, Decimator) else 1

    @property
    def factor(self) -> int:
        """Samples from one output to the next."""
        return self.band.factor if isinstance(self.band, Decimator) else 1

    def outputs(self, samples: int) -> int:
        """Outputs of a piece of so many samples."""
        return max(0, (samples - 2 * self.margin - self.kernel) // self.factor + 1)


def state_cutoff(rate_hz: float, cutoff_hz: float | None) -> float:
    """Cut-off [Hz] of the motion's own smoothing for a given common band."""
    return rate_hz / 2.0 if cutoff_hz is None else min(filters.STATE_BAND_RATIO * cutoff_hz, rate_hz / 2.0)


def transient_motion(stretch: Stretch, trim: Trim, source: MotionSource) -> Motion | None:
    """Smoothed and differentiated motion of a stretch; None where it is too short for one output of the band."""
    rate, count = stretch.rate_hz, len(stretch.position)
    if not trim.outputs(count):
        return None
    cutoffs = np.broadcast_to(trim.state_hz, stretch.position.shape[1])
    position = filters.smooth_each(stretch.position, rate, cutoffs)
    velocity = filters.derivative(position, rate)
    use_velocity = _usable(stretch.velocity, source.velocity)
    if stretch.velocity is not None and use_velocity.any():
        velocity[:, use_velocity] = filters.smooth_each(stretch.velocity[:, use_velocity], rate, cutoffs[use_velocity])
    acceleration = filters.derivative(velocity, rate)
    use_acceleration = _usable(stretch.acceleration, source.acceleration)
    if stretch.acceleration is not None and use_acceleration.any():
        acceleration[:, use_acceleration] = filters.smooth_each(
            stretch.acceleration[:, use_acceleration], rate, cutoffs[use_acceleration]
        )
    inner = slice(trim.margin, count - trim.margin)
    return Motion(
        time=stretch.start_s + np.arange(count)[inner] / rate,
        position=position[inner],
        velocity=velocity[inner],
        acceleration=acceleration[inner],
        torque=stretch.torque[None, inner],
        measured=stretch.measured[None, inner],
        rate_hz=rate,
        band=trim.band,
        period=None if stretch.period is None else stretch.period[inner],
    )


def average_motion(periods: Periods, cutoff_hz: float | None, source: MotionSource) -> Motion:
    """One period for all: positions averaged, differentiated by their Fourier series, torques kept apart."""
    rate, count = periods.rate_hz, periods.position.shape[1]
    cutoff = state_cutoff(rate, cutoff_hz)
    series = fourier_derivatives(periods.position.mean(axis=0), rate, cutoff, periods.advance)
    position, velocity, acceleration = series
    use_velocity = _usable(periods.velocity, source.velocity)
    if periods.velocity is not None and use_velocity.any():
        recorded = periods.velocity[..., use_velocity].mean(axis=0)
        velocity[:, use_velocity], acceleration[:, use_velocity] = fourier_derivatives(
            recorded, rate, cutoff, orders=(0, 1)
        )
    use_acceleration = _usable(periods.acceleration, source.acceleration)
    if periods.acceleration is not None and use_acceleration.any():
        recorded = periods.acceleration[..., use_acceleration].mean(axis=0)
        (acceleration[:, use_acceleration],) = fourier_derivatives(recorded, rate, cutoff, orders=(0,))
    open_band = cutoff_hz is None or cutoff_hz >= OPEN_BAND_FRACTION * rate
    return Motion(
        time=periods.start_s + np.arange(count) / rate,
        position=position,
        velocity=velocity,
        acceleration=acceleration,
        torque=periods.torque,
        measured=periods.measured,
        rate_hz=rate,
        band=AllPass(rate) if open_band or cutoff_hz is None else HarmonicBand.design(rate, count, cutoff_hz),
        scatter=np.sqrt(periods.position.var(axis=0, ddof=1).mean(axis=0)),
    )


def _usable(recorded: Array | None, wanted: Mask) -> Mask:
    if recorded is None:
        return np.zeros_like(wanted)
    return wanted & np.isfinite(recorded).all(axis=tuple(range(recorded.ndim - 1)))
