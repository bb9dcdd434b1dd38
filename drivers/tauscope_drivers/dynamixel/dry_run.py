"""The frames that a run would send, without a port."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel import packets, preparation
from tauscope_drivers.dynamixel.bus import has_room_for_speeds, planned_budget
from tauscope_drivers.dynamixel.configuration import read_configuration
from tauscope_drivers.dynamixel.control_table import encode_items
from tauscope_drivers.dynamixel.enabling import goals_of
from tauscope_drivers.dynamixel.group import health_turns, item_writes, paced_goals, servo_families
from tauscope_drivers.dynamixel.servo import JointServo, make_servo
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.inspection import FrameRequest, PlannedFrame
from tauscope_drivers.limits import require_sensible
from tauscope_drivers.state import Setpoint

_frame = PlannedFrame.on_serial_bus

# settings of a servo of the X series as delivered, but for a Current Limit that limits nothing
_DELIVERED = {
    **dict.fromkeys(preparation.SETTINGS, 0),
    "Return Delay Time": 250,
    "Operating Mode": 3,
    "Status Return Level": 2,
    "PWM Limit": 885,
    "Current Limit": 0x7FFF,
}


def plan_frames(joints: Sequence[DriveJoint], request: FrameRequest) -> Iterator[PlannedFrame]:
    """Frames of a connection, of enabling, of some cycles and of a stop, for X series servos as delivered.

    Every servo knows Fast Sync Read, and nothing is lost. Raises DriverError ``refused``. `joints`: base first; each
    ``drive`` block has to name its model.
    """
    mode, limits, targets, cycle_s = request.mode, request.limits, request.targets, request.cycle_s
    configuration = read_configuration(joints)
    servos = [make_servo(number, servo, None) for number, servo in enumerate(configuration.servos, 1)]
    require_sensible(limits, targets[0], [servo.label for servo in servos])
    tasks = [
        preparation.ServoTask(
            mode,
            preparation.current_cap(servo, _DELIVERED, float(limits.torque[joint])),
            servo.units.velocity_cap(float(limits.velocity[joint])),
            servo.units.counts(float(targets[0, joint])),
            preparation.watchdog_steps(request.watchdog_s),
            *servo.units.counts_within(float(limits.position_low[joint]), float(limits.position_high[joint])),
        )
        for joint, servo in enumerate(servos)
    ]
    for servo in servos:
        yield _frame("connect", f"{servo.label}: who are you?", packets.encode_ping(servo.servo))
        yield from _writes(servo, "connect", preparation.commissioning_writes(servo, _DELIVERED, holds=False))
    for servo, task in zip(servos, tasks, strict=True):
        yield from _writes(servo, "enable", preparation.preparing_writes(servo, _DELIVERED, task, holds=False))
    for servo, task in zip(servos, tasks, strict=True):
        yield from _writes(servo, "enable", preparation.taking_writes(servo, task, holds=False))
    if cycle_s is not None and not has_room_for_speeds(*planned_budget(configuration), cycle_s):
        cycle_s = None
    yield from _cycles(servos, tasks, targets, cycle_s)
    for servo in servos:
        items = servo.model.items
        off = [preparation.RegisterWrite(items["Torque Enable"], 0, "torque off")] if mode is ControlMode.TORQUE else []
        yield from _writes(
            servo, "stop", [*off, preparation.RegisterWrite(items["Bus Watchdog"], 0, "stays so without cycles")]
        )


def _cycles(
    servos: Sequence[JointServo],
    tasks: Sequence[preparation.ServoTask],
    targets: NDArray[np.float64],
    cycle_s: float | None,
) -> Iterator[PlannedFrame]:
    mode, turns, pace = tasks[0].mode, health_turns(servos), None
    for cycle, position in enumerate(targets):
        name, goals = goals_of(servos, mode, tasks, Setpoint(position, np.zeros(len(servos))))
        if mode is ControlMode.TORQUE or cycle_s is None:
            writes = item_writes(servos, name, goals)
        else:
            pace = pace or GoalPace(servos, goals, [task.velocity_cap for task in tasks], cycle_s, 0)
            writes = paced_goals(servos, goals, pace.speeds(goals, round(cycle * cycle_s * 1e9)))
        for items, values in writes:
            names = ", ".join(item.name for item in items)
            told = ", ".join(f"{servo} := {', '.join(map(str, own))}" for servo, own in values.items())
            encoded = {servo: encode_items(items, own) for servo, own in values.items()}
            frame = packets.encode_sync_write(encoded, items[0].address)
            yield _frame("cycle", f"{names}: servo {told}", frame)
        for block, members in servo_families(servos):
            identifiers = [servos[index].servo for index in members]
            asked = ", ".join(map(str, identifiers))
            frame = packets.encode_sync_read(identifiers, block.address, block.length, fast=True)
            yield _frame("cycle", f"servos {asked}: current, velocity, position?", frame)
        turn, health = turns[cycle % len(turns)]
        names = ", ".join(item.name for item in health.items)
        frame = packets.encode_read(servos[turn].servo, health.address, health.length)
        yield _frame("cycle", f"{servos[turn].label}: {names}?", frame)


def _writes(servo: JointServo, phase: str, writes: Iterable[preparation.RegisterWrite]) -> Iterator[PlannedFrame]:
    for write in writes:
        frame = packets.encode_write(servo.servo, write.item.address, write.item.encode(write.value))
        yield _frame(phase, f"{servo.label}: {write.item.name} := {write.value}, {write.reason}", frame)
