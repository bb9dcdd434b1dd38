"""The size of a wanted strength is found where there is one, and where there is none, the nearest."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from concealed.generator import forward
from concealed.generator.arms import NOISE_STD, arm_named
from concealed.generator.effects import CATALOGUE, EVENTS, Drawn, Ground
from concealed.generator.motions import Motion
from concealed.generator.sizing import CLOSE_ENOUGH, tuned
from concealed.generator.strength import Sight
from tauscope_sim.motion import random_fourier_motion


def knob(power: float = 1.0, largest: float = math.inf) -> Drawn:
    return Drawn(lambda size: {"size": size}, 1.0, power, (0,), ("any",), largest=largest)


@given(slope=st.floats(0.1, 1e3), power=st.sampled_from([0.7, 1.0, 2.0]), sign=st.sampled_from([-1.0, 1.0]))
def test_a_power_law_is_inverted(slope: float, power: float, sign: float) -> None:
    size, found = tuned(lambda size: slope * abs(size) ** power, 40.0, sign, knob(power))
    assert found == pytest.approx(slope * abs(size) ** power)
    assert found == pytest.approx(40.0, rel=CLOSE_ENOUGH)
    assert size * sign > 0.0


def test_at_a_bound_it_looks_no_further() -> None:
    looks: list[float] = []

    def shown(size: float) -> float:
        looks.append(size)
        return size

    assert tuned(shown, 40.0, 1.0, knob(largest=5.0)) == (5.0, 5.0)
    assert looks == [1.0, 5.0]


@pytest.mark.slow
def test_every_effect_is_sized_without_a_simulation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sound passages are made once; an effect is a law along them."""
    sight = short_sight()

    def play(*_: object) -> None:
        pytest.fail("an effect was simulated to find its size")

    monkeypatch.setattr(forward, "_played", play)
    ground = Ground(sight.robot, 1, noise=0.3, load=5.0, low=-1.0, high=1.0, duration=3.0, shortest=3.0)
    for effect, draw in {**CATALOGUE, **EVENTS}.items():
        drawn = draw(ground, np.random.default_rng(3))
        assert sight.foreseen(drawn.entry(drawn.size)) >= 0.0, effect


def test_an_effect_that_takes_more_torque_than_all_else_is_not_plausible() -> None:
    sight = short_sight()
    entry = {"effect": "cogging", "joint": 2, "order": 9.0, "phase": 0.0}
    assert sight.is_plausible({**entry, "amplitude": 0.5})
    assert not sight.is_plausible({**entry, "amplitude": 500.0})


@cache
def short_sight() -> Sight:
    robot = arm_named("paper")
    series = random_fourier_motion(robot.joints, np.random.default_rng(4), period_s=3.0, limit_fraction=0.5)
    return Sight(robot, [forward._played(robot, (), Motion("short", series, 1).setpoints)], NOISE_STD["paper"])
