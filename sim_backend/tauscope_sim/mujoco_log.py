"""A recording of the user's own MuJoCo simulation, for ``tauscope diagnose --against SIM.csv`` and rollouts.

>>> log = MujocoLog(model, data)
>>> while data.time < 20.0:
...     data.ctrl[:] = command(data.time)
...     log.step()
>>> log.save("sim.csv")
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from tauscope.errors import RecordingError

HINGE_OR_SLIDE = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))

_GROUPS = ("q", "tau", "qd", "qref")


def list_actuators(model: mujoco.MjModel, joint: int) -> list[int]:
    """Actuators that drive a joint, by their indices. `joint`: its index."""
    on_joint = model.actuator_trntype == int(mujoco.mjtTrn.mjTRN_JOINT)
    return np.flatnonzero(on_joint & (model.actuator_trnid[:, 0] == joint)).tolist()


class MujocoLog:
    """Steps a simulation and keeps its joints' state before each step, the torque in it, and commands."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, joints: Sequence[str] | None = None) -> None:
        """Take a simulation's `joints`, base first; None: all. Raises RecordingError: missing, or no hinge or slide."""
        every = [model.joint(index).name for index in range(model.njnt) if model.jnt_type[index] in HINGE_OR_SLIDE]
        self.joints = tuple(every if joints is None else joints)
        for name in self.joints:
            if name not in every:
                raise RecordingError(f"joint {name} is no hinge or slide of the model; they are {', '.join(every)}")
        places = [model.joint(name).id for name in self.joints]
        self._model, self._data = model, data
        self._qpos = np.array([model.jnt_qposadr[place] for place in places])
        self._dof = np.array([model.jnt_dofadr[place] for place in places])
        self._actuators = [next(iter(list_actuators(model, place)), None) for place in places]
        self._rows: list[NDArray[np.float64]] = []

    def step(self, command: NDArray[np.float64] | None = None) -> None:
        """``mujoco.mj_step(model, data)``, keeping a row. `command`: (n,), kept as ``qref``; None: the actuators'."""
        data = self._data
        time, position, velocity = data.time, data.qpos[self._qpos].copy(), data.qvel[self._dof].copy()
        if command is None:
            command = np.array([np.nan if each is None else data.ctrl[each] for each in self._actuators])
        mujoco.mj_step(self._model, data)
        self._rows.append(np.concatenate([[time], position, data.qfrc_actuator[self._dof], velocity, command]))

    def save(self, path: str | Path, *, with_torque: bool = True) -> None:
        """Write all rows as CSV. `with_torque`: whether torque is a column; a position servo's log has none."""
        rows, count = np.array(self._rows), len(self.joints)
        groups = [group for group in _GROUPS if with_torque or group != "tau"]
        places = [_GROUPS.index(group) for group in groups]
        kept = [0, *(1 + count * place + joint for place in places for joint in range(count))]
        names = ["t", *(f"{group}{joint}" for group in groups for joint in range(1, count + 1))]
        known = [place for place, column in enumerate(kept) if np.isfinite(rows[:, column]).any()]
        header = f"# joints: {', '.join(self.joints)}\n" + ",".join(names[place] for place in known)
        data = rows[:, [kept[place] for place in known]]
        np.savetxt(path, data, fmt="%.9g", delimiter=",", header=header, comments="", encoding="utf-8")
