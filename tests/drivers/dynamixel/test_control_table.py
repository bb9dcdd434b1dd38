"""Control tables: what the library's files say, and what is added to them."""

import math

import pytest

from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import (
    describe_model,
    family_of,
    find_model,
    find_model_by_name,
    model_names,
)
from tauscope_drivers.dynamixel.servo import make_servo
from tauscope_drivers.errors import DriverError

# ROBOTIS e-Manual: number, label, torque, goal current, present current, watchdog, counts a turn, mA a unit.
E_MANUAL = [
    (1020, "XM430-W350", 64, 102, 126, 98, 4096, 2.69),
    (1120, "XM540-W270", 64, 102, 126, 98, 4096, 2.69),
    (1050, "XH430-V210", 64, 102, 126, 98, 4096, 1.34),
    (1200, "XL330-M288", 64, 102, 126, 98, 4096, 1.0),
    (311, "MX-64", 64, 102, 126, 98, 4096, 3.36),
    (2020, "PH54-200-S500", 512, 550, 574, 546, 1_003_846, 1.0),
    (4030, "YM070-210-R099", 512, 526, 546, 8, 524_288, 10.0),
]


@pytest.mark.parametrize(
    ("number", "label", "torque", "goal", "present", "watchdog", "counts", "milliampere"), E_MANUAL
)
def test_addresses_and_units(
    number: int, label: str, torque: int, goal: int, present: int, watchdog: int, counts: int, milliampere: float
) -> None:
    model = find_model(number)
    assert model.label == label
    assert model.items["Torque Enable"].address == torque
    assert model.items["Goal Current"].address == goal
    assert model.items["Bus Watchdog"].address == watchdog
    assert (model.state_block.address, model.state_block.length) == (present, 10)
    assert round(model.counts_per_radian * 2.0 * math.pi) == counts
    assert model.current_unit is not None
    assert model.current_unit.milliampere == milliampere
    assert model.current_unit.source


def test_every_model_of_a_known_family_has_what_a_cycle_needs() -> None:
    for number, name in model_names().items():
        if family_of(name) is None:
            continue
        model = find_model(number)
        if model.senses_current:
            assert model.state_block.length == 10
            assert (model.current_unit is None) is (name == "xc335_t332"), name
            assert all(block.length <= 48 for block in model.health_blocks)
            lengths = [block.length for block in model.watched_blocks]
            assert len(set(lengths)) == len(lengths), "a late answer cannot be taken for another"
            assert max(lengths) <= 4
            assert model.velocity_unit > 0.0


@pytest.mark.parametrize("number", [1060, 1070, 30, 350, 1090])
def test_models_without_a_current_sensor_are_known_as_such(number: int) -> None:
    assert not find_model(number).senses_current


def test_firmware_chooses_the_table() -> None:
    old, new = find_model(1200, 51), find_model(1200, 52)
    assert old.items["Indirect Data 1"].address != new.items["Indirect Data 1"].address
    assert old.items["Goal Current"] == new.items["Goal Current"]


@pytest.mark.parametrize("name", ["XM430-W350", "xm430_w350", "XM430-W350-T", "XM430-W350-R"])
def test_model_by_the_name_on_its_case(name: str) -> None:
    assert find_model_by_name(name).number == 1020


@pytest.mark.parametrize("number", [9999, 35074])
def test_unknown_model_is_refused(number: int) -> None:
    with pytest.raises(DriverError, match=f"model number {number}.*no control table"):
        find_model(number)


@pytest.mark.parametrize(("number", "name"), [(1280, "XW430-T200"), (1700, "XC335-T332")])
def test_the_newest_models_are_known_by_number_and_name(number: int, name: str) -> None:
    model = find_model(number, 55)
    assert model.label == describe_model(number) == name
    assert find_model_by_name(f"{name}-T") == find_model(number)
    assert model.senses_current
    assert (model.items["Operating Mode"].address, model.items["Bus Watchdog"].address) == (11, 98)
    assert model.items["Goal Current"].address == 102
    assert model.state_block.address == 126


def test_a_model_without_a_known_unit_of_current_needs_it_stated() -> None:
    with pytest.raises(DriverError, match=r"no unit of current is known for the XC335-T332; state drive.milliampere"):
        make_servo(1, ServoConfiguration("elbow", 1), (1700, 55))
    servo = make_servo(1, ServoConfiguration("elbow", 1, milliampere_per_unit=1.0), (1700, 55))
    assert servo.units.milliampere == 1.0


def test_a_pro_servo_with_legacy_firmware_is_named() -> None:
    assert describe_model(54024) == "H54-200-S500-R (PRO with legacy firmware, not supported)"
    with pytest.raises(DriverError, match=r"H54-200-S500-R \(PRO with legacy firmware.*update its firmware"):
        find_model(54024)


def test_unknown_name_is_refused() -> None:
    with pytest.raises(DriverError, match="'XM999' is not known"):
        find_model_by_name("XM999")


def test_values_carry_their_sign() -> None:
    model = find_model(1020)
    block = bytes.fromhex("25 00 F6 FF FF FF FD 07 00 00")
    assert model.state_block.decode(block) == {"Present Current": 37, "Present Velocity": -10, "Present Position": 2045}
    assert model.items["Bus Watchdog"].decode(b"\xff", 98) == 255
    assert model.items["Goal Current"].encode(-2) == b"\xfe\xff"


def test_block_of_the_wrong_length_has_no_values() -> None:
    assert find_model(1020).state_block.decode(b"\0" * 9) == {}
