"""Process data and units of a drive."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.process_data import PdoLayout, decode_pdo, encode_pdo
from tauscope_drivers.canopen.units import DriveUnits

STATE_PDO = PdoLayout((objects.STATUSWORD, objects.TORQUE_ACTUAL, objects.POSITION_ACTUAL))
MOTION_PDO = PdoLayout((objects.VELOCITY_ACTUAL, objects.ERROR_CODE))
UNITS = DriveUnits(2.0 * math.pi / (65536 * 50), zero_count=1000, torque_per_permille=0.025)


def test_the_bytes_of_a_target_frame() -> None:
    layout = PdoLayout((objects.CONTROLWORD, objects.TARGET_POSITION))
    payload = encode_pdo(layout, {objects.CONTROLWORD: 0x000F, objects.TARGET_POSITION: -2})
    assert payload == bytes.fromhex("0F 00 FE FF FF FF")
    assert [entry.mapping for entry in layout.objects] == [0x60400010, 0x607A0020]


def test_the_bytes_of_a_state_frame() -> None:
    values = decode_pdo(STATE_PDO, bytes.fromhex("37 16 9C FF 00 00 10 00"))
    assert values == {objects.STATUSWORD: 0x1637, objects.TORQUE_ACTUAL: -100, objects.POSITION_ACTUAL: 0x100000}


def test_a_target_that_does_not_fit_is_refused_and_not_cut() -> None:
    with pytest.raises(OverflowError, match="Target torque"):
        encode_pdo(PdoLayout((objects.TARGET_TORQUE,)), {objects.TARGET_TORQUE: 40000})


@given(st.binary(max_size=8))
def test_no_frame_breaks_the_decoder(payload: bytes) -> None:
    for layout in (STATE_PDO, MOTION_PDO):
        values = decode_pdo(layout, payload)
        assert (values is None) == (len(payload) != layout.size)
        if values is not None:
            assert encode_pdo(layout, values) == payload


@given(st.floats(-6.0, 6.0))
def test_a_position_survives_to_half_a_count(position: float) -> None:
    assert abs(UNITS.position(UNITS.counts(position)) - position) <= 0.5001 * UNITS.radians_per_count


def test_the_torque_cap_never_exceeds_the_limit() -> None:
    assert UNITS.torque_cap(20.0) == 800
    assert UNITS.torque_cap(20.0249) == 800
    assert UNITS.torque_cap(math.inf) == 0xFFFF
