"""Giving an arm of drives power, stopping it, and clearing what stopped it. A drive that holds goes on holding."""

from collections.abc import Sequence

from tauscope_drivers.backend import ControlMode, StopPolicy
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import NMT_START
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.session import Session, listed, stay_at
from tauscope_drivers.canopen.state_machine import DISABLE_VOLTAGE, FAULT_RESET, DriveState, Goal, next_controlword
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.state import ArmState, Array

TRANSITION_S = 2.0  # time for all drives together to reach a power state

_NO_MODE = 0

STILL_CYCLES = 4  # cycles at one place before anything moves: drives interpolate between the last few targets


def power_up(session: Session, mode: ControlMode) -> tuple[ArmState, Array]:
    """Take all drives to *operation enabled* where they stand; the state, and targets, (n,). Raises DriverError."""
    place = _read_settled_place(session, mode)

    def cycle() -> ArmState:
        for index, node in enumerate(session.nodes):
            if not _is_up(node):
                place[index] = node.last_position
        return session.cycle(mode, Goal.OPERATION_ENABLED, stay_at(place), session.unhurried_ns)

    state = session.step_until(lambda: all(map(_is_up, session.nodes)), cycle, TRANSITION_S)
    for _ in range(STILL_CYCLES):
        session.wait_for_next(state)
        state = cycle()
    if not state.fresh.all():
        session.wait_for_next(state)
        state = session.step_until(lambda: all(node.has_answered for node in session.nodes), cycle, TRANSITION_S)
    _require_up(session, state)
    if 2 * session.answer_time.usual_ns > session.answer_ns:  # this bus usually takes most of the time for answers
        session.answer_ns += session.answer_time.usual_ns
    for node in session.nodes:
        _note_mode(node, mode)
    return state, place


def _note_mode(node: DriveNode, mode: ControlMode) -> None:
    """Keep that a drive shows another mode than it was given: the guard finds an arm that does not follow."""
    wanted, shown = node.mode_numbers[mode], node.dictionary.read_optional(objects.MODE_DISPLAY)
    remark = f"{objects.MODE_DISPLAY} shows {shown}, not {wanted}: it may not have changed its mode"
    if shown not in (None, _NO_MODE, wanted) and remark not in node.remarks:
        node.remarks += (remark,)


def _read_settled_place(session: Session, mode: ControlMode) -> Array:
    """Where the joints are, before any drive changes its state: one that holds may be powered again with it."""
    stay = session.standstill()

    def cycle() -> ArmState:
        for node in session.nodes:
            if not node.has_answered:  # it may have missed that it shall take process data
                session.bus.command_nodes(NMT_START, node.configuration.node_id)
        return session.cycle(mode, Goal.QUICK_STOP, stay, session.unhurried_ns)

    session.step_until(lambda: all(node.has_answered for node in session.nodes), cycle, TRANSITION_S)
    return session.standstill().position


def _is_up(node: DriveNode) -> bool:
    return node.last_state is DriveState.OPERATION_ENABLED


def _require_up(session: Session, state: ArmState) -> None:
    """Refuse to go on with a drive that is not there, and say why it may be."""
    waiting = next((node for node in session.nodes if not _is_up(node)), None)
    if waiting is None:
        return
    faults = state.faults
    text = listed(faults) if faults else f"{waiting.place} stays in {waiting.last_state or 'an unknown state'}"
    kind = DriverErrorKind.FAULT if faults else DriverErrorKind.REFUSED
    raise DriverError(kind, f"the drives cannot be enabled: {text}", faults)


# what drives can do by themselves, and where that takes them
POLICY_GOALS = {StopPolicy.HOLD: Goal.QUICK_STOP, StopPolicy.TORQUE_OFF: Goal.SWITCH_ON_DISABLED}
STOP_S = 0.5  # time for a stop by process data; drives that are not there by then are told one by one
RESET_S = 0.1  # time in which a drive leaves its fault, or is back in it because the cause persists

# a frame that tells a drive to stop may be lost, and the answer that it has stopped comes a cycle later
PROMPT_CYCLES = 3
_SILENT_REMEDY = "support the arm, check the drive's cable and power, then acknowledge"
_RESTART_REMEDY = "support the arm, look for a dip of its supply, then acknowledge"


def stop_in_cycle(session: Session, mode: ControlMode, goal: Goal) -> bool:
    """Stop by process data, all together; False where not all got there: a drive that takes none has stopped itself."""

    def is_nothing_left_to_wait_for() -> bool:
        are_stopped = all(has_stopped(node, goal) or node.is_deaf for node in session.nodes)
        has_braked = session.brake is None or session.brake.is_at_rest(session.clock.now_ns())
        return are_stopped and (has_braked or not any(node.holds_by_targets for node in session.nodes))

    def cycle() -> ArmState:
        return session.cycle(mode, goal, session.stop_targets(), session.unhurried_ns)

    session.step_until(is_nothing_left_to_wait_for, cycle, STOP_S)
    return all(has_stopped(node, goal) for node in session.nodes)


def stop_promptly(session: Session, mode: ControlMode, goal: Goal) -> ArmState:
    """Tell all drives to stop within a cycle of the control loop, and again where one may not have heard it.

    Those that missed the master have stopped by themselves and answer no SYNC: they are asked by SDO, for
    what they told last is from before.
    """
    for _ in range(PROMPT_CYCLES):
        state = session.cycle(mode, goal, session.stop_targets(), session.answer_ns)
        if all(has_stopped(node, goal) for node in session.nodes):
            return state
        if all(node.is_deaf for node in session.nodes):
            break
    return session.read_by_sdo() if any(node.is_deaf for node in session.nodes) else state


def stop_one_by_one(nodes: Sequence[DriveNode], goal: Goal, *, is_stopped: bool) -> list[Fault]:
    """Stop drives that no longer take process data, let all forget the master, and read them.

    One that holds already stays as it is. A fault for each drive that does not answer: the others are stopped all the
    same. Raises DriverError ``lost`` where the bus is gone.
    """
    silent: list[Fault] = []
    for node in nodes:
        try:
            node.read_now()
            is_driven = node.state is DriveState.OPERATION_ENABLED and node.stays_stopped
            if not is_stopped and (goal is not Goal.QUICK_STOP or is_driven):
                node.dictionary.write(objects.CONTROLWORD, next_controlword(node.state, goal))
            node.disarm_watchdog()
            node.read_now()
        except DriverError as error:
            if error.kind is DriverErrorKind.LOST:
                raise
            node.values = {}
            silent.append(Fault("silent", node.joint, "did not answer while it was stopped", _SILENT_REMEDY))
    return silent


def has_stopped(node: DriveNode, goal: Goal) -> bool:
    """Whether a drive is where a stop takes it; one in fault has stopped by itself."""
    if goal is Goal.QUICK_STOP and not node.stays_stopped:
        return node.state in (DriveState.OPERATION_ENABLED, DriveState.FAULT)
    if goal is Goal.QUICK_STOP:
        return node.state in (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT)
    return node.state not in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE, None)


def dropped_faults(nodes: Sequence[DriveNode]) -> list[Fault]:
    """Drives that should hold and have no power, and do not say why: they were restarted."""
    return [
        Fault("not-held", node.joint, f"is without power ({node.state}) after a stop that holds", _RESTART_REMEDY)
        for node in nodes
        if node.state in (DriveState.SWITCH_ON_DISABLED, DriveState.READY, DriveState.SWITCHED_ON)
    ]


def reset_faults(session: Session) -> ArmState:
    """Reset drives in fault, once, and forget emergencies; what persists is in the state that is returned."""
    session.caught = None
    for node in session.nodes:
        node.read_now()
        if node.state is DriveState.FAULT:
            for word in (DISABLE_VOLTAGE, FAULT_RESET, DISABLE_VOLTAGE):
                node.dictionary.write(objects.CONTROLWORD, word)
        node.error_code, node.acknowledged_code = 0, node.values.get(objects.ERROR_CODE, 0)
    # a drive whose cause persists needs a moment to be back in its fault
    session.clock.wait_until_ns(session.clock.now_ns() + session.settling_ns)
    return session.step_until(lambda: not session.faults, session.read_by_sdo, RESET_S)
