"""Error registers decoded into faults with a remedy."""

import pytest

from tauscope_drivers.dynamixel.control_table import find_model
from tauscope_drivers.dynamixel.health import hardware_faults

X, Y = find_model(1020), find_model(4030)


@pytest.mark.parametrize(
    ("register", "codes"),
    [
        (0x00, []),
        (0x01, ["voltage"]),
        (0x04, ["over-temperature"]),
        (0x08, ["encoder"]),
        (0x10, ["electrical"]),
        (0x20, ["overload"]),
        (0x24, ["over-temperature", "overload"]),
        (0x80, ["drive"]),
    ],
)
def test_bits_of_hardware_error_status(register: int, codes: list[str]) -> None:
    faults = hardware_faults(X, register, 2)
    assert [fault.code for fault in faults] == codes
    assert all(fault.joint == 2 and fault.remedy and "Hardware Error Status 0x" in fault.detail for fault in faults)


@pytest.mark.parametrize(
    ("register", "code"), [(1, "voltage"), (4, "over-temperature"), (5, "overload"), (13, "encoder"), (18, "watchdog")]
)
def test_error_codes_of_the_y_series(register: int, code: str) -> None:
    (fault,) = hardware_faults(Y, register, 1)
    assert fault.code == code
    assert fault.remedy


def test_every_register_value_is_decoded() -> None:
    for model in (X, Y):
        for register in range(1, 256):
            assert hardware_faults(model, register, 1)


def test_no_remedy_restarts_a_loaded_servo() -> None:
    for register in (0x01, 0x04, 0x20):
        (fault,) = hardware_faults(X, register, 1)
        assert "support the arm" in fault.remedy
