"""An arm of drives that watch no heartbeat, behind a serial CAN adapter: commands, and an adapter that is torn off."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from emulated_data_sheet import sections, write_file
from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.canopen_robot import drive_joints, write_canopen_arm
from hardware_emulated.commands import Tauscope, write_short_motion
from patience import eventually
from tauscope.robot import read_robot
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.limits import stated_limits
from tauscope_sim.canopen_bus.emulator import CanOrder

pytestmark = pytest.mark.realtime

START = (0.1, 0.1, 0.1)


@pytest.fixture
def emulator(tmp_path: Path) -> Iterator[EmulatorProcess]:
    content = {name: keys for name, keys in sections().items() if not name.startswith("1016")}
    write_file(tmp_path, content)
    arm = write_canopen_arm(three_joints(), tmp_path / "arm.json", tmp_path / "port", eds="drive.eds")
    write_short_motion(arm, tmp_path / "motion.json")
    order = CanOrder(
        robot=str(arm),
        start=START,
        port=str(tmp_path / "port"),
        control=str(tmp_path / "control"),
        rated_torque_mnm=(1000, 1000, 800),
    )
    with EmulatorProcess(order) as emulator:
        yield emulator


def test_doctor_and_run_guard_the_drives(tauscope: Tauscope, tmp_path: Path, emulator: EmulatorProcess) -> None:
    status, out, err = tauscope("doctor", tmp_path / "arm.json")
    assert status == 0, err
    assert out.count("the host guards it by remote frames") == 3
    arguments = (
        "--backend",
        "canopen",
        "--trajectory",
        tmp_path / "motion.json",
        "--rate",
        "50",
        "--least-kept",
        "0.5",
    )
    status, _, err = tauscope("run", tmp_path / "arm.json", *arguments, "--out", tmp_path / "recording.csv")
    assert status == 0, err
    assert emulator.state["state"] == ["QUICK_STOP_ACTIVE"] * 3, "it holds"
    assert [emulator.get(node, (0x100C, 0)) for node in (1, 2, 3)] == [0, 0, 0]


def test_guarded_drives_stop_where_the_bus_is_lost(tmp_path: Path, emulator: EmulatorProcess) -> None:
    joints = drive_joints(read_robot(tmp_path / "arm.json"))
    for joint in joints:
        joint.drive["eds"] = str(tmp_path / "drive.eds")  # pyright: ignore[reportIndexIssue]
    arm = CanopenArm(joints, patience_s=0.1)
    arm.connect()
    arm.enable(ControlMode.POSITION, stated_limits(joints), StopPolicy.HOLD, 0.2, 0.01)
    assert emulator.state["state"] == ["OPERATION_ENABLED"] * 3
    assert arm._session is not None
    arm._session.bus.close()  # no word to anybody, as a killed host or a torn cable leaves it
    assert eventually(lambda: emulator.state["state"] == ["QUICK_STOP_ACTIVE"] * 3)
    np.testing.assert_allclose(emulator.state["position"], START, atol=5e-3)
