"""Feed-forward torque of a host that is slower than the drives: no ripple in step with its cycle."""

import numpy as np
import pytest

from tauscope_sim.device.target import Target

TICK_S = 0.0005
OMEGA = 2.0 * np.pi * 0.5


@pytest.mark.parametrize("cycle", [2, 10, 20])
def test_torque_moves_with_the_positions_that_it_belongs_to(cycle: int) -> None:
    """τ_ff = 3 q along a sine: it stays three times the target's position at every tick, however slow the host."""
    target = Target(np.zeros(1), np.zeros(1), np.full(1, 50.0), TICK_S)
    worst, largest_step, before = 0.0, 0.0, 0.0
    for tick in range(8000):
        if tick % cycle == 0:
            asked = np.array([0.4 * (1.0 - np.cos(OMEGA * tick * TICK_S))])
            target.follow(asked, 3.0 * asked, float(tick))
        target.advance(tick)
        if tick > 1000:
            worst = max(worst, abs(float(target.feed_forward[0] - 3.0 * target.position[0])))
            largest_step = max(largest_step, abs(float(target.feed_forward[0]) - before))
        before = float(target.feed_forward[0])
    assert worst < 1e-9
    assert largest_step < 1.01 * 3.0 * 0.4 * OMEGA * TICK_S


def test_a_setpoint_without_torque_brings_none() -> None:
    target = Target(np.zeros(2), np.zeros(2), np.full(2, 50.0), TICK_S)
    for tick in range(200):
        if tick % 4 == 0:
            target.follow(np.full(2, 1e-5 * tick), None, float(tick))
        target.advance(tick)
    assert not target.feed_forward.any()
