"""One identification that all tests of the report look at."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
import pytest

from figures import leave_figures_undrawn
from tauscope.identification import Identification, identify
from tauscope.recording import Recording
from tauscope.report.identification_report import identification_report
from tauscope.report.provenance import InputFile, Provenance
from tauscope.robot import Model, read_robot
from tauscope_sim.examples import example_robot
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import simulate_recording

NOISE_STD = (0.5, 0.3, 0.7)
HOSTILE = '"><script>alert(1)</script>'
JOINTS = ("shoulder", '</svg><img src=x onerror="alert(2)">', "a&b $\\frac{1}{2}$ <b>")


@dataclass(frozen=True, eq=False)
class Case:
    """An identification and what it was made from."""

    identification: Identification
    recordings: tuple[Recording, ...]
    held_out: tuple[Recording, ...]

    def page(self) -> str:
        inputs = (InputFile("recording", f"{HOSTILE}.csv", 12, "ab" * 32),)
        command = ("tauscope", "identify", "robot.yaml", f"{HOSTILE}.csv")
        provenance = Provenance(command, inputs, (("Python", "3.11"),), datetime(2026, 11, 21, tzinfo=UTC))
        return identification_report(self.identification, self.recordings, self.held_out, provenance)


def recording(name: str, seed: int, periods: int) -> Recording:
    """The paper's arm on a random motion."""
    arm = read_robot(example_robot("paper_arm"))
    motion_rng, noise_rng = np.random.default_rng(seed).spawn(2)
    motion = random_fourier_motion(arm.joints, motion_rng, period_s=10.0)
    made = simulate_recording(arm, motion, rate_hz=200.0, periods=periods, noise_std=NOISE_STD, rng=noise_rng)
    effort = made.torque.copy()
    effort[500:520, 1] = np.nan
    return Recording.from_arrays(name, made.time, made.position, effort, period=made.period.astype(np.float64))


@pytest.fixture(scope="session")
def case() -> Case:
    """An arm with names that want to be HTML, on recordings with a hole in them."""
    arm = read_robot(example_robot("paper_arm"))
    joints = tuple(replace(joint, name=name) for joint, name in zip(arm.joints, JOINTS, strict=True))
    robot = replace(arm, name=HOSTILE, joints=joints, model=Model())
    train, held_out = recording(f"{HOSTILE}.csv", 3, 2), recording("held <out>.csv", 4, 1)
    return Case(identify(robot, [train], [held_out]), (train,), (held_out,))


@pytest.fixture(scope="session")
def page(case: Case) -> str:
    return case.page()


@pytest.fixture
def undrawn_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages have empty figures: Matplotlib takes a second a page."""
    leave_figures_undrawn(monkeypatch)
