"""Taking an arm under power where it stands: everything is checked before anything is written."""

import contextlib
import math

import numpy as np

from drivers.backend import ControlMode, DriveLimits
from drivers.dynamixel.bounds import Bounds
from drivers.dynamixel.preparation import (
    ServoTask,
    current_cap,
    drive_mode,
    enabling_writes,
    operating_mode,
    position_counts,
    watchdog_steps,
)
from drivers.dynamixel.session import Session
from drivers.errors import DriverError, DriverErrorKind
from drivers.limits import require_sensible


def enable_servos(
    session: Session, mode: ControlMode, limits: DriveLimits, watchdog_s: float
) -> tuple[Bounds, list[int]]:
    """Give every servo its goal, limits and watchdog, read them back, then torque, one servo at a time.

    A servo that holds its joint already, in the mode that is asked for, is taken over without letting go.

    Parameters
    ----------
    session : Session
        with sound servos
    mode : ControlMode
        who closes the loop
    limits : DriveLimits
        of the joints
    watchdog_s : float
        time of silence after which the servos stop [s]

    Returns
    -------
    Bounds
        for the cyclic exchange
    list of int
        Goal Position that each servo was given where positions are tracked [counts]

    Raises
    ------
    DriverError
        ``refused`` or ``cannot-connect``: no servo has torque that had none before
    """
    steps = watchdog_steps(watchdog_s)
    present = _present_positions(session)
    places = np.array([servo.units.position(count) for servo, count in zip(session.servos, present, strict=True)])
    require_sensible(limits, places, [servo.label for servo in session.servos])
    tasks: list[ServoTask] = []
    ranges: list[tuple[int, int]] = []
    for joint, servo in enumerate(session.servos):
        settings = session.settings[joint]
        cap = current_cap(servo, settings, float(limits.torque[joint]))
        ranges.append(_range(session, joint, limits, mode, present[joint]))
        velocity_cap = servo.units.velocity_cap(float(limits.velocity[joint]))
        tasks.append(ServoTask(mode, cap, velocity_cap, present[joint], steps))
        if session.health.has_torque[joint]:
            _require_adoptable(session, joint, mode)
    _give_torque(session, tasks)
    lows, highs = zip(*ranges, strict=True)
    caps = tuple(task.current_cap for task in tasks)
    return Bounds(tuple(lows), tuple(highs), caps, tuple(task.velocity_cap for task in tasks)), present


def _give_torque(session: Session, tasks: list[ServoTask]) -> None:
    """Carry out the tasks; where one fails, those that had no torque before are let go again."""
    held_before = session.health.has_torque.copy()
    reached: list[int] = []
    try:
        for joint, task in enumerate(tasks):
            holds = bool(held_before[joint])
            reached.append(joint)
            servo = session.servos[joint]
            session.carry_out(joint, enabling_writes(servo, session.settings[joint], task, holds=holds))
            session.health.has_torque[joint] = True
    except DriverError:
        for joint in reached:
            with contextlib.suppress(DriverError):
                if not held_before[joint]:
                    session.write(joint, "Torque Enable", 0)
                session.write(joint, "Bus Watchdog", 0)
        raise


def _present_positions(session: Session) -> list[int]:
    """Present Position of every servo [counts]; a servo that does not answer is asked again."""
    return [session.read(joint, ["Present Position"])["Present Position"] for joint in range(len(session.servos))]


def _range(session: Session, joint: int, limits: DriveLimits, mode: ControlMode, present: int) -> tuple[int, int]:
    """Goal Positions that are allowed; the servo's own limits, where it applies them, leave the joint where it is."""
    servo, settings = session.servos[joint], session.settings[joint]
    lowest, highest = position_counts(
        servo, settings, float(limits.position_low[joint]), float(limits.position_high[joint]), mode
    )
    own_lowest, own_highest = position_counts(servo, settings, -math.inf, math.inf, mode)
    if not (own_lowest <= present <= own_highest and lowest < highest):
        place = servo.units.position(present)
        ends = sorted((servo.units.position(own_lowest), servo.units.position(own_highest)))
        raise DriverError(
            DriverErrorKind.REFUSED,
            f"{servo.label} stands at {place:.4g}, its own Position Limits are {ends[0]:.4g} to {ends[1]:.4g}; move it "
            "back by hand, or widen them",
        )
    return lowest, highest


def _require_adoptable(session: Session, joint: int, mode: ControlMode) -> None:
    """A servo under torque can only go on as it is: its modes are locked, and letting go would drop the arm."""
    servo, settings = session.servos[joint], session.settings[joint]
    wrong_mode = settings["Operating Mode"] != operating_mode(servo, mode)
    if wrong_mode or settings["Drive Mode"] != drive_mode(servo, settings["Drive Mode"]):
        raise DriverError(
            DriverErrorKind.REFUSED,
            f"{servo.label} is under torque in another mode; support the arm, stop it with torque_off, then enable",
        )
