"""The bus budget against figures worked out by hand, and its refusals."""

import pytest

from tauscope_drivers.dynamixel.bus import count_traffic
from tauscope_drivers.errors import DriverError, DriverErrorKind
from tauscope_drivers.serial_servos.bus import BusTiming, cycle_parts, largest_rate_hz, require_rate

# Whole cycle of Sync Write of a current and (Fast) Sync Read of ten bytes: servos, baud, fast, return delay [s],
# latency timer [s], cycles a second. Worked out from the frames' lengths in the protocol's description.
BY_HAND = [
    (3, 57_600, False, 500e-6, 0.0, 52),
    (3, 1_000_000, False, 2e-6, 1e-3, 491),
    (6, 57_600, False, 500e-6, 16e-3, 20),
    (6, 1_000_000, False, 500e-6, 0.0, 209),
    (6, 1_000_000, False, 2e-6, 0.0, 558),
    (6, 1_000_000, False, 2e-6, 1e-3, 358),
    (6, 1_000_000, False, 2e-6, 16e-3, 56),
    (6, 1_000_000, True, 2e-6, 0.0, 693),
    (6, 1_000_000, True, 2e-6, 1e-3, 410),
    (7, 3_000_000, True, 2e-6, 1e-3, 649),
    (7, 4_500_000, False, 2e-6, 1e-3, 683),
]


@pytest.mark.parametrize(("servos", "baud", "fast", "delay", "latency", "rate"), BY_HAND)
def test_rates_by_hand(servos: int, baud: int, fast: bool, delay: float, latency: float, rate: int) -> None:
    traffic = count_traffic(servos, goal_bytes=2, health_bytes=0, fast=fast)
    assert round(largest_rate_hz(traffic, BusTiming(baud, delay, latency), load=1.0)) == rate


def test_bytes_of_a_cycle_by_hand() -> None:
    # Sync Write 14 + 6·5, Sync Read 14 + 6, six answers of 21, Read 14 and its answer 11 + 3.
    assert count_traffic(6).bytes == 44 + 20 + 126 + 28
    # Fast: one answer of 8 + 6·14.
    assert count_traffic(6, fast=True).bytes == 44 + 20 + 92 + 28
    # Two families: one more Sync Write and Sync Read of 14 each.
    assert count_traffic(6, families=2).bytes == count_traffic(6).bytes + 28


def test_six_servos_at_a_megabaud_get_200_hz() -> None:
    require_rate(200.0, count_traffic(6), BusTiming(1_000_000, 2e-6, 1e-3))


@pytest.mark.parametrize(
    ("timing", "limit", "remedy"),
    [
        (BusTiming(57_600, 2e-6, 1e-3), "the wire at 57600 baud", "higher baud rate"),
        (BusTiming(1_000_000, 500e-6, 1e-3), "Return Delay Time of 500 µs", "Return Delay Time = 0"),
        (BusTiming(1_000_000, 2e-6, 16e-3), "latency timer of 16 ms", "latency_timer"),
    ],
)
def test_refusal_names_what_limits(timing: BusTiming, limit: str, remedy: str) -> None:
    with pytest.raises(DriverError, match=limit) as caught:
        require_rate(200.0, count_traffic(6), timing)
    assert caught.value.kind is DriverErrorKind.REFUSED
    assert remedy in str(caught.value)
    assert "\n" not in str(caught.value)


def test_parts_add_up_to_the_cycle() -> None:
    traffic, timing = count_traffic(6), BusTiming(1_000_000, 2e-6, 1e-3)
    assert sum(cycle_parts(traffic, timing).values()) == pytest.approx(1.0 / largest_rate_hz(traffic, timing, load=1.0))
