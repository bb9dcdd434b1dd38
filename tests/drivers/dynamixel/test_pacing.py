"""How fast a servo goes after each goal: by the path of a target that moves so fast and no faster."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tauscope_drivers.dynamixel.configuration import ServoConfiguration
from tauscope_drivers.dynamixel.control_table import encode_items
from tauscope_drivers.dynamixel.group import paced_goals
from tauscope_drivers.dynamixel.packets import encode_sync_write
from tauscope_drivers.dynamixel.servo import JointServo, make_servo
from tauscope_drivers.goal_pace import GoalPace

CYCLE_S = 0.005
PH54, XM430, YM070 = 2020, 1020, 4030


def servo(model: int = PH54, number: int = 1) -> JointServo:
    return make_servo(number, ServoConfiguration(f"joint{number}", number), (model, 52))


class Target:
    """A servo's own target, which follows Goal Position no faster than Profile Velocity."""

    def __init__(self, model: JointServo, place: float) -> None:
        # 0.01 or 0.229 turns a minute and unit
        turns_a_minute = 0.01 if model.model.number == PH54 else 0.229
        turn = 1_003_846 if model.model.number == PH54 else 4096
        self.counts_a_second = turns_a_minute / 60.0 * turn
        self.place = place

    def follow(self, goal: int, speed: int, seconds: float) -> float:
        """Go on; the time for which it was under way."""
        most = speed * self.counts_a_second
        way = min(abs(goal - self.place), most * seconds)
        self.place += math.copysign(way, goal - self.place)
        return way / most


@pytest.mark.parametrize("speed", [0.1, 0.5, 1.9])
def test_a_servo_moves_on_evenly_one_cycle_behind_its_goals(speed: float) -> None:
    one = servo()
    pace, target = GoalPace([one], [0], [1910], CYCLE_S, 0), Target(one, 0.0)
    step = speed * CYCLE_S * 1_003_846 / (2.0 * math.pi)
    for cycle in range(1, 200):
        goal = round(cycle * step)
        (profile,) = pace.speeds([goal], round(cycle * CYCLE_S * 1e9))
        under_way = target.follow(goal, profile, CYCLE_S)
        if cycle > 20:
            assert under_way == pytest.approx(CYCLE_S), "never at rest between two goals"
            assert profile * target.counts_a_second * CYCLE_S == pytest.approx(step, abs=3.0), "at their own speed"
            assert goal - target.place == pytest.approx(step, abs=3.0)


def test_a_goal_that_is_far_is_approached_at_the_largest_speed() -> None:
    one = servo()
    pace, target, goal = GoalPace([one], [0], [500], CYCLE_S, 0), Target(one, 0.0), 60_000
    speeds = []
    for cycle in range(1, 200):
        (profile,) = pace.speeds([goal], round(cycle * CYCLE_S * 1e9))
        speeds.append(profile)
        target.follow(goal, profile, CYCLE_S)
    needed_s = 60_000 / (500 * target.counts_a_second)
    assert set(speeds[: int(needed_s / CYCLE_S) - 1]) == {500}
    assert max(speeds) == 500
    assert target.place == goal


@pytest.mark.parametrize("model", [PH54, XM430])
def test_a_host_that_is_late_stops_no_servo_and_leaves_none_behind(model: int) -> None:
    one = servo(model)
    cap = one.units.velocity_cap(2.0)
    pace, target = GoalPace([one], [0], [cap], CYCLE_S, 0), Target(one, 0.0)
    rng = np.random.default_rng(4)
    counts_a_second = 0.7 * one.model.counts_per_radian
    due = CYCLE_S * np.arange(1, 2000)
    wakes = due + np.where(rng.random(len(due)) < 0.1, 0.004 * rng.random(len(due)), 0.0)
    behind, rests = [], []
    for instant, wake, next_wake in zip(due[:-1], wakes[:-1], wakes[1:], strict=True):
        goal = round(counts_a_second * instant)
        (profile,) = pace.speeds([goal], round(wake * 1e9))
        rests.append(next_wake - wake - target.follow(goal, profile, next_wake - wake))
        behind.append(abs(goal - target.place))
    assert np.mean(rests[5:]) < 0.005 * CYCLE_S, "it is under way all the time, but for what whole units make of it"
    assert max(behind) <= 2.0 * counts_a_second * CYCLE_S
    assert np.median(behind) == pytest.approx(counts_a_second * CYCLE_S, rel=0.3)


@given(arrays(np.float64, 60, elements=st.floats(0.0, 0.85)), st.floats(-1.5, 1.5))
def test_a_late_host_does_not_change_the_speed_of_an_even_motion(late: np.ndarray, speed: float) -> None:
    """Goals are for the instants at which cycles were due: what changes with lateness is read as friction."""
    late[0] = 0.0
    one = servo()
    wakes = CYCLE_S * (np.arange(1, 61) + late)
    counts_a_second = speed * one.model.counts_per_radian
    pace, target = GoalPace([one], [0], [1910], CYCLE_S, 0), Target(one, 0.0)
    passed = []
    for cycle, (wake, next_wake) in enumerate(pairwise(wakes), start=1):
        goal = round(counts_a_second * cycle * CYCLE_S)
        (profile,) = pace.speeds([goal], round(wake * 1e9))
        target.follow(goal, profile, next_wake - wake)
        passed.append(target.place - counts_a_second * (next_wake - 2.0 * CYCLE_S))
    # whole units of Profile Velocity are upward, so that the servo is a little ahead
    unit = one.model.velocity_unit * one.model.counts_per_radian
    assert np.abs(passed[30:]).max() <= 2.0 * unit * CYCLE_S + 1.0 + 0.01 * 1910 * unit * CYCLE_S


def test_a_servo_that_stands_keeps_a_speed_for_zero_would_be_none_at_all() -> None:
    pace = GoalPace([servo(), servo(XM430, 2)], [0, 2048], [1910, 0], CYCLE_S, 0)
    for cycle in range(1, 5):
        assert min(pace.speeds([0, 2048], cycle * 5_000_000)) >= 1
    assert pace.speeds([0, 4096], 30_000_000)[1] > 100, "without a limit it goes as fast as it takes"


def test_goal_and_speed_go_out_in_one_write_where_they_are_neighbours() -> None:
    servos = [servo(XM430, 1), servo(XM430, 2), servo(YM070, 3)]
    frames = [
        encode_sync_write({key: encode_items(items, own) for key, own in values.items()}, items[0].address)
        for items, values in paced_goals(servos, [2048, 1000, -5], [41, 7, 300])
    ]
    assert len(frames) == 2
    x, y = (frame.hex(" ").upper() for frame in frames)
    # Profile Velocity 112 and Goal Position 116, eight bytes each; of Y, whose speed is elsewhere, Goal Position 532
    assert x.startswith("FF FF FD 00 FE 19 00 83 70 00 08 00 01 29 00 00 00 00 08 00 00 02 07 00 00 00 E8 03 00 00")
    assert y.startswith("FF FF FD 00 FE 0C 00 83 14 02 04 00 03 FB FF FF FF")
