"""The same arm in Pinocchio, the oracle of the dynamics tests and the yardstick of the benchmark."""

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from tauscope.robot.robot import JointType, Placement, Robot

Array = NDArray[np.float64]

_TO_PINOCCHIO = [6, 7, 8, 9, 0, 3, 1, 4, 5, 2]
"""Pinocchio orders m, msx, msy, msz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz."""


def pinocchio_model(robot: Robot, parameters: Array | None = None) -> pinocchio.Model:
    """Pinocchio model of the chain; each joint frame lies before the segment's `after` placement."""
    model = pinocchio.Model()
    model.gravity = pinocchio.Motion(robot.gravity, np.zeros(3))
    joint, previous = 0, pinocchio.SE3.Identity()
    for index, segment in enumerate(robot.segments):
        revolute = segment.type is JointType.REVOLUTE
        kind = pinocchio.JointModelRZ() if revolute else pinocchio.JointModelPZ()
        joint = model.addJoint(joint, kind, previous * _se3(segment.before), f"joint{index + 1}")
        previous = _se3(segment.after)
        if parameters is not None:
            link = parameters[10 * index : 10 * index + 10][_TO_PINOCCHIO]
            model.appendBodyToJoint(joint, pinocchio.Inertia.FromDynamicParameters(link), previous)
    return model


def pinocchio_regressor(robot: Robot, q: Array, qd: Array, qdd: Array) -> Array:
    """Pinocchio's regressor of every sample, over our parameters: our order, and in the link frame."""
    model = pinocchio_model(robot)
    data = model.createData()
    frames = [_to_joint_frame(segment.after) for segment in robot.segments]
    result = np.empty((*q.shape, 10 * robot.joint_count))
    for sample, state in enumerate(zip(q, qd, qdd, strict=True)):
        # Pinocchio's binding hands out a single row as a vector.
        phi = np.atleast_2d(pinocchio.computeJointTorqueRegressor(model, data, *state))
        for link, frame in enumerate(frames):
            columns = slice(10 * link, 10 * link + 10)
            result[sample, :, columns] = phi[:, columns][:, np.argsort(_TO_PINOCCHIO)] @ frame
    return result


def _se3(placement: Placement) -> pinocchio.SE3:
    return pinocchio.SE3(placement.rotation, placement.translation)


def _to_joint_frame(placement: Placement) -> Array:
    """Standard parameters in the link frame to those in the joint frame, (10, 10), by way of the pseudo-inertia."""
    displacement = np.eye(4)
    displacement[:3, :3], displacement[:3, 3] = placement.rotation, placement.translation
    columns = [_from_pseudo_inertia(displacement @ _pseudo_inertia(unit) @ displacement.T) for unit in np.eye(10)]
    return np.stack(columns, axis=1)


def _pseudo_inertia(parameters: Array) -> Array:
    xx, yy, zz, xy, xz, yz, mass, x, y, z = parameters
    half = (xx + yy + zz) / 2
    return np.array([[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, mass]])


def _from_pseudo_inertia(matrix: Array) -> Array:
    second = matrix[:3, :3]
    xx, yy, zz = np.trace(second) - np.diag(second)
    return np.array([xx, yy, zz, -second[0, 1], -second[0, 2], -second[1, 2], matrix[3, 3], *matrix[:3, 3]])
