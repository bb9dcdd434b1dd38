"""Torque that a position or velocity loop makes of the recorded commands."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.actuation.delay import FOUND_STD_S, Delay, command_torque, estimate_delays, shift_command
from tauscope.actuation.scale import STATED_MASS_STD, estimate_torque_per_volt, is_open, with_torque_per_volt
from tauscope.errors import RecordingError
from tauscope.recording.columns import table_columns
from tauscope.recording.recording import Recording
from tauscope.recording.samples import EffortKind
from tauscope.recording.table import MemoryTable
from tauscope.result_warning import ResultWarning
from tauscope.robot import Actuator, Robot
from tauscope.robot.actuator import ASSUMED_SERVO

__all__ = ["make_efforts", "require_loops", "shift_command"]

# Share of rows at the duty limit from which gain and torque per volt can be told from each other.
SATURATED_SHARE = 0.02
_KEPT = {"qd": "velocity", "qdd": "acceleration", "qref": "reference", "temp": "temperature", "qlink": "link_position"}


def make_efforts(
    robot: Robot, recordings: Sequence[Recording], held_out: Sequence[Recording] = ()
) -> tuple[Robot, tuple[Recording, ...], tuple[Recording, ...]]:
    """Torque where recordings hold commands; delays not stated are estimated. Returns the robot with them, notes.

    Raises RecordingError where a joint has no loop, or its loop lacks a voltage.
    """
    commands = [each for each in recordings if each.effort_kind is EffortKind.COMMAND]
    unseen = [each for each in held_out if each.effort_kind is EffortKind.COMMAND]
    if not commands and not unseen:
        return robot, tuple(recordings), tuple(held_out)
    for recording in (*commands, *unseen):
        require_loops(robot, recording)
    given = commands or unseen
    open_ = [place for place, joint in enumerate(robot.joints) if is_open(joint)]
    in_volts = with_torque_per_volt(robot, dict.fromkeys(open_, 1.0))
    delays = estimate_delays(in_volts, given)
    if open_:
        scales = estimate_torque_per_volt(in_volts, given, delays, open_)
        for place in sorted(set(open_) - set(scales)):
            raise RecordingError(
                f"{given[0].name}: {robot.joints[place].name}: torque cannot be made of qref{place + 1} without its"
                f" torque per volt, and stated masses do not tell it; state joints[{place}].actuator.torque_per_volt"
            )
        robot = with_torque_per_volt(robot, scales, STATED_MASS_STD)
    pairs = zip(robot.actuators, delays, strict=True)
    driven = robot.with_actuators(loop and replace(loop, delay=delay.value) for loop, delay in pairs)
    made = {id(each): _make_effort(driven, each, delays) for each in (*commands, *unseen)}
    told = _describe(driven, delays, [made[id(each)] for each in given], given, open_)
    train, judge = (tuple(made.get(id(each), each) for each in some) for some in (recordings, held_out))
    return replace(driven, notes=(*robot.notes, *told)), train, judge


def require_loops(robot: Robot, recording: Recording) -> None:
    """Raise RecordingError, which names joint and key, where a loop is missing, or its supply."""
    for number, joint in enumerate(robot.joints, 1):
        loop = joint.actuator
        if loop is None or not loop.has_loop:
            raise RecordingError(
                f"{recording.name}: column tau{number} is missing, and joint {number} ({joint.name}) has no loop that"
                f" makes torque of qref{number}; state joints[{number - 1}].actuator with kind: position and kp"
            )
        if loop.unit == "register" and not (loop.supply_voltage or recording.has("volt")):
            raise RecordingError(
                f"{recording.name}: {joint.name}: torque cannot be made of qref{number} without its supply; state"
                f" joints[{number - 1}].actuator.supply_voltage, or record volt{number}"
            )


def _make_effort(robot: Robot, recording: Recording, delays: Sequence[Delay]) -> Recording:
    """The recording with torque in place of commands, and notes on what it is made of."""
    samples = recording.samples()
    effort = command_torque(robot, samples, [delay.value for delay in delays])
    groups = {name: values for name, key in _KEPT.items() if (values := getattr(samples, key)) is not None}
    columns = [samples.time[:, None], samples.position, effort * [joint.sign for joint in robot.joints]]
    columns += groups.values()
    names = list(table_columns(robot.joint_count, EffortKind.TORQUE))
    names += [f"{group}{joint}" for group in groups for joint in range(1, robot.joint_count + 1)]
    if samples.period is not None:
        names, columns = [*names, "period"], [*columns, samples.period[:, None]]
    loops = [joint.actuator for joint in robot.joints if joint.actuator is not None]
    return replace(
        recording,
        effort_kind=EffortKind.TORQUE,
        table=MemoryTable(tuple(names), np.hstack(columns)),
        effort_std=tuple(loop.relative_std for loop in loops),
    )


def _describe(
    robot: Robot,
    delays: Sequence[Delay],
    made: Sequence[Recording],
    commands: Sequence[Recording],
    weighed: Sequence[int],
) -> list[ResultWarning]:
    """What the torque is made of, and what these data cannot tell of it."""
    notes = []
    for index, (joint, delay) in enumerate(zip(robot.joints, delays, strict=True)):
        loop = joint.actuator
        if loop is None:
            continue
        late = "as stated"
        if delay.std is not None:
            is_found = delay.std < FOUND_STD_S
            late = f"± {1e3 * delay.std:.1f} ms, estimated" if is_found else "which these data do not tell"
        gain = "as recorded" if any(each.has("kp") for each in commands) else f"{loop.kp:g}"
        text = f"{joint.name}: torque is made of qref{index + 1} by a {loop.kind} loop, kp {gain}"
        if loop.unit == "register":
            text += f" (register of {loop.servo or f'no stated servo: {ASSUMED_SERVO} is assumed'})"
        text += f"; delay {1e3 * delay.value:.1f} ms, {late}"
        remedy = "record torque or current where the servo has them" + (
            "" if loop.servo or loop.unit != "register" else ", or state the servo in joints[].actuator.servo"
        )
        notes.append(ResultWarning(code="made-effort", joint=joint.name, text=text, remedy=remedy))
        limited = max(_measure_limited_share(loop, *pair, index) for pair in zip(made, commands, strict=True))
        notes.append(_separate(joint.name, loop, limited, is_weighed=index in weighed))
    return notes


def _measure_limited_share(loop: Actuator, made: Recording, commands: Recording, joint: int) -> float:
    """Share of rows in which the bridge is at its duty limit; zero for a loop in SI."""
    if loop.unit != "register":
        return 0.0
    voltage = commands.samples().voltage
    supply = loop.supply_voltage if voltage is None else voltage[:, joint]
    top = 0.999 * loop.duty_limit * (loop.volt_torque or 0.0) * np.asarray(supply)
    return float(np.mean(np.abs(made.samples().effort[:, joint]) >= top))


def _separate(name: str, loop: Actuator, limited: float, *, is_weighed: bool) -> ResultWarning:
    """What of gain, torque per volt and friction the commands can tell from each other."""
    known = f"stated to {100.0 * loop.relative_std:.3g} %" if loop.relative_std else "taken as exact"
    scale, scaled = "torque_per_volt", "kp, supply and torque_per_volt count as one product"
    if loop.unit == "Nm_per_rad":
        scale, scaled = "kp", "the scale of the torque is that of kp"
    elif limited > SATURATED_SHARE:
        scaled = f"kp and torque_per_volt separate only in the {100.0 * limited:.0f} % of rows at the duty limit"
    if is_weighed:
        scaled = f"torque per volt is {loop.volt_torque:.3g} Nm/V by the stated masses"
    text = f"{name}: {scaled}, {known}: masses and friction are proportional to it"
    text += ". Back-EMF and kd are parts of viscous friction" if not (loop.back_emf or loop.kd) else ""
    remedy = f"weigh one known payload, or state a mass that is known, and set {scale} so that both agree"
    return ResultWarning(code="effort-scale", joint=name, text=text, remedy=remedy)
