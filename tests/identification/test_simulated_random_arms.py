"""Random arms run by MuJoCo's physics and identified from the recording: what comes out are MuJoCo's own inertias."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from excitation.excited_arms import modelled_arm, resting_series, with_limits
from tauscope.identification import Identification, identify
from tauscope.recording import read_recording
from tauscope.robot import JointLimits, Model, Robot
from tauscope.robot.robot import STANDARD_PARAMETERS
from tauscope.runtime.drivers import make_backend
from tauscope.runtime.options import RunOptions
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope.trajectory import FourierSegment, Trajectory
from tauscope_sim.model import build_model

PERIODS = 2

ROOMY = JointLimits((-4.0, 4.0), 5.0, 40.0, 2000.0)
"""More than any of the motions needs."""


def parameters_of_mujoco(robot: Robot) -> dict[str, float]:
    """Standard parameters about the link frames, from the compiled model's masses, centres and principal moments."""
    model = build_model(robot)
    named: dict[str, float] = {}
    for body in range(1, model.nbody):
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.body_iquat[body])
        axes = turn.reshape(3, 3)
        mass, centre = float(model.body_mass[body]), model.body_ipos[body]
        inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia = inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        xx, yy, zz, xy, xz, yz = (inertia[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        values = (xx, yy, zz, xy, xz, yz, mass, *(mass * centre))
        named |= {f"{name}{body}": float(value) for name, value in zip(STANDARD_PARAMETERS, values, strict=True)}
    return named


def identified(seed: int, joint_count: int, folder: Path) -> tuple[Robot, Identification]:
    """A random arm, run in virtual time, and identified from a robot file that has no model."""
    rng = np.random.default_rng(seed)
    robot = with_limits(modelled_arm(rng, joint_count), ROOMY)
    series = resting_series(rng, joint_count, period_s=5.0)
    names = tuple(joint.name for joint in robot.joints)
    motion = Trajectory(robot.name, names, (FourierSegment(series, PERIODS, 0),))
    scenario = folder / "scenario.yaml"
    noise = [round(float(value), 3) for value in rng.uniform(0.1, 0.5, joint_count)]
    scenario.write_text(f"torque_noise_std: {noise}\nseed: {seed}\n", encoding="utf-8")
    settings = {"start": motion.start.tolist(), "scenario": str(scenario)}
    record = run_trajectory(
        robot, motion, lambda: make_backend("sim", robot, settings), folder / "run", RunOptions(rate_hz=200.0)
    )
    assert record.state is RunState.FINISHED, record.problem
    recording = read_recording(folder / "run" / "recording.csv", joint_count, names)
    return robot, identify(replace(robot, model=Model()), [recording])


def check_against_mujoco(seed: int, joint_count: int, folder: Path) -> None:
    """Every identifiable combination within four of its standard errors."""
    robot, found = identified(seed, joint_count, folder)
    truth = parameters_of_mujoco(robot)
    base = found.structure.base
    exact = np.array([sum(factor * truth[name] for name, factor in terms.items()) for terms in base.terms])
    std = np.sqrt(np.diag(found.covariance))[: len(exact)]
    errors = (found.free_parameters[: len(exact)] - exact) / std
    assert np.abs(errors).max() < 4.0, dict(zip(base.names, errors.round(2), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("joint_count", range(2, 8))
def test_a_random_arm_has_mujocos_inertias(tmp_path: Path, joint_count: int) -> None:
    check_against_mujoco(100 + joint_count, joint_count, tmp_path)
