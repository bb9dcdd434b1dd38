"""Error codes in words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers.canopen.emergency import decode_emergency, describe_error


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0x8130, "watchdog"),
        (0x2310, "over-current"),
        (0x2320, "over-current"),
        (0x4310, "over-temperature"),
        (0x3220, "under-voltage"),
        (0x7121, "overload"),
        (0x7305, "encoder"),
        (0x8611, "following-error"),
        (0x8110, "bus"),
        (0xFF01, "drive"),
    ],
)
def test_codes_of_the_standard(code: int, name: str) -> None:
    fault = describe_error(code, 2)
    assert fault is not None
    assert fault.code == name
    assert fault.joint == 2
    assert f"0x{code:04X}" in str(fault)


@given(st.integers(0, 0xFFFF))
def test_every_code_has_words_and_a_remedy(code: int) -> None:
    fault = describe_error(code, 1)
    assert (fault is None) == (code < 0x100)
    assert fault is None or (fault.detail and fault.remedy and "\n" not in str(fault))


@given(st.binary(max_size=10))
def test_no_frame_breaks_the_decoder(payload: bytes) -> None:
    assert (decode_emergency(payload) is None) == (len(payload) != 8)
