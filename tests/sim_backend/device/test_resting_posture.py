"""Where the simulated arm stands at first."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from dataclasses import replace

import mujoco
import numpy as np

from tauscope.robot import JointLimits, Robot, read_robot
from tauscope_sim.device.mechanism import resting_posture
from tauscope_sim.examples import example_robot
from tauscope_sim.model import build_model


def inertia(robot: Robot, position: np.ndarray) -> np.ndarray:
    model = build_model(robot)
    data = mujoco.MjData(model)
    data.qpos[:] = position
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    return full.diagonal()


def test_an_arm_that_would_stand_in_line_with_a_joint_stands_elsewhere() -> None:
    robot = read_robot(example_robot("paper_arm"))
    assert inertia(robot, np.zeros(3))[0] < 1e-6
    posture = resting_posture(robot)
    assert inertia(robot, posture)[0] > 0.05
    np.testing.assert_array_equal(posture, resting_posture(robot))


def test_an_arm_that_may_stand_at_zero_does() -> None:
    robot = read_robot(example_robot("paper_arm"))
    bent = replace(robot.joints[1], limits=JointLimits(position=(0.5, 2.0)))
    posture = resting_posture(replace(robot, joints=(robot.joints[0], bent, robot.joints[2])))
    np.testing.assert_array_equal(posture, [0.0, 0.5, 0.0])
