"""Every damage is found, counted and mended; a sound recording is left alone."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import assume, example, given, note, settings
from hypothesis import strategies as st

from identification.simulated import PAPER_NOISE, paper_robot, simulate
from recording.examination.damages import (
    DAMAGES,
    Channels,
    drop_long,
    freeze_positions,
    hold_all,
    hold_efforts,
    queue_samples,
    reset_encoder,
    spike_efforts,
    spike_positions,
    wrap_angles,
)
from recording.examination.sound_arms import record_sound_arm
from recording.recording_files import message_of
from tauscope.errors import TauscopeError
from tauscope.identification import document, identify
from tauscope.recording import Recording, check_recording, examine_recording, open_recording
from tauscope.recording.examination.examine import mend_recording

ROBOT = paper_robot()
ARM, JUDGE = simulate(ROBOT, seed=1), simulate(ROBOT, seed=2)
BASE = ARM.recording(ARM.white(PAPER_NOISE, np.random.default_rng(0)), ARM.white(1e-5, np.random.default_rng(3)))
HELD_OUT = JUDGE.recording(JUDGE.white(PAPER_NOISE, np.random.default_rng(5)))
Damage = Callable[[Channels, np.random.Generator], None]
SLOW: dict[Damage, int] = {hold_efforts: 4, hold_all: 3}
"""Damages that lower the rate of a recording, and by how much."""


def measure_held_out_error(recording: Recording) -> float:
    fit = document(identify(ROBOT, [recording], [HELD_OUT])).fit.held_out
    assert fit is not None
    return fit.relative_error


@cache
def measure_error_at_rate(step: int) -> float:
    """Error of the sound recording at a lower rate."""
    channels = Channels.of(BASE)
    channels.keep(np.arange(0, len(channels.time), step))
    return measure_held_out_error(read_text(channels.csv()))


SOURCE: set[Damage] = {reset_encoder, wrap_angles, spike_positions, spike_efforts}
"""Damages of encoders and drives: a slow controller holds what they report."""


def require_one_line(error: TauscopeError) -> None:
    assert len(str(error).splitlines()) == 1


def read_text(text: str) -> Recording:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "damaged.csv"
        path.write_text(text, encoding="utf-8")
        return open_recording(path, ROBOT)


def write_damaged(damage: Damage, seed: int, rows: int = len(BASE)) -> str:
    channels = Channels.of(BASE)
    channels.keep(np.arange(rows))
    damage(channels, np.random.default_rng(seed))
    return channels.csv()


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_a_damage_is_named_and_costs_little(damage: Damage) -> None:
    recording = read_text(write_damaged(damage, 1))
    assert DAMAGES[damage] in {warning.code for warning in recording.warnings}
    sound = measure_error_at_rate(SLOW.get(damage, 1))
    assert measure_held_out_error(recording) < 1.2 * sound


@given(seed=st.integers(0, 2**31), times=st.integers(1, 3))
def test_no_row_keeps_a_stamp_that_is_not_its_own(seed: int, times: int) -> None:
    channels, rng = Channels.of(BASE), np.random.default_rng(seed)
    own = channels.time.copy()
    for _ in range(times):
        queue_samples(channels, rng)
    samples = read_text(channels.csv()).samples()
    kept = np.isfinite(samples.position).all(axis=1)
    assert np.abs(samples.time - own)[kept].max() < 0.5 * (own[1] - own[0])
    assert kept.mean() > 1.0 - 0.1 * times


@given(damage=st.sampled_from(list(DAMAGES)), seed=st.integers(0, 2**31))
def test_a_damage_is_named_wherever_it_is(damage: Damage, seed: int) -> None:
    codes = {warning.code for warning in read_text(write_damaged(damage, seed, 1200)).warnings}
    assert DAMAGES[damage] in codes


@pytest.mark.proof
@pytest.mark.timeout(1800)
@settings(max_examples=1000, deadline=None)
@given(damages=st.lists(st.sampled_from(list(DAMAGES)), min_size=1, max_size=2), seed=st.integers(0, 2**31))
@example(damages=[reset_encoder, freeze_positions], seed=247598171)  # the reset follows the frozen rows at once
@example(damages=[queue_samples, queue_samples], seed=3)  # more than a tenth of the rows waited
def test_damages_end_in_a_line_or_in_a_result_as_good(damages: list[Damage], seed: int) -> None:
    assume(len(set(damages) & set(SLOW)) < 2)
    channels, rng = Channels.of(BASE), np.random.default_rng(seed)
    for damage in sorted(damages, key=lambda damage: 0 if damage in SOURCE else 1 if damage in SLOW else 2):
        damage(channels, rng)
    try:
        recording = read_text(channels.csv())
        result = measure_held_out_error(recording)
    except TauscopeError as error:
        require_one_line(error)
        return
    codes = {warning.code for warning in recording.warnings}
    undone = len(set(damages)) < len(damages)  # a damage that is done twice may undo itself
    assert undone or any(DAMAGES[damage] in codes for damage in damages)
    slowest = max(SLOW.get(damage, 1) for damage in damages)
    note(f"{[damage.__name__ for damage in damages]}, seed {seed}: {[warning.text for warning in recording.warnings]}")
    assert result < 1.2 * max(measure_error_at_rate(slowest), measure_error_at_rate(1))


@given(seed=st.integers(0, 2**31))
@example(seed=7943)  # an effort in coarse steps rests while it turns
def test_a_sound_recording_is_left_alone(seed: int) -> None:
    sound = record_sound_arm(seed)
    mended = mend_recording(sound.recording, sound.robot)
    # A peak of fast motion at 30 Hz may be one sample high: a few rows are no loss.
    assert {note.code for note in mended.notes} <= {"spikes"}
    missed = np.isnan(mended.samples().effort).sum() + np.isnan(mended.samples().position).sum()
    assert missed <= 0.004 * mended.samples().effort.size


def test_blocks_read_alike() -> None:
    for damage in DAMAGES:
        recording = read_text(write_damaged(damage, 3))
        whole = recording.samples()
        for start, stop in ((0, 7), (100, 900), (1033, 1034), (2900, 3100), (50, 50)):
            part = recording.samples(start, stop)
            np.testing.assert_array_equal(part.position, whole.position[start:stop])
            np.testing.assert_array_equal(part.effort, whole.effort[start:stop])


def test_a_long_recording_is_mended_across_blocks() -> None:
    time = np.arange(100_000) / 500.0
    rng = np.random.default_rng(4)
    position = np.column_stack([np.sin(time), 2.0 * np.cos(0.7 * time)])
    effort = 10.0 * np.cos(position) + 0.05 * rng.normal(size=position.shape)
    wrapped = position.copy()
    wrapped[:, 1] = np.mod(2.0 * time, 2.0 * np.pi)
    effort[32_760:32_780] = 0.0
    wrapped[65_530, 0] += 3.0
    mended = examine_recording(Recording.from_arrays("long", time, wrapped, effort))
    assert {warning.code for warning in mended.warnings} == {"wrapped-angle", "effort-dropouts", "spikes"}
    samples = mended.samples()
    steps = np.diff(samples.position[:, 1])
    assert np.abs(steps).max() < 0.01
    assert np.flatnonzero(np.isnan(samples.effort[:, 0])).tolist() == list(range(32_760, 32_780))
    assert np.flatnonzero(np.isnan(samples.position[:, 0])).tolist() == [65_530]


def test_an_arm_that_swings_freely_keeps_its_zeros() -> None:
    channels = Channels.of(BASE)
    channels.effort[1500:] = 0.0
    assert read_text(channels.csv()).warnings == ()
    channels.position[1500:] = channels.position[1500]
    codes = {warning.code for warning in read_text(channels.csv()).warnings}
    assert "effort-dropouts" in codes  # it stands on its brakes


def test_zeros_on_the_way_from_one_sign_to_the_other_are_measured() -> None:
    channels = Channels.of(BASE)
    channels.effort[:, 0] = 0.01 * np.rint(100.0 * channels.effort[:, 0])
    for start in range(200, 2800, 400):  # forth, rest without load, back
        channels.effort[start - 50 : start, 0] = 20.0 + channels.effort[start - 50 : start, 0] / 100.0
        channels.effort[start : start + 50, 0] = 0.0
        channels.effort[start + 50 : start + 100, 0] = channels.effort[start + 50 : start + 100, 0] / 100.0 - 20.0
    assert "effort-dropouts" not in {warning.code for warning in read_text(channels.csv()).warnings}


def test_motion_during_a_pause_of_the_logger_is_no_jump() -> None:
    channels = Channels.of(BASE)
    channels.keep(np.r_[0:1000, 1400 : len(channels.time)])
    assert np.abs(channels.position[1000] - channels.position[999]).max() > 0.5
    assert read_text(channels.csv()).warnings == ()


def test_steps_of_torque_are_no_held_samples() -> None:
    channels = Channels.of(BASE)
    levels = np.random.default_rng(6).uniform(-20.0, 20.0, channels.effort.shape)
    channels.effort = levels[np.arange(len(levels)) // 80]
    assert read_text(channels.csv()).warnings == ()


def test_a_held_spike_is_a_spike_and_a_long_hold_is_not_stuck() -> None:
    channels = Channels.of(BASE)
    channels.effort = channels.effort[np.arange(len(channels.time)) // 16 * 16]
    assert {warning.code for warning in read_text(channels.csv()).warnings} == {"held-samples"}
    channels = Channels.of(BASE)
    spike_efforts(channels, np.random.default_rng(0))
    hold_efforts(channels, np.random.default_rng(0))
    assert {warning.code for warning in read_text(channels.csv()).warnings} == {"spikes", "held-samples"}


def test_one_joint_by_itself_may_drop_out() -> None:
    channels = Channels.of(BASE)
    row = int(np.argmax(np.abs(channels.effort[20:-20, 1]))) + 20
    channels.effort[row : row + 5, 1] = 0.0
    recording = read_text(channels.csv())
    assert [warning.code for warning in recording.warnings] == ["effort-dropouts"]
    assert np.flatnonzero(np.isnan(recording.samples().effort[:, 1])).tolist() == list(range(row, row + 5))


def test_a_held_position_is_masked_and_a_rest_is_not() -> None:
    channels, rng = Channels.of(BASE), np.random.default_rng(0)
    channels.position = np.rint(channels.position / 1e-3) * 1e-3
    channels.position[1000:1300] = channels.position[1000]
    number = np.arange(len(channels.time))
    updates = np.cumsum([0, *rng.integers(2, 5, len(number))])  # every third row, give or take one
    rows = updates[np.searchsorted(updates, number, side="right") - 1]
    channels.position = channels.position[rows]
    kept = np.isfinite(read_text(channels.csv()).samples().position.sum(axis=1))
    moving = kept & ((number < 1000) | (number >= 1300))
    assert np.mean(rows[moving] == number[moving]) > 0.99
    assert kept[1000:1300].mean() > 0.2


@pytest.mark.parametrize(("damage", "arm", "seed"), [(spike_positions, 10_600, 18), (drop_long, 10_400, 12)])
def test_a_damage_is_named_where_it_is_hard(damage: Damage, arm: int, seed: int) -> None:
    channels = Channels.of(record_sound_arm(arm).recording)  # a coarse encoder rests; torque near zero is all noise
    damage(channels, np.random.default_rng(seed))
    recording = Recording.from_arrays("hard", channels.time, channels.position, channels.effort)
    assert {warning.code for warning in examine_recording(recording).warnings} == {DAMAGES[damage]}


def test_check_finds_the_same(tmp_path: Path) -> None:
    for damage, code in DAMAGES.items():
        path = tmp_path / f"{damage.__name__}.csv"
        path.write_text(write_damaged(damage, 2), encoding="utf-8")
        texts = [warning.text for warning in open_recording(path, ROBOT).warnings if warning.code == code]
        found = [finding.text for finding in check_recording(path, robot=ROBOT).findings]
        assert texts
        assert all(any(text.endswith(each) for each in found) for text in texts)


def test_efforts_that_are_nan_throughout_are_refused() -> None:
    channels = Channels.of(BASE)
    channels.effort[:] = np.nan
    assert "columns tau1 to tau3: NaN throughout" in message_of(lambda: read_text(channels.csv()))
    channels = Channels.of(BASE)
    channels.effort[:, 1] = np.nan
    assert "column tau2: NaN throughout" in message_of(lambda: read_text(channels.csv()))
    channels = Channels.of(BASE)
    channels.effort[:] = 0.0
    assert "columns tau1 to tau3: zero throughout" in message_of(lambda: read_text(channels.csv()))
