"""What was done to a recording, for its result and its reader."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ConditioningSummary:
    """What was done to one recording, for the result and its reader.

    missed_torques : tuple of int
        per joint, samples without a torque (filled in for filtering, not counted in the fit)
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
    velocity_source: tuple[str, ...]
