"""How well a control loop keeps its time on this machine, and how quickly a simulated arm runs in virtual time.

Real time: the loop with guard, log and journal process over a stand-in that answers at once, then over the simulated
arm in its own process. Run it alone: another busy process is part of what is measured.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from runtime.control_double import RealClock  # noqa: E402
from runtime.doubles import PointArm, point_robot, short_motion  # noqa: E402
from tauscope.robot import Robot, read_robot  # noqa: E402
from tauscope.runtime.drivers import Connection, make_backend  # noqa: E402
from tauscope.runtime.options import RunOptions  # noqa: E402
from tauscope.runtime.record import RunRecord  # noqa: E402
from tauscope.runtime.run import run_trajectory  # noqa: E402
from tauscope.trajectory import FourierSegment, FourierSeries, Trajectory  # noqa: E402
from tauscope_sim.examples import example_robot  # noqa: E402

REAL_S = 10.0
VIRTUAL_S = 30.0


def measured(
    robot: Robot, motion: Trajectory, connect: Callable[[], Connection], options: RunOptions
) -> tuple[RunRecord, float]:
    """A run, and the seconds that it took."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        begun = time.perf_counter()
        record = run_trajectory(robot, motion, connect, Path(folder) / "run", options)
        return record, time.perf_counter() - begun


def line(name: str, rate: float, record: RunRecord) -> None:
    """One line of the table."""
    timing = record.timing
    if timing is None:
        print(f"{name:<24} {rate:6.0f}  {record.state}: {record.problem and record.problem.detail}")
        return
    late = timing.lateness_us
    print(
        f"{name:<24} {rate:6.0f}  {late['p50']:7.0f} {late['p99']:7.0f} {late['p99.9']:7.0f} {late['max']:8.0f}"
        f"  {timing.missed_periods:6d} of {timing.cycles + timing.missed_periods:<6d} {max(timing.stale_samples):5d}"
        f"  {record.state}{'' if record.problem is None else ': ' + record.problem.detail}"
    )


def paper_motion(robot: Robot, duration_s: float) -> Trajectory:
    """Three harmonics of ten seconds, at rest at the ends of each period."""
    rng, order = np.random.default_rng(4), np.arange(1, 4)
    cosine, sine = rng.normal(size=(2, robot.joint_count, 3)) * 0.15
    cosine -= cosine.mean(axis=1, keepdims=True)
    sine -= (sine @ order)[:, None] * order / (order @ order)
    series = FourierSeries(10.0, np.zeros(robot.joint_count), cosine, sine)
    segment = FourierSegment(series, round(duration_s / 10.0), 0)
    return Trajectory(robot.name, tuple(joint.name for joint in robot.joints), (segment,))


def main() -> None:
    """Print the table."""
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} processors")
    print(
        f"{'lateness [us]':<24} {'Hz':>6}  {'p50':>7} {'p99':>7} {'p99.9':>7} {'max':>8}  {'missed':>16} {'stale':>5}"
    )
    double = point_robot(6)
    for rate in (200.0, 500.0, 1000.0):
        arm = PointArm(joint_count=6, position=np.full(6, 0.1), clock=RealClock())
        motion = short_motion(double, repeats=round(REAL_S / 0.5), amplitude=0.05)
        options = RunOptions(rate_hz=rate, watchdog_s=1.0)
        record, _ = measured(double, motion, lambda arm=arm: Connection(arm, is_real_time=True), options)
        line("stand-in, 6 joints", rate, record)
    paper = read_robot(example_robot("paper_arm"))
    real = {"time": "real"}
    motion, options = paper_motion(paper, REAL_S), RunOptions(rate_hz=500.0, watchdog_s=0.5)
    record, _ = measured(paper, motion, lambda: make_backend("sim", paper, real), options)
    line("simulated, 3 joints", 500.0, record)
    record, took = measured(paper, paper_motion(paper, VIRTUAL_S), lambda: make_backend("sim", paper, {}), RunOptions())
    outcome = record.state if record.problem is None else record.problem.detail
    print(f"virtual time, 3 joints, 500 Hz: {VIRTUAL_S:g} s of motion in {took:.1f} s ({outcome})")


if __name__ == "__main__":
    main()
