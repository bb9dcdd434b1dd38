"""The CiA 402-2 power state machine (0x6041, 0x6040): statusword to state, state and goal to the next controlword."""

from enum import StrEnum


class DriveState(StrEnum):
    """State of a drive, as its statusword tells it."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"


# states in which a drive holds or moves its joint
POWERED = (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE)


class Goal(StrEnum):
    """Where a drive shall be taken; a fault is never reset on the way."""

    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP = "quick stop"
    SWITCH_ON_DISABLED = "switch on disabled"


SHUTDOWN = 0x0006
SWITCH_ON = 0x0007
ENABLE_OPERATION = 0x000F
QUICK_STOP = 0x0002
DISABLE_VOLTAGE = 0x0000
FAULT_RESET = 0x0080

_PATTERNS = (
    (0x4F, 0x00, DriveState.NOT_READY),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION),
    (0x4F, 0x08, DriveState.FAULT),
)

_TO_OPERATION = {
    DriveState.SWITCH_ON_DISABLED: SHUTDOWN,
    DriveState.READY: SWITCH_ON,
    DriveState.SWITCHED_ON: ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: ENABLE_OPERATION,
    # Straight back under power (transition 16): by way of "switch on disabled" an arm that holds its weight would drop.
    # Targets are the present ones while drives are being enabled, so nothing resumes.
    DriveState.QUICK_STOP_ACTIVE: ENABLE_OPERATION,
}


def decode_state(statusword: int) -> DriveState | None:
    """State that a statusword (0x6041) tells; None for a pattern that the standard does not know."""
    return next((state for mask, value, state in _PATTERNS if statusword & mask == value), None)


def next_controlword(state: DriveState | None, goal: Goal) -> int:
    """Controlword (0x6040) towards a goal, sent every cycle; only a reset gives voltage to a drive in fault."""
    if goal is Goal.OPERATION_ENABLED:
        return _TO_OPERATION.get(state, DISABLE_VOLTAGE) if state is not None else DISABLE_VOLTAGE
    if goal is Goal.QUICK_STOP and state in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
        return QUICK_STOP
    return DISABLE_VOLTAGE
