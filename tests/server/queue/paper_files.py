"""Files of the paper's arm: its robot file, and recordings that the simulated backend makes."""

from pathlib import Path

import numpy as np

from shared_data import REPOSITORY
from tauscope.robot import read_robot
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import simulate_recording, write_recording_csv

PAPER_ROBOT = REPOSITORY / "sim_backend" / "tauscope_sim" / "examples" / "paper_arm.yaml"


def write_recording(path: Path, *, seed: int, rate_hz: float = 100.0) -> Path:
    """Two periods of ten seconds of a random motion, with the paper's noise."""
    robot, rng = read_robot(PAPER_ROBOT), np.random.default_rng(seed)
    motion = random_fourier_motion(robot.joints, rng)
    recording = simulate_recording(robot, motion, rate_hz=rate_hz, periods=2, noise_std=[0.5, 0.3, 0.7], rng=rng)
    write_recording_csv(path, recording, robot.joints)
    return path
