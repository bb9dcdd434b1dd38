"""Conditioned motion: what the regressor is evaluated on, and the band that it shares with the torque."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from service.errors import RecordingError
from service.recording.conditioning.filters import (
    DIFFERENCE_MARGIN,
    STATE_BAND_RATIO,
    AllPass,
    BandFilter,
    Decimator,
    HarmonicBand,
    derivative,
    smooth,
    smoothing_margin,
)
from service.recording.conditioning.periods import Periods, fourier_derivatives, repeats, split_periods
from service.recording.conditioning.position_noise import PositionNoise, position_noise
from service.recording.conditioning.uniform import (
    WINDOW_ROWS,
    Mask,
    Stretch,
    Timing,
    find_stretches,
    read_stretch,
    windows,
)
from service.recording.recording import Array, Recording
from service.robot.robot import Robot

OPEN_BAND_FRACTION = 0.45
"""A cut-off above this part of the sampling rate filters nothing."""


@dataclass(frozen=True, eq=False)
class Motion:
    """One piece of conditioned motion with the torque that went with it.

    time : (N,) float64
        [s]; of the first period where periods were averaged
    position, velocity, acceleration : (N, n) float64
        smoothed q, q̇, q̈ at the recorded rate
    torque : (P, N, n) float64
        measured joint torque of every repetition; P = 1 where nothing was averaged
    measured : (P, N, n) bool
        where that torque was measured and not filled in
    rate_hz : float
        sampling rate of all of these [Hz]
    band : BandFilter
        filter and decimation that torque and regressor share
    period : (N,) float64 or None
        index of the repeated period, where it is known and not averaged
    """

    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    measured: Mask
    rate_hz: float
    band: BandFilter
    period: Array | None = None

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
class ConditioningSummary:
    """What was done to one recording, for the result and its reader.

    recording : str
        name of the file
    samples, missed_positions, dropped : int
        rows in the file; rows without a complete position; rows in pieces too short to use
    missed_torques : tuple of int
        per joint, samples without a torque (filled in for filtering, not counted in the fit)
    gaps : int
        long gaps at which the recording was split
    rate_hz : float
        sampling rate
    resampled : bool
        the stamps jittered and the signals were interpolated
    averaged_periods : int
        periods averaged into one, 0 where none were
    position_noise_std : tuple of float
        per joint, standard deviation of the position noise over the whole spectrum [rad or m]
    """

    recording: str
    samples: int
    missed_positions: int
    dropped: int
    missed_torques: tuple[int, ...]
    gaps: int
    rate_hz: float
    resampled: bool
    averaged_periods: int
    position_noise_std: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Conditioner:
    """One recording, surveyed once, from which conditioned motion can be drawn at any band.

    recording : Recording
        the recording
    robot : Robot
        sign and torque constant of every joint
    timing : Timing
        stretches and sampling rate
    noise : PositionNoise
        noise of the positions and the band that it allows
    """

    recording: Recording
    robot: Robot
    timing: Timing
    noise: PositionNoise

    @staticmethod
    def survey(recording: Recording, robot: Robot) -> "Conditioner":
        """Find the usable stretches of a recording and the noise of its positions.

        Parameters
        ----------
        recording : Recording
            the recording
        robot : Robot
            the robot that it belongs to

        Raises
        ------
        RecordingError
            where nothing in the recording is long enough to be used
        """
        timing = find_stretches(recording)
        longest = max(timing.rows, key=lambda rows: rows[1] - rows[0])
        sample = read_stretch(
            recording, robot, longest[0], min(longest[1], longest[0] + WINDOW_ROWS), timing.rate_hz
        )
        return Conditioner(recording, robot, timing, position_noise(sample))

    def motions(self, cutoff_hz: float | None) -> Iterator[Motion]:
        """The recording's motion, piece by piece, in one band.

        Parameters
        ----------
        cutoff_hz : float or None
            cut-off of the band that torque and regressor share [Hz]; None for no filter

        Yields
        ------
        Motion
            pieces of bounded size, whatever the recording's length

        Raises
        ------
        RecordingError
            where the band is so narrow that nothing of the recording is left
        """
        found = False
        for start, stop in self.timing.rows:
            for motion in self._stretch_motions(start, stop, cutoff_hz):
                found = True
                yield motion
        if not found:
            raise RecordingError(
                f"{self.recording.name}: too short for a band of {cutoff_hz:.3g} Hz: the filters need all of it;"
                " record longer or ask for a higher cut-off"
            )

    def summary(self, cutoff_hz: float | None) -> ConditioningSummary:
        """Counts of what was missing and what was averaged.

        Parameters
        ----------
        cutoff_hz : float or None
            the band [Hz]; whether periods are averaged depends on it
        """
        missed, resampled, averaged = np.zeros(self.robot.joint_count, int), False, 0
        for start, stop in self.timing.rows:
            for first in range(start, stop, WINDOW_ROWS):
                effort = self.recording.samples(first, min(first + WINDOW_ROWS, stop)).effort
                missed += np.isnan(effort).sum(axis=0)
        first_rows = self.timing.rows[0]
        stretch = self._read(first_rows[0], min(first_rows[1], first_rows[0] + WINDOW_ROWS))
        resampled = stretch.resampled
        periods = self._repeating_periods(stretch, cutoff_hz)
        averaged = 0 if periods is None else len(periods.position)
        return ConditioningSummary(
            recording=self.recording.name,
            samples=self.timing.samples,
            missed_positions=self.timing.missed,
            dropped=self.timing.dropped,
            missed_torques=tuple(int(value) for value in missed),
            gaps=self.timing.gaps,
            rate_hz=self.timing.rate_hz,
            resampled=resampled,
            averaged_periods=averaged,
            position_noise_std=tuple(float(v) for v in np.sqrt(self.noise.density * self.timing.rate_hz / 2.0)),
        )

    def _read(self, start: int, stop: int) -> Stretch:
        return read_stretch(self.recording, self.robot, start, stop, self.timing.rate_hz)

    def _stretch_motions(self, start: int, stop: int, cutoff_hz: float | None) -> Iterator[Motion]:
        """Averaged periods first, where there are any, then what lies outside them."""
        margin = _edge_samples(self.timing.rate_hz, cutoff_hz)
        for first, last in windows(start, stop, margin):
            stretch = self._read(first, last)
            periods = self._repeating_periods(stretch, cutoff_hz)
            if periods is None:
                yield from _transient_motion(stretch, cutoff_hz)
                continue
            yield _averaged_motion(periods, stretch.start_s, cutoff_hz)
            for part in (slice(0, periods.rows[0]), slice(periods.rows[1], None)):
                yield from _transient_motion(_part(stretch, part), cutoff_hz)

    def _repeating_periods(self, stretch: Stretch, cutoff_hz: float | None) -> Periods | None:
        """The stretch's periods, where they repeat well enough to be averaged."""
        periods = split_periods(stretch)
        if periods is None:
            return None
        state_cutoff = _state_cutoff(stretch.rate_hz, cutoff_hz)
        return periods if repeats(periods, state_cutoff) else None


def _state_cutoff(rate_hz: float, cutoff_hz: float | None) -> float:
    """Cut-off of the motion's own smoothing for a given common band."""
    return rate_hz / 2.0 if cutoff_hz is None else min(STATE_BAND_RATIO * cutoff_hz, rate_hz / 2.0)


def _edge_samples(rate_hz: float, cutoff_hz: float | None) -> int:
    """Samples that conditioning takes from each end of a piece."""
    margin = 2 * DIFFERENCE_MARGIN
    if cutoff_hz is None or cutoff_hz >= OPEN_BAND_FRACTION * rate_hz:
        return margin
    return margin + smoothing_margin(rate_hz, _state_cutoff(rate_hz, cutoff_hz))


def _transient_motion(stretch: Stretch, cutoff_hz: float | None) -> Iterator[Motion]:
    """Smoothed and differentiated motion, edges trimmed; nothing where the stretch is too short."""
    rate = stretch.rate_hz
    open_band = cutoff_hz is None or cutoff_hz >= OPEN_BAND_FRACTION * rate
    margin = _edge_samples(rate, cutoff_hz)
    band = AllPass(rate) if open_band or cutoff_hz is None else Decimator.design(rate, cutoff_hz)
    kernel = len(band.kernel) if isinstance(band, Decimator) else 1
    if len(stretch.position) < 2 * margin + kernel + 1:
        return
    position = stretch.position if open_band else smooth(stretch.position, rate, _state_cutoff(rate, cutoff_hz))
    velocity = derivative(position, rate)
    acceleration = derivative(velocity, rate)
    inner = slice(margin, len(position) - margin)
    time = stretch.start_s + np.arange(len(position)) / rate
    yield Motion(
        time[inner],
        position[inner],
        velocity[inner],
        acceleration[inner],
        stretch.torque[None, inner],
        stretch.measured[None, inner],
        rate,
        band,
        None if stretch.period is None else stretch.period[inner],
    )


def _averaged_motion(periods: Periods, start_s: float, cutoff_hz: float | None) -> Motion:
    """One period for all: positions averaged, differentiated by their Fourier series, torques kept apart."""
    rate, count = periods.rate_hz, periods.position.shape[1]
    open_band = cutoff_hz is None or cutoff_hz >= OPEN_BAND_FRACTION * rate
    mean = periods.position.mean(axis=0)
    position, velocity, acceleration = fourier_derivatives(mean, rate, _state_cutoff(rate, cutoff_hz))
    band = AllPass(rate) if open_band or cutoff_hz is None else HarmonicBand.design(rate, count, cutoff_hz)
    time = start_s + (periods.rows[0] + np.arange(count)) / rate
    return Motion(time, position, velocity, acceleration, periods.torque, periods.measured, rate, band)


def _part(stretch: Stretch, rows: slice) -> Stretch:
    """A slice of a stretch."""
    start = rows.start or 0
    return replace(
        stretch,
        start_s=stretch.start_s + start / stretch.rate_hz,
        position=stretch.position[rows],
        torque=stretch.torque[rows],
        measured=stretch.measured[rows],
        period=None,
    )
