"""Slow reversals: where they happen, how the arm gets there, and what is left out where it cannot."""

import numpy as np
import pytest

from excitation.excited_arms import limited_paper_arm, resting_series
from tauscope.excitation.constraints import StateUsage
from tauscope.excitation.slow_reversals import SlowPart, slow_part
from tauscope.trajectory import FourierSegment, FourierSeries, MotionSamples, motion_limits
from tauscope.trajectory.segments import MoveSegment, PathSegment

ROBOT = limited_paper_arm()
LIMITS = motion_limits(ROBOT).scaled(0.95)
SERIES = resting_series(np.random.default_rng(5), 3)
PATH = SERIES.evaluate(np.linspace(0.0, 10.0, 201)).position


class NearThePath(StateUsage):
    """An arm that may go nowhere but along the excitation's own path, or a little beside it."""

    def __init__(self, distance: float) -> None:
        self._distance = distance

    def largest(self, motion: MotionSamples) -> float:
        """1 at the distance that is allowed."""
        gaps = np.linalg.norm(motion.position[:, None] - PATH[None], axis=2).min(axis=1)
        return float(gaps.max()) / self._distance


def made(states: StateUsage, count: int = 3, series: FourierSeries = SERIES) -> SlowPart:
    return slow_part(ROBOT, series, LIMITS, states, count)


def test_free_arms_move_straight() -> None:
    part = made(NearThePath(10.0))
    assert part.postures == 3
    kinds = [type(segment) for segment in part.segments]
    assert kinds.count(FourierSegment) == 3
    assert PathSegment not in kinds


def test_where_the_straight_way_is_barred_the_path_is_taken() -> None:
    part = made(NearThePath(0.15))
    assert part.postures == 3
    moves = [segment for segment in part.segments if not isinstance(segment, FourierSegment)]
    assert any(isinstance(segment, PathSegment) for segment in moves)
    for segment in part.segments:
        motion = segment.evaluate(np.linspace(0.0, segment.duration_s, 999))
        assert (np.abs(motion.velocity) <= LIMITS.velocity * (1.0 + 1e-9)).all()
        assert (np.abs(motion.acceleration) <= LIMITS.acceleration * (1.0 + 1e-9)).all()
        assert NearThePath(0.15).largest(motion) <= 1.0


@pytest.mark.parametrize("distance", [0.15, 10.0])
def test_pieces_meet_and_lead_back_to_the_start(distance: float) -> None:
    part = made(NearThePath(distance))
    assert part.segments
    here = SERIES.evaluate(np.zeros(1)).position[0]
    for segment in part.segments:
        ends = segment.evaluate(np.array([0.0, segment.duration_s]))
        np.testing.assert_allclose(ends.position[0], here, atol=1e-9)
        assert np.abs(ends.velocity).max() < 1e-9
        assert np.abs(ends.acceleration).max() < 1e-9
        here = ends.position[1]
    np.testing.assert_allclose(here, SERIES.evaluate(np.zeros(1)).position[0], atol=1e-9)


def test_no_room_no_reversals() -> None:
    assert made(NearThePath(1e-4)).segments == ()
    assert made(NearThePath(1e-4)).postures == 0
    assert made(NearThePath(0.15), count=0).segments == ()


def test_moves_are_moves() -> None:
    part = made(NearThePath(10.0), count=1)
    assert [type(segment) for segment in part.segments] == [MoveSegment, FourierSegment, MoveSegment]
