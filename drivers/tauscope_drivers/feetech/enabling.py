"""Taking an arm under power where it is, and stopping it."""

import contextlib
from collections.abc import Sequence
from functools import partial

import numpy as np

from tauscope_drivers.backend import DriveLimits, StopPolicy
from tauscope_drivers.errors import DriverError
from tauscope_drivers.feetech.commissioning import ServoTask, find_flaws, plan_task, read_servo
from tauscope_drivers.feetech.registers import COUNTS_PER_RADIAN
from tauscope_drivers.feetech.session import Session
from tauscope_drivers.goal_pace import GoalPace
from tauscope_drivers.limits import require_sensible
from tauscope_drivers.serial_servos.arm import act_on_each

# a servo that is no further than this from its goal only lags behind it, or gives way to a load [rad of the horn]
NEAR_GOAL_RAD = 0.1
FREE_ACCELERATION = 0  # acceleration of a target that follows each goal at Goal Speed

_LET_GO = {"Torque Enable": 0}
_BLIND_ATTEMPTS = 3


def plan_tasks(session: Session, limits: DriveLimits) -> list[ServoTask]:
    """Check everything that enabling needs; only reads. Raises DriverError ``refused``, which names the joint."""
    readings = [read_servo(session, joint) for joint in range(len(session.servos))]
    places = [
        servo.position(reading.feedback["Present Position"])
        for servo, reading in zip(session.servos, readings, strict=True)
    ]
    require_sensible(limits, np.array(places), [servo.label for servo in session.servos])
    for joint, (servo, reading) in enumerate(zip(session.servos, readings, strict=True)):
        for flaw in find_flaws(servo, reading, limits, joint):
            raise DriverError.refusal(f"{servo.label}: {flaw.detail}; {flaw.remedy}")
    return [
        plan_task(servo, reading, limits, joint)
        for joint, (servo, reading) in enumerate(zip(session.servos, readings, strict=True))
    ]


def enable_servos(session: Session, tasks: Sequence[ServoTask]) -> list[int]:
    """Give each servo its limits and its place for a goal, then torque, one after the other; their goals [counts].

    Each is asked for its place at the last moment: an arm may fall. Where one fails, those that had no torque are let
    go. Raises DriverError.
    """
    held_before = session.health.has_torque.copy()
    reached: list[int] = []
    goals: list[int] = []
    try:
        for joint, task in enumerate(tasks):
            reached.append(joint)
            goals.append(_take(session, joint, task))
    except DriverError:
        for joint in reached:
            session.health.expect(joint, {})
            if not held_before[joint]:
                _let_go_blindly(session, joint)
        raise
    return goals


def taking_writes(task: ServoTask, present: int, goal: int | None) -> list[dict[str, int]]:
    """Registers that take a servo under power. `present`, `goal`: place, and goal where it holds already [counts]."""
    place = goal if goal is not None and _is_near(goal, present) else present
    target = {"Acceleration": FREE_ACCELERATION, "Goal Position": place, "Goal Time": 0}
    writes = [target | {"Goal Speed": task.speed, "Torque Limit": task.torque}]
    return writes if goal is not None else [*writes, {"Torque Enable": 1}]


def _take(session: Session, joint: int, task: ServoTask) -> int:
    """Take a servo under power where it is now; its goal [counts]."""
    goal = session.read_targets(joint)["Goal Position"] if session.health.has_torque[joint] else None
    present = session.read_feedback(joint)["Present Position"]
    writes = taking_writes(task, present, goal)
    for write in writes:
        session.write(joint, write)
    session.health.has_torque[joint] = True
    session.health.expect(joint, {"Torque Enable": 1, "Torque Limit": task.torque})
    return writes[0]["Goal Position"]


def goal_writes(
    goals: Sequence[int], tasks: Sequence[ServoTask], pace: GoalPace | None, now_ns: int
) -> list[dict[str, int]]:
    """Registers of a cycle, one servo each. `goals`: [counts]; `pace`: None: servos leap at the speed limit."""
    speeds = [task.speed for task in tasks] if pace is None else pace.speeds(goals, now_ns)
    return [
        {"Goal Position": goal, "Goal Time": 0, "Goal Speed": speed} for goal, speed in zip(goals, speeds, strict=True)
    ]


def stop_servos(session: Session, policy: StopPolicy) -> None:
    """Stop every servo. These servos cannot damp: for `StopPolicy.DAMP` they hold, which gives way less.

    A servo that is near its goal keeps it, another's goal becomes its place. One that does not answer may hold a goal
    that nobody knows: it is told to let go. Raises DriverError where a servo could not be reached; the others are
    stopped.
    """
    for joint in range(len(session.servos)):
        session.health.expect(joint, {})
    if policy is StopPolicy.TORQUE_OFF:
        session.bus.sync_write(dict.fromkeys(session.identifiers, _LET_GO))
    act = _let_go if policy is StopPolicy.TORQUE_OFF else _hold
    act_on_each(range(len(session.servos)), partial(act, session), partial(_let_go_blindly, session))


def _hold(session: Session, joint: int) -> None:
    targets = session.read_targets(joint)
    if not targets["Torque Enable"]:
        return
    present = session.read_feedback(joint)["Present Position"]
    if not _is_near(targets["Goal Position"], present):
        session.write(joint, {"Goal Position": present})


def _is_near(goal: int, present: int) -> bool:
    return abs(goal - present) < NEAR_GOAL_RAD * COUNTS_PER_RADIAN


def _let_go(session: Session, joint: int) -> None:
    session.write(joint, _LET_GO)
    session.read_targets(joint)


def _let_go_blindly(session: Session, joint: int) -> None:
    """Tell a servo to let go that may hear, and does not answer."""
    for _ in range(_BLIND_ATTEMPTS):
        with contextlib.suppress(DriverError):
            session.bus.sync_write({session.servos[joint].servo: _LET_GO})
    session.health.has_torque[joint] = False
