"""Effects that are drawn: whatever size is tried on the way to a strength, the simulated arm takes it."""

import numpy as np
import pytest

from concealed.generator.arms import arm_named
from concealed.generator.effects import CATALOGUE, EVENTS, Ground
from concealed.generator.forward import physical, sensory
from tauscope_sim.driver import SimulatedArm
from tauscope_sim.scenario import Scenario

WITHOUT_BOUND = 100.0
"""A size that is tried where an effect may be as large as one likes."""


@pytest.mark.parametrize("effect", [*CATALOGUE, *EVENTS])
@pytest.mark.parametrize("seed", range(5))
def test_no_size_within_its_bounds_is_refused(effect: str, seed: int) -> None:
    robot = arm_named("paper")
    ground = Ground(robot, 1, noise=0.5, load=1.0, low=-1.0, high=1.0, duration=20.0, shortest=10.0)
    drawn = {**CATALOGUE, **EVENTS}[effect](ground, np.random.default_rng(seed))
    entry = drawn.entry(np.copysign(min(drawn.largest, WITHOUT_BOUND), drawn.size))
    SimulatedArm(robot, Scenario(effects=physical([entry]), sensor_effects=sensory([entry]))).connect()
