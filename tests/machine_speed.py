"""Whether this machine is quick enough for emulated devices: their physics share it with the master."""

import os
import time
from functools import cache
from pathlib import Path

import numpy as np

from tauscope.robot import read_robot
from tauscope_sim.examples import example_robot
from tauscope_sim.plant import Plant

QUICK_ENOUGH_S = 0.15e-3
"""Mean time of a step of the paper arm's physics with which drives at 250 Hz still answer in time [s].

Of a machine of 0.03 ms the processors were given a part of their time: with a fifth of it (0.08 ms) 2 of 113 tests
against the clock had to be run again; with a seventh (0.12 ms) 1 of 90; with a tenth (0.16 ms) 25 of 90, six in vain.
"""

STEP_S = 5e-4
STEPS = 1600

WAITED_EVERY_S = 2.0
"""Between two instants at which the kernel counts what waited [s]."""


@cache
def _plant() -> Plant:
    return Plant(read_robot(example_robot("paper_arm")))


def physics_step_s() -> float:
    """The mean time in which this machine does a step now: what is taken from it in between counts [s]."""
    plant = _plant()
    torque = np.zeros(plant.joint_count)
    plant.place(np.full(plant.joint_count, 0.4))
    begin = time.perf_counter()
    for _ in range(STEPS):
        plant.advance(torque, STEP_S)
    return (time.perf_counter() - begin) / STEPS


def waited_s() -> float:
    """Time in which some program waited for a processor, as the kernel counts it; zero where it does not [s]."""
    try:
        return int(Path("/proc/pressure/cpu").read_text(encoding="ascii").split()[4].removeprefix("total=")) * 1e-6
    except OSError:
        return 0.0


def taken_s() -> float:
    """Time that other machines on the same host have taken from this one's processors, as its kernel counts it [s].

    Zero where the kernel does not count it.
    """
    try:
        of_all = Path("/proc/stat").read_text(encoding="ascii").partition("\n")[0].split()
        return int(of_all[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError):
        return 0.0
