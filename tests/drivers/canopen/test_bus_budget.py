"""How much a CAN bus carries, against figures worked out by hand."""

import pytest

from drivers.canopen.bus_budget import CycleFrames, cycle_bits, frame_bits, largest_rate_hz, require_rate
from drivers.errors import DriverError

TORQUE_CYCLE = CycleFrames((4,), (8, 4))


@pytest.mark.parametrize(("payload", "bits"), [(0, 55), (1, 65), (4, 95), (8, 135)])
def test_the_longest_form_of_a_frame(payload: int, bits: int) -> None:
    assert frame_bits(payload) == bits


@pytest.mark.parametrize(("nodes", "bits", "rate"), [(3, 1030, 777), (6, 2005, 399), (7, 2330, 343)])
def test_cycles_of_an_arm_at_one_megabit(nodes: int, bits: int, rate: int) -> None:
    assert cycle_bits(nodes, TORQUE_CYCLE) == bits
    assert largest_rate_hz(nodes, TORQUE_CYCLE, 1e6) == pytest.approx(rate, abs=1.0)


def test_a_rate_beyond_the_bus_is_refused_and_says_what_limits() -> None:
    require_rate(390.0, 6, TORQUE_CYCLE, 1e6)
    with pytest.raises(DriverError, match=r"500 Hz: the bus at 1000 kbit/s with 6 nodes carries at most 399 Hz"):
        require_rate(500.0, 6, TORQUE_CYCLE, 1e6)


def test_a_true_serial_line_limits_before_the_bus() -> None:
    # 19 frames of 22 characters of 10 bits at 115200 baud: 27 cycles a second
    with pytest.raises(DriverError, match=r"serial line of 115200 baud carries at most 28 Hz"):
        require_rate(50.0, 6, TORQUE_CYCLE, 1e6, serial_baud=115200)
