"""How much a CAN bus carries, against figures worked out by hand."""

import pytest

from tauscope_drivers.canopen.process_data import cycle_bits, frame_bits, largest_rate_hz, rate_limit

TORQUE_CYCLE = (4, 8, 4)


@pytest.mark.parametrize(("payload", "bits"), [(0, 55), (1, 65), (4, 95), (8, 135)])
def test_the_longest_form_of_a_frame(payload: int, bits: int) -> None:
    assert frame_bits(payload) == bits


@pytest.mark.parametrize(("nodes", "bits", "rate"), [(3, 1030, 777), (6, 2005, 399), (7, 2330, 343)])
def test_cycles_of_an_arm_at_one_megabit(nodes: int, bits: int, rate: int) -> None:
    assert cycle_bits(nodes, TORQUE_CYCLE) == bits
    assert largest_rate_hz(nodes, TORQUE_CYCLE, 1e6) == pytest.approx(rate, abs=1.0)


def test_what_limits_is_the_bus_with_its_cycle_by_hand() -> None:
    full = "the frames of 6 drives take 2.00 ms of each cycle at 1000 kbit/s, and 20 % of the bus are kept free"
    assert rate_limit(6, TORQUE_CYCLE, 1e6) == full, "2005 bits; no CAN bus is faster"
    assert rate_limit(6, TORQUE_CYCLE, 5e5).endswith(
        "take 4.01 ms of each cycle at 500 kbit/s, and 20 % of the bus are kept free, use a higher bit rate"
    )


def test_a_true_serial_line_limits_before_the_bus() -> None:
    # 19 frames of 22 characters of 10 bits at 115200 baud: 36.3 ms, 28 cycles a second
    assert largest_rate_hz(6, TORQUE_CYCLE, 1e6, serial_baud=115200) == pytest.approx(27.6, abs=0.05)
    slow = "the adapter's serial line of 115200 baud takes 36.28 ms of each cycle, use a faster adapter"
    assert rate_limit(6, TORQUE_CYCLE, 1e6, serial_baud=115200) == slow
    assert rate_limit(6, TORQUE_CYCLE, 1e6, serial_baud=4e6) == rate_limit(6, TORQUE_CYCLE, 1e6), "a fast one does not"
