"""Torque of what happens for a while, along a motion that is known: the same as MuJoCo's drives need for it."""

from typing import Any

import numpy as np
import pytest

from concealed.generator.arms import arm_named
from concealed.generator.forward import Entry, passage, physical
from concealed.generator.laws import STEP_S, law_torque
from concealed.generator.motions import Motion
from tauscope_sim.motion import random_fourier_motion

PUSH = {"effect": "external_contact", "joint": 2, "torque": 6.0, "start": 0.8, "duration": 1.0}
LOAD = {"effect": "payload_change", "mass": 1.5, "offset": [0.05, 0.0, 0.1], "start": 0.9, "end": 2.1}


@pytest.mark.slow
@pytest.mark.parametrize("entry", [{**PUSH, "profile": "half_sine"}, {**PUSH, "profile": "rectangular"}, LOAD])
def test_it_is_what_the_simulated_drives_need_more(
    entry: Entry, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("concealed.generator.forward.CACHE", tmp_path)
    robot = arm_named("paper")
    series = random_fourier_motion(robot.joints, np.random.default_rng(4), period_s=2.5, limit_fraction=0.5)
    motion = Motion("short", series, 1)
    plain, made = passage(robot, [], motion), passage(robot, [entry], motion)
    (effect,) = physical([entry])
    law = law_torque(robot, effect, plain)
    assert law is not None
    more = made.torque - plain.torque
    begin, end = float(entry["start"]), float(entry.get("end", entry["start"] + entry.get("duration", 0.0)))
    time = STEP_S * np.arange(len(law))
    inside = (time > begin + 0.25) & (time < end - 0.05)  # the drives need a moment to follow a step
    assert np.abs(law[inside]).max() > 1.0
    np.testing.assert_allclose(more[inside], law[inside], atol=0.15 * np.abs(law).max())
    assert np.abs(law[time < begin - 0.01]).max() == 0.0
    assert np.abs(law[time > end + 0.01]).max() == 0.0
