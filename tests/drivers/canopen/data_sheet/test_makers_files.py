"""Drives as they are sold: which makers' files are accepted, and an arm of each, from its connection to its stop."""

import math
from pathlib import Path

import numpy as np
import pytest

from emulated_can_bus import EmulatedBus
from shared_data import SHARED_CASES, needs_shared_cases
from tauscope_drivers import ControlMode, DriveLimits, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.configuration import read_configuration
from tauscope_drivers.canopen.doctor import examine
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.inspection import Severity
from tauscope_sim.canopen_bus.power_state import PowerState

pytestmark = needs_shared_cases

FOLDER = SHARED_CASES / "eds"
GUARDED = "ingenia-everest-xcr.eds"
ACCEPTED = ("maxon-epos4.eds", "maxon-epos4-50-15.dcf", "zeroerr-erob.eds", "eyou-v1.4.eds", "pilz-prbt.dcf", GUARDED)
REFUSED = {
    "maxon-epos2.eds": ["Torque actual value (0x6077:00) is missing"],
    "xeryon-xla5.eds": ["Consumer heartbeat time (0x1016:01) is missing", "Torque actual value (0x6077:00) is missing"],
}
LIMITS = DriveLimits(np.full(1, -1.0), np.full(1, 1.0), np.full(1, 2.0), np.full(1, 20.0))
RATED_NM = 0.5
STEPS = 20


def joint(bus: EmulatedBus) -> DriveJoint:
    (found,) = bus.joints()
    return DriveJoint(found.name, {**found.drive, "rated_torque_nm": RATED_NM}, gear_ratio=found.gear_ratio)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_used_is_refused_with_all_reasons(name: str) -> None:
    block = {"interface": "virtual", "channel": "none", "node_id": 1, "counts_per_turn": 4096}
    block |= {"eds": str(FOLDER / name), "rated_torque_nm": RATED_NM}
    with pytest.raises(DriverError) as refusal:
        read_configuration([DriveJoint("elbow", block, gear_ratio=50.0)])
    for reason in REFUSED[name]:
        assert reason in str(refusal.value)


@pytest.mark.parametrize("policy", [StopPolicy.HOLD, pytest.param(StopPolicy.TORQUE_OFF, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", ACCEPTED)
def test_an_accepted_drive_moves_and_stops(name: str, policy: StopPolicy) -> None:
    """Its emulation has the objects, the access rights and the mappings of the file, and no others."""
    with EmulatedBus([Path(FOLDER / name)]) as bus:
        described = joint(bus)
        failures = [one for one in examine([described]) if one.severity is Severity.FAILURE]
        assert failures == []
        arm = CanopenArm([described], patience_s=0.1)
        start = float(arm.connect().position[0])
        arm.enable(ControlMode.POSITION, LIMITS, policy, 2.0, 0.01)
        assert bus.drives[0].power.state is PowerState.OPERATION_ENABLED
        for step in [*range(1, STEPS + 1), STEPS, STEPS]:
            target = start + 0.1 * (1.0 - math.cos(math.pi * step / STEPS))
            arm.clock.wait_until_ns(arm.clock.now_ns() + 10_000_000)
            state = arm.exchange(Setpoint(np.array([target]), np.zeros(1)))
            assert not state.faults
            assert state.fresh.all()
        assert bus.position[0] == pytest.approx(start + 0.2, abs=1e-3)
        state = arm.stop(policy)
        assert not state.faults
        holds = bus.drives[0].power.state in (PowerState.QUICK_STOP_ACTIVE, PowerState.OPERATION_ENABLED)
        assert holds is (policy is StopPolicy.HOLD)
        arm.disconnect()


@pytest.mark.slow
@pytest.mark.parametrize("name", ACCEPTED)
def test_a_held_arm_is_enabled_again_without_letting_go(name: str) -> None:
    with EmulatedBus([Path(FOLDER / name)]) as bus:
        for _ in range(2):
            arm = CanopenArm([joint(bus)], patience_s=0.1)
            arm.connect()
            arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 2.0, 0.01)
            assert not arm.stop(StopPolicy.HOLD).faults
            arm.disconnect()
            assert bus.drives[0].power.state in (PowerState.QUICK_STOP_ACTIVE, PowerState.OPERATION_ENABLED)


@pytest.mark.slow
@pytest.mark.parametrize("name", ACCEPTED)
def test_a_drive_whose_host_is_gone_stops_by_itself(name: str) -> None:
    with EmulatedBus([Path(FOLDER / name)]) as bus:
        arm = CanopenArm([joint(bus)], patience_s=0.1)
        arm.connect()
        arm.enable(ControlMode.POSITION, LIMITS, StopPolicy.HOLD, 0.1, 0.01)
        deadline = arm.clock.now_ns() + 2_000_000_000
        while bus.drives[0].power.state is PowerState.OPERATION_ENABLED and arm.clock.now_ns() < deadline:
            arm.clock.wait_until_ns(arm.clock.now_ns() + 10_000_000)
        assert bus.drives[0].power.state is not PowerState.OPERATION_ENABLED
        arm.disconnect()
