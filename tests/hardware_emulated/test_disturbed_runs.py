"""Runs on the kernel's CAN bus while netem loses, delays or alters its frames: test_socketcan.py starts this.

A CAN controller drops a frame whose checksum is wrong, and its sender tries again: what arrives altered was altered in
an adapter or a driver. A host cannot notice that of every frame. What holds all the same is here: a run ends in a
definite state, a joint's position is never recorded where the joint cannot have been, and without a host nothing moves.
"""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.canopen_robot import drive_joints, write_canopen_arm
from hardware_emulated.fault_runs import Site, fault_site
from hardware_emulated.fault_table import outcome
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.recording.journal_reading import read_journal
from tauscope.robot import Robot
from tauscope.runtime.states import RunState
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.node import FASTEST, SLACK_S
from tauscope_sim.canopen_bus.emulator import CanOrder

INTERFACE = os.environ.get("TAUSCOPE_SOCKETCAN", "")
NETEM = os.environ.get("TAUSCOPE_NETEM", "")

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not INTERFACE or not NETEM, reason="needs the kernel's CAN bus: see test_socketcan.py"),
]

RUNS = 2
CYCLE_S, WATCHDOG_S = 0.01, 0.2
AT_REST = 0.03
"""[rad/s]"""

ROUNDING = 1e-3
"""Of a place between two lines of the trace [rad]."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("disturbed")
    robot_file = write_canopen_arm(three_joints(), folder / "arm.json", INTERFACE)

    def order(_: Robot, start: tuple[float, ...]) -> CanOrder:
        return CanOrder(
            robot=str(robot_file),
            start=start,
            port=f"socketcan:{INTERFACE}",
            control=str(folder / "control"),
            rated_torque_mnm=(1000, 1000, 800),
            trace=str(folder / "trace"),
            stepped=True,
        )

    with fault_site(robot_file, order) as one:
        yield one


def largest_error(folder: Path, trace: list[dict]) -> float:
    """How far a recorded position is from where the joint was; what was missed is no error."""
    rows = read_journal(folder / "journal.mcap").rows
    time = np.array([entry["time"] for entry in trace])
    place = np.array([entry["position"] for entry in trace])
    true = np.array([np.interp(rows["time_ns"] * 1e-9, time, one) for one in place.T]).T
    assert np.isfinite(rows["position"]).mean() > 0.9
    return float(np.nanmax(np.abs(rows["position"] - true)))


@pytest.mark.parametrize("number", range(RUNS))
def test_a_run_ends_in_a_definite_state_and_nothing_moves_without_a_host(site: Site, number: int) -> None:
    site.emulator.reset()
    clock = SteppedClock(site.emulator)
    record, folder = site.run(CanopenArm(drive_joints(site.robot), patience_s=0.1, clock=clock), str(number), "canopen")
    found = outcome(record)
    print(NETEM, found)
    if "corrupt" not in NETEM:
        assert record.state is RunState.FINISHED, found
    assert record.state in (RunState.FINISHED, RunState.FAILED)
    if record.state is RunState.FAILED:
        assert found.reason, "decoded"
        assert ";" in found.message, "what happened; what to do"
        assert "\n" not in found.message
    if record.timing is not None:
        assert record.recording is not None
        assert record.recording.partial == (record.state is RunState.FAILED)
        reach = max(FASTEST * (joint.limits.velocity or 0.0) * (CYCLE_S + SLACK_S) for joint in site.robot.joints)
        assert largest_error(folder, site.emulator.trace()) < reach + ROUNDING
    clock.wait_until_ns(clock.now_ns() + round((WATCHDOG_S + 0.5) * 1e9))
    state = site.emulator.state
    assert "OPERATION_ENABLED" not in state["state"], "nobody commands it any more"
    held = np.array(state["state"]) == "QUICK_STOP_ACTIVE"
    assert np.abs(np.array(state["velocity"])[held]).max(initial=0.0) < AT_REST
