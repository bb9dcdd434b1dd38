"""Whether this machine is quick enough for emulated devices: their physics share it with the master."""

import time
from functools import cache

import numpy as np

from service.robot import read_robot
from sim_backend.examples import example_robot
from sim_backend.plant import Plant

QUICK_ENOUGH_S = 0.15e-3
"""Time of a step of the paper arm's physics at which drives at 250 Hz still answer in time [s]."""

STEP_S = 5e-4
STEPS, REPEATS = 20, 40


@cache
def physics_step_s() -> float:
    """The shortest time in which this machine does a step: what else runs on it only makes others longer [s]."""
    plant = Plant(read_robot(example_robot("paper_arm")))
    torque = np.zeros(plant.joint_count)
    plant.place(np.full(plant.joint_count, 0.4))
    times = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        for _ in range(STEPS):
            plant.advance(torque, STEP_S)
        times.append((time.perf_counter() - begin) / STEPS)
    return min(times)
