"""A whole campaign over the bus: design, run, identify; what comes out is what was put into the emulated arm.

Bytes go over a pseudo terminal to servos in a process of their own, whose time passes in step with the host's cycles:
what a busy machine does to a run in real time is another test's matter.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import (
    TORQUE_PER_MILLIAMPERE,
    assert_within,
    deviations,
    six_joints,
    three_joints,
    write_robot,
)
from hardware_emulated.servo_kinds import servos_of
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.identification import document, identify
from tauscope.recording import read_recording
from tauscope.robot import read_robot
from tauscope.runtime.drivers import Connection, find_driver, to_drive_joints
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope_drivers import ControlMode, StopPolicy
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_sim.dynamixel_bus import DynamixelOrder
from tauscope_sim.emulation import FaultKind, InjectedFault

NOISE_MA = 100.0
"""0.5 Nm, as the seed paper has it."""

LITTLE_LATE_NS, LATE_NS = 2.5e5, 1e6
"""Standard deviation: a twentieth and a fifth of a cycle."""

RATE_HZ = 200.0
DESIGN = ExcitationOptions(period_s=8.0, periods=2, starts=2, slow_postures=2)

ARMS: dict[str, Callable[[], dict[str, Any]]] = {"three": three_joints, "six": six_joints}


class LateClock(SteppedClock):
    """A host that wakes late, now more and now less, as on a machine that has other work to do."""

    def __init__(self, emulator: EmulatorProcess, lateness_ns: float) -> None:
        super().__init__(emulator)
        self._lateness_ns = lateness_ns
        self._random = np.random.default_rng(1)

    def wait_until_ns(self, deadline_ns: int) -> int:
        late_ns = round(abs(self._random.normal(0.0, self._lateness_ns))) if deadline_ns > self.now_ns() else 0
        return super().wait_until_ns(deadline_ns + late_ns)


def play(
    arm: dict[str, Any],
    folder: Path,
    faults: list[InjectedFault],
    options: RunOptions,
    design: ExcitationOptions,
    make_clock: Callable[[EmulatorProcess], SteppedClock] = SteppedClock,
) -> RunRecord:
    """Design a motion for an arm and run it on emulated servos."""
    robot = read_robot(write_robot(arm, folder / "arm.json", str(folder / "port")))
    motion = design_excitation(robot, design).trajectory
    servos = tuple(replace(servo, current_noise_ma=NOISE_MA) for servo in servos_of(robot))
    order = DynamixelOrder(
        servos=servos,
        start=tuple((motion.start + 0.1).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        robot=str(folder / "arm.json"),
        stepped=True,
    )
    with EmulatorProcess(order) as emulator:
        backend = DynamixelArm(
            to_drive_joints(find_driver("dynamixel"), robot), slack_s=0.5, clock=make_clock(emulator)
        )
        emulator.inject(*faults)
        return run_trajectory(
            robot,
            motion,
            lambda: Connection(backend, is_real_time=False),
            folder / "run",
            options,
            backend_name="dynamixel",
        )


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", ["three", pytest.param("six", marks=pytest.mark.proof)])
def test_parameters_are_found_within_their_errors(name: str, tmp_path: Path) -> None:
    arm = ARMS[name]()
    lost = [InjectedFault(FaultKind.LOSE, device=2, at_s=at_s, count=2) for at_s in (5.0, 12.0, 19.0)]
    record = play(arm, tmp_path, lost, RunOptions(rate_hz=RATE_HZ), DESIGN)
    assert record.state is RunState.FINISHED, record.problem
    assert record.timing is not None
    assert record.timing.missed_periods == 0
    recording = read_recording(tmp_path / "run" / "recording.csv")
    missed = np.isnan(recording.samples().position).sum(axis=0)
    assert missed[1] >= 3, "samples that a servo did not answer are marked"
    assert missed[1] <= record.timing.stale_samples[1], "and counted"
    told = read_robot(write_robot(arm, tmp_path / "told.json", "unused", knows_model=False))
    truth = read_robot(tmp_path / "arm.json")
    found = document(identify(told, [recording]))
    far = deviations(found, truth)
    assert_within(4.0, far)
    assert len(found.base_parameters) >= 3 * len(arm["joints"])


@pytest.mark.proof
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("lateness_ns", [LITTLE_LATE_NS, LATE_NS])
def test_a_host_that_is_late_shifts_no_parameter(lateness_ns: float, tmp_path: Path) -> None:
    arm = three_joints()
    late = partial(LateClock, lateness_ns=lateness_ns)
    record = play(arm, tmp_path, [], RunOptions(rate_hz=RATE_HZ), DESIGN, late)
    assert record.state is RunState.FINISHED, record.problem
    told = read_robot(write_robot(arm, tmp_path / "told.json", "unused", knows_model=False))
    found = identify(told, [read_recording(tmp_path / "run" / "recording.csv")])
    far = deviations(document(found), read_robot(tmp_path / "arm.json"))
    assert_within(4.0, far)
    # what the servos read is the noise that was put in, and hardly more
    assert np.all(found.residuals.noise_std < 1.4 * NOISE_MA * TORQUE_PER_MILLIAMPERE)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_hosts_own_loop_tracks_a_motion_by_current(tmp_path: Path) -> None:
    options = RunOptions(rate_hz=RATE_HZ, mode=ControlMode.TORQUE, stop_policy=StopPolicy.TORQUE_OFF)
    design = ExcitationOptions(period_s=4.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    record = play(three_joints(), tmp_path, [], options, design)
    assert record.state is RunState.FINISHED, record.problem
    assert record.worst_following is not None
    assert max(record.worst_following) < 0.05
    samples = read_recording(tmp_path / "run" / "recording.csv").samples()
    assert samples.effort_command is not None
    # Before a sample flows what was asked for a cycle ago, after it what is asked now: in units of 5 mNm, with the
    # servo's noise.
    flowing = TORQUE_PER_MILLIAMPERE * samples.effort[1:-1]
    asked = 0.5 * (samples.effort_command[:-2] + samples.effort_command[1:-1])
    assert np.abs(flowing - asked).std() < 1.5e-3 * NOISE_MA * 5.0 / np.sqrt(2.0)
