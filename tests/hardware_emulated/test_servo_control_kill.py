"""The control process of a run killed or frozen at any instant: the servos stop by themselves, and nothing falls.

Dynamixel servos stop by their watchdogs, and say so later. STS3215 servos have none: they go on to their last goal, at
most a cycle away, and hold it.
"""

import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints
from hardware_emulated.servo_bench import SLACK_S, Bench
from hardware_emulated.servo_kinds import DYNAMIXEL, FEETECH, ServoKind
from kills import KILLS, killed_often
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import find_driver, to_drive_joints
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
    kind: ServoKind
    bench: Bench
    robot: Robot
    order: RunOrder
    folder: Path
    runs: int = 0


@pytest.fixture(scope="module", params=[DYNAMIXEL, FEETECH], ids=lambda kind: kind.name)
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Pendulums in place of the arm's links: what is looked at is when the servos stop."""
    kind: ServoKind = request.param
    folder = tmp_path_factory.mktemp("kill")
    path = kind.write_robot(three_joints(), folder / "arm.json", str(folder / "port"))
    robot = read_robot(path)
    design = ExcitationOptions(period_s=4.0, periods=8, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    write_trajectory(motion, folder / "motion.json")
    options = RunOptions(
        rate_hz=RATE_HZ, watchdog_s=WATCHDOG_S, following_error=1.0, missed=20, lost_s=0.3, settle_s=0.0, least_kept=0.0
    )
    backend = BackendOrder(name=kind.name, settings={"patience_s": SLACK_S})
    run = RunOrder(robot=str(path), trajectory=str(folder / "motion.json"), backend=backend, options=options)
    with EmulatorProcess(kind.order(robot, (motion.start + 0.05).tolist(), folder, quick=True)) as emulator:
        yield Site(kind, Bench(emulator, []), robot, run, folder)


@contextmanager
def watchdogs_fire(site: Site, state: str) -> Iterator[None]:
    killed_s = site.bench.emulator.state["time"]
    stopped = site.bench.wait_until(lambda device: not any(device["commanded"]), 20.0)
    fired = [instant for instant in stopped["latched_at"] if instant is not None]
    assert max(fired, default=0.0) - killed_s <= 1.1 * WATCHDOG_S
    assert state != "running" or len(fired) == len(site.robot.joints)
    yield


@contextmanager
def last_goals_are_held(site: Site, state: str) -> Iterator[None]:
    killed, wanted = site.bench.position, goals(site)
    yield
    if state == "running":
        assert np.array_equal(goals(site), wanted)
        assert np.abs(site.bench.position - wanted).max() < DROOP, "the last goal is where it rests"
        assert np.abs(wanted - killed).max() < FASTEST * LAG_S + DROOP


def goals(site: Site) -> np.ndarray:
    """Where STS3215 servos go [rad]."""
    counts = [site.bench.emulator.get(servo, "goal_position") for servo in (1, 2, 3)]
    return (np.array(counts) - 2048) * 2.0 * np.pi / 4096


def hit(site: Site, how: signal.Signals, rng: np.random.Generator) -> str | None:
    """Kill once, in the state that is returned, and check all that was promised.

    None where the run has ended before, as on a machine that is too slow for it.
    """
    bench = site.bench
    bench.emulator.reset()
    site.runs += 1
    states = ["created"]

    def listen(event: Mapping[str, Any]) -> None:
        if event["event"] == "state":
            states.append(event["state"])

    stops = watchdogs_fire if site.kind is DYNAMIXEL else last_goals_are_held
    run = RunProcess(site.folder / f"run{site.runs}", site.order, site.robot, report=listen)
    try:
        wanted = "running" if rng.random() < 0.8 else "enabling"
        bench.wait_until(lambda _: wanted in states or run.has_ended, 60.0)
        bench.let_pass(rng.uniform(0.0, 0.6))
        state = states[-1]
        if run.has_ended:
            return None
        os.kill(run.pid, how)
        with stops(site, state):
            bench.let_pass(REST_S)
        place = bench.position
        resting = bench.let_pass(0.2)
        assert np.abs(np.array(resting["position"]) - place).max() < 1e-3
        assert state != "running" or all(resting["enabled"]), "no joint was dropped"
    finally:
        with suppress(ProcessLookupError):
            os.kill(run.pid, signal.SIGKILL)
        record = run.wait(30.0)
    assert record.state in (RunState.INTERRUPTED, RunState.FAILED)
    if state == "running" and site.kind is DYNAMIXEL:
        refuse_until_acknowledged(site)
    return state


def refuse_until_acknowledged(site: Site) -> None:
    """The next run does not move the arm; once the fault is acknowledged, the arm has none."""
    before = site.bench.position
    site.runs += 1
    record = RunProcess(site.folder / f"run{site.runs}", site.order, site.robot).wait(60.0)
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert "(watchdog)" in record.problem.detail
    assert "acknowledge" in record.problem.detail
    assert np.abs(site.bench.position - before).max() < 1e-3
    arm = site.kind.make_arm(to_drive_joints(find_driver(site.kind.name), site.robot), slack_s=SLACK_S)
    assert arm.connect().faults
    assert not arm.acknowledge_faults().faults
    arm.disconnect()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_killed_or_frozen_control_process(site: Site, how: signal.Signals) -> None:
    assert hit(site, how, np.random.default_rng([1, how])) is not None


@pytest.mark.proof
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_at_any_instant(site: Site, how: signal.Signals) -> None:
    rng = np.random.default_rng([2, how])
    states = killed_often(lambda: hit(site, how, rng), KILLS)
    assert states.count("running") >= len(states) // 2, states
