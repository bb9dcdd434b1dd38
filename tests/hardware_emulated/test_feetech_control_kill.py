"""The control process of a run killed or frozen at any instant: servos without a watchdog go on to their last goal.

That is at most a cycle away. They hold it, and nothing falls.
"""

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from feetech_bus import FeetechOrder, ServoSpecification
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.dynamixel_bench import SLACK_S
from hardware_emulated.test_feetech_commands import TORQUE_PER_PERMILLE, write_feetech_robot
from kills import killed_often
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import Robot, read_robot
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.run_process import RunProcess
from tauscope.runtime.states import RunState
from tauscope.trajectory import write_trajectory

pytestmark = pytest.mark.realtime

WATCHDOG_S = 0.4
RATE_HZ = 100.0
REST_S = 0.8
FASTEST = 2.0
"""Speed limit of the joints [rad/s]."""

LAG_S = 3.0 / RATE_HZ + 2.0 / (2.0 * np.pi * 8.0)
"""Between goal and joint: the pace's two cycles, the one under way, and the loop's two time constants [s]."""

DROOP = 0.006
"""Of the loop under a pendulum's weight, with a count of the encoder [rad]."""


@dataclass
class Site:
    emulator: EmulatorProcess
    robot: Robot
    order: RunOrder
    folder: Path
    runs: int = 0

    def wait_until(self, condition: Callable[[dict[str, Any]], bool], timeout_s: float) -> dict[str, Any]:
        """State of the device once it is as wanted."""
        deadline = time.monotonic() + timeout_s
        while not condition(state := self.emulator.state):
            assert time.monotonic() < deadline, f"not within {timeout_s} s: {state}"
            time.sleep(0.002)
        return state

    def let_pass(self, seconds: float) -> dict[str, Any]:
        """State of the device when so much of its own time has passed."""
        end = self.emulator.state["time"] + seconds
        return self.wait_until(lambda state: state["time"] >= end, 20.0)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Pendulums in place of the arm's links."""
    folder = tmp_path_factory.mktemp("kill")
    robot = read_robot(write_feetech_robot(three_joints(), folder / "arm.json", str(folder / "port")))
    design = ExcitationOptions(period_s=4.0, periods=8, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    write_trajectory(motion, folder / "motion.json")
    quick = {"return_delay": 0}
    start = FeetechOrder(
        servos=tuple(
            ServoSpecification(number, torque_per_permille=TORQUE_PER_PERMILLE, registers=quick) for number in (1, 2, 3)
        ),
        start=tuple((motion.start + 0.05).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
    )
    options = RunOptions(
        rate_hz=RATE_HZ,
        watchdog_s=WATCHDOG_S,
        following_error=1.0,
        missed=20,
        lost_s=0.3,
        settle_s=0.0,
        least_kept=0.0,
    )
    backend = BackendOrder(name="feetech", settings={"patience_s": SLACK_S})
    order = RunOrder(
        robot=str(folder / "arm.json"), trajectory=str(folder / "motion.json"), backend=backend, options=options
    )
    with EmulatorProcess(start) as emulator:
        yield Site(emulator, robot, order, folder)


def goals(site: Site) -> np.ndarray:
    """Where the servos go [rad]."""
    counts = [site.emulator.get(servo, "goal_position") for servo in (1, 2, 3)]
    return (np.array(counts) - 2048) * 2.0 * np.pi / 4096


def hit(site: Site, how: signal.Signals, rng: np.random.Generator) -> str | None:
    """Kill once, in the state that is returned, and check that the arm rests where it was going, held.

    None where the run has ended before, as on a machine that is too slow for it.
    """
    emulator = site.emulator
    emulator.reset()
    site.runs += 1
    states = ["created"]

    def listen(event: Mapping[str, Any]) -> None:
        if event["event"] == "state":
            states.append(event["state"])

    run = RunProcess(site.folder / f"run{site.runs}", site.order, site.robot, report=listen)
    try:
        wanted = "running" if rng.random() < 0.8 else "enabling"
        site.wait_until(lambda _: wanted in states or run.has_ended, 60.0)
        site.let_pass(rng.uniform(0.0, 0.6))
        state = states[-1]
        if run.has_ended:
            return None
        os.kill(run.pid, how)
        killed, wanted_place = emulator.state, goals(site)
        site.let_pass(REST_S)
        place = np.array(emulator.state["position"])
        resting = site.let_pass(0.2)
        assert np.abs(np.array(resting["position"]) - place).max() < 1e-3
        if state == "running":
            assert np.array_equal(goals(site), wanted_place)
            assert np.abs(place - wanted_place).max() < DROOP, "the last goal is where it rests"
            assert np.abs(wanted_place - killed["position"]).max() < FASTEST * LAG_S + DROOP
        assert state != "running" or all(resting["enabled"]), "no joint was dropped"
    finally:
        with suppress(ProcessLookupError):
            os.kill(run.pid, signal.SIGKILL)
        record = run.wait(30.0)
    assert record.state in (RunState.INTERRUPTED, RunState.FAILED)
    return state


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_killed_or_frozen_control_process(site: Site, how: signal.Signals) -> None:
    assert hit(site, how, np.random.default_rng([1, how])) is not None


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_hundred_times_each(site: Site, how: signal.Signals) -> None:
    rng = np.random.default_rng([2, how])
    states = killed_often(lambda: hit(site, how, rng))
    assert states.count("running") >= len(states) // 2, states
