"""Torque regressor of 10,000 samples: ours against a Pinocchio loop with its results stacked, in one run.

    python tests/benchmarks/benchmark_regressor.py [--json OUT] [--samples N] [--repeats R]

The two are timed by turns, so that whatever else the machine does falls on both; the ratio is that of the medians.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from arms import panda_like, random_states, ur5_like  # noqa: E402
from pinocchio_arm import pinocchio_model, pinocchio_regressor  # noqa: E402
from tauscope.dynamics.base_parameters import base_parameters  # noqa: E402
from tauscope.dynamics.regressor import torque_regressor  # noqa: E402
from tauscope.robot.robot import Robot  # noqa: E402

ARMS = {
    "6 joints, right angles exact": ur5_like(),
    "6 joints, right angles of 8 digits": ur5_like(1.5707963),
    "7 joints, right angles of 10 digits": panda_like(1.570796327),
}


class Times(NamedTuple):
    """Median times [s] of one arm."""

    arm: str
    pinocchio: float
    all_columns: float
    base_columns: float

    @property
    def ratio(self) -> float:
        """How many times faster than Pinocchio, both over all columns."""
        return self.pinocchio / self.all_columns


def main() -> None:
    """Measure every arm, print a table, and write JSON where asked."""
    parser = argparse.ArgumentParser(description="Torque regressor against a Pinocchio loop, medians of one run.")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--samples", type=int, default=10_000)
    parser.add_argument("--repeats", type=int, default=15)
    options = parser.parse_args()
    rows = [measure(name, robot, options.samples, options.repeats) for name, robot in ARMS.items()]
    for row in rows:
        print(
            f"{row.arm:36s} Pinocchio {row.pinocchio * 1e3:6.1f} ms   ours {row.all_columns * 1e3:5.1f} ms"
            f"   {row.ratio:.2f} times faster   (base columns only {row.base_columns * 1e3:5.1f} ms)"
        )
    if options.json:
        figures = [{**row._asdict(), "ratio": row.ratio} for row in rows]
        result = {"samples": options.samples, "repeats": options.repeats, "unit": "s", "arms": figures}
        options.json.write_text(json.dumps(result, indent=1))


def measure(name: str, robot: Robot, samples: int, repeats: int) -> Times:
    """Time one arm, after checking that both compute the same."""
    states = random_states(np.random.default_rng(0), samples, robot.joint_count)
    some = [array[:20] for array in states]
    np.testing.assert_allclose(torque_regressor(robot, *some), pinocchio_regressor(robot, *some), rtol=0, atol=1e-7)
    model = pinocchio_model(robot)
    data = model.createData()
    columns = base_parameters(robot).independent_columns

    def pinocchio_loop() -> np.ndarray:
        q, qd, qdd = states
        each = [pinocchio.computeJointTorqueRegressor(model, data, q[k], qd[k], qdd[k]) for k in range(samples)]
        return np.stack(each)

    def ours() -> np.ndarray:
        return torque_regressor(robot, *states)

    def ours_base_columns() -> np.ndarray:
        return torque_regressor(robot, *states, columns=columns)

    return Times(name, *times_by_turns([pinocchio_loop, ours, ours_base_columns], repeats))


def times_by_turns(functions: list[Callable[[], np.ndarray]], repeats: int) -> list[float]:
    """Median time of each function; the first round, which loads and allocates, does not count."""
    times: list[list[float]] = [[] for _ in functions]
    for round_number in range(repeats + 1):
        for function, of_one in zip(functions, times, strict=True):
            start = time.perf_counter()
            function()
            if round_number:
                of_one.append(time.perf_counter() - start)
    return [median(of_one) for of_one in times]


if __name__ == "__main__":
    main()
