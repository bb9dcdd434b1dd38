"""The log of a user's own simulation: the same motion as without it, and rows that fit together."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's extension modules come without type stubs)

from pathlib import Path

import mujoco
import numpy as np
import pytest

import tauscope
from shared_data import REPOSITORY
from tauscope.errors import RecordingError
from tauscope_sim.mujoco_log import MujocoLog

ARM = REPOSITORY / "docs" / "examples" / "position_arm.xml"


def test_logging_changes_nothing_and_rows_fit_together(tmp_path: Path) -> None:
    """Torque of a row is that of MuJoCo's inverse dynamics at its state."""
    models = [mujoco.MjModel.from_xml_path(str(ARM)) for _ in range(2)]
    plain, logged = (mujoco.MjData(model) for model in models)
    log = MujocoLog(models[1], logged)
    for step in range(500):
        for data in (plain, logged):
            data.ctrl[:] = 0.5 * np.sin(0.01 * step * np.array([1.0, 2.0, 3.0]))
        mujoco.mj_step(models[0], plain)
        log.step()
    np.testing.assert_array_equal(plain.qpos, logged.qpos)
    log.save(tmp_path / "sim.csv")
    recording = tauscope.read_recording(tmp_path / "sim.csv", tauscope.load_robot(ARM))
    samples = recording.samples()
    assert samples.reference is not None
    assert samples.velocity is not None
    expected = 20.0 * (samples.reference - samples.position) - 0.5 * samples.velocity
    np.testing.assert_allclose(samples.effort[50:], expected[50:], atol=1e-6)


def test_a_joint_that_is_not_there_is_named() -> None:
    model = mujoco.MjModel.from_xml_path(str(ARM))
    with pytest.raises(RecordingError, match="wrist is no hinge or slide of the model; they are shoulder_pan"):
        MujocoLog(model, mujoco.MjData(model), ["wrist"])


def test_a_position_servo_logs_no_torque(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(ARM))
    log = MujocoLog(model, mujoco.MjData(model), ["elbow"])
    log.step()
    log.save(tmp_path / "sim.csv", with_torque=False)
    lines = (tmp_path / "sim.csv").read_text(encoding="utf-8").splitlines()
    assert lines[:2] == ["# joints: elbow", "t,q1,qd1,qref1"]
