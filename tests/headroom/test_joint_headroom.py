"""A black box finds a law that is there, nothing in noise, and learns nothing of held-out torque."""

from dataclasses import replace

import numpy as np
import pytest

from headroom.black_box_rows import Law, motion, recordings, with_torque
from tauscope.headroom import joint_headroom as joint_headroom_module
from tauscope.headroom import learners
from tauscope.headroom.entries import REFUTES_FROM
from tauscope.headroom.joint_headroom import (
    FOLDS,
    Choice,
    choose_black_box,
    compare_residuals,
    fold_numbers,
    joint_headroom,
)
from tauscope.headroom.learners import LEARNERS, Learner
from tauscope.headroom.motion_rows import Inputs, MotionRows, joint_inputs, travel_since_reversal
from tauscope.recording.recording import Array

NOISE = 0.1


def spring(rows: MotionRows) -> Array:
    return 0.2 * rows.position[0]


def load_friction(rows: MotionRows) -> Array:
    return 0.1 * np.abs(rows.load[0]) * np.tanh(20.0 * rows.velocity[0])


def cogging(rows: MotionRows) -> Array:
    return 0.15 * np.sin(6.0 * rows.position[0])


def coupling(rows: MotionRows) -> Array:
    return 0.15 * np.tanh(10.0 * (rows.velocity[0] + rows.velocity[1]))


def nothing(rows: MotionRows) -> Array:
    return np.zeros(len(rows.time))


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Smaller learners, where their size is not what is asked."""
    monkeypatch.setattr(learners, "TREES", (5, 20))
    monkeypatch.setattr(learners, "LANDMARKS", 60)


@pytest.mark.slow
@pytest.mark.parametrize("law", [load_friction, spring, cogging, coupling])
def test_a_hidden_law_is_predicted_near_its_true_share(law: Law) -> None:
    training, held_out = recordings(law, NOISE, seed=1)
    truth = float(np.sum(law(held_out[0]) ** 2))
    found = joint_headroom(training, held_out, 0)
    true_share = truth / (truth + NOISE**2 * len(held_out[0].time))
    assert found.is_significant
    assert 0.8 * true_share < found.share < true_share + 2.0 * found.share_std
    assert 0.95 * NOISE < found.black_box < found.explained == found.plain


@pytest.mark.slow
@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 50), marks=pytest.mark.proof)], ids=len)
def test_noise_is_never_predicted(seeds: range) -> None:
    for seed in seeds:
        training, held_out = recordings(nothing, NOISE, seed, count=1, duration_s=12.0)
        found = joint_headroom(training, held_out, 0)
        assert not (found.is_significant and found.share > REFUTES_FROM), seed


@pytest.mark.usefixtures("small")
def test_held_out_torque_is_not_learned() -> None:
    """Held-out torque in another order: what a black box knew of it would show as a gain."""
    training, held_out = recordings(load_friction, NOISE, seed=2)
    rng = np.random.default_rng(0)
    shuffled = [replace(each, torque=rng.permuted(each.torque, axis=1)) for each in held_out]
    found = joint_headroom(training, shuffled, 0)
    assert found.share < 0.0


@pytest.mark.slow
@pytest.mark.usefixtures("small")
def test_a_law_that_changes_with_the_recording_is_no_gain() -> None:
    rng = np.random.default_rng(4)
    made = [motion(seed, place) for place, seed in enumerate((5, 6, 7))]
    slopes = rng.permutation([1.0, -1.0, 0.3])
    rows = [with_torque(each, nothing, slope * each.position[0]) for each, slope in zip(made, slopes, strict=True)]
    found = joint_headroom(rows[:2], rows[2:], 0)
    assert not (found.is_significant and found.share > REFUTES_FROM)


@pytest.mark.usefixtures("small")
def test_the_black_box_learns_what_the_findings_leave() -> None:
    training, held_out = recordings(spring, NOISE, seed=3)
    training, held_out = (
        [replace(each, explained=np.stack([spring(each), np.zeros(len(each.time))])) for each in part]
        for part in (training, held_out)
    )
    found = joint_headroom(training, held_out, 0)
    assert found.explained == pytest.approx(NOISE, rel=0.1)
    assert found.plain > 1.2 * NOISE
    assert found.share < 0.05


def test_the_standard_error_is_that_of_independent_blocks() -> None:
    rng = np.random.default_rng(2)
    blocks = np.repeat(np.arange(20), 50)
    shares, errors = [], []
    for _ in range(300):
        explained = rng.standard_normal(1000)
        found = compare_residuals(explained, explained, explained - 0.2 * rng.standard_normal(1000), blocks)
        shares.append(found.share)
        errors.append(found.share_std)
    assert np.mean(errors) == pytest.approx(np.std(shares), rel=0.1)


def test_one_block_proves_nothing() -> None:
    residual = np.ones(100)
    assert not compare_residuals(residual, residual, 0.1 * residual, np.zeros(100, dtype=np.intp)).is_significant


@pytest.mark.usefixtures("small")
def test_rows_that_were_not_measured_count_nowhere() -> None:
    training, held_out = recordings(spring, NOISE, seed=6)

    def spoil(rows: MotionRows) -> MotionRows:
        used, torque = rows.used.copy(), rows.torque.copy()
        used[:, 100:160], torque[:, 100:160] = False, 1e3
        return replace(rows, used=used, torque=torque)

    found = joint_headroom([spoil(each) for each in training], [spoil(each) for each in held_out], 0)
    assert found.plain < 1.0
    assert found.share > 0.3


def test_too_few_rows_teach_nothing() -> None:
    training, held_out = recordings(spring, NOISE, seed=7)
    few = [replace(each, used=each.used & (np.arange(each.used.shape[1]) < 30)) for each in training]
    found = joint_headroom(few, held_out, 0)
    assert np.isnan(found.share)
    assert np.isnan(found.black_box)
    assert not found.is_significant


def test_many_rows_are_thinned_evenly(monkeypatch: pytest.MonkeyPatch) -> None:
    training, held_out = recordings(spring, 0.0, seed=8)
    seen: list[Array] = []

    def choose(inputs: Inputs, *_: object) -> Choice:
        seen.append(inputs.columns[:, 0])
        return Choice(1.0)

    monkeypatch.setattr(joint_headroom_module, "MOST_ROWS", 240)
    monkeypatch.setattr(joint_headroom_module, "choose_black_box", choose)
    joint_headroom(training, held_out, 0)
    every = np.concatenate([each.position[0] for each in training])
    places = np.flatnonzero(np.isin(every, seen[0]))
    assert len(places) == 240
    assert set(np.diff(places)) == {10, 11}
    assert (places[0], places[-1]) == (0, len(every) - 1)


def test_folds_are_parts_of_the_motion_and_recordings() -> None:
    several = [motion(place, place) for place in range(3)]
    by_part, by_recording = fold_numbers(several)
    np.testing.assert_array_equal(by_recording, np.repeat([0, 1, 2], len(several[0].time)))
    np.testing.assert_array_equal(by_part, np.tile(by_part[: len(several[0].time)], 3))
    assert sorted(set(by_part)) == list(range(FOLDS))
    (alone,) = fold_numbers(several[:1])
    assert np.all(np.diff(alone) >= 0)


def test_without_a_second_fold_nothing_is_chosen() -> None:
    rows = motion(1, 0)
    folds = np.zeros(len(rows.time), dtype=np.intp)
    assert choose_black_box(joint_inputs(rows, 0), rows.position[0], [folds], LEARNERS).members == ()


def test_inputs_begin_with_the_joints_own() -> None:
    rows = motion(1, 0)
    found = joint_inputs(rows, 1)
    np.testing.assert_array_equal(found.columns[:, :4].T, np.stack([rows.position[1], *_rest(rows, 1)]))
    np.testing.assert_array_equal(found.columns[1:, 4], rows.velocity[1, :-1])
    np.testing.assert_array_equal(found.columns[:-1, 5], rows.velocity[1, 1:])
    np.testing.assert_array_equal(found.columns[:, found.own], rows.position[0])


def _rest(rows: MotionRows, joint: int) -> list[Array]:
    return [each[joint] for each in (rows.velocity, rows.acceleration, rows.load)]


def test_travel_begins_anew_at_every_reversal() -> None:
    position = np.array([0.0, 1.0, 2.0, 1.5, 0.5, 0.6, 1.6])
    velocity = np.array([1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0])
    np.testing.assert_allclose(travel_since_reversal(position, velocity), [0.0, 1.0, 2.0, 0.0, -1.0, 0.0, 1.0])


@pytest.mark.parametrize("learner", LEARNERS)
def test_a_column_that_never_changes_is_ignored(learner: Learner) -> None:
    rows = motion(1, 0)
    inputs = joint_inputs(replace(rows, load=np.full_like(rows.load, 0.1)), 0)
    predictions = learner.predict(inputs, rows.position[0], inputs)
    assert all(np.isfinite(each).all() for each in predictions.values())


@pytest.mark.parametrize("learner", LEARNERS)
def test_motion_beyond_the_training_range_is_not_extrapolated(learner: Learner) -> None:
    rows = motion(1, 0)
    target = np.sin(rows.position[0])
    far = replace(rows, position=10.0 * rows.position, velocity=10.0 * rows.velocity)
    predictions = learner.predict(joint_inputs(rows, 0), target, joint_inputs(far, 0))
    assert all(np.abs(each).max() < 4.0 for each in predictions.values())
