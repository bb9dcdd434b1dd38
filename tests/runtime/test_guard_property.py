"""Whatever is commanded, whenever: nothing outside the limits ever reaches the backend."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from runtime.doubles import PointArm
from runtime.test_guard import limits
from tauscope.runtime.guard import Guard, GuardViolationError
from tauscope.runtime.loop import GuardedArm
from tauscope_drivers import ControlMode, Setpoint, StopPolicy

PERIOD_S = 0.002
WATCHDOG_S = 0.1

numbers = st.one_of(
    st.floats(-1.2, 1.2),
    st.floats(width=64),
    st.sampled_from([np.nan, np.inf, -np.inf, 1e308, -0.0, 1.0, -1.0, 0.5, 1.0 + 1e-8]),
)
small_steps = st.floats(-0.006, 0.006)
cycle = st.fixed_dictionaries(
    {
        "steps": st.lists(small_steps, min_size=3, max_size=3),
        "wild": st.one_of(st.none(), st.none(), st.none(), st.tuples(st.integers(0, 2), numbers)),
        "torque": st.one_of(st.just([0.0] * 3), st.lists(numbers, min_size=3, max_size=3)),
        "wait_ns": st.one_of(st.just(2_000_000), st.just(2_000_000), st.integers(-10_000_000, 300_000_000)),
        "late_ns": st.one_of(st.just(0), st.just(0), st.integers(-5_000_000, 200_000_000)),
    }
)


@given(st.lists(cycle, max_size=40))
def test_nothing_outside_the_limits_is_sent(cycles: list[dict]) -> None:
    bounds = limits()
    arm = PointArm(joint_count=3, position=np.full(3, 0.25))
    start_ns = arm.clock.now_ns()
    state = arm.enable(ControlMode.POSITION, bounds.drive_limits, StopPolicy.HOLD, WATCHDOG_S)
    guard = Guard(bounds, period_s=PERIOD_S, watchdog_s=WATCHDOG_S, enabled_ns=start_ns)
    guarded = GuardedArm(arm, guard, state)
    target, due, objected, when = np.full(3, 0.25), start_ns, False, []
    for drawn in cycles:
        target = target + drawn["steps"]
        if drawn["wild"] is not None:
            joint, value = drawn["wild"]
            target = target.copy()
            target[joint] = value
        due += drawn["wait_ns"]
        arm.clock.time_ns = due + drawn["late_ns"]
        sent = len(arm.sent)
        try:
            guarded.exchange(Setpoint(target, np.array(drawn["torque"], dtype=float)), due)
        except GuardViolationError:
            objected = True
            assert len(arm.sent) == sent, "a command that was refused was sent"
            continue
        assert not objected, "a command was sent after an find_objection"
        when.append((due, arm.clock.now_ns()))
    _assert_within(arm, bounds, start_ns, when)


def _assert_within(arm: PointArm, bounds: object, start_ns: int, when: list[tuple[int, int]]) -> None:
    """Judge what was sent by the limits themselves, written out again."""
    before, before_due, before_now = np.full(3, 0.25), start_ns, start_ns
    low, high = np.array([-1.0, -1.0, 0.0]), np.array([1.0, 1.0, 0.5])
    speed, torque = np.array([2.0, 2.0, 0.5]), np.array([10.0, 20.0, np.inf])
    slack = np.array([0.05, 0.05, 0.01])
    assert len(arm.sent) == len(when)
    for setpoint, (due, now) in zip(arm.sent, when, strict=True):
        assert np.isfinite(setpoint.position).all()
        assert np.isfinite(setpoint.torque).all()
        assert (setpoint.position >= low - 1e-9).all()
        assert (setpoint.position <= high + 1e-9).all()
        assert (np.abs(setpoint.torque) <= torque + 1e-9).all()
        elapsed = max((due - before_due) * 1e-9, PERIOD_S)
        assert (np.abs(setpoint.position - before) <= speed * elapsed + slack + 1e-9).all()
        assert due >= before_due
        assert before_now <= now <= before_now + int(WATCHDOG_S * 1e9)
        assert due <= now
        before, before_due, before_now, slack = setpoint.position, due, now, 0.0
