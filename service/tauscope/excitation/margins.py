"""What a trajectory leaves of every limit, and the refusal of one that leaves nothing."""

from dataclasses import dataclass, field

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.excitation.constraints import StateUsage
from tauscope.robot import Robot
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples, between_samples
from tauscope.trajectory.limits import MotionLimits
from tauscope.trajectory.segments import FourierSegment, Segment
from tauscope.trajectory.trajectory import Trajectory

CHECK_RATE_HZ = 500.0  # rate at which segments are looked at that are no Fourier series [Hz]
SAMPLES_PER_HARMONIC = 400  # instants a period of the highest harmonic at which a Fourier series is looked at
ROUNDING = 1e-6  # part of a limit by which rounding may exceed it: a file's digits


@dataclass(frozen=True, eq=False)
class Margins:
    """What is left of every limit, as part of the limit; negative where it is exceeded."""

    position: Array  # (n,), of the range, from its middle
    velocity: Array  # (n,)
    acceleration: Array  # (n,)
    # by kind, (n,), of what may be used, by the prior model; infinite without a limit, none without a model
    drive: dict[str, Array] = field(default_factory=dict)
    # least clearance of joint origins and tool from floor and boxes [m]; None: nothing is forbidden
    workspace_m: float | None = None

    def as_table(self) -> dict[str, list[float | None]]:
        """Margins of the joints by kind of limit, None where there is no limit."""
        kinds = {"position": self.position, "velocity": self.velocity, "acceleration": self.acceleration, **self.drive}
        return {kind: [float(v) if np.isfinite(v) else None for v in values] for kind, values in kinds.items()}


def trajectory_margins(trajectory: Trajectory, limits: MotionLimits, states: StateUsage | None = None) -> Margins:
    """Margins over a whole trajectory."""
    usage, drive, clearance = np.zeros((3, trajectory.joint_count)), np.zeros(1), np.inf
    prediction, workspace = (None, None) if states is None else (states.torque, states.workspace)
    for segment in trajectory.segments:
        motion, between = _sample_extremes(segment)
        usage = np.maximum(usage, _kinematic_usage(segment, motion, between, limits))
        if prediction is not None:
            drive = np.maximum(drive, prediction.usage(motion).max(axis=0))
        if workspace is not None:
            clearance = min(clearance, float(workspace.clearance(motion.position).min()))
    left: dict[str, Array] = {}
    if prediction is not None:
        bounds = prediction.bounds
        parts = np.where(np.isfinite(bounds.available), 1.0 - drive.reshape(bounds.available.shape), np.inf)
        left = dict(zip(bounds.names, parts, strict=True))
    return Margins(*(1.0 - usage), drive=left, workspace_m=clearance if np.isfinite(clearance) else None)


def require_within_limits(trajectory: Trajectory, robot: Robot, limits: MotionLimits, name: str = "trajectory") -> None:
    """Raise ExcitationError, which names joint, instant, value and limit, where a trajectory leaves a limit."""
    margins = trajectory_margins(trajectory, limits)
    for kind in ("position", "velocity", "acceleration"):
        left = getattr(margins, kind)
        if (left >= -ROUNDING).all():
            continue
        j = int(np.argmin(left))
        begin = 0.0
        worst = (-np.inf, 0.0, 0.0)
        for segment in trajectory.segments:
            motion, _ = _sample_extremes(segment)
            values = getattr(motion, kind)[:, j]
            centre = limits.middle[j] if kind == "position" else 0.0
            at = int(np.argmax(np.abs(values - centre)))
            instant = begin + at * segment.duration_s / max(len(values) - 1, 1)
            worst = max(worst, (abs(values[at] - centre), instant, float(values[at])))
            begin += segment.duration_s
        length = robot.joints[j].type.unit
        unit, bound = {
            "position": (length, f"{limits.position_low[j]:.6g} to {limits.position_high[j]:.6g}"),
            "velocity": (f"{length}/s", f"{limits.velocity[j]:.6g}"),
            "acceleration": (f"{length}/s²", f"{limits.acceleration[j]:.6g}"),
        }[kind]
        raise ExcitationError(
            f"{name}: {robot.joints[j].name}: {kind} is {worst[2]:.6g} {unit} at {worst[1]:.3f} s, "
            f"the limit is {bound} {unit}; make the motion slower or smaller"
        )


def _sample_extremes(segment: Segment) -> tuple[MotionSamples, float]:
    """A segment at instants that show its extremes, and the factor by which it may exceed them in between."""
    if isinstance(segment, FourierSegment):
        series = segment.series
        count = SAMPLES_PER_HARMONIC * series.harmonics
        time = np.arange(float(count)) * (series.period_s / count)
        return series.evaluate(time), between_samples(series.harmonics, count)
    count = max(int(np.ceil(segment.duration_s * CHECK_RATE_HZ)), 50)
    return segment.evaluate(np.linspace(0.0, segment.duration_s, count + 1)), 1.0


def _kinematic_usage(segment: Segment, motion: MotionSamples, between: float, limits: MotionLimits) -> Array:
    """Largest usage of position, velocity and acceleration, (3, n)."""
    centre = segment.series.centre if isinstance(segment, FourierSegment) else limits.middle
    position = centre + between * (motion.position - centre)
    parts = limits.usage(MotionSamples(position, between * motion.velocity, between * motion.acceleration))
    return np.stack([np.abs(part).max(axis=0) for part in parts])
