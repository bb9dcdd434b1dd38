"""The guard, rule by rule; that nothing passes it is in test_guard_property."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from runtime.doubles import with_fault
from tauscope.runtime.guard import Guard, GuardLimits, Rule, Violation
from tauscope_drivers import ArmState, Setpoint

T0 = 10**9
PERIOD = 2_000_000
N = 3


def limits(**changes: Any) -> GuardLimits:
    fields: dict[str, Any] = {
        "joints": ("shoulder", "elbow", "slide"),
        "units": ("rad", "rad", "m"),
        "position_low": np.array([-1.0, -1.0, 0.0]),
        "position_high": np.array([1.0, 1.0, 0.5]),
        "velocity": np.array([2.0, 2.0, 0.5]),
        "acceleration": np.array([5.0, 5.0, 1.0]),
        "torque": np.array([10.0, 20.0, np.inf]),
        "following": np.array([0.2, 0.2, 0.05]),
        "position_margin": np.array([0.05, 0.05, 0.01]),
        "temperature_c": 80.0,
    }
    return GuardLimits(**(fields | changes))


def new_guard(**options: float) -> Guard:
    settings = {"period_s": 0.002, "watchdog_s": 0.1, "stale_misses": 3, "stale_s": 0.05} | options
    return Guard(limits(), enabled_ns=T0, **settings)  # type: ignore[arg-type]


def state(cycle: int, position: Any = 0.25, **changes: Any) -> ArmState:
    where = np.broadcast_to(np.asarray(position, dtype=float), N).copy()
    read = ArmState(T0 + cycle * PERIOD, where, np.zeros(N), np.zeros(N), np.full(N, 30.0), np.ones(N, dtype=bool))
    return replace(read, **changes)


def command(position: Any = 0.25, torque: Any = 0.0) -> Setpoint:
    spread = (np.broadcast_to(np.asarray(values, dtype=float), N).copy() for values in (position, torque))
    return Setpoint(*spread)


def check(guard: Guard, cycle: int, at: ArmState, sent: Setpoint, late_ns: int = 0) -> Violation | None:
    due = T0 + (cycle + 1) * PERIOD
    return guard.check(at, sent, due + late_ns, due)


def first(values: float, others: float = 0.25) -> np.ndarray:
    return np.array([values, others, others])


def test_a_sound_stream_passes() -> None:
    guard = new_guard()
    for cycle in range(200):
        way = 0.25 + 0.0009 * cycle / 2 * np.array([1.0, -1.0, 0.1])
        assert check(guard, cycle, state(cycle, way), command(way, [9.9, -19.9, 1e6])) is None


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("field", ["position", "torque"])
def test_what_is_not_a_number_is_named(bad: float, field: str) -> None:
    values = {"position": 0.25 * np.ones(N), "torque": np.zeros(N)}
    values[field] = values[field].copy()
    values[field][1] = bad
    violation = check(new_guard(), 0, state(0), Setpoint(**values))
    assert violation is not None
    assert (violation.rule, violation.joint) == (Rule.NOT_FINITE, "elbow")


@pytest.mark.parametrize(
    ("sent", "rule", "value", "limit"),
    [
        (command(first(1.001)), Rule.POSITION, 1.001, 1.0),
        (command(first(-1.001)), Rule.POSITION, -1.001, -1.0),
        (command(torque=[10.1, 0, 0]), Rule.TORQUE, 10.1, 10.0),
        (command(torque=[-10.1, 0, 0]), Rule.TORQUE, 10.1, 10.0),
    ],
    ids=["too high", "too low", "torque", "negative torque"],
)
def test_limits_of_a_command(sent: Setpoint, rule: Rule, value: float, limit: float) -> None:
    at = first(np.clip(sent.position[0], -1, 1))
    violation = check(new_guard(), 0, state(0, at), sent)
    assert violation is not None
    assert (violation.rule, violation.joint) == (rule, "shoulder")
    assert (violation.value, violation.limit) == pytest.approx((value, limit))
    assert "shoulder" in str(violation)
    assert "\n" not in str(violation)


def test_a_step_faster_than_the_velocity_limit() -> None:
    guard = new_guard()
    assert check(guard, 0, state(0), command()) is None
    assert check(guard, 1, state(1), command(first(0.25 + 2.0 * 0.002))) is None, "just at the limit"
    violation = check(guard, 2, state(2), command(first(0.25 + 4.01 * 0.002)))
    assert violation is not None
    assert (violation.rule, violation.joint, violation.limit) == (Rule.VELOCITY, "shoulder", 2.0)
    assert violation.value == pytest.approx(2.01)


def test_speed_is_judged_by_deadlines_and_not_by_jitter() -> None:
    """A late cycle and a punctual one after it: the targets are one period apart, the instants a tenth of it."""
    guard = new_guard()
    assert check(guard, 0, state(0), command(), late_ns=PERIOD * 9 // 10) is None
    assert check(guard, 1, state(1), command(first(0.25 + 0.002 * 1.99))) is None
    assert check(guard, 5, state(5), command(first(0.25 + 0.002 * 1.99 * 5))) is None, "four periods were missed"


def test_the_first_command_starts_where_the_arm_stands() -> None:
    assert check(new_guard(), 0, state(0), command(first(0.25 + 0.05))) is None, "within noise and margin"
    violation = check(new_guard(), 0, state(0), command(first(0.25 + 0.06)))
    assert violation is not None
    assert violation.rule is Rule.VELOCITY


def test_the_arm_is_not_where_it_was_sent() -> None:
    guard = new_guard()
    assert check(guard, 0, state(0), command()) is None
    violation = check(guard, 1, state(1, first(0.46)), command())
    assert violation is not None
    assert (violation.rule, violation.joint, violation.limit) == (Rule.FOLLOWING, "shoulder", 0.2)
    assert violation.value == pytest.approx(0.21)


def test_the_arm_outside_its_limits_by_more_than_the_margin() -> None:
    at = first(1.04)
    assert check(new_guard(), 0, state(0, at), command(first(1.0))) is None
    violation = check(new_guard(), 0, state(0, first(1.051)), command(first(1.0)))
    assert violation is not None
    assert violation.rule in (Rule.POSITION, Rule.VELOCITY)


def test_temperature() -> None:
    assert check(new_guard(), 0, state(0, temperature=np.array([80.0, 20.0, np.nan])), command()) is None
    violation = check(new_guard(), 0, state(0, temperature=np.array([20.0, 80.5, np.nan])), command())
    assert violation is not None
    assert (violation.rule, violation.joint, violation.value) == (Rule.TEMPERATURE, "elbow", 80.5)


def test_a_runaway_speed_counts_when_it_persists() -> None:
    guard = new_guard()
    fast = np.array([0.0, 3.01, 0.0])
    verdicts = [
        check(guard, cycle, state(cycle, velocity=fast if cycle != 2 else 0 * fast), command()) for cycle in range(6)
    ]
    assert verdicts[:5] == [None] * 5, "one calm reading starts the count again"
    assert verdicts[5] is not None
    assert (verdicts[5].rule, verdicts[5].joint, verdicts[5].limit) == (Rule.VELOCITY, "elbow", 3.0)


def test_a_velocity_that_is_not_reported_is_nobodys_fault() -> None:
    guard = new_guard()
    for cycle in range(5):
        assert check(guard, cycle, state(cycle, velocity=np.full(N, np.nan)), command()) is None


def test_braking_distance() -> None:
    """At 0.9 rad and 1.6 rad/s, 5 rad/s² stop the joint at 0.9 + 0.256 rad: beyond the limit and its margin."""
    guard = new_guard()
    at, speed = first(0.9), np.array([1.6, 0.0, 0.0])
    verdicts = [check(guard, cycle, state(cycle, at, velocity=speed), command(at)) for cycle in range(3)]
    assert verdicts[2] is not None
    assert (verdicts[2].rule, verdicts[2].joint) == (Rule.BRAKING, "shoulder")
    assert verdicts[2].value == pytest.approx(0.9 + 1.6**2 / 10)
    calm = new_guard()
    assert all(check(calm, cycle, state(cycle, at, velocity=-speed), command(at)) is None for cycle in range(5)), (
        "away from the limit is no danger"
    )


def test_missed_readings_trip_after_three_in_a_row() -> None:
    guard, silent = new_guard(), np.array([0.25, np.nan, 0.25])
    pattern = [None, silent, silent, None, silent, silent, silent]
    verdicts = [
        check(guard, cycle, state(cycle, 0.25 if at is None else at), command()) for cycle, at in enumerate(pattern)
    ]
    assert verdicts[:6] == [None] * 6
    assert verdicts[6] is not None
    assert (verdicts[6].rule, verdicts[6].joint, verdicts[6].value) == (Rule.STALE, "elbow", 3.0)
    assert guard.stale.tolist() == [0, 5, 0]


def test_where_the_arm_stands_must_be_known_before_the_first_command() -> None:
    violation = check(new_guard(), 0, state(0, np.array([0.25, np.nan, 0.25])), command())
    assert violation is not None
    assert (violation.rule, violation.joint) == (Rule.STALE, "elbow")


def test_missed_readings_trip_after_the_stale_time_if_that_is_sooner() -> None:
    guard, silent = new_guard(stale_misses=1000, stale_s=0.0085), np.array([0.25, 0.25, np.nan])
    assert check(guard, 0, state(0), command()) is None
    verdicts = [check(guard, cycle, state(cycle, silent), command()) for cycle in range(1, 6)]
    assert verdicts[:4] == [None] * 4
    assert verdicts[4] is not None
    assert (verdicts[4].rule, verdicts[4].joint) == (Rule.STALE, "slide")


def test_time_running_backwards_or_standing_still() -> None:
    guard = new_guard()
    assert check(guard, 4, state(4), command()) is None
    violation = check(guard, 3, state(5), command())
    assert violation is not None
    assert (violation.rule, violation.joint) == (Rule.TIME, None)
    still = new_guard()
    assert check(still, 4, state(4), command()) is None
    violation = check(still, 4, state(5), command())
    assert violation is not None
    assert violation.rule is Rule.TIME


def test_a_reading_older_than_the_one_before() -> None:
    guard = new_guard()
    assert check(guard, 1, state(1), command()) is None
    violation = check(guard, 2, state(0), command())
    assert violation is not None
    assert violation.rule is Rule.TIME


def test_the_same_reading_again_is_a_missed_one() -> None:
    guard = new_guard()
    verdicts = [check(guard, cycle, state(0), command()) for cycle in range(4)]
    assert verdicts[:3] == [None] * 3
    assert verdicts[3] is not None
    assert verdicts[3].rule is Rule.STALE
    assert guard.stale.tolist() == [3, 3, 3]


def test_later_than_the_watchdog() -> None:
    assert check(new_guard(), 0, state(0), command(), late_ns=97_000_000) is None
    violation = check(new_guard(), 0, state(0), command(), late_ns=101_000_000)
    assert violation is not None
    assert (violation.rule, violation.limit) == (Rule.LATE, 0.1)


def test_a_fault_of_a_drive() -> None:
    violation = check(new_guard(), 0, with_fault(state(0)), command())
    assert violation is not None
    assert (violation.rule, violation.joint) == (Rule.FAULT, "elbow")
    assert "overload" in str(violation)


def test_a_drive_that_dropped_out() -> None:
    violation = check(new_guard(), 0, state(0, enabled=np.array([True, True, False])), command())
    assert violation is not None
    assert (violation.rule, violation.joint) == (Rule.NOT_ENABLED, "slide")


def test_an_objection_is_for_good() -> None:
    guard = new_guard()
    violation = check(guard, 0, state(0), command(np.nan))
    assert violation is not None
    assert check(guard, 1, state(1), command()) is violation
