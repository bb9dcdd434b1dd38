"""The control process killed or frozen at any instant while CiA 402 drives move: they stop by themselves and hold."""

import contextlib
import os
import signal
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import tauscope_sim.examples
from arm_rigs import START
from emulator_process import EmulatorProcess
from hardware_emulated.canopen_rig import ANSWER_PATIENCE_S
from hardware_emulated.canopen_robot import RATED_TORQUE_MNM, drive_joints, write_canopen_robot
from kills import SERIES, killed_often
from runtime.control_runs import wait_for
from runtime.doubles import short_motion
from tauscope.robot import read_robot
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.run_process import RunProcess, recover_runs
from tauscope.runtime.states import RunState
from tauscope.trajectory import write_trajectory
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_sim.canopen_bus.emulator import CanOrder

WATCHDOG_S = 0.25
STANDSTILL_S = 0.4
GLANCE_S = 0.01


@dataclass
class Site:
    """An emulated arm, and a folder of runs."""

    folder: Path
    emulator: EmulatorProcess
    runs: int = 0

    def start(self, *, acknowledge: bool) -> tuple[RunProcess, list[str]]:
        """A run, and the states that it tells."""
        self.runs += 1
        states: list[str] = []
        order = RunOrder(
            robot=str(self.folder / "robot.yaml"),
            trajectory=str(self.folder / "motion.json"),
            backend=BackendOrder(name="canopen", settings={"patience_s": ANSWER_PATIENCE_S}),
            options=RunOptions(
                rate_hz=100.0,
                watchdog_s=WATCHDOG_S,
                heartbeat_s=5.0,
                following_error=1.0,
                missed=30,
                least_kept=0.0,
                lost_s=0.3,
                acknowledge_faults=acknowledge,
                settle_s=0.0,
            ),
        )

        def hear(event) -> None:
            if event["event"] == "state":
                states.append(event["state"])

        folder = self.folder / "runs" / f"{self.runs:03d}"
        return RunProcess(folder, order, read_robot(order.robot), report=hear), states


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    folder = tmp_path_factory.mktemp("can")
    (folder / "runs").mkdir()
    robot = write_canopen_robot(Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml"), folder)
    motion = short_motion(read_robot(robot), period_s=3.0, repeats=30, amplitude=0.15)
    write_trajectory(motion, folder / "motion.json")
    order = CanOrder(
        robot=str(robot),
        start=tuple(START.tolist()),
        port=str(folder / "port"),
        control=str(folder / "control"),
        rated_torque_mnm=(RATED_TORQUE_MNM,) * 3,
        trace=str(folder / "trace"),
    )
    with EmulatorProcess(order) as emulator:
        yield Site(folder, emulator)


def kill_once(site: Site, how: signal.Signals, rng: np.random.Generator) -> str | None:
    """Kill or freeze a run in the state that is returned; None where it had ended by itself, as on a busy machine."""
    site.emulator.reset()
    run, states = site.start(acknowledge=False)
    try:
        wanted = "running" if rng.random() < 0.8 else "enabling"
        wait_for(lambda: wanted in states or run.has_ended, wanted)
        time.sleep(rng.uniform(0.0, 1.0))
        if run.has_ended:
            return None
        state = states[-1]
        os.kill(run.pid, how)
        killed_ns = time.monotonic_ns()
        allowed_ns = killed_ns + round((1.1 * WATCHDOG_S + GLANCE_S) * 1e9)
        rest_ns = allowed_ns + round(STANDSTILL_S * 1e9)
        wait_for(lambda: site.emulator.state["monotonic_ns"] > rest_ns + 100_000_000, "the end of the stop")
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(run.pid, signal.SIGKILL)
        run.wait()
    trace = site.emulator.trace()
    late = [entry for entry in trace if entry["monotonic_ns"] > allowed_ns]
    assert not any(any(entry["commanded"]) for entry in late), "under command after the watchdog's time"
    resting = [entry for entry in late if entry["monotonic_ns"] > rest_ns]
    assert resting
    if state == "running":  # before, some drives have no power yet, and nothing to hold with
        assert np.abs([entry["velocity"] for entry in resting]).max() < 0.03
        assert {state for entry in late for state in entry["state"]} == {"QUICK_STOP_ACTIVE"}, "nothing was dropped"
        refuse_until_acknowledged(site)
    return state


def refuse_until_acknowledged(site: Site) -> None:
    """The next start neither moves the arm nor lets go of it; once the fault is acknowledged, there is none."""
    stopped_s = site.emulator.state["time"]
    # the position loop's integral is still at work when the ramp has ended: half a milliradian, gone a second later
    wait_for(lambda: site.emulator.state["time"] > stopped_s + 1.0, "the arm to settle")
    before = np.array(site.emulator.state["position"])
    recover_runs(site.folder / "runs")
    run, _ = site.start(acknowledge=False)
    record = run.wait()
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert "(watchdog)" in record.problem.detail
    assert "acknowledge" in record.problem.detail
    after = site.emulator.state
    assert np.abs(np.array(after["position"]) - before).max() < 1e-3
    assert after["state"] == ["QUICK_STOP_ACTIVE"] * len(before)
    arm = CanopenArm(drive_joints(read_robot(site.folder / "robot.yaml")), patience_s=ANSWER_PATIENCE_S)
    assert arm.connect().faults
    assert not arm.acknowledge_faults().faults
    arm.disconnect()


@pytest.mark.realtime
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
@SERIES
def test_at_any_instant(site: Site, how: signal.Signals, times: int) -> None:
    rng = np.random.default_rng([3, how])
    states = killed_often(lambda: kill_once(site, how, rng), times)
    assert states.count("running") >= len(states) // 2, states
