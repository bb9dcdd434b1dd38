"""Taking commissioned drives under power where the arm stands, all of them together."""

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.bus import NMT_START
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.session import Session, listed, stay_at
from tauscope_drivers.canopen.state_machine import DriveState, Goal
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.state import ArmState, Array

TRANSITION_S = 2.0  # time for all drives together to reach a power state

_NO_MODE = 0

STILL_CYCLES = 4  # cycles at one place before anything moves: drives interpolate between the last few targets


def power_up(session: Session, mode: ControlMode) -> tuple[ArmState, Array]:
    """Take all drives to *operation enabled*; targets are where the joints are when their drives get there.

    Raises DriverError: ``fault`` or ``refused``: a drive does not get there. Returns the state of the last cycle, and
    the targets that the drives stand at, (n,) [rad or m].
    """
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
    session.learn_answer_time()
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
    """Where the joints are now, by process data, read before any drive changes its state.

    One that holds may be back under power with its first target: that must not be where it was when commissioning
    began.
    """
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
