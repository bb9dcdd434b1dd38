"""A robot file and recordings of it on disk, small enough for every test."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tauscope.cli.demo_command import robot_text_without_model
from tauscope.robot import Robot, read_robot
from tauscope_sim.examples import example_robot
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import simulate_recording, write_recording_csv

NOISE_STD = (0.05, 0.03, 0.07)


@dataclass(frozen=True)
class SimulatedFiles:
    """Paths of a robot file and of recordings on different motions."""

    robot: Path
    train: tuple[Path, Path]
    held_out: tuple[Path, Path]

    @property
    def everything(self) -> tuple[Path, ...]:
        return (self.robot, *self.train, *self.held_out)


def write_files(folder: Path) -> SimulatedFiles:
    """The paper's arm without its model, two recordings and two to hold out."""
    arm = read_robot(example_robot("paper_arm"))
    robot = folder / "robot.yaml"
    robot.write_text(robot_text_without_model(example_robot("paper_arm")), encoding="utf-8")
    names = ("train-1.csv", "train-2.csv", "held-1.csv", "held-2.csv")
    paths = [record(arm, folder / name, seed) for seed, name in enumerate(names)]
    return SimulatedFiles(robot, (paths[0], paths[1]), (paths[2], paths[3]))


def record(arm: Robot, path: Path, seed: int, rate_hz: float = 100.0, periods: int = 2) -> Path:
    """One recording of 5 s periods."""
    motion_rng, noise_rng = np.random.default_rng(seed).spawn(2)
    motion = random_fourier_motion(arm.joints, motion_rng, period_s=5.0)
    recording = simulate_recording(arm, motion, rate_hz=rate_hz, periods=periods, noise_std=NOISE_STD, rng=noise_rng)
    write_recording_csv(path, recording, arm.joints)
    return path


def rename_arm(arm: Robot, name: str, joints: tuple[str, ...]) -> Robot:
    """The same arm under other names."""
    return replace(
        arm, name=name, joints=tuple(replace(joint, name=new) for joint, new in zip(arm.joints, joints, strict=True))
    )
