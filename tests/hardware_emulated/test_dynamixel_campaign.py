"""A whole campaign over the bus: design, run, identify; what comes out is what was put into the emulated arm.

Bytes go over a pseudo terminal to servos in a process of their own, whose time passes in step with the host's cycles:
what a busy machine does to a run in real time is another test's matter.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers import ControlMode, StopPolicy
from drivers.dynamixel import DynamixelArm
from hardware_emulated.campaign_arms import (
    TORQUE_PER_MILLIAMPERE,
    six_joints,
    standard_parameters,
    three_joints,
    write_robot,
)
from hardware_emulated.stepped_clock import SteppedClock
from service.acquisition import RunOptions, RunRecord, RunState, run_trajectory
from service.acquisition.backends import Connection
from service.acquisition.dynamixel_bus import dynamixel_joints
from service.excitation import ExcitationOptions, design_excitation
from service.identification import IdentificationDocument, document, identify
from service.recording import read_recording
from service.robot import Robot, read_robot
from sim_backend.dynamixel_bus import DynamixelOrder
from sim_backend.dynamixel_bus.robot_servos import servos_of
from sim_backend.emulation import EmulatorProcess, FaultKind, InjectedFault

NOISE_MA = 100.0
"""0.5 Nm, as the seed paper has it."""

RATE_HZ = 200.0
DESIGN = ExcitationOptions(period_s=8.0, periods=2, starts=2, slow_postures=2)

ARMS: dict[str, Callable[[], dict[str, Any]]] = {"three": three_joints, "six": six_joints}


def play(
    arm: dict[str, Any], folder: Path, faults: list[InjectedFault], options: RunOptions, design: ExcitationOptions
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
        backend = DynamixelArm(dynamixel_joints(robot), slack_s=0.5, clock=SteppedClock(emulator))
        emulator.inject(*faults)
        return run_trajectory(
            robot,
            motion,
            lambda: Connection(backend, is_real_time=False),
            folder / "run",
            options,
            backend_name="dynamixel",
        )


def deviations(found: IdentificationDocument, truth: Robot) -> dict[str, float]:
    """Distance of every parameter from the truth, in its own standard errors."""
    true, result = standard_parameters(truth), {}
    for entry in found.base_parameters:
        assert entry.std is not None
        value = sum(factor * true[name] for name, factor in entry.terms.items())
        result[entry.name] = (entry.value - value) / entry.std
    assert truth.model is not None
    assert truth.model.friction is not None
    for friction, coefficients in zip(found.friction, truth.model.friction, strict=True):
        for name in ("stiction", "stribeck", "viscous"):
            std = friction.std[name]
            assert std is not None
            result[f"{name} of {friction.joint}"] = (getattr(friction, name) - getattr(coefficients, name)) / std
    return result


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", list(ARMS))
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
    assert max(map(abs, far.values())) < 4.0, far
    assert len(found.base_parameters) >= 3 * len(arm["joints"])


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_hosts_own_loop_tracks_a_motion_by_current(tmp_path: Path) -> None:
    options = RunOptions(rate_hz=RATE_HZ, mode=ControlMode.TORQUE, stop_policy=StopPolicy.TORQUE_OFF)
    design = ExcitationOptions(period_s=4.0, periods=1, starts=1, slow_postures=0, closing_period=False)
    record = play(three_joints(), tmp_path, [], options, design)
    assert record.state is RunState.FINISHED, record.problem
    assert record.worst_following is not None
    assert max(record.worst_following) < 0.05
    samples = read_recording(tmp_path / "run" / "recording.csv").samples()
    assert samples.effort_command is not None
    # Before a sample flows what was asked for a cycle ago, after it what is asked now: 5 mNm a unit, and the servo's noise.
    flowing = TORQUE_PER_MILLIAMPERE * samples.effort[1:-1]
    asked = 0.5 * (samples.effort_command[:-2] + samples.effort_command[1:-1])
    assert np.abs(flowing - asked).std() < 1.5e-3 * NOISE_MA * 5.0 / np.sqrt(2.0)
