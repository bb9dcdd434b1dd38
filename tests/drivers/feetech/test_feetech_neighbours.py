"""Devices of other kinds that answer on such a bus."""

import pytest

from tauscope_drivers.feetech.neighbours import describe_device, is_supported
from tauscope_drivers.feetech.registers import IDENTITY


@pytest.mark.parametrize(
    ("servo", "first_bytes", "words"),
    [
        (3, (3, 10, 0, 9, 3), "STS3215"),
        (3, (3, 9, 0, 9, 11), "Feetech STS3250 (not supported)"),
        (1, (1, 0, 1, 5, 4), "Feetech SCS0009 (not supported)"),
        (2, (1, 0, 0, 1, 1), "model number 257 (not supported)"),
        (7, (12, 0, 24, 7, 1), "Dynamixel AX-12 (protocol 1.0, not supported)"),
        (4, (29, 0, 36, 4, 34), "Dynamixel MX-28 (protocol 1.0, not supported)"),
    ],
)
def test_a_device_is_named_by_its_first_bytes(servo: int, first_bytes: tuple[int, ...], words: str) -> None:
    identity = IDENTITY.decode(bytes(first_bytes))
    assert describe_device(servo, identity) == words
    assert is_supported(servo, identity) == (words == "STS3215")
