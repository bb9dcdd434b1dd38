"""The service or the control process killed or frozen at any instant: the arm stops, and nothing recorded is lost.

The arm is the simulated one, in a process of its own in real time, with its own watchdog; its trace is the witness.
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from device_trace import DeviceTrace, read_trace
from kills import SERIES, killed_often
from runtime.control_runs import wait_for
from runtime.doubles import point_robot, short_motion
from shared_data import REPOSITORY
from tauscope.recording import read_recording
from tauscope.recording.journal_reading import read_journal
from tauscope.robot import read_robot
from tauscope.runtime.options import BackendOrder, RunOptions, RunOrder
from tauscope.runtime.record import RunRecord, child_environment, read_record
from tauscope.runtime.run_process import recover_runs
from tauscope.runtime.states import RunState
from tauscope.trajectory import write_trajectory
from tauscope_sim.device.drives import COMMANDED
from tauscope_sim.driver import DeviceProcess, start_device

WATCHDOG_S, HEARTBEAT_S = 0.2, 0.5
STANDSTILL_S = 0.3
OWNER = REPOSITORY / "tests" / "runtime" / "run_owner.py"
ROBOT = """\
name: points
kinematics:
  dh:
    - {theta: 0.0, d: 0.1, a: 0.0, alpha: 0.0}
    - {theta: 0.0, d: 0.1, a: 0.0, alpha: 0.0}
joints:
  - {name: joint1, limits: {position: [-2.0, 2.0], velocity: 4.0, acceleration: 30.0, torque: 50}}
  - {name: joint2, limits: {position: [-2.0, 2.0], velocity: 4.0, acceleration: 30.0, torque: 50}}
model:
  links:
    - {mass: 1, first_moment: [0, 0, 0], inertia: {xx: 0.5, yy: 0.5, zz: 0.5, xy: 0, xz: 0, yz: 0}}
    - {mass: 1, first_moment: [0, 0, 0], inertia: {xx: 0.5, yy: 0.5, zz: 0.5, xy: 0, xz: 0, yz: 0}}
"""


@dataclass
class Site:
    """A simulated arm that runs, and a folder of runs."""

    folder: Path
    device: DeviceProcess
    runs: int = 0
    seen: int = 0

    @property
    def root(self) -> Path:
        return self.folder / "runs"

    def trace(self) -> DeviceTrace:
        """What the device has written since `forget_trace`."""
        with self.device.trace.open(encoding="utf-8") as file:
            header = file.readline()
            file.seek(max(self.seen, file.tell()))
            part = self.folder / "part.csv"
            part.write_text(header + file.read(), encoding="utf-8")
        return read_trace(part)

    def forget_trace(self) -> None:
        """Start the trace anew from here."""
        self.seen = self.device.trace.stat().st_size


@pytest.fixture(scope="module")
def site() -> Iterator[Site]:
    """Its path is short: a socket lies in it."""
    with tempfile.TemporaryDirectory(prefix="kill-") as name:
        folder = Path(name)
        (folder / "runs").mkdir()
        (folder / "points.yaml").write_text(ROBOT, encoding="utf-8")
        robot = read_robot(folder / "points.yaml")
        write_trajectory(short_motion(point_robot(), period_s=2.0, repeats=30, amplitude=0.25), folder / "motion.json")
        with start_device(robot, folder, start_position=[0.0, 0.2], linger_s=600.0) as device:
            order = RunOrder(
                robot=str(folder / "points.yaml"),
                trajectory=str(folder / "motion.json"),
                backend=BackendOrder(name="sim", settings={"time": "real", "socket": str(device.socket)}),
                options=RunOptions(
                    rate_hz=100.0,
                    watchdog_s=WATCHDOG_S,
                    heartbeat_s=HEARTBEAT_S,
                    following_error=1.0,
                    missed=12,
                    lost_s=0.15,
                    least_kept=0.0,
                    acknowledge_faults=True,
                    settle_s=0.0,
                ),
            )
            (folder / "order.json").write_text(order.model_dump_json(), encoding="utf-8")
            yield Site(folder, device)


class Owner:
    """The owner's process, and what it has said so far."""

    def __init__(self, run: Path) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(OWNER), str(run)],
            stdout=subprocess.PIPE,
            env=child_environment(),
            text=True,
        )
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(line.strip())

    @property
    def control(self) -> int | None:
        return next((int(line.split()[1]) for line in self.said if line.startswith("control")), None)

    def has_said(self, *lines: str) -> bool:
        return any(line in self.said for line in lines)

    @property
    def has_ended(self) -> bool:
        return any(line.startswith("ended") for line in self.said)

    def bury(self) -> None:
        if self.process.returncode is not None:
            return
        self.process.kill()
        self.process.wait()
        self._reader.join(10)
        assert self.process.stdout is not None
        self.process.stdout.close()


STARVED = {"late", "stale-state", "velocity", "fault"}
"""Rules by which a run may end before it is killed, where other processes take the device's processor time."""


def kill_once(site: Site, victim: str, how: signal.Signals, rng: np.random.Generator) -> str | None:
    """Kill or freeze once, check all that was promised.

    The last state that the owner had heard of; None where the run had ended by itself.
    """
    site.runs += 1
    site.forget_trace()
    run = site.root / f"{site.runs:03d}-{victim}-{how.name}"
    owner = Owner(run)
    try:
        return _kill_run(site, run, owner, victim, how, rng)
    finally:
        owner.bury()


def _kill_run(
    site: Site, run: Path, owner: Owner, victim: str, how: signal.Signals, rng: np.random.Generator
) -> str | None:
    """The same with the owner's process at hand."""
    wait_for(lambda: owner.control is not None, "the control process")
    if rng.random() < 0.8:
        wait_for(lambda: owner.has_said("state running", "state stopping") or owner.has_ended, "the motion")
        time.sleep(rng.uniform(0.0, 0.6))
    else:
        time.sleep(rng.uniform(0.0, 2.5))
    if owner.has_ended:
        problem = read_record(run).problem
        assert problem is not None
        assert problem.rule in STARVED, problem
        return None
    control = owner.control
    assert control is not None
    state = next((line for line in reversed(owner.said) if line.startswith("state")), "state created")
    os.kill(owner.process.pid if victim == "owner" else control, how)
    killed_ns = time.monotonic_ns()
    allowed_s = 1.1 * WATCHDOG_S if victim == "control" else 1.1 * HEARTBEAT_S + WATCHDOG_S
    _assert_arm_stops(site, killed_ns, killed_ns + round(allowed_s * 1e9))
    if victim == "control" or how is signal.SIGKILL:
        owner.bury()
    else:
        wait_for(lambda: read_record(run).state.is_end, "the end of the run")
        owner.bury()
    record = _recovered(site, run)
    if record.problem is not None and record.problem.rule in STARVED:
        return None
    _assert_shown_as_interrupted(run, record, was_moving=state == "state running")
    return state


def _assert_arm_stops(site: Site, killed_ns: int, bound_ns: int) -> None:
    """By the device's own clock and record: under nobody's command after the bound, and at rest a little later."""
    rest_ns = bound_ns + round(STANDSTILL_S * 1e9)
    enough = rest_ns + 200_000_000
    wait_for(lambda: site.trace().time_ns.max(initial=0) > enough, "the device's trace", poll_s=0.05)
    trace = site.trace()
    late = trace.time_ns > bound_ns
    commanded = [
        activity for activity, is_late in zip(trace.activity, late, strict=True) if is_late and activity in COMMANDED
    ]
    assert not commanded, f"still under command after {(bound_ns - killed_ns) * 1e-9:g} s"
    assert np.abs(trace.velocity[trace.time_ns > rest_ns]).max(initial=0.0) < 0.02
    after = trace.position[trace.time_ns > rest_ns]
    assert np.ptp(after, axis=0).max(initial=0.0) < 0.01


def _recovered(site: Site, run: Path) -> RunRecord:
    """What the next start of the service makes of it."""
    recover_runs(site.root, patience_s=0.5)
    wait_for(lambda: read_record(run).state.is_end, "the end of the run")
    assert recover_runs(site.root) == (), "nothing is left to be recovered"
    return read_record(run)


def _assert_shown_as_interrupted(run: Path, record: RunRecord, *, was_moving: bool) -> None:
    """The run's end, and what is left of it."""
    assert record.state is RunState.INTERRUPTED, record.problem
    if not was_moving:
        return
    assert len(read_journal(run / "journal.mcap").rows) > 0
    assert record.recording is not None
    assert record.recording.partial
    if record.recording.files:
        assert len(read_recording(run / "recording.csv")) == record.recording.samples


CASES = [("control", signal.SIGKILL), ("control", signal.SIGSTOP), ("owner", signal.SIGKILL), ("owner", signal.SIGSTOP)]


@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("victim", "how"), CASES[1:2])
def test_the_arm_stops_and_the_run_is_interrupted(site: Site, victim: str, how: signal.Signals) -> None:
    rng = np.random.default_rng([1, CASES.index((victim, how))])
    killed_often(lambda: kill_once(site, victim, how, rng), times=1)


@pytest.mark.realtime
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(("victim", "how"), CASES)
@SERIES
def test_at_any_instant(site: Site, victim: str, how: signal.Signals, times: int) -> None:
    rng = np.random.default_rng([2, CASES.index((victim, how))])
    states = killed_often(lambda: kill_once(site, victim, how, rng), times)
    assert states.count("state running") >= len(states) // 2, states
