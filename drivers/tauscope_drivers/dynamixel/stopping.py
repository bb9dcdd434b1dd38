"""Stopping an arm, and clearing what stopped it. Nothing here restarts a servo, and nothing lets go unasked."""

from collections.abc import Callable, Sequence
from functools import partial

from tauscope_drivers.backend import ControlMode, StopPolicy
from tauscope_drivers.dynamixel.control_table import CURRENT_MODE
from tauscope_drivers.dynamixel.group import GroupReading
from tauscope_drivers.dynamixel.preparation import operating_mode
from tauscope_drivers.dynamixel.session import Session
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.serial_servos.arm import act_on_each

# a servo that is no further than this from its goal only lags behind it, or gives way to a load [rad of the horn]
NEAR_GOAL_RAD = 0.1
_SLOWEST = 1


def stop_servos(
    session: Session, policy: StopPolicy, caps: Sequence[int], last_goals: Sequence[int | None] | None
) -> None:
    """Stop every servo, then end its watchdog, so that it stays so without cycles.

    Holding goes by position; servos in current mode are changed over, which lets go of the arm for the few milliseconds
    that the change takes. These servos cannot damp: for `StopPolicy.DAMP` they hold, which gives way less. Raises
    DriverError where a servo could not be reached; the others are stopped.

    `caps`: most current with which each servo may hold [units].
    """
    everybody = range(len(session.servos))
    session.health.expect_torque(False)
    if policy is StopPolicy.TORQUE_OFF:
        session.group.write("Torque Enable", [0] * len(everybody))
        act_on_each(everybody, partial(_let_go, session))
        return
    in_current_mode = [joint for joint in everybody if session.settings[joint]["Operating Mode"] == CURRENT_MODE]
    holding = [joint for joint in everybody if session.health.has_torque[joint]]
    if change := [joint for joint in holding if joint in in_current_mode]:
        silent = _change_to_holding(session, change, caps)
    else:
        silent = _hold_in_place(session, last_goals)
    # Those that do not answer come last: while they are waited for, the others' watchdogs would fire.
    act_on_each(sorted(everybody, key=silent.__contains__), partial(_confirm_hold, session))


def clear_watchdogs(session: Session) -> None:
    """Clear latched watchdogs without moving the arm.

    The clear lets a servo follow its old goal again, and while it is latched no new goal is taken. So the old goal has
    to be where the servo stands, but for a following error; it is approached at the slowest speed, and replaced by the
    present position at once. A servo in current mode exerts nothing while it is latched, and is let go first. Raises
    DriverError ``fault`` where a servo's old goal is too far away; nothing was cleared.
    """
    latched = [joint for joint in range(len(session.servos)) if session.health.is_latched[joint]]
    _clear(session, latched, lambda joint: session.write(joint, "Bus Watchdog", 0))


def clear_errors(session: Session) -> None:
    """Clear errors of servos that forget them without a restart (Y), just as `clear_watchdogs` does.

    What comes back stays in the servo's Error Code. Raises DriverError ``fault`` where an old goal is too far away.
    """
    stating = [
        joint
        for joint, servo in enumerate(session.servos)
        if servo.model.family.error_is_code and session.health.states_error(joint)
    ]
    _clear(session, stating, lambda joint: session.bus.clear_error(session.servos[joint].servo))


def _clear(session: Session, joints: Sequence[int], clear: Callable[[int], None]) -> None:
    """Clear what keeps servos from taking goals, without moving the arm; none goes where it no longer belongs."""
    in_current_mode = [joint for joint in joints if session.settings[joint]["Operating Mode"] == CURRENT_MODE]
    holding = [joint for joint in joints if session.health.has_torque[joint] and joint not in in_current_mode]
    for joint in holding:
        servo, values = session.servos[joint], session.read(joint, ["Present Position", "Goal Position"])
        distance = abs(values["Present Position"] - values["Goal Position"]) / servo.model.counts_per_radian
        if distance > NEAR_GOAL_RAD:
            text = (
                f"{servo.label} holds {distance:.2f} rad from its old goal and would go there; support the arm, "
                "stop it with torque_off, then acknowledge"
            )
            raise DriverError(DriverErrorKind.FAULT, text, session.health.faults)
    for joint in in_current_mode:
        session.write(joint, "Torque Enable", 0)
    for joint in holding:
        session.write(joint, "Profile Velocity", _SLOWEST)
    for joint in joints:
        clear(joint)
        if joint in holding:
            session.write(joint, "Goal Position", session.read(joint, ["Present Position"])["Present Position"])


def _hold_in_place(session: Session, last_goals: Sequence[int | None] | None) -> set[int]:
    """Goals := where the servos stand; who is near its goal keeps it. Returns those that are silent."""
    present = _present_counts(session, session.group.read())
    goals: list[int | None] = []
    for joint, servo in enumerate(session.servos):
        place, last = present[joint], None if last_goals is None else last_goals[joint]
        near = NEAR_GOAL_RAD * servo.model.counts_per_radian
        is_near = place is not None and last is not None and abs(last - place) < near
        goals.append(None if is_near else place)
    session.group.write("Goal Position", goals)
    return {joint for joint, place in enumerate(present) if place is None}


def _change_to_holding(session: Session, joints: Sequence[int], caps: Sequence[int]) -> set[int]:
    """From current mode to position mode, all servos at once. Returns those that are silent.

    Where they stand is read before they let go of the arm, so that they do so for as short as can be. A servo whose
    place is not known would go after an old goal: it is let go.
    """
    present = _present_counts(session, session.group.read_patiently())
    known = [joint for joint in joints if present[joint] is not None]

    def write(name: str, values: Sequence[int | None], to: Sequence[int]) -> None:
        session.group.write(name, [values[joint] if joint in to else None for joint in range(len(values))])

    count = len(session.servos)
    write("Torque Enable", [0] * count, joints)
    write("Operating Mode", [operating_mode(servo, ControlMode.POSITION) for servo in session.servos], known)
    write("Goal Current", caps, known)
    write("Goal Position", present, known)
    write("Torque Enable", [1] * count, known)
    return {joint for joint, place in enumerate(present) if place is None}


def _present_counts(session: Session, reading: GroupReading) -> list[int | None]:
    return [
        None if reading.alerts[joint] is None else servo.units.counts(float(reading.state.position[joint]))
        for joint, servo in enumerate(session.servos)
    ]


def _let_go(session: Session, joint: int) -> None:
    session.write(joint, "Torque Enable", 0)
    _end_watchdog(session, joint)


def _confirm_hold(session: Session, joint: int) -> None:
    """Make sure of what was written without an answer."""
    before, found = session.settings[joint]["Operating Mode"], session.read(joint, ["Operating Mode"])
    session.settings[joint] |= found
    if session.originals and found["Operating Mode"] != before:
        session.originals[joint].remember("Operating Mode", before, found["Operating Mode"])
    _end_watchdog(session, joint)


def _end_watchdog(session: Session, joint: int) -> None:
    """Let a servo be without cycles; one whose watchdog has fired keeps that until it is acknowledged."""
    session.health.take(joint, session.read(joint, ["Torque Enable", "Bus Watchdog"]))
    if not session.health.is_latched[joint]:
        session.write(joint, "Bus Watchdog", 0)
