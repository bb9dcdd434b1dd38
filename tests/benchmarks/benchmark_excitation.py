"""Designing an excitation: ours against FIGAROH's own optimiser and the best of 1,000 random Fourier series.

    python tests/benchmarks/benchmark_excitation.py [--figaroh-python PYTHON] [--arms NAME ...] [--repeats R]

The paper's arm, a UR5-like and a Panda-like one; the same limits, all of them used by everybody, and ten seconds.
FIGAROH (the `bench` group of pyproject.toml, and cyipopt, which it needs here) runs in a process of its own and may
live in an environment of its own, with its defaults: 200 iterations at most. It knows no limits of acceleration; we
keep ours. Every motion is sampled at 100 Hz and judged twice: by FIGAROH's base regressor, which is what it minimises,
and by ours, which has the friction curve of the robot file. `FIGAROH, best seen` is the lowest value on its way, which
it does not return. Seconds are those of the clock, and in brackets of the processor, which tell more on a busy
machine. Set OMP_NUM_THREADS=1 for both.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from arms import panda_like, ur5_like  # noqa: E402
from tauscope.dynamics import base_parameters, inverse_dynamics  # noqa: E402
from tauscope.excitation import ExcitationOptions, design_excitation  # noqa: E402
from tauscope.excitation.information import ExcitationRegressor  # noqa: E402
from tauscope.robot import Joint, JointLimits, LinkInertia, Model, Placement, Robot, read_robot  # noqa: E402
from tauscope.trajectory.fourier_series import MotionSamples  # noqa: E402
from tauscope_sim.examples import example_robot  # noqa: E402
from tauscope_sim.motion import random_fourier_motion  # noqa: E402

Array = NDArray[np.float64]

DURATION_S = 10.0
RATE_HZ = 100.0
RANDOM_SERIES = 1000
FIGAROH_ITERATIONS = 200


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description="Excitation design against FIGAROH and random Fourier series.")
    parser.add_argument("--figaroh-python", default=sys.executable, help="Python that has FIGAROH and cyipopt")
    parser.add_argument("--figaroh-iterations", type=int, default=FIGAROH_ITERATIONS)
    parser.add_argument("--arms", nargs="+", choices=list(ARMS), default=list(ARMS))
    parser.add_argument("--repeats", type=int, default=3, help="designs of ours, of different seeds")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    figures = {}
    for name in options.arms:
        figures[name] = compare(name, options)
        print(table(name, figures[name]), flush=True)
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1))


def compare(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """Seconds and condition numbers of all three on one arm."""
    robot = ARMS[name]()
    time_s = np.arange(round(DURATION_S * RATE_HZ) + 1) / RATE_HZ
    seconds, busy, ours = [], [], {}
    for seed in range(options.repeats):
        begin, begin_busy = time.perf_counter(), time.process_time()
        design = design_excitation(
            robot, ExcitationOptions(period_s=DURATION_S, limit_fraction=1.0, torque_margin=0.0, seed=seed)
        )
        seconds.append(time.perf_counter() - begin)
        busy.append(time.process_time() - begin_busy)
        ours[f"ours, seed {seed}"] = design.series.evaluate(time_s)
    judge = Judge(robot)
    random = best_random(robot, judge, time_s)
    motions = ours | {"random": random}
    figaroh = run_figaroh(robot, motions, options)
    by_ours = {label: judge(motion) for label, motion in motions.items()}
    by_figaroh = figaroh["judged"]
    if not figaroh["failed"]:
        motion = MotionSamples(*(np.array(figaroh[key]) for key in ("position", "velocity", "acceleration")))
        by_ours["FIGAROH"], by_figaroh["FIGAROH"] = judge(motion), figaroh["condition_number"]
        by_figaroh["FIGAROH, best seen"] = min(figaroh["history"])
    return {
        "ours_s": median(seconds),
        "figaroh_s": figaroh["seconds"],
        "ratio": figaroh["seconds"] / median(seconds),
        "ours_processor_s": median(busy),
        "figaroh_processor_s": figaroh["processor_seconds"],
        "processor_ratio": figaroh["processor_seconds"] / median(busy),
        "figaroh_iterations": figaroh.get("iterations"),
        "condition_by_our_regressor": by_ours,
        "condition_by_figaroh": by_figaroh,
    }


class Judge:
    """Condition number of our regressor, friction's curve as the robot file has it."""

    def __init__(self, robot: Robot) -> None:
        self._regressor = ExcitationRegressor(robot, base_parameters(robot), capacity=4096)

    def __call__(self, motion: MotionSamples) -> float:
        return float(np.linalg.cond(self._regressor.stacked(motion)))


def best_random(robot: Robot, judge: Judge, time_s: Array) -> MotionSamples:
    """The best of random Fourier series within all limits, torque included."""
    rng = np.random.default_rng(0)
    assert robot.model.links is not None
    parameters = np.concatenate([link.to_vector() for link in robot.model.links])
    limit = np.array([joint.limits.torque for joint in robot.joints])
    best, found = (np.inf, None), 0
    while found < RANDOM_SERIES:
        drawn = random_fourier_motion(robot.joints, rng, period_s=DURATION_S, limit_fraction=1.0).evaluate(time_s)
        motion = MotionSamples(drawn.position, drawn.velocity, drawn.acceleration)
        torque = inverse_dynamics(robot, parameters, motion.position, motion.velocity, motion.acceleration)
        if (np.abs(torque) > limit).any():
            continue
        found += 1
        best = min(best, (judge(motion), motion), key=lambda each: each[0])
    assert best[1] is not None
    return best[1]


def run_figaroh(robot: Robot, motions: dict[str, MotionSamples], options: argparse.Namespace) -> dict[str, Any]:
    """FIGAROH in a process of its own: its motion, its seconds, and its opinion of the other motions."""
    assert robot.model.links is not None
    joints = [
        {
            "before": _placement(segment.before),
            "after": _placement(segment.after),
            "parameters": link.to_vector().tolist(),
            "position": list(joint.limits.position or ()),
            "velocity": joint.limits.velocity,
            "torque": joint.limits.torque,
        }
        for joint, segment, link in zip(robot.joints, robot.segments, robot.model.links, strict=True)
    ]
    arm = {
        "gravity": robot.gravity.tolist(),
        "seed": 0,
        "max_iterations": options.figaroh_iterations,
        "duration_s": DURATION_S,
        "joints": joints,
        "motions": {
            label: [part.tolist() for part in (motion.position, motion.velocity, motion.acceleration)]
            for label, motion in motions.items()
        },
    }
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder) / "arm.json", Path(folder) / "result.json"
        source.write_text(json.dumps(arm))
        child = Path(__file__).with_name("figaroh_trajectory.py")
        command = [options.figaroh_python, str(child), str(source), str(result)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return json.loads(result.read_text())


def table(name: str, figures: dict[str, Any]) -> str:
    """The figures of one arm as text."""
    lines = [
        f"{name}: ours {figures['ours_s']:.2f} s ({figures['ours_processor_s']:.2f}), "
        f"FIGAROH {figures['figaroh_s']:.1f} s ({figures['figaroh_processor_s']:.1f}), "
        f"ratio {figures['ratio']:.0f} ({figures['processor_ratio']:.0f})",
        f"  {'condition number':<22}{'our regressor':>15}{'FIGAROH':>12}",
    ]
    by_ours, by_figaroh = figures["condition_by_our_regressor"], figures["condition_by_figaroh"]
    for label in by_ours | by_figaroh:
        cells = (f"{by[label]:.1f}" if label in by else "" for by in (by_ours, by_figaroh))
        lines.append("  {:<22}{:>15}{:>12}".format(label, *cells))
    return "\n".join(lines)


def _placement(placement: Placement) -> dict[str, Any]:
    return {"rotation": placement.rotation.tolist(), "translation": placement.translation.tolist()}


def _link(mass: float, centre: tuple[float, float, float], radius_m: float) -> LinkInertia:
    """A body of this mass about its centre, its radius of gyration the same about all axes."""
    c = np.array(centre)
    about_centre = mass * radius_m**2 * np.eye(3)
    return LinkInertia(mass, mass * c, about_centre + mass * (c @ c * np.eye(3) - np.outer(c, c)))


def _limited(
    arm: Robot,
    position: list[tuple[float, float]],
    velocity: list[float],
    acceleration: list[float],
    torque: list[float],
    links: tuple[LinkInertia, ...],
) -> Robot:
    limits = [JointLimits(*row) for row in zip(position, velocity, acceleration, torque, strict=True)]
    joints = tuple(Joint(joint.name, joint.type, limit) for joint, limit in zip(arm.joints, limits, strict=True))
    return replace(arm, joints=joints, model=Model(links=links))


def ur5() -> Robot:
    """Six joints with the UR5's published geometry, speeds and torques."""
    links = (
        _link(3.7, (0.0, -0.02, 0.0), 0.06),
        _link(8.4, (0.21, 0.0, 0.11), 0.1),
        _link(2.3, (0.15, 0.0, 0.02), 0.07),
        _link(1.2, (0.0, -0.002, 0.02), 0.045),
        _link(1.2, (0.0, 0.002, 0.02), 0.045),
        _link(0.19, (0.0, 0.0, -0.01), 0.022),
    )
    return _limited(
        ur5_like(), [(-np.pi, np.pi)] * 6, [np.pi] * 6, [8.0] * 6, [150.0] * 3 + [28.0] * 3, links
    )  # fmt: skip


def panda() -> Robot:
    """Seven joints with the Panda's published geometry and limits."""
    position = [
        (-2.8973, 2.8973),
        (-1.7628, 1.7628),
        (-2.8973, 2.8973),
        (-3.0718, -0.0698),
        (-2.8973, 2.8973),
        (-0.0175, 3.7525),
        (-2.8973, 2.8973),
    ]
    links = (
        _link(4.97, (0.0, -0.03, -0.12), 0.1),
        _link(0.65, (0.0, -0.07, 0.0), 0.06),
        _link(3.2, (0.03, 0.04, -0.07), 0.08),
        _link(3.6, (-0.05, 0.1, 0.03), 0.08),
        _link(1.2, (-0.01, 0.04, -0.04), 0.08),
        _link(1.7, (0.06, -0.01, -0.01), 0.055),
        _link(0.74, (0.01, 0.0, 0.06), 0.055),
    )
    velocity, acceleration = [2.175] * 4 + [2.61] * 3, [15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0]
    return _limited(panda_like(), position, velocity, acceleration, [87.0] * 4 + [12.0] * 3, links)


ARMS: dict[str, Callable[[], Robot]] = {
    "paper": lambda: read_robot(example_robot("paper_arm")),
    "ur5": ur5,
    "panda": panda,
}


if __name__ == "__main__":
    main()
