"""Warnings of an identification: what a reader must know before its numbers."""

from collections.abc import Iterator

from tauscope.identification.consistency import far_reaching
from tauscope.identification.excitation import Excitation
from tauscope.identification.identification import Identification
from tauscope.identification.posterior import DETERMINED
from tauscope.recording.conditioning import ConditioningEntry
from tauscope.result_warning import ResultWarning
from tauscope.robot import Robot
from tauscope.robot.messages import listed

FEWEST_REVERSALS = 2  # a joint turns round at least so often where friction is to be told from a constant torque
UNSEEN = 0.1  # share of a joint's held-out torque above which it matters that training leaves it uncertain
# Times the top speed, the range or the uncertain torque of training at which held-out motion is another motion.
BEYOND = 1.25
FAR_OFF = 3.0  # factor between recorded and stated weight beyond which a unit is wrong rather than a mass

_FRICTION = {
    "stiction": "Coulomb friction; turn the joint round more often",
    "viscous": "viscous friction; move at three or more speeds",
    "offset": "constant torque; turn the joint round more often",
}


def identification_warnings(result: Identification) -> list[ResultWarning]:
    """All warnings, the gravest first."""
    return [
        *_signs(result),
        *_scale(result),
        *_passive_joints(result),
        *robot_warnings(result.robot),
        *result.recording_warnings,
        *_bodies(result),
        *excitation_warnings(result),
        *extrapolation_warnings(result),
        *_samples((*result.conditioning, *result.held_out_conditioning)),
    ]


def robot_warnings(robot: Robot) -> list[ResultWarning]:
    """Warnings of what the robot file states, and what is believed instead."""
    far = [
        ResultWarning(
            code="repaired-inertial",
            joint=robot.joint_of_link(link).name,
            text=f"{robot.joint_of_link(link).name}: the stated inertia of its link is that of a body a hundred times"
            " as large as the arm; a compact body is believed instead",
            remedy="state the inertia in kg m² and the mass in kg",
        )
        for link in far_reaching(robot)
    ]
    return [*robot.warnings, *far]


def weak_points(result: Identification, joint: int) -> list[str]:
    """What the recordings do not tell of a joint and of its link, each with the motion that would."""
    if result.excitation.speed[joint] == 0.0:
        return ["motion: it stands still; move it through its range"]
    known = result.identifiable[joint]
    weak = [text for name, text in _FRICTION.items() if not known.get(name, True)]
    if result.excitation.reversals[joint] < FEWEST_REVERSALS:
        weak.append(f"reversals: {result.excitation.reversals[joint]}; move it to and fro")
    base, learnt = result.structure.base, result.posterior.learnt
    own = [place for place, column in enumerate(base.independent_columns) if column // 10 == joint]
    open_ = [base.names[place] for place in own if learnt[place] < DETERMINED]
    if open_:
        weak.append(f"{listed(open_)}; move it faster together with the joints before it, in more postures")
    return weak


def _signs(result: Identification) -> Iterator[ResultWarning]:
    joints = result.robot.joints
    for joint in result.reversed_joints:
        sign = "-1" if joints[joint].sign > 0 else "1"
        yield ResultWarning(
            code="wrong-sign",
            joint=joints[joint].name,
            text=f"{joints[joint].name}: the torque has the wrong sign: bodies and friction fit it far better reversed",
            remedy=f"look at the drive, then set `sign: {sign}` for {joints[joint].name} in the robot file",
        )


def _scale(result: Identification) -> Iterator[ResultWarning]:
    scale = result.gravity_scale
    if scale is not None and not result.reversed_joints and not 1.0 / FAR_OFF < scale < FAR_OFF:
        yield ResultWarning(
            code="torque-scale",
            text=f"gravity's torque is {scale:.3g} times what the masses of the robot file weigh: is the torque in Nm?",
            remedy="check `torque_constant` and `gear_ratio`, or the masses",
        )


def _passive_joints(result: Identification) -> Iterator[ResultWarning]:
    for joint, torque in zip(result.robot.joints, result.residuals.fit.torque_rms, strict=True):
        if torque == 0.0:
            yield ResultWarning(
                code="no-torque",
                joint=joint.name,
                text=f"{joint.name}: its torque is zero throughout: it counts as a passive joint",
                remedy="if it has a motor, record its torque or current",
            )


def _bodies(result: Identification) -> Iterator[ResultWarning]:
    if result.constrained:
        yield ResultWarning(
            code="no-body",
            text=f"no bodies can have the least-squares estimate: {100 * result.free_fit.relative_error:.3g} % error,"
            f" {100 * result.residuals.fit.relative_error:.3g} % with bodies; physics is missing, or a unit, sign or"
            " dimension is wrong",
            remedy="diagnose the same recordings",
        )


def excitation_warnings(result: Identification) -> Iterator[ResultWarning]:
    """Joints of which the recordings leave something open."""
    for joint, each in enumerate(result.robot.joints):
        weak = weak_points(result, joint)
        if weak:
            yield ResultWarning(
                code="poor-excitation",
                joint=each.name,
                text=f"{each.name}: weakly excited: {'. '.join(weak)}",
                remedy="record the motion of `tauscope excite`",
            )


def extrapolations(result: Identification) -> dict[int, str]:
    """Joints whose held-out motion is beyond what training excites, and how, by joint index from 0."""
    if result.held_out_excitation is None or result.extrapolation is None or result.uncertainty_growth is None:
        return {}
    own, other = result.excitation, result.held_out_excitation
    found = {}
    for joint, each in enumerate(result.robot.joints):
        unit = each.type.unit
        reasons = []
        if other.speed[joint] > BEYOND * own.speed[joint]:
            reasons.append(
                f"it moves at up to {other.speed[joint]:.3g} {unit}/s, in training at {own.speed[joint]:.3g}"
            )
        if other.highest[joint] - other.lowest[joint] > BEYOND * (own.highest[joint] - own.lowest[joint]):
            reasons.append(f"it moves from {_range(other, joint)} {unit}, in training from {_range(own, joint)}")
        if joint in undetermined(result):
            reasons.append(f"training leaves {100 * result.extrapolation[joint]:.2g} % of its torque uncertain")
        if reasons:
            found[joint] = "; ".join(reasons)
    return found


def undetermined(result: Identification) -> frozenset[int]:
    """Joints whose held-out torque the parameters leave open that training does not tell."""
    if result.extrapolation is None or result.uncertainty_growth is None:
        return frozenset()
    pairs = zip(result.extrapolation, result.uncertainty_growth, strict=True)
    return frozenset(joint for joint, (share, growth) in enumerate(pairs) if share > UNSEEN and growth > BEYOND)


def _range(motion: Excitation, joint: int) -> str:
    return f"{motion.lowest[joint]:.2g} to {motion.highest[joint]:.2g}"


def extrapolation_warnings(result: Identification) -> Iterator[ResultWarning]:
    """Held-out motion beyond what training excites."""
    for joint, reason in extrapolations(result).items():
        name = result.robot.joints[joint].name
        yield ResultWarning(
            code="extrapolation",
            joint=name,
            text=f"{name}: held-out motion is beyond what training excites: {reason}",
            remedy="train on motion as fast and as wide as the held-out motion",
        )


def _samples(summaries: tuple[ConditioningEntry, ...]) -> Iterator[ResultWarning]:
    for each in summaries:
        counts = {
            "without a position": each.missed_positions,
            "without a torque": sum(each.missed_torques),
            "in pieces too short to filter": each.dropped,
        }
        parts = [f"{count} {what}" for what, count in counts.items() if count]
        if parts:
            text = f"{each.recording}: samples left out: {', '.join(parts)}, of {each.samples}"
            yield ResultWarning(code="missing-samples", text=text, remedy="look for lost messages or a full disk")
        if each.gaps:
            text = f"{each.recording}: split at {each.gaps} {'gap' if each.gaps == 1 else 'gaps'} in the clock"
            yield ResultWarning(code="clock-gaps", text=text, remedy="record without a pause")
