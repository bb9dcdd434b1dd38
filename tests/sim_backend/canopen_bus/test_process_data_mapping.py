"""What an emulated drive takes for a mapping of process data, and what it declines (CiA 301)."""

import pytest

from tauscope_sim.canopen_bus.drive import AxisScale, EmulatedDrive
from tauscope_sim.canopen_bus.object_dictionary import Abort

MAPPING = 0x1A00
STATUSWORD, TORQUE, POSITION = 0x60410010, 0x60770010, 0x60640020
DONE = 0


@pytest.fixture
def drive() -> EmulatedDrive:
    return EmulatedDrive(2, AxisScale(1000.0, 400, 50.0))


def written(drive: EmulatedDrive, subindex: int, value: int, size: int) -> int:
    """Abort code of an SDO write; 0 where it was done."""
    head = 0x23 | (4 - size) << 2
    request = bytes([head]) + MAPPING.to_bytes(2, "little") + bytes([subindex]) + value.to_bytes(4, "little")
    ((identifier, answer),) = drive.receive((0x602, request), 0.0)
    assert identifier == 0x582
    assert answer[1:4] == request[1:4]
    return int.from_bytes(answer[4:], "little")


def test_objects_that_it_has_are_mapped_in_their_order(drive: EmulatedDrive) -> None:
    for subindex, entry in enumerate((STATUSWORD, TORQUE, POSITION), 1):
        assert written(drive, subindex, entry, 4) == DONE
    assert written(drive, 0, 3, 1) == DONE


@pytest.mark.parametrize("entry", [0x60410020, 0x69410010, 0x60410110, 0x00000000])
def test_what_it_has_not_or_not_at_this_length_is_declined(drive: EmulatedDrive, entry: int) -> None:
    assert written(drive, 1, entry, 4) == Abort.NOT_MAPPABLE


def test_entries_are_fixed_while_they_count(drive: EmulatedDrive) -> None:
    assert written(drive, 1, STATUSWORD, 4) == DONE
    assert written(drive, 0, 1, 1) == DONE
    assert written(drive, 1, TORQUE, 4) == Abort.DEVICE_STATE
    assert written(drive, 0, 0, 1) == DONE
    assert written(drive, 1, TORQUE, 4) == DONE


def test_more_than_a_frame_holds_and_entries_that_are_not_there_do_not_count(drive: EmulatedDrive) -> None:
    for subindex in (1, 2, 3):
        assert written(drive, subindex, POSITION, 4) == DONE
    assert written(drive, 0, 3, 1) == Abort.TOO_MUCH_MAPPED
    assert written(drive, 0, 2, 1) == DONE
    assert written(drive, 0, 4, 1) == Abort.NOT_MAPPABLE
    assert written(drive, 0, 9, 1) == Abort.VALUE_RANGE
