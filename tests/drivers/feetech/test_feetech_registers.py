"""The memory table: as another library has it, numbers that come out as they went in, devices by their first bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.robot.actuator import COUNT, SERVOS
from tauscope_drivers.feetech.registers import (
    COUNTS_PER_RADIAN,
    FEEDBACK,
    FIRST_IN_RAM,
    IDENTITY,
    MODEL_NUMBER,
    NEIGHBOURS,
    REGISTERS,
    SETTINGS,
    SPARE_BYTES,
    TARGETS,
    TORQUE_PER_VOLT,
    Block,
    Register,
    describe_device,
    is_supported,
    speed_unit,
)

SIGNED = [register for register in REGISTERS.values() if register.sign_bit is not None]


def test_addresses_sizes_and_signs_are_those_of_rustypot() -> None:
    rustypot = pytest.importorskip("rustypot")
    theirs = {one.name: one for one in rustypot.Sts3215PyController.registers()}
    compared = 0
    for name, own in REGISTERS.items():
        other = theirs.get(name.lower().replace(" ", "_"))
        if other is None:
            assert name == "Byte Order", name
            continue
        sign = getattr(other, "sign_bit", None) if "sign" in str(other.encoding) else None
        assert (own.address, own.size, own.sign_bit) == (other.addr, other.size, sign), name
        compared += 1
    assert compared > 30
    models = rustypot.Sts3215PyController.models()
    assert models["STS3215"] == MODEL_NUMBER
    assert all(models[name] == number for number, name in NEIGHBOURS.items() if name in models)


def test_constants_are_those_of_the_actuator_model() -> None:
    servo = SERVOS["feetech-sts3215"]
    assert servo.torque_per_volt == pytest.approx(TORQUE_PER_VOLT)
    assert pytest.approx(COUNT) == 1.0 / COUNTS_PER_RADIAN


@given(st.sampled_from(SIGNED), st.data())
def test_a_signed_number_comes_out_as_it_went_in(register: Register, data: st.DataObject) -> None:
    most = (1 << (register.sign_bit or 0)) - 1
    value = data.draw(st.integers(-most, most))
    assert register.decode(register.encode(value)) == value
    for beyond in (most + 1, -most - 1):
        with pytest.raises(OverflowError):
            register.encode(beyond)


def test_a_number_without_sign_is_not_negative() -> None:
    with pytest.raises(OverflowError):
        REGISTERS["Torque Limit"].encode(-1)
    with pytest.raises(OverflowError):
        REGISTERS["Torque Enable"].encode(256)


@pytest.mark.parametrize("block", [SETTINGS, TARGETS, FEEDBACK])
def test_a_block_is_decoded_with_and_without_spare_bytes(block: Block) -> None:
    data = bytes(range(block.length + SPARE_BYTES))
    plain, spared = block.decode(data[: block.length]), block.decode(data)
    assert plain.items() <= spared.items()
    assert plain


def test_lengths_of_answers_tell_the_blocks_apart() -> None:
    assert FEEDBACK.length + SPARE_BYTES < TARGETS.length
    assert TARGETS.length + SPARE_BYTES < SETTINGS.length


def test_eeprom_is_one_block() -> None:
    assert Block(0, FIRST_IN_RAM) == SETTINGS


@pytest.mark.parametrize(("phase", "unit"), [(12, 1), (0, 50)])
def test_phase_states_the_unit_of_speed(phase: int, unit: int) -> None:
    assert speed_unit(phase) == unit


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
