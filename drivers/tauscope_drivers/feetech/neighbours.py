"""Devices that answer on such a bus, by the first bytes of their memory tables."""

from collections.abc import Mapping

from tauscope_drivers.feetech.registers import MODEL_NUMBER, NEIGHBOURS

_ROBOTIS = {
    12: "AX-12",
    18: "AX-18A",
    300: "AX-12W",
    24: "RX-24F",
    28: "RX-28",
    64: "RX-64",
    107: "EX-106",
    29: "MX-28",
    310: "MX-64",
    320: "MX-106",
}
"""Models of Dynamixel protocol 1.0, whose frames are the same: model number at 0, firmware at 2, ID at 3."""


def is_supported(servo: int, identity: Mapping[str, int]) -> bool:
    """Whether it is an STS3215. `identity`: the registers of `IDENTITY`."""
    return _robotis_model(servo, identity) is None and _model_number(identity) == MODEL_NUMBER


def describe_device(servo: int, identity: Mapping[str, int]) -> str:
    """Its model, and whether the driver knows it. `identity`: the registers of `IDENTITY`."""
    if (model := _robotis_model(servo, identity)) is not None:
        return f"Dynamixel {model} (protocol 1.0, not supported)"
    number = _model_number(identity)
    if number == MODEL_NUMBER:
        return "STS3215"
    if number in NEIGHBOURS:
        return f"Feetech {NEIGHBOURS[number]} (not supported)"
    return f"model number {number} (not supported)"


def _model_number(identity: Mapping[str, int]) -> int:
    """Model number; servos of the SCS series have the high byte first, and say so."""
    number = identity["Model Number"]
    return (number & 0xFF) << 8 | number >> 8 if identity["Byte Order"] == 1 else number


def _robotis_model(servo: int, identity: Mapping[str, int]) -> str | None:
    number = identity["Firmware Major Version"] | identity["Firmware Minor Version"] << 8
    return _ROBOTIS.get(number) if identity["Model Number"] & 0xFF == servo else None
