"""Link placements against closed forms, and the two Denavit-Hartenberg conventions against each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope.errors import RecordingMismatchError
from tauscope.robot import JointType
from tauscope.robot.kinematics import DenavitHartenbergRow, link_placements, modified_segments, standard_segments

ANGLE = st.floats(-np.pi, np.pi)
LENGTH = st.floats(-2.0, 2.0)
ROW = st.builds(DenavitHartenbergRow, ANGLE, LENGTH, LENGTH, ANGLE, st.sampled_from(JointType))
CHAIN = st.lists(st.tuples(ROW, st.floats(-3.0, 3.0)), min_size=1, max_size=7)


def test_planar_arm_has_the_textbook_positions() -> None:
    rows = [DenavitHartenbergRow(0.0, 0.0, 0.3, 0.0), DenavitHartenbergRow(0.0, 0.0, 0.2, 0.0)]
    q = np.random.default_rng(1).uniform(-3.0, 3.0, (50, 2))
    elbow = 0.3 * np.stack([np.cos(q[:, 0]), np.sin(q[:, 0])], axis=1)
    tip = elbow + 0.2 * np.stack([np.cos(q.sum(axis=1)), np.sin(q.sum(axis=1))], axis=1)

    placements = link_placements(standard_segments(rows), q)

    assert placements.shape == (50, 2, 4, 4)
    np.testing.assert_allclose(placements[:, 0, :2, 3], elbow, atol=1e-15)
    np.testing.assert_allclose(placements[:, 1, :2, 3], tip, atol=1e-15)
    np.testing.assert_allclose(placements[:, 1, :2, 0], (tip - elbow) / 0.2, atol=1e-14)


def test_paper_arm_has_the_positions_of_its_table_1() -> None:
    rows = [
        DenavitHartenbergRow(0.0, 0.3, 0.0, np.pi / 2),
        DenavitHartenbergRow(np.pi / 2, 0.0, 0.5, 0.0),
        DenavitHartenbergRow(0.0, 0.0, 0.5, 0.0),
    ]
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (40, 3))
    upper, lower = q[:, 1] + np.pi / 2, q[:, 1] + np.pi / 2 + q[:, 2]
    reach = 0.5 * (np.cos(upper) + np.cos(lower))
    height = 0.3 + 0.5 * (np.sin(upper) + np.sin(lower))

    tip = link_placements(standard_segments(rows), q)[:, 2, :3, 3]

    expected = np.stack([reach * np.cos(q[:, 0]), reach * np.sin(q[:, 0]), height], axis=1)
    np.testing.assert_allclose(tip, expected, atol=1e-15)


def test_prismatic_joint_slides_along_z_before_the_twist() -> None:
    rows = [DenavitHartenbergRow(0.0, 0.1, 0.2, np.pi / 2, JointType.PRISMATIC)]
    placement = link_placements(standard_segments(rows), np.array([[0.7]]))[0, 0]
    np.testing.assert_allclose(placement[:3, 3], [0.2, 0.0, 0.8])
    np.testing.assert_allclose(placement[:3, :3] @ [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], atol=1e-15)


def _rotation(axis: int, angle: float) -> np.ndarray:
    transform, c, s = np.eye(4), np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    transform[i, i] = transform[j, j] = c
    transform[j, i], transform[i, j] = s, -s
    return transform


def _shift(axis: int, distance: float) -> np.ndarray:
    transform = np.eye(4)
    transform[axis, 3] = distance
    return transform


def _row_motion(row: DenavitHartenbergRow, q: float) -> np.ndarray:
    """Rz(θ) Tz(d), with the joint's position added to θ or d as the conventions define it."""
    turns = row.type is JointType.REVOLUTE
    return _rotation(2, row.theta + q * turns) @ _shift(2, row.d + q * (not turns))


@given(CHAIN)
def test_standard_convention_is_rz_tz_tx_rx(chain: list[tuple[DenavitHartenbergRow, float]]) -> None:
    frame = np.eye(4)
    placements = link_placements(standard_segments([row for row, _ in chain]), np.array([[q for _, q in chain]]))
    for j, (row, q) in enumerate(chain):
        frame = frame @ _row_motion(row, q) @ _shift(0, row.a) @ _rotation(0, row.alpha)
        np.testing.assert_allclose(placements[0, j], frame, atol=1e-12)


@given(CHAIN)
def test_modified_convention_is_rx_tx_rz_tz(chain: list[tuple[DenavitHartenbergRow, float]]) -> None:
    frame = np.eye(4)
    placements = link_placements(modified_segments([row for row, _ in chain]), np.array([[q for _, q in chain]]))
    for j, (row, q) in enumerate(chain):
        frame = frame @ _rotation(0, row.alpha) @ _shift(0, row.a) @ _row_motion(row, q)
        np.testing.assert_allclose(placements[0, j], frame, atol=1e-12)


@given(CHAIN)
def test_conventions_describe_the_same_arm_when_a_and_alpha_move_one_row_on(
    chain: list[tuple[DenavitHartenbergRow, float]],
) -> None:
    """Modified row j holds a, α of standard row j-1; the last frames then differ by Tx(a) Rx(α) of the last row."""
    rows = [row for row, _ in chain]
    q = np.array([[position for _, position in chain]])
    shifted = [
        DenavitHartenbergRow(row.theta, row.d, before.a, before.alpha, row.type)
        for row, before in zip(rows, [DenavitHartenbergRow(0.0, 0.0, 0.0, 0.0), *rows], strict=False)
    ]
    standard = link_placements(standard_segments(rows), q)[0, -1]
    modified = link_placements(modified_segments(shifted), q)[0, -1]
    end = _shift(0, rows[-1].a) @ _rotation(0, rows[-1].alpha)
    np.testing.assert_allclose(standard, modified @ end, atol=1e-12)


def test_positions_of_another_arm_are_refused() -> None:
    segments = standard_segments([DenavitHartenbergRow(0.0, 0.0, 0.3, 0.0)])
    for q in (np.zeros((5, 2)), np.zeros(5)):
        with pytest.raises(RecordingMismatchError, match="1 joints"):
            link_placements(segments, q)


def test_no_samples_give_no_placements() -> None:
    segments = standard_segments([DenavitHartenbergRow(0.0, 0.0, 0.3, 0.0)])
    assert link_placements(segments, np.zeros((0, 1))).shape == (0, 1, 4, 4)
