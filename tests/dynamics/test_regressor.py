"""The regressor against Pinocchio, and against itself."""

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arms import emps_like, panda_like, paper_arm, random_arm, random_parameters, random_states, ur5_like
from pinocchio_arm import pinocchio_model, pinocchio_regressor
from tauscope.dynamics.regressor import CHUNK, TorqueRegressor, torque_regressor

SEEDS = st.integers(0, 2**32 - 1)
KNOWN_ARMS = {
    "paper": paper_arm(),
    "ur5": ur5_like(),
    "ur5 with few digits": ur5_like(1.5707963),
    "panda": panda_like(1.570796327),
    "emps": emps_like(),
}


def assert_same(actual: np.ndarray, expected: np.ndarray) -> None:
    """Equal to 1e-9 of the largest entry."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


@given(seed=SEEDS, joint_count=st.integers(1, 7))
def test_every_column_is_pinocchios_on_random_chains(seed: int, joint_count: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_arm(rng, joint_count)
    states = random_states(rng, 5, joint_count)
    assert_same(torque_regressor(robot, *states), pinocchio_regressor(robot, *states))


@pytest.mark.parametrize("name", KNOWN_ARMS)
def test_every_column_is_pinocchios_on_known_arms(name: str) -> None:
    robot = KNOWN_ARMS[name]
    states = random_states(np.random.default_rng(1), 50, robot.joint_count)
    assert_same(torque_regressor(robot, *states), pinocchio_regressor(robot, *states))


@pytest.mark.parametrize("name", KNOWN_ARMS)
def test_a_sample_alone_is_what_it_is_among_others(name: str) -> None:
    """As a controller asks for it, one at a time; NumPy 2.4 negates columns of one sample in place wrongly."""
    robot = KNOWN_ARMS[name]
    q, qd, qdd = random_states(np.random.default_rng(1), 1, robot.joint_count)
    assert_same(torque_regressor(robot, q, qd, qdd), pinocchio_regressor(robot, q, qd, qdd))


@pytest.mark.parametrize("joint_count", range(1, 8))
def test_torques_are_those_of_pinocchios_recursive_newton_euler(joint_count: int) -> None:
    rng = np.random.default_rng(joint_count)
    robot, parameters = random_arm(rng, joint_count), random_parameters(rng, joint_count)
    states = random_states(rng, 50, joint_count)
    model = pinocchio_model(robot, parameters)
    data = model.createData()
    expected = np.array([pinocchio.rnea(model, data, *state) for state in zip(*states, strict=True)])
    assert_same(torque_regressor(robot, *states) @ parameters, expected)


@pytest.mark.parametrize("turns", [0.5, 1.0, -1.0, 7.5, 1000.25])
def test_positions_of_half_turns_and_many_turns(turns: float) -> None:
    robot = ur5_like()
    q, qd, qdd = random_states(np.random.default_rng(2), 4, 6)
    q[:] = 2 * np.pi * turns
    assert_same(torque_regressor(robot, q, qd, qdd), pinocchio_regressor(robot, q, qd, qdd))


def test_a_link_loads_only_the_joints_that_carry_it() -> None:
    robot = random_arm(np.random.default_rng(3), 5)
    phi = torque_regressor(robot, *random_states(np.random.default_rng(4), 20, 5))
    for link in range(5):
        assert not phi[:, link + 1 :, 10 * link : 10 * link + 10].any()


@given(seed=SEEDS, joint_count=st.integers(1, 6), data=st.data())
def test_some_columns_are_those_of_the_whole(seed: int, joint_count: int, data: st.DataObject) -> None:
    chosen = data.draw(st.sets(st.integers(0, 10 * joint_count - 1)))
    columns = np.array(sorted(chosen), dtype=np.intp)
    rng = np.random.default_rng(seed)
    robot = random_arm(rng, joint_count)
    states = random_states(rng, 7, joint_count)
    part = torque_regressor(robot, *states, columns=columns)
    assert part.shape == (7, joint_count, len(columns))
    np.testing.assert_array_equal(part, torque_regressor(robot, *states)[:, :, columns])


@pytest.mark.parametrize("chunk", [1, 3, 8, 100, 101])
def test_the_chunk_size_does_not_matter(chunk: int) -> None:
    robot = random_arm(np.random.default_rng(5), 4)
    states = random_states(np.random.default_rng(6), 100, 4)
    out = np.full((4, 40, 100), np.nan)
    TorqueRegressor(robot, chunk=chunk).write(*states, out)
    assert_same(out.transpose(2, 0, 1), torque_regressor(robot, *states))


def test_more_samples_than_one_chunk() -> None:
    robot = paper_arm()
    states = random_states(np.random.default_rng(7), 2 * CHUNK + 7, 3)
    phi = torque_regressor(robot, *states)
    some = np.array([0, CHUNK - 1, CHUNK, 2 * CHUNK - 1, 2 * CHUNK, 2 * CHUNK + 6])
    assert_same(phi[some], pinocchio_regressor(robot, *(array[some] for array in states)))


def test_write_fills_a_part_of_a_larger_buffer_and_nothing_else() -> None:
    robot = ur5_like()
    states = random_states(np.random.default_rng(8), 30, 6)
    columns = np.arange(3, 60, 4)
    buffer = np.full((6, len(columns), 50), np.nan)
    TorqueRegressor(robot, columns=columns).write(*states, buffer[:, :, 10:40])
    assert np.isnan(buffer[:, :, :10]).all()
    assert np.isnan(buffer[:, :, 40:]).all()
    assert_same(buffer[:, :, 10:40].transpose(2, 0, 1), torque_regressor(robot, *states, columns=columns))


def test_one_object_serves_several_recordings() -> None:
    robot = panda_like()
    regressor = TorqueRegressor(robot, chunk=16)
    for seed, samples in ((9, 40), (10, 5), (11, 16)):
        states = random_states(np.random.default_rng(seed), samples, 7)
        out = np.empty((7, 70, samples))
        regressor.write(*states, out)
        assert_same(out.transpose(2, 0, 1), torque_regressor(robot, *states))


def test_samples_are_adjacent_in_memory() -> None:
    phi = torque_regressor(paper_arm(), *random_states(np.random.default_rng(12), 10, 3))
    assert phi.transpose(1, 2, 0).flags.c_contiguous


def test_a_missed_sample_leaves_the_others_alone() -> None:
    robot = paper_arm()
    states = random_states(np.random.default_rng(13), 10, 3)
    expected = torque_regressor(robot, *states)
    states[0][4] = np.nan
    phi = torque_regressor(robot, *states)
    np.testing.assert_array_equal(np.delete(phi, 4, axis=0), np.delete(expected, 4, axis=0))
    assert np.isnan(phi[4]).any()


def test_no_samples() -> None:
    nothing = np.empty((0, 3))
    assert torque_regressor(paper_arm(), nothing, nothing, nothing).shape == (0, 3, 30)


def test_the_callers_numpy_settings_and_arrays_are_left_alone() -> None:
    states = random_states(np.random.default_rng(14), 10, 3)
    before, size = [array.copy() for array in states], np.getbufsize()
    torque_regressor(paper_arm(), *states)
    assert np.getbufsize() == size
    for array, copy in zip(states, before, strict=True):
        np.testing.assert_array_equal(array, copy)


def test_a_result_of_any_size_has_its_zeros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Large results are made of new memory, small ones of memory that was used before."""
    robot = panda_like()
    states = random_states(np.random.default_rng(15), 30, 7)
    small = torque_regressor(robot, *states)
    monkeypatch.setattr("tauscope.dynamics.regressor._FRESH_MEMORY", 0)
    np.testing.assert_array_equal(torque_regressor(robot, *states), small)
