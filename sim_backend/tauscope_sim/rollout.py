"""An exported MJCF as the plant of a closed loop, one step at a time; friction at rest is rest."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from collections.abc import Sequence

import mujoco
import numpy as np

from tauscope.robot.robot import Array

JOINT_EQUALITY = int(mujoco.mjtEq.mjEQ_JOINT)


class MujocoPlant:
    """A compiled MJCF with torque and dry friction at every step, without joint limits, which would hide an error."""

    def __init__(self, mjcf: str, joints: Sequence[str], step_s: float, damping: Array) -> None:
        """Compile the file. `joints`: base first; `step_s`: [s]; `damping`: (n,), added [Nm s/rad or N s/m]."""
        model = mujoco.MjModel.from_xml_string(mjcf)
        model.opt.timestep = step_s
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
        places = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in joints]
        self._qpos = np.array([model.jnt_qposadr[place] for place in places])
        self._dof = np.array([model.jnt_dofadr[place] for place in places])
        model.dof_damping[self._dof] += damping
        self._followers = [
            (int(model.eq_obj1id[e]), int(model.eq_obj2id[e]), model.eq_data[e, :5].copy())
            for e in range(model.neq)
            if model.eq_type[e] == JOINT_EQUALITY
        ]
        self._model, self._data = model, mujoco.MjData(model)
        self._rotor = model.dof_armature[self._dof].copy()
        self._inertial = np.zeros(model.nv)

    def reset(self, position: Array, velocity: Array) -> None:
        """Put the joints somewhere. `position`: (n,) [rad or m]; `velocity`: (n,) [rad/s or m/s]."""
        model, data = self._model, self._data
        mujoco.mj_resetData(model, data)
        data.qpos[self._qpos], data.qvel[self._dof] = position, velocity
        for follower, master, terms in self._followers:
            at = float(data.qpos[model.jnt_qposadr[master]])
            speed = float(data.qvel[model.jnt_dofadr[master]])
            powers = np.arange(5)
            data.qpos[model.jnt_qposadr[follower]] = terms @ at**powers
            data.qvel[model.jnt_dofadr[follower]] = terms[1:] @ (powers[1:] * at ** powers[:-1]) * speed
        mujoco.mj_forward(model, data)

    def advance(self, torque: Array, dry: Array) -> None:
        """One step. `torque`: (n,), on the joints [Nm or N]; `dry`: (n,), friction that holds one at rest [Nm or N]."""
        self._data.qfrc_applied[self._dof] = torque
        self._model.dof_frictionloss[self._dof] = dry
        mujoco.mj_step(self._model, self._data)

    @property
    def position(self) -> Array:
        """q, (n,) [rad or m]."""
        return self._data.qpos[self._qpos]

    @property
    def velocity(self) -> Array:
        """q̇, (n,) [rad/s or m/s]."""
        return self._data.qvel[self._dof]

    @property
    def load(self) -> Array:
        """Torque of the rigid body in the last step, without rotors, (n,) [Nm or N]."""
        data = self._data
        mujoco.mj_mulM(self._model, data, self._inertial, data.qacc)
        return data.qfrc_bias[self._dof] + self._inertial[self._dof] - self._rotor * data.qacc[self._dof]
