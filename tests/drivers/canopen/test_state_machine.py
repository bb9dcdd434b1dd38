"""The drive's power state machine against the tables of CiA 402."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.canopen.state_machine import (
    DISABLE_VOLTAGE,
    ENABLE_OPERATION,
    FAULT_RESET,
    QUICK_STOP,
    SHUTDOWN,
    SWITCH_ON,
    DriveState,
    Goal,
    decode_state,
    next_controlword,
)


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, DriveState.NOT_READY),
        (0x0250, DriveState.SWITCH_ON_DISABLED),
        (0x0231, DriveState.READY),
        (0x0233, DriveState.SWITCHED_ON),
        (0x1637, DriveState.OPERATION_ENABLED),
        (0x0217, DriveState.QUICK_STOP_ACTIVE),
        (0x021F, DriveState.FAULT_REACTION),
        (0x0218, DriveState.FAULT),
    ],
)
def test_statuswords_as_drives_send_them(statusword: int, state: DriveState) -> None:
    assert decode_state(statusword) is state


@given(st.integers(0, 0xFFFF))
def test_bits_beyond_the_pattern_change_nothing(statusword: int) -> None:
    irrelevant = 0xFF90
    assert decode_state(statusword) is decode_state(statusword & ~irrelevant)


@given(st.integers(0, 0xFFFF), st.sampled_from(Goal))
def test_no_statusword_ever_gets_a_fault_reset(statusword: int, goal: Goal) -> None:
    assert not next_controlword(decode_state(statusword), goal) & FAULT_RESET


def test_the_way_up_takes_one_word_a_state() -> None:
    way = [DriveState.SWITCH_ON_DISABLED, DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED]
    words = [next_controlword(state, Goal.OPERATION_ENABLED) for state in way]
    assert words == [SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, ENABLE_OPERATION]


@pytest.mark.parametrize("state", [DriveState.FAULT, DriveState.FAULT_REACTION, DriveState.NOT_READY, None])
@pytest.mark.parametrize("goal", list(Goal))
def test_a_drive_that_is_not_sound_gets_no_voltage(state: DriveState | None, goal: Goal) -> None:
    assert next_controlword(state, goal) == DISABLE_VOLTAGE


def test_a_quick_stop_goes_on_until_somebody_enables_again() -> None:
    stopping = [DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE]
    assert [next_controlword(state, Goal.QUICK_STOP) for state in stopping] == [QUICK_STOP, QUICK_STOP]
    assert next_controlword(DriveState.QUICK_STOP_ACTIVE, Goal.OPERATION_ENABLED) == ENABLE_OPERATION
