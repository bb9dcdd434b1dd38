"""What the conditioning makes of recordings from real machines."""

from pathlib import Path

import numpy as np
import pytest

from tauscope.recording import read_recording
from tauscope.recording.conditioning import Conditioner, Source
from tauscope.robot import read_robot


def survey(folder: Path, file: str) -> Conditioner:
    """One recording of one machine."""
    robot = read_robot(folder / "robot.yaml")
    return Conditioner.survey(read_recording(folder / file, robot.joint_count), robot)


@pytest.mark.parametrize(
    ("machine", "file"),
    [
        ("kuka-lwr4", "train-1.csv"),  # lags by 0.6 to 2.4 samples
        ("kuka-lwr4", "held-out-1.csv"),
        ("franka-panda", "train-1.csv"),  # quieter than the derivative, but 1.2 to 2.2 samples late
        ("franka-panda", "held-out-1.csv"),
        ("double-pendulum", "train-1.csv"),  # half a sample late, and noisier
        ("double-pendulum", "train-3.csv"),
    ],
)
def test_velocities_of_real_drives_lag_and_are_refused(shared_data: Path, machine: str, file: str) -> None:
    conditioner = survey(shared_data / machine, file)
    assert set(conditioner.summary(5.0).velocity_source) == {Source.POSITION}


def test_the_repeated_half_of_emps_is_averaged(shared_data: Path) -> None:
    conditioner = survey(shared_data / "emps", "train-1.csv")
    assert conditioner.summary(50.0).averaged_periods == 2
    (motion,) = conditioner.motions(50.0)
    scatter = np.std(motion.torque[1] - motion.torque[0]) / np.sqrt(2.0)
    assert scatter == pytest.approx(0.33, abs=0.01)  # the data's README, period against period


@pytest.mark.parametrize("machine", ["bam-xl330", "odrive-cogging", "franka-panda"])
def test_irregular_logs_are_resampled_and_used_to_their_edges(shared_data: Path, machine: str) -> None:
    conditioner = survey(shared_data / machine, "train-1.csv")
    time = conditioner.recording.samples().time
    assert conditioner.summary(8.0).resampled
    (motion,) = conditioner.motions(8.0)
    assert motion.time[0] - time[0] < 0.25
    assert time[-1] - motion.time[-1] < 0.25
    assert np.mean(motion.measured) > 0.95
