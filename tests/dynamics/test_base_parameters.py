"""Base parameters: the paper's Table 2, and what must hold for any arm."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from arms import (
    arm,
    dh_segment,
    emps_like,
    panda_like,
    paper_arm,
    paper_parameters,
    random_arm,
    random_parameters,
    random_states,
    ur5_like,
)
from tauscope.dynamics.base_parameters import RIGHT_ANGLE, base_parameters
from tauscope.dynamics.regressor import torque_regressor
from tauscope.robot.robot import STANDARD_PARAMETERS, JointType, Robot
from tauscope.robot.robot_file import read_robot

TABLE_2 = {
    "Ixx2 - Iyy2 - 0.5*msx2": np.sqrt(2) / 24,
    "Ixx3 - Iyy3 - 0.5*msx3": np.sqrt(2) / 24,
    "Ixy2": 0.0,
    "Ixy3": 0.0,
    "Iyy1 + Iyy2 + Iyy3 + 0.5*msx2 + 0.5*msx3": -np.sqrt(2) / 12,
    "Ixz2 - 0.5*msz2 - 0.5*msz3": 0.0,
    "Ixz3 - 0.5*msz3": 0.0,
    "Iyz2": 0.0,
    "Iyz3": 0.0,
    "Izz2 + 0.5*msx2": -np.sqrt(2) / 24,
    "Izz3 + 0.5*msx3": -np.sqrt(2) / 24,
    "m2 + 2*msx2 - 2*msx3": np.sqrt(2),
    "m3 + 2*msx3": np.sqrt(2) / 2,
    "msy2": 0.0,
    "msy3": 0.0,
}
"""The paper prints these to three digits: 0.059, -0.117 (cut, not rounded), 1.414, 0.707."""

EXPECTED_COUNTS = {"kuka-lwr4": 43, "franka-panda": 43, "staubli-tx40": 36, "double-pendulum": 6, "emps": 1}
ARMS = given(seed=st.integers(0, 2**32 - 1), joint_count=st.integers(1, 7))


def fresh_regressor(robot: Robot, samples: int = 40) -> np.ndarray:
    """Φ at states that `base_parameters` has not seen, (N n, 10 n)."""
    phi = torque_regressor(robot, *random_states(np.random.default_rng(99), samples, robot.joint_count))
    return phi.reshape(-1, phi.shape[-1])


def scaled_singular_values(phi: np.ndarray) -> np.ndarray:
    """Singular values, the largest first and of size one, of the columns scaled to length one."""
    lengths = np.linalg.norm(phi, axis=0)
    kept = lengths > 1e-10 * lengths.max()
    values = np.linalg.svd(phi[:, kept] / lengths[kept], compute_uv=False)
    return values / values[0]


def numerical_rank(phi: np.ndarray) -> int:
    """Rank by singular values."""
    return int(np.sum(scaled_singular_values(phi) > 1e-9))


def assert_same_torques(robot: Robot, relative: float) -> None:
    """K = L B, and Φ Θ = L Θ*, at states that `base_parameters` has not seen."""
    parameters = random_parameters(np.random.default_rng(4), robot.joint_count)
    base, phi = base_parameters(robot), fresh_regressor(robot)
    leading, bound = phi[:, base.independent_columns], relative * np.abs(phi).max()
    np.testing.assert_allclose(phi[:, base.dependent_columns], leading @ base.combination, rtol=0, atol=bound)
    np.testing.assert_allclose(phi[:, base.unidentifiable_columns], 0.0, rtol=0, atol=bound)
    torque = phi @ parameters
    assert np.abs(leading @ base.project(parameters) - torque).max() <= relative * np.abs(torque).max()


@pytest.mark.parametrize(
    ("alpha", "theta"), [(np.pi / 2, np.pi / 2), (1.5707963, 1.5708), (1.570796, 1.57), (1.5708, 1.5708)]
)
def test_table_2_with_right_angles_of_any_number_of_digits(alpha: float, theta: float) -> None:
    base = base_parameters(paper_arm(alpha, theta))
    values = base.project(paper_parameters())
    assert set(base.expressions) == set(TABLE_2)
    for expression, value in zip(base.expressions, values, strict=True):
        assert value == pytest.approx(TABLE_2[expression], abs=1e-12)


def test_terms_of_table_2_are_exact() -> None:
    base = base_parameters(paper_arm())
    terms = dict(zip(base.names, base.terms, strict=True))
    assert terms["Iyy1"] == {"Iyy1": 1.0, "Iyy2": 1.0, "Iyy3": 1.0, "msx2": 0.5, "msx3": 0.5}
    assert terms["Ixx2"] == {"Ixx2": 1.0, "Iyy2": -1.0, "msx2": -0.5}
    assert terms["m2"] == {"m2": 1.0, "msx2": 2.0, "msx3": -2.0}
    assert next(iter(terms["m2"])) == "m2"


def test_the_papers_independent_and_unidentifiable_parameters() -> None:
    base = base_parameters(paper_arm())
    alone = {name for index, name in enumerate(base.names) if base.is_independent(index)}
    assert alone == {"Ixy2", "Ixy3", "Iyz2", "Iyz3", "msy2", "msy3"}
    assert base.unidentifiable == tuple(f"{name}1" for name in STANDARD_PARAMETERS if name != "Iyy")


@ARMS
def test_the_rank_is_that_of_the_singular_values(seed: int, joint_count: int) -> None:
    robot = random_arm(np.random.default_rng(seed), joint_count)
    phi = fresh_regressor(robot)
    values = scaled_singular_values(phi)
    assume(not np.any((values > 1e-12) & (values < 1e-6)))  # Else the rank is a matter of opinion.
    assert len(base_parameters(robot).names) == numerical_rank(phi)


@pytest.mark.parametrize("robot", [paper_arm(), ur5_like(), panda_like(), emps_like()])
def test_base_parameters_of_known_arms_give_the_same_torques(robot: Robot) -> None:
    assert_same_torques(robot, 1e-12)


@ARMS
def test_base_parameters_of_random_arms_give_the_same_torques(seed: int, joint_count: int) -> None:
    robot = random_arm(np.random.default_rng(seed), joint_count)
    leading = fresh_regressor(robot)[:, base_parameters(robot).independent_columns]
    # Rounding grows with the condition number, which random axes that happen to be nearly parallel raise to 1e6.
    condition = float(np.linalg.cond(leading / np.linalg.norm(leading, axis=0)))
    assert_same_torques(robot, max(3e-8, 1e-14 * condition))


@ARMS
def test_every_column_is_sorted_into_one_of_three_kinds(seed: int, joint_count: int) -> None:
    base = base_parameters(random_arm(np.random.default_rng(seed), joint_count))
    kinds = [base.independent_columns, base.dependent_columns, base.unidentifiable_columns]
    np.testing.assert_array_equal(np.sort(np.concatenate(kinds)), np.arange(10 * joint_count))


@pytest.mark.parametrize("robot", [paper_arm(), ur5_like(), panda_like(), emps_like()])
def test_leading_columns_are_the_leftmost(robot: Robot) -> None:
    """As in a row echelon form, a column is a combination of leading columns to its left only."""
    base = base_parameters(robot)
    to_the_right = base.independent_columns[:, None] > base.dependent_columns[None, :]
    assert not base.combination[to_the_right].any()


@pytest.mark.parametrize("robot", [paper_arm(), ur5_like(), panda_like(), random_arm(np.random.default_rng(3), 6)])
def test_the_random_states_do_not_matter(robot: Robot) -> None:
    first = base_parameters(robot)
    for seed in (1, 2, 2**31):
        other = base_parameters(robot, seed=seed)
        assert other.expressions == first.expressions
        assert other.unidentifiable == first.unidentifiable
        np.testing.assert_allclose(other.combination, first.combination, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("make", "count"), [(ur5_like, 36), (panda_like, 43)])
@pytest.mark.parametrize("alpha", [1.570796327, 1.5707963, 1.570796, 1.5708])
def test_a_right_angle_with_few_digits_is_a_right_angle(make, count: int, alpha: float) -> None:
    exact, rounded = base_parameters(make()), base_parameters(make(alpha))
    assert len(exact.names) == count
    assert rounded.expressions == exact.expressions
    assert_same_torques(make(alpha), RIGHT_ANGLE)


@pytest.mark.parametrize("alpha", [1.571, 1.57, 1.5705, 1.56])
def test_nearly_parallel_axes_leave_the_leading_columns_well_conditioned(alpha: float) -> None:
    """Too far off to be taken for right angles: the geometry counts as it is given, to 1e-8 of a column."""
    robot = ur5_like(alpha)
    base = base_parameters(robot)
    assert base.names == base_parameters(ur5_like()).names
    assert_same_torques(robot, 1e-8)
    leading = fresh_regressor(robot)[:, base.independent_columns]
    assert np.linalg.cond(leading / np.linalg.norm(leading, axis=0)) < 20
    assert np.abs(base.combination).max() < 3


def pendulum(tilt: float) -> Robot:
    """Two hinges, the second one's axis tilted against the first's; gravity in the plane of motion."""
    return arm("pendulum", [dh_segment(0.0, 0.0, 0.3, tilt), dh_segment(0.0, 0.0, 0.2, 0.0)], (9.81, 0.0, 0.0))


def test_a_real_tilt_counts_and_a_rounded_angle_does_not() -> None:
    parallel = base_parameters(pendulum(0.0))
    assert parallel.expressions == (
        "Izz1 + 0.3*msx1",
        "m1 + 3.33333*msx1 - 5*msx2",
        "msy1",
        "Izz2 + 0.2*msx2",
        "m2 + 5*msx2",
        "msy2",
    )
    assert base_parameters(pendulum(1.5708 - np.pi / 2)).expressions == parallel.expressions
    for tilt in (1e-2, 0.5):
        count = len(base_parameters(pendulum(tilt)).names)
        assert count == numerical_rank(fresh_regressor(pendulum(tilt))) > len(parallel.names)


def test_one_horizontal_slide_shows_its_mass_only() -> None:
    base = base_parameters(emps_like())
    assert base.expressions == ("m1",)
    assert base.is_independent(0)
    assert base.unidentifiable == tuple(f"{name}1" for name in STANDARD_PARAMETERS if name != "m")
    assert base.project(np.arange(10.0)) == pytest.approx([6.0])


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), (0.0, 1e-9, -9.81)])
def test_one_hinge_about_the_vertical_shows_one_inertia_only(gravity: tuple[float, float, float]) -> None:
    robot = arm("turntable", [dh_segment(0.0, 0.1, 0.0, 1.5707963)], gravity)
    assert base_parameters(robot).expressions == ("Iyy1",)


def test_a_gantry_of_three_slides_shows_three_masses() -> None:
    rows = ((0.0, np.pi / 2), (np.pi / 2, np.pi / 2), (0.0, 0.0))
    slides = [dh_segment(theta, 0.0, 0.0, alpha, JointType.PRISMATIC) for theta, alpha in rows]
    assert base_parameters(arm("gantry", slides)).expressions == ("m1", "m2", "m3")


def test_without_gravity_less_is_seen() -> None:
    floating = replace(paper_arm(), gravity=np.zeros(3))
    assert len(base_parameters(floating).names) == numerical_rank(fresh_regressor(floating))
    assert len(base_parameters(floating).names) < len(TABLE_2)


@pytest.mark.parametrize("name", EXPECTED_COUNTS)
def test_counts_of_real_arms(name: str, shared_data: Path) -> None:
    robot = read_robot(shared_data / name / "robot.yaml")
    assert len(base_parameters(robot).names) == EXPECTED_COUNTS[name]
