"""A whole campaign over the bus of STS3215 servos: design, run, identify from load.

Bytes go over a pseudo terminal to servos whose time passes in step with the host's cycles.
"""

from pathlib import Path

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import standard_parameters, three_joints
from hardware_emulated.servo_kinds import FEETECH
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.identification import document, identify
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope.runtime.drivers import Connection, find_driver, to_drive_joints
from tauscope.runtime.options import RunOptions
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_sim.emulation import FaultKind, InjectedFault

RELATIVE, ABSOLUTE = 0.1, 0.04
"""With encoders of 4096 counts: twice as far off as this motion's results were [1; kg m², kg m, kg]."""

DESIGN = ExcitationOptions(period_s=8.0, periods=2, starts=2, slow_postures=2)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_parameters_are_found_from_load(tmp_path: Path) -> None:
    arm = three_joints()
    robot = read_robot(FEETECH.write_robot(arm, tmp_path / "arm.json", str(tmp_path / "port")))
    motion = design_excitation(robot, DESIGN).trajectory
    order = FEETECH.order(
        robot, (motion.start + 0.1).tolist(), tmp_path, robot=str(tmp_path / "arm.json"), stepped=True
    )
    with EmulatorProcess(order) as emulator:
        joints = to_drive_joints(find_driver("feetech"), robot)
        backend = FeetechArm(joints, slack_s=0.5, clock=SteppedClock(emulator))
        lost = [InjectedFault(FaultKind.LOSE, device=2, at_s=at_s, count=2) for at_s in (5.0, 12.0)]
        emulator.inject(*lost)
        record = run_trajectory(
            robot,
            motion,
            lambda: Connection(backend, is_real_time=False),
            tmp_path / "run",
            RunOptions(rate_hz=100.0),
            backend_name="feetech",
        )
    assert record.state is RunState.FINISHED, record.problem
    recording = read_recording(tmp_path / "run" / "recording.csv")
    samples = recording.samples()
    assert np.isnan(samples.position).sum(axis=0)[1] >= 2, "samples that a servo did not answer are marked"
    assert samples.voltage is not None
    found = document(identify(robot, [recording]))
    assert found.fit.train.relative_error < 0.02
    assert robot.model is not None
    assert robot.model.friction is not None
    for one, told in zip(found.friction, robot.model.friction, strict=True):
        assert one.stiction == pytest.approx(told.stiction, rel=RELATIVE)
        assert one.viscous == pytest.approx(told.viscous, rel=RELATIVE)
    true = standard_parameters(robot)
    for entry in found.base_parameters:
        value = sum(factor * true[name] for name, factor in entry.terms.items())
        assert entry.value == pytest.approx(value, abs=ABSOLUTE), entry.name
    assert len(found.base_parameters) == 15
