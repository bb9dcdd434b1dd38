"""The multibody dynamics of the plant, all of it MuJoCo's: mass matrix, bias, Jacobians."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

import mujoco
import numpy as np

from tauscope.robot.robot import Array, LinkInertia, Robot
from tauscope_sim.model import body_inertia, build_model


class RigidBodies:
    """An arm of rigid links at one position and velocity: H(q), h(q, q̇) + c(q), and what a tool carries.

    Where segments follow joints, q_segments = A q + b, and H = Aᵀ H_segments A, h + c = Aᵀ (h + c)_segments.

    `rotor_inertia`: (n,), reflected inertia of the motors of rigid joints, added to the diagonal of H [kg m² or kg].
    """

    def __init__(self, robot: Robot, rotor_inertia: Array) -> None:
        self._model = build_model(robot)
        self._ratios = robot.ratios
        self._offsets = np.array([coupling.offset for coupling in robot.couplings])
        self._is_coupled = robot.link_count > robot.joint_count
        self._rotors = np.diag(np.asarray(rotor_inertia, dtype=np.float64))
        if not self._is_coupled:
            self._model.dof_armature[:] = rotor_inertia
        self._data = mujoco.MjData(self._model)
        self._scratch = mujoco.MjData(self._model)
        count = robot.link_count
        self._last_link = list(robot.model.links or ())[-1].to_vector()
        self._carried: dict[int, Array] = {}
        self._position, self._velocity = self._data.qpos, self._data.qvel
        self._bias = self._data.qfrc_bias
        self._matrix = np.zeros((count, count))
        self._solution = np.empty((1, count))
        self._accelerations = self._solution[0]
        self._right_side = np.empty((1, count))

    def update(self, position: Array | list[float], velocity: Array | list[float]) -> None:
        """Move the links. `position`: (n,), q [rad or m]; `velocity`: (n,), q̇ [rad/s or m/s]."""
        self._position[:] = self._ratios @ position + self._offsets if self._is_coupled else position
        self._velocity[:] = self._ratios @ velocity if self._is_coupled else velocity
        mujoco.mj_fwdPosition(self._model, self._data)
        mujoco.mj_fwdVelocity(self._model, self._data)

    @property
    def bias(self) -> Array:
        """h(q, q̇) + c(q), shape (n,): a view that the next `update` overwrites [Nm or N]."""
        return self._ratios.T @ self._bias if self._is_coupled else self._bias

    def mass_matrix(self) -> Array:
        """H(q) with the rotors on its diagonal, shape (n, n): overwritten by the next call [kg m² or kg]."""
        mujoco.mj_fullM(self._model, self._data, self._matrix)
        return self._ratios.T @ self._matrix @ self._ratios + self._rotors if self._is_coupled else self._matrix

    def accelerations(self, torque: Array | list[float]) -> Array:
        """Solve H(q) q̈ = τ, (n,): a view that the next call overwrites [rad/s² or m/s²]. `torque`: τ [Nm or N]."""
        if self._is_coupled:
            return np.asarray(np.linalg.solve(self.mass_matrix(), torque), dtype=np.float64)
        self._right_side[0] = torque
        mujoco.mj_solveM(self._model, self._data, self._solution, self._right_side)
        return self._accelerations

    def tool_jacobian(self, offset: Array) -> Array:
        """Jacobian of a point of the last link, in base axes, (3, n) [m/rad or 1]. `offset`: (3,), in its frame [m]."""
        tool = len(self._position)
        point = self._data.xpos[tool] + self._data.xmat[tool].reshape(3, 3) @ offset
        jacobian = np.zeros((3, tool))
        mujoco.mj_jac(self._model, self._data, jacobian, None, point, tool)
        return jacobian @ self._ratios if self._is_coupled else jacobian

    def carry(self, carrier: object, payload: Array | None) -> None:
        """Change what the last link carries, without impact. `payload`: (10,), `STANDARD_PARAMETERS`; None drops it."""
        self._carried.pop(id(carrier), None)
        if payload is not None:
            self._carried[id(carrier)] = payload
        self._weigh_last_link()

    def drop_everything(self) -> None:
        """Leave the last link as the robot file describes it."""
        if self._carried:
            self._carried.clear()
            self._weigh_last_link()

    def _weigh_last_link(self) -> None:
        """Write the last link's inertia into the compiled model, and let MuJoCo renew what depends on it."""
        inertia = body_inertia(LinkInertia.from_vector(sum(self._carried.values(), self._last_link)))
        body = len(self._position)
        self._model.body_mass[body] = inertia.mass
        self._model.body_ipos[body] = inertia.centre
        self._model.body_iquat[body] = inertia.quaternion
        self._model.body_inertia[body] = inertia.moments
        mujoco.mj_setConst(self._model, self._scratch)
