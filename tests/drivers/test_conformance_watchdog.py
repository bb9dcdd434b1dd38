"""Every backend: the device stops by itself when its host falls silent, and says so until it is acknowledged."""

import numpy as np
import pytest

from arm_rigs import AT_REST, START, Rig, drive, enable, require_policy, setpoint, slide, wide_limits
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind

SPEED = 0.5
READING_S = 0.01
"""What the onlooker may miss between two glances."""


@pytest.mark.parametrize("watchdog_s", [0.1, 0.25])
def test_it_fires_within_its_time_and_the_arm_comes_to_rest(rig: Rig, watchdog_s: float) -> None:
    enable(rig, watchdog_s=watchdog_s)
    drive(rig, slide(START, SPEED), 0.3)
    silent_since = rig.backend.clock.now_ns()
    seen = rig.watch(watchdog_s + 0.8)
    since = (seen.time_ns - silent_since) * 1e-9
    stopped = since[~seen.commanded]
    assert stopped[0] <= 1.1 * watchdog_s + READING_S
    assert stopped[0] >= 0.8 * watchdog_s - READING_S or not rig.has_watchdog
    assert not seen.commanded[since >= stopped[0]].any()
    assert np.abs(seen.velocity[-1]).max() < AT_REST
    # without setpoints the target runs on for a few cycles at most, then the stop takes its time
    assert np.abs(seen.position[-1] - seen.position[0]).max() < SPEED * 0.2


@pytest.mark.parametrize("policy", list(StopPolicy))
def test_it_carries_out_the_policy_that_the_arm_was_enabled_with(rig: Rig, policy: StopPolicy) -> None:
    require_policy(rig, policy)
    enable(rig, policy=policy, watchdog_s=0.02)
    drive(rig, lambda _: setpoint(START), 0.1)
    rig.watch(0.1)
    enabled = rig.backend.exchange(setpoint(START)).enabled
    assert enabled.all() == (policy is not StopPolicy.TORQUE_OFF)
    fallen = np.abs(rig.watch(0.3).position[-1] - START).max()
    assert {StopPolicy.HOLD: fallen < 1e-3, StopPolicy.DAMP: 1e-3 < fallen < 0.1, StopPolicy.TORQUE_OFF: fallen > 0.2}[
        policy
    ], fallen


def test_it_latches_until_it_is_acknowledged(rig: Rig) -> None:
    enable(rig, watchdog_s=0.02)
    rig.watch(0.1)
    for _ in range(2):
        (fault,) = rig.backend.exchange(setpoint(START + 1.0)).faults
        assert (fault.code, fault.joint) == ("watchdog", None)
        assert "acknowledge" in fault.remedy
    np.testing.assert_allclose(rig.watch(0.2).position[-1], START, atol=1e-3)
    rig.backend.stop(StopPolicy.HOLD)
    arguments = (ControlMode.POSITION, wide_limits(rig.robot), StopPolicy.HOLD, 0.5)
    with pytest.raises(DriverError) as caught:
        rig.backend.enable(*arguments)
    assert caught.value.kind is DriverErrorKind.FAULT
    assert caught.value.faults == (fault,)
    assert not rig.backend.acknowledge_faults().faults
    assert not rig.backend.enable(*arguments).faults
    assert not drive(rig, lambda _: setpoint(START), 0.05)[-1].faults


def test_it_is_not_armed_after_a_stop(rig: Rig) -> None:
    enable(rig, watchdog_s=0.1)
    rig.backend.stop(StopPolicy.HOLD)
    rig.watch(0.3)
    assert not rig.backend.stop(StopPolicy.HOLD).faults


@pytest.mark.parametrize("policy", [StopPolicy.HOLD, StopPolicy.TORQUE_OFF])
def test_disconnecting_an_enabled_arm_stops_it_by_its_policy(rig: Rig, policy: StopPolicy) -> None:
    require_policy(rig, policy)
    enable(rig, policy=policy)
    drive(rig, lambda _: setpoint(START), 0.05)
    rig.backend.disconnect()
    seen = rig.watch(0.3)
    assert not seen.commanded.any()
    moved = np.abs(seen.position[-1] - START).max()
    assert moved < 1e-3 if policy is StopPolicy.HOLD else moved > 0.1
    assert not rig.backend.connect().faults, "a host that says good-bye is no fault"
