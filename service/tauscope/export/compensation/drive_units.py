"""Joint torque in the units that drives speak: milliampere, and per mille of rated torque."""

import math
from dataclasses import dataclass

from tauscope.errors import ExportError
from tauscope.recording import EffortKind
from tauscope.robot import Joint, JointType
from tauscope.robot.messages import one_line, shown

_RATED_TORQUE = "rated_torque_nm"


@dataclass(frozen=True)
class DriveUnits:
    """What one drive unit means at the joint; None where the robot file and the recording do not tell.

    `torque_per_milliampere`: joint torque per mA of recorded current, sign of the wiring included [Nm or N per mA].
    `torque_per_permille`: joint torque per 1/1000 of the motor's rated torque, sign included [Nm per ‰].
    """

    torque_per_milliampere: float | None = None
    torque_per_permille: float | None = None
    remarks: tuple[str, ...] = ()


UNKNOWN_UNITS = DriveUnits()  # nothing is known of the drive


def drive_units(joint: Joint, effort_kind: EffortKind) -> DriveUnits:
    """Drive units of a joint from its robot file entry and from what the recording holds.

    Current is known where the recording holds current (ampere): `torque_constant` is then Nm per A. Per mille of rated
    torque is known where the joint's drive block states ``rated_torque_nm``, the rated torque at the motor shaft as in
    CiA 402 object 0x6076: joint torque = ‰ / 1000 · rated torque · |gear ratio|. Directions are the joint's `sign`.
    Raises ExportError if the torque constant is zero, or the rated torque or the gear ratio is not a usable number.
    """
    milliampere, current_remark = _milliampere(joint, effort_kind)
    permille, torque_remark = _permille(joint)
    return DriveUnits(milliampere, permille, (current_remark, torque_remark))


def _milliampere(joint: Joint, effort_kind: EffortKind) -> tuple[float | None, str]:
    """Joint torque per mA, and a remark."""
    if effort_kind is not EffortKind.CURRENT:
        return None, "mA not known: the recording holds torque, so no torque constant in Nm per A was used"
    constant = joint.torque_constant
    if not math.isfinite(constant) or constant == 0.0:
        text = f"joint {shown(joint.name)}: torque_constant = {constant:g} must be finite and not zero"
        raise ExportError(one_line(f"{text}; correct the robot file"))
    force = "N" if joint.type is JointType.PRISMATIC else "Nm"
    remark = f"mA: torque_constant {constant!r} {force}/A, sign {joint.sign:+d}"
    if constant == 1.0:
        remark += f"; if the robot file gives no torque_constant, all torques here are in A, not in {force}"
    return joint.sign * constant / 1000.0, remark


def _permille(joint: Joint) -> tuple[float | None, str]:
    """Joint torque per mille of rated torque, and a remark."""
    rated = (joint.drive or {}).get(_RATED_TORQUE)
    if rated is None:
        return None, f"per mille of rated torque not known: the robot file states no drive.{_RATED_TORQUE}"
    if joint.type is JointType.PRISMATIC:
        return None, "per mille of rated torque not known: the travel per motor turn of a prismatic joint is not stated"
    rated = _positive(joint, f"drive.{_RATED_TORQUE}", rated)
    if joint.gear_ratio is None:
        remark = f"per mille of rated torque: {rated!r} Nm, taken at the joint because no gear_ratio is stated"
        return joint.sign * rated / 1000.0, f"{remark}, sign {joint.sign:+d}"
    ratio = _positive(joint, "gear_ratio", abs(joint.gear_ratio))
    remark = f"per mille of rated torque: {rated!r} Nm at the motor, gear_ratio {ratio!r}, sign {joint.sign:+d}"
    return joint.sign * rated * ratio / 1000.0, remark


def _positive(joint: Joint, name: str, value: object) -> float:
    """A positive finite number of the robot file."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value <= 0.0:
        text = f"joint {shown(joint.name)}: {name} = {shown(value)} must be a positive number; correct the robot file"
        raise ExportError(one_line(text))
    return float(value)
