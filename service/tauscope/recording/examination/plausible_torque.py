"""Whether torque can be torque: not a register, not a current, not a magnitude."""

import numpy as np

from tauscope.recording.examination.sketch import Sketch, percentile
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.samples import Array
from tauscope.robot.kinematics import link_placements
from tauscope.robot.robot import JointType, Robot

# Multiple of a joint's torque limit that a peak stays below: limits are of the drive, or of continuous duty.
ABOVE_LIMITS = 5.0
# Multiple of the stated masses' gravity that no torque is: masses that are guessed are off by a few times.
ABOVE_GRAVITY = 20.0
LIVELY = 5.0  # acceleration of the hand, relative to gravity's, from which a motion says nothing about gravity
AS_GRAVITY = 0.8  # least cosine between torque and gravity's torque for which one is the other times a constant
POSTURES = 400

SMALL_STEP = 1e-5  # of a difference quotient: its error of 1e-10 of the slope is as large as round-off [rad or m]
LARGEST_TORQUE = 1e6  # no joint's torque is larger [Nm or N]
# A negative number that is read without its sign is at least this: signs are in bit 10 of old servos, or in bit 15.
REGISTER_RANGE = 1 << 10
# Torque in whole Nm belongs to an arm whose wrist, too, has this much; a register has it at every joint [Nm].
REGISTER_LEVEL = 30.0
MASS_DENSITY = 150.0  # mass of the heaviest arms by the cube of their reach [kg/m³]: 4,700 kg at 3.2 m
WRIST_SHARE = 0.03  # torque at the wrist of such an arm, relative to gravity's at its base
NEAR_ZERO = 0.05  # share of its 99th percentile below which a torque is near zero
FEWEST_TOUCHES = 3  # times that a magnitude comes down to zero while the joint is fast, and goes up again


def find_implausible_torque(recording: Recording, sketch: Sketch, robot: Robot | None) -> str | None:
    """The column, evidence and remedy of torque that can hardly be torque; None where it can."""
    if recording.effort_kind is EffortKind.COMMAND:
        return None
    if robot is not None and recording.effort_kind is EffortKind.CURRENT:
        fault = _find_missing_constant(robot)
        if fault is not None:
            return fault
    return (
        _find_register(recording, sketch, robot)
        or _find_magnitude(recording, sketch)
        or (_find_excess(sketch, robot) if recording.effort_kind is EffortKind.TORQUE else None)
    )


def _find_missing_constant(robot: Robot) -> str | None:
    """Current that nothing turns into torque."""
    for number, joint in enumerate(robot.joints, 1):
        if not joint.has_torque_constant and joint.torque_constant == 1.0:
            return (
                f"column i{number}: holds current or drive units, and robot {robot.name} states no torque_constant for"
                f" joint {number} ({joint.name}); state joints[{number - 1}].torque_constant, Nm per recorded unit"
            )
    return None


def _find_register(recording: Recording, sketch: Sketch, robot: Robot | None) -> str | None:
    """Whole numbers that are too large for an arm of this size, or that lost their sign."""
    effort = sketch.effort
    known = np.isfinite(effort)
    if not known.any() or not (effort[known] == np.rint(effort[known])).all():
        return None
    name = recording.effort_kind.value
    highest = np.where(known, effort, 0.0).max(axis=0)
    if effort[known].min() >= 0.0 and highest.max() >= REGISTER_RANGE:
        joint = int(np.argmax(highest))
        return (
            f"column {name}{joint + 1}: whole numbers up to {highest[joint]:.0f} and none below zero at any joint, as a"
            " register has that is read without its sign; write signed numbers"
        )
    if recording.effort_kind is EffortKind.CURRENT:
        return None
    level = percentile(np.abs(effort), 95.0)
    moved = level[known.any(axis=0)]
    reach = 3.2 if robot is None else _reach(robot, sketch)
    least = max(REGISTER_LEVEL, WRIST_SHARE * MASS_DENSITY * 9.81 * reach**4)
    if moved.min() < least:
        return None
    return (
        f"column {name}1: whole numbers of up to {np.nanmax(np.abs(effort)):.0f} at every joint, as a drive's register"
        " has; read it with --units tau=drive and state torque_constant, Nm per unit, in the robot file"
    )


def _find_magnitude(recording: Recording, sketch: Sketch) -> str | None:
    """Torque that is negative at no joint although they move both ways: friction alone must change its sign.

    Gravity may outweigh friction, but not where the torque comes down to zero at speed, both ways, and turns there.
    """
    if np.nanmin(sketch.effort, initial=0.0) < 0.0:
        return None
    for joint in range(recording.joint_count):
        effort, slope = sketch.effort_at_slope[:, joint], sketch.slope[:, joint]
        known = np.isfinite(effort) & np.isfinite(slope)
        effort, slope = effort[known], slope[known]
        if len(effort) < 100:
            continue
        top, fast = float(np.percentile(effort, 99.0)), float(np.percentile(np.abs(slope), 95.0))
        forward, backward = (float(np.mean(sign * slope > 0.3 * fast)) for sign in (1.0, -1.0))
        if top <= 0.0 or fast <= 0.0 or min(forward, backward) < 0.05:
            continue
        touches = (effort < NEAR_ZERO * top) & (effort > 0.0)  # zero itself is a dropout
        ways = [touches & (sign * slope > 0.2 * fast) for sign in (1.0, -1.0)]
        episodes = sum(int(np.count_nonzero(np.diff(way.astype(np.int8), prepend=0) == 1)) for way in ways)
        if episodes >= FEWEST_TOUCHES and ways[0].any() and ways[1].any():
            column = f"{recording.effort_kind.value}{joint + 1}"
            return (
                f"column {column}: never negative, though joint {joint + 1} moves both ways and its torque comes down"
                f" to zero {episodes} times at speed: this is a magnitude; record torque with its sign"
            )
    return None


def _find_excess(sketch: Sketch, robot: Robot | None) -> str | None:
    """Torque beyond limits, or beyond gravity's on the stated masses."""
    effort = sketch.effort
    peak = percentile(np.abs(effort), 99.0)
    mend = "read current with --units tau=mA (or tau=A), and state torque_constant in the robot file"
    if peak.max() > LARGEST_TORQUE:
        return f"column tau{np.argmax(peak) + 1}: {peak.max():.3g} is no joint's torque in Nm; {mend}"
    if robot is None:
        return None
    ratio = _gravity_ratio(sketch, robot)
    if ratio is not None and ratio[1] > ABOVE_GRAVITY:
        joint, times = ratio
        return f"column tau{joint + 1}: {times:.3g} times the gravity of the stated masses: hardly in Nm; {mend}"
    limits = np.array([joint.limits.torque or np.inf for joint in robot.joints])
    if ratio is not None or len(set(limits)) == 1 < len(limits):
        return None  # masses vouch for the unit; one limit for all joints is a default of a drawing program
    above = peak > ABOVE_LIMITS * limits
    if above.any() and above.sum() >= np.isfinite(limits).sum() / 2.0:
        joint = int(np.argmax(peak / limits))
        return f"column tau{joint + 1}: {peak[joint]:.4g}, of a joint limited to {limits[joint]:.4g} Nm; {mend}"
    return None


def _gravity_ratio(sketch: Sketch, robot: Robot) -> tuple[int, float] | None:
    """A joint whose torque follows gravity's, and how many times that it is; None where none does."""
    if robot.model.links is None or _is_lively(sketch, robot):
        return None
    known = np.flatnonzero(np.isfinite(sketch.position).all(axis=1) & np.isfinite(sketch.effort).all(axis=1))
    if len(known) < 10:
        return None
    rows = known[np.linspace(0, len(known) - 1, min(POSTURES, len(known))).astype(int)]
    gravity, effort = _gravity_torque(robot, sketch.position[rows]), sketch.effort[rows]
    weight = np.sqrt(np.mean(gravity**2, axis=0))
    size = np.sqrt(np.mean(effort**2, axis=0))
    cosine = np.mean(gravity * effort, axis=0) / np.maximum(weight * size, 1e-300)
    follows = (np.abs(cosine) > AS_GRAVITY) & (weight > 0.1 * weight.max()) & (weight > 0.0)
    if not follows.any():
        return None
    joint = int(np.argmax(np.where(follows, weight, -1.0)))
    return joint, float(size[joint] / weight[joint])


def _is_lively(sketch: Sketch, robot: Robot) -> bool:
    """Whether inertia outweighs gravity, as in fast motion: then torque that follows gravity's may be larger."""
    speed = percentile(np.abs(sketch.slope), 99.0)
    acceleration = 2.0 * speed**2 / np.maximum(sketch.span, 1e-9)  # of a wave of this speed and span
    revolute = np.array([joint.type is JointType.REVOLUTE for joint in robot.joints])
    lever = np.where(revolute, _reach(robot, sketch), 1.0)
    return bool((acceleration * lever).max() > LIVELY * 9.81)


def _gravity_torque(robot: Robot, position: Array) -> Array:
    """Torque that holds the stated masses against gravity, (N, n) [Nm or N]: the slope of their potential energy."""
    mass = np.array([link.mass for link in robot.model.links or ()])
    moment = np.array([link.first_moment for link in robot.model.links or ()])

    def potential(posture: Array) -> Array:
        frames = link_placements(robot, posture)
        centre = frames[..., :3, 3] * mass[:, None] + np.einsum("tjab,jb->tja", frames[..., :3, :3], moment)
        return -centre.sum(axis=1) @ robot.gravity

    steps = SMALL_STEP * np.eye(robot.joint_count)
    return np.stack([potential(position + step) - potential(position - step) for step in steps], 1) / (2 * SMALL_STEP)


def _reach(robot: Robot, sketch: Sketch) -> float:
    """Length of the chain at one of the recorded postures, joint by joint [m]."""
    known = np.flatnonzero(np.isfinite(sketch.position).all(axis=1))
    posture = sketch.position[known[:1]] if len(known) else np.zeros((1, robot.joint_count))
    origin = np.concatenate([np.zeros((1, 3)), link_placements(robot, posture)[0, :, :3, 3]])
    return float(np.linalg.norm(np.diff(origin, axis=0), axis=1).sum())
