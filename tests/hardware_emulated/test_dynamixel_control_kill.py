"""The control process of a run killed or frozen at any instant: the servos stop by themselves, and say so later."""

import os
import signal
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import three_joints, write_robot
from hardware_emulated.dynamixel_bench import SLACK_S, Bench
from hardware_emulated.robot_servos import servos_of
from kills import killed_often
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import find_driver, to_drive_joints
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.run_process import RunProcess
from tauscope.runtime.states import RunState
from tauscope.trajectory import write_trajectory
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_sim.dynamixel_bus import DynamixelOrder

pytestmark = pytest.mark.realtime

WATCHDOG_S = 0.4
REST_S = 0.8


@dataclass
class Site:
    bench: Bench
    robot: Robot
    order: RunOrder
    folder: Path
    runs: int = 0


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """Pendulums in place of the arm's links: what is looked at is when the servos stop."""
    folder = tmp_path_factory.mktemp("kill")
    path = write_robot(three_joints(), folder / "arm.json", str(folder / "port"))
    robot = read_robot(path)
    design = ExcitationOptions(period_s=4.0, periods=8, starts=1, slow_postures=0, closing_period=False)
    motion = design_excitation(robot, design).trajectory
    write_trajectory(motion, folder / "motion.json")
    start = DynamixelOrder(
        servos=servos_of(robot),
        start=tuple((motion.start + 0.05).tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
    )
    options = RunOptions(
        rate_hz=100.0,
        watchdog_s=WATCHDOG_S,
        following_error=1.0,
        missed=20,
        lost_s=0.3,
        settle_s=0.0,
        least_kept=0.0,
    )
    order = RunOrder(
        robot=str(path),
        trajectory=str(folder / "motion.json"),
        backend=BackendOrder(name="dynamixel", settings={"patience_s": SLACK_S}),
        options=options,
    )
    with EmulatorProcess(start) as emulator:
        yield Site(Bench(emulator, []), robot, order, folder)


def hit(site: Site, how: signal.Signals, rng: np.random.Generator) -> str:
    """Kill once, in the state that is returned, and check all that was promised."""
    bench, emulator = site.bench, site.bench.emulator
    emulator.reset()
    site.runs += 1
    states = ["created"]

    def listen(event: Mapping[str, Any]) -> None:
        if event["event"] == "state":
            states.append(event["state"])

    run = RunProcess(site.folder / f"run{site.runs}", site.order, site.robot, report=listen)
    try:
        wanted = "running" if rng.random() < 0.8 else "enabling"
        bench.wait_until(lambda _: wanted in states or run.has_ended, 60.0)
        bench.let_pass(rng.uniform(0.0, 0.6))
        state = states[-1]
        os.kill(run.pid, how)
        killed_s = emulator.state["time"]
        stopped = bench.wait_until(lambda device: not any(device["commanded"]), 20.0)
        fired = [instant for instant in stopped["latched_at"] if instant is not None]
        assert max(fired, default=0.0) - killed_s <= 1.1 * WATCHDOG_S
        assert state != "running" or len(fired) == len(site.robot.joints)
        bench.let_pass(REST_S)
        place = np.array(emulator.state["position"])
        resting = bench.let_pass(0.2)
        assert np.abs(np.array(resting["position"]) - place).max() < 1e-3
        assert state != "running" or all(resting["enabled"]), "no joint was dropped"
    finally:
        with suppress(ProcessLookupError):
            os.kill(run.pid, signal.SIGKILL)
        record = run.wait(30.0)
    assert record.state in (RunState.INTERRUPTED, RunState.FAILED)
    if state == "running":
        refuse_until_acknowledged(site)
    return state


def refuse_until_acknowledged(site: Site) -> None:
    """The next run does not move the arm; once the fault is acknowledged, the arm has none."""
    before = np.array(site.bench.emulator.state["position"])
    site.runs += 1
    record = RunProcess(site.folder / f"run{site.runs}", site.order, site.robot).wait(60.0)
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert "(watchdog)" in record.problem.detail
    assert "acknowledge" in record.problem.detail
    assert np.abs(np.array(site.bench.emulator.state["position"]) - before).max() < 1e-3
    arm = DynamixelArm(to_drive_joints(find_driver("dynamixel"), site.robot), slack_s=SLACK_S)
    assert arm.connect().faults
    assert not arm.acknowledge_faults().faults
    arm.disconnect()


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_killed_or_frozen_control_process(site: Site, how: signal.Signals) -> None:
    hit(site, how, np.random.default_rng([1, how]))


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_hundred_times_each(site: Site, how: signal.Signals) -> None:
    rng = np.random.default_rng([2, how])
    states = killed_often(lambda: hit(site, how, rng))
    assert states.count("running") >= len(states) // 2, states
