"""What was done to a recording, for its result and its reader."""

from dataclasses import dataclass


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
    velocity_source : tuple of str
        per joint, what its velocity and acceleration were made from: ``position``, ``recorded velocity`` or
        ``recorded acceleration``
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
    velocity_source: tuple[str, ...]
