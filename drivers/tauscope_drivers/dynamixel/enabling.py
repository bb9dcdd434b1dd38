"""Taking an arm under power where it is: everything is checked before anything is written."""

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope_drivers.backend import ControlMode, DriveLimits
from tauscope_drivers.dynamixel import preparation
from tauscope_drivers.dynamixel.servo import JointServo
from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.errors import DriverError
from tauscope_drivers.limits import require_sensible
from tauscope_drivers.state import Setpoint


def goals_of(
    servos: Sequence[JointServo], mode: ControlMode, tasks: Sequence[preparation.ServoTask], setpoint: Setpoint
) -> tuple[str, list[int]]:
    """Item and values of a setpoint. Positions and torques beyond the tasks' bounds are brought back to them."""
    if mode is ControlMode.POSITION:
        pairs = zip(servos, tasks, setpoint.position.tolist(), strict=True)
        return "Goal Position", [min(max(one.units.counts(q), task.low), task.high) for one, task, q in pairs]
    pairs = zip(servos, [task.current_cap for task in tasks], setpoint.torque.tolist(), strict=True)
    return "Goal Current", [min(max(one.units.current_units(torque), -cap), cap) for one, cap, torque in pairs]


def enable_servos(
    session: Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float
) -> tuple[list[preparation.ServoTask], list[int]]:
    """Prepare every servo, then give each its place for a goal, its watchdog and torque, one servo at a time.

    An arm may fall meanwhile: each servo is asked where it is at the last moment, and catches its joint there. A servo
    that holds its joint already, in the mode that is asked for, is taken over without letting go. Raises DriverError:
    ``refused`` or ``cannot-connect``: no servo has torque that had none before. Returns the tasks, and the Goal
    Position that each servo was given where positions are tracked [counts].
    """
    tasks = plan_tasks(session, mode, limits, watchdog_s)
    held_before = session.health.has_torque.copy()
    reached: list[int] = []
    taken: list[int] = []
    try:
        for joint, task in enumerate(tasks):
            servo, settings, holds = session.servos[joint], session.settings[joint], bool(held_before[joint])
            session.carry_out(joint, preparation.preparing_writes(servo, settings, task, holds=holds))
        for joint, task in enumerate(tasks):
            reached.append(joint)
            taken.append(_take(session, joint, task))
    except DriverError:
        for joint in reached:
            with contextlib.suppress(DriverError):
                if not held_before[joint]:
                    session.write(joint, "Torque Enable", 0)
                session.write(joint, "Bus Watchdog", 0)
        raise
    return tasks, taken


def plan_tasks(
    session: Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float
) -> list[preparation.ServoTask]:
    """Check and plan enabling, reading only: a task a joint. Raises DriverError."""
    steps = preparation.watchdog_steps(watchdog_s)
    present = [_present_position(session, joint) for joint in range(len(session.servos))]
    places = np.array([servo.units.position(count) for servo, count in zip(session.servos, present, strict=True)])
    require_sensible(limits, places, [servo.label for servo in session.servos])
    tasks: list[preparation.ServoTask] = []
    for joint, servo in enumerate(session.servos):
        settings = session.settings[joint]
        cap = preparation.current_cap(servo, settings, float(limits.torque[joint]))
        _require_in_own_range(session, joint, mode, present[joint])
        low, high = float(limits.position_low[joint]), float(limits.position_high[joint])
        lowest, highest = preparation.position_counts(servo, settings, low, high, mode)
        if lowest >= highest:
            raise DriverError.refusal(
                f"{servo.label}: its own Position Limits leave nothing of the range {low:.4g} to {high:.4g}; widen them"
            )
        speed = preparation.velocity_cap(servo, settings, float(limits.velocity[joint]))
        tasks.append(preparation.ServoTask(mode, cap, speed, present[joint], steps, lowest, highest))
        if session.health.has_torque[joint]:
            _require_adoptable(session, joint, mode)
    return tasks


def _take(session: Session, joint: int, task: preparation.ServoTask) -> int:
    """Take a prepared servo under power where it is now; that place [counts]."""
    holds = bool(session.health.has_torque[joint])
    if not holds:
        task = replace(task, present=_present_position(session, joint))
        _require_in_own_range(session, joint, task.mode, task.present)
    session.carry_out(joint, preparation.taking_writes(session.servos[joint], task, holds=holds))
    session.health.has_torque[joint] = True
    return task.present


def _present_position(session: Session, joint: int) -> int:
    return session.read(joint, ["Present Position"])["Present Position"]


def _require_in_own_range(session: Session, joint: int, mode: ControlMode, present: int) -> None:
    """A servo that stands beyond Position Limits that it applies would not stay where it is."""
    servo = session.servos[joint]
    lowest, highest = preparation.position_counts(servo, session.settings[joint], -math.inf, math.inf, mode)
    if not lowest <= present <= highest:
        place = servo.units.position(present)
        ends = sorted((servo.units.position(lowest), servo.units.position(highest)))
        raise DriverError.refusal(
            f"{servo.label} stands at {place:.4g}, its own Position Limits are {ends[0]:.4g} to {ends[1]:.4g}; move it "
            "back by hand, or widen them"
        )


def _require_adoptable(session: Session, joint: int, mode: ControlMode) -> None:
    """A servo under torque can only go on as it is: its modes are locked, and letting go would drop the arm."""
    servo, settings = session.servos[joint], session.settings[joint]
    wrong_mode = settings["Operating Mode"] != preparation.operating_mode(servo, mode)
    if wrong_mode or settings["Drive Mode"] != preparation.drive_mode(servo, settings["Drive Mode"]):
        raise DriverError.refusal(
            f"{servo.label} is under torque in another mode; support the arm, stop it with torque_off, then enable"
        )
