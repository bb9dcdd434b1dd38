"""Repeated excitation: where periods lie, how they align, what their average and their Fourier series give."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from recording.conditioning.synthetic import harmonics, record, robot, torque_of
from tauscope.recording.conditioning import Conditioner, Stretch, split_periods
from tauscope.recording.conditioning.periods import fourier_derivatives, repeats, with_turns_removed
from tauscope.recording.conditioning.timing import find_stretches
from tauscope.recording.conditioning.uniform import read_stretch
from tauscope.robot.robot import JointType

MOTION = harmonics(fundamental_hz=0.5)  # period 2 s
RATE = 100.0
LENGTH = 200


def labelled(periods: float, first: float = 0.0, skip: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Time and period index, `skip` samples of the first period left out."""
    time = np.arange(skip, round(periods * LENGTH)) / RATE
    return time, np.floor(np.arange(skip, round(periods * LENGTH)) / LENGTH) + first


def progress_of(time: np.ndarray, period: np.ndarray) -> Stretch:
    """The stretch of a recording with this period column."""
    recording = record(MOTION, time, period=period)
    timing = find_stretches(recording)
    return read_stretch(recording, robot(), *timing.rows[0], timing)


@pytest.mark.parametrize("first", [0.0, 1.0, -3.0, 41.0])
@pytest.mark.parametrize(("periods", "skip"), [(2.0, 0), (3.0, 0), (3.4, 0), (4.0, 63), (5.7, 199)])
def test_progress_follows_the_index_through_cut_first_and_last_periods(first: float, periods: float, skip: int) -> None:
    time, period = labelled(periods, first, skip)
    stretch = progress_of(time, period)
    assert stretch.period is not None
    np.testing.assert_allclose(stretch.period, first + time * RATE / LENGTH, atol=1e-9)
    found = split_periods(stretch)
    assert found is not None
    assert found.position.shape == (int(len(time) / LENGTH), LENGTH, 2)
    np.testing.assert_allclose(found.position, found.position[:1].repeat(found.count, axis=0), atol=1e-12)


def test_two_periods_of_unequal_length_are_not_trusted() -> None:
    time, period = labelled(2.0, skip=30)
    assert progress_of(time, period).period is None


def test_one_period_is_no_repetition() -> None:
    time, period = labelled(1.0)
    assert progress_of(time, period).period is None
    assert split_periods(progress_of(time, period)) is None


def test_what_lies_outside_the_periods_has_no_progress() -> None:
    time = np.arange(1300) / RATE
    period = np.full(1300, np.nan)
    period[150:950] = np.repeat(np.arange(4.0), LENGTH)
    stretch = progress_of(time, period)
    assert stretch.period is not None
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(stretch.period)), np.arange(150, 950))


def test_a_lead_in_under_the_first_label_and_a_hold_under_the_last_are_no_period() -> None:
    time = np.arange(1000) / RATE
    period = np.concatenate([np.zeros(280), np.full(200, 1.0), np.full(200, 2.0), np.full(320, 3.0)])
    stretch = progress_of(time, period)
    assert stretch.period is not None
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(stretch.period)), np.arange(80, 880))


def test_periods_that_start_again_are_runs_of_their_own() -> None:
    time = np.arange(6 * LENGTH + 50) / RATE
    period = np.concatenate([np.repeat(np.arange(3.0), LENGTH), np.full(50, np.nan), np.repeat(np.arange(3.0), LENGTH)])
    timing = find_stretches(record(MOTION, time, period=period))
    assert [run.count for run in timing.runs] == [3, 3]
    assert [run.start_s for run in timing.runs] == pytest.approx([0.0, 6.5])


def test_periods_do_not_reach_across_a_long_gap() -> None:
    time, period = labelled(6.0)
    time[700:] += 5.0
    timing = find_stretches(record(MOTION, time, period=period))
    assert [(run.rows, run.count) for run in timing.runs] == [((0, 700), 3), ((700, 1200), 2)]


def test_labels_that_change_with_every_row_are_no_periods() -> None:
    time = np.arange(800) / RATE
    assert find_stretches(record(MOTION, time, period=np.arange(800.0))).runs == ()
    assert find_stretches(record(MOTION, time, period=np.arange(800.0)[::-1])).runs == ()


@pytest.mark.parametrize("missing", [[200], [0], [199, 200, 201], [399, 400, 777]])
def test_missing_samples_do_not_shift_the_periods(missing: list[int]) -> None:
    time, period = labelled(5.0)
    stretch = progress_of(np.delete(time, missing), np.delete(period, missing))
    found = split_periods(stretch)
    assert found is not None
    assert found.position.shape[1] == LENGTH
    np.testing.assert_allclose(found.position, found.position[:1].repeat(found.count, axis=0), atol=2e-4)


@pytest.mark.parametrize("origin_s", [0.0, 1.7e9])
@pytest.mark.parametrize("length", [200.4, 199.75, 333.3333])
def test_a_period_that_is_no_whole_number_of_samples_is_found_and_aligned(origin_s: float, length: float) -> None:
    motion = harmonics(fundamental_hz=RATE / length)
    time = np.arange(int(4 * length)) / RATE
    period = np.floor(np.arange(len(time)) / length)
    recording = record(
        motion, origin_s + time, period=period, position=motion.derivative(time, 0), effort=torque_of(motion, time)
    )
    timing = find_stretches(recording)
    found = split_periods(read_stretch(recording, robot(), *timing.rows[0], timing), refine=True)
    assert found is not None
    assert found.count == 4 or (found.count == 3 and int(4 * length) + 1 < 4 * length)
    assert found.position.shape[1] * RATE / found.rate_hz == pytest.approx(length, abs=3e-4)
    np.testing.assert_allclose(found.position, found.position[:1].repeat(found.count, axis=0), atol=2e-4)


def test_jittered_stamps_leave_periods_aligned() -> None:
    rng = np.random.default_rng(4)
    time = np.arange(5 * LENGTH) / RATE
    period = np.floor(time / 2.0 + 1e-9)
    time = time + rng.uniform(-2e-3, 2e-3, len(time))
    recording = record(MOTION, time, period=period)
    timing = find_stretches(recording)
    found = split_periods(read_stretch(recording, robot(), *timing.rows[0], timing), refine=True)
    assert found is not None
    assert found.count == 5
    assert found.position.shape[1] / found.rate_hz == pytest.approx(2.0, abs=1e-5)
    inner = found.position[:-1, 5:-5]
    np.testing.assert_allclose(inner, inner[:1].repeat(4, axis=0), atol=2e-4)


def test_a_label_one_sample_late_is_set_right_by_the_positions() -> None:
    time, _ = labelled(2.0)
    period = (np.arange(400) >= LENGTH + 1).astype(float)
    recording = record(MOTION, time[:401], period=period[:401])
    timing = find_stretches(recording)
    assert timing.runs == ()  # 201 and 199 samples: the labels alone do not say which is right
    period = (np.arange(400) >= LENGTH).astype(float)[:399]
    recording = record(MOTION, time[:399], period=period)
    conditioner = Conditioner.survey(recording, robot())
    assert conditioner.summary(10.0).averaged_periods == 2


@given(
    length=st.integers(40, 300),
    count=st.integers(2, 6),
    start=st.integers(0, 299),
    tail=st.integers(0, 40),
)
@example(length=40, count=2, start=3, tail=39)
@example(length=40, count=2, start=0, tail=39)
def test_progress_needs_no_label_at_the_start_of_a_period(length: int, count: int, start: int, tail: int) -> None:
    """Residuals of trimmed motion come back with their progress: whole periods are counted from wherever it begins."""
    samples = count * length + tail
    progress = (start + np.arange(samples)) / length
    residual = np.sin(2 * np.pi * progress)[:, None]
    known = np.ones((samples, 1), dtype=bool)
    periods = split_periods(Stretch(0.0, 100.0, residual, residual, known, progress, False))
    assert periods is not None
    assert periods.count == (samples + 1) // length  # the last sample of the last period may be missing, and is masked
    assert (~periods.measured).sum() == (count + 1) * length - samples if tail == length - 1 else periods.measured.all()
    expected = np.broadcast_to(periods.torque[:1], periods.torque.shape)
    np.testing.assert_allclose(periods.torque[periods.measured], expected[periods.measured], atol=1e-6)


def test_trimming_both_ends_alike_does_not_align_two_periods_wrongly() -> None:
    """Two periods less their edges: 150 and 150 labels are left, but a sample's partner is 200 samples on, not 150."""
    progress = np.arange(50, 350) / LENGTH
    residual = np.sin(2 * np.pi * progress)[:, None]
    known = np.ones((300, 1), dtype=bool)
    assert split_periods(Stretch(0.0, RATE, residual, residual, known, progress, False)) is None


@pytest.mark.parametrize("samples", [200, 201])
def test_the_fourier_derivatives_are_exact_on_harmonics(samples: int) -> None:
    time = np.arange(samples) * 2.0 / samples
    series = fourier_derivatives(MOTION.derivative(time, 0), samples / 2.0, 30.0)
    for order, values in enumerate(series):
        np.testing.assert_allclose(values, MOTION.derivative(time, order), atol=1e-10)


def test_harmonics_beyond_the_cut_off_are_gone() -> None:
    time = np.arange(200) / RATE
    position, velocity, _ = fourier_derivatives(np.sin(2 * np.pi * 20.0 * time)[:, None], RATE, 10.0)
    np.testing.assert_allclose(position, 0.0, atol=1e-14)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-12)


def test_a_joint_that_turns_on_and_on_keeps_its_ramp() -> None:
    time = np.arange(200) / RATE
    wave = 0.3 * np.sin(np.pi * time)
    turning = (np.pi * time + wave)[:, None]
    position, velocity, acceleration = fourier_derivatives(turning, RATE, 20.0, np.array([2 * np.pi]))
    np.testing.assert_allclose(position, turning, atol=1e-12)
    np.testing.assert_allclose(velocity[:, 0], np.pi + 0.3 * np.pi * np.cos(np.pi * time), atol=1e-11)
    np.testing.assert_allclose(acceleration[:, 0], -(np.pi**2) * wave, atol=1e-9)


def test_whole_turns_are_removed_and_other_advances_refused() -> None:
    time, period = labelled(3.0)
    stretch = progress_of(time, period)
    for advance, accepted in ((2 * np.pi, True), (-4 * np.pi, True), (0.5, False), (2 * np.pi + 0.5, False)):
        position = stretch.position + np.array([1.0, 0.0]) * advance * time[:, None] / 2.0
        periods = split_periods(replace(stretch, position=position))
        assert periods is not None
        turned = with_turns_removed(periods, [JointType.REVOLUTE, JointType.REVOLUTE])
        assert (turned is not None) is accepted
        assert with_turns_removed(periods, [JointType.PRISMATIC, JointType.REVOLUTE]) is None
        if turned is not None:
            assert turned.advance is not None
            np.testing.assert_allclose(turned.position, turned.position[:1].repeat(3, axis=0), atol=1e-11)


def test_motion_that_differs_from_period_to_period_does_not_repeat() -> None:
    time, period = labelled(4.0)
    stretch = progress_of(time, period)
    quiet = np.zeros(2)
    for size, expected in ((0.0, True), (0.01, True), (0.2, False)):
        changing = stretch.position * (1.0 + size * period[:, None])
        periods = split_periods(replace(stretch, position=changing))
        assert periods is not None
        assert repeats(periods, 10.0, quiet) is expected


def test_noise_and_joints_at_rest_do_not_prevent_an_average() -> None:
    rng = np.random.default_rng(0)
    time, period = labelled(6.0)
    stretch = progress_of(time, period)
    position = stretch.position * np.array([1.0, 0.0]) + rng.normal(0.0, 1e-3, stretch.position.shape)
    periods = split_periods(replace(stretch, position=position))
    assert periods is not None
    assert repeats(periods, 20.0, np.full(2, 2e-6 / RATE))
    assert not repeats(periods, 20.0, np.full(2, 2e-8 / RATE))


def test_a_joint_that_is_shaken_by_the_others_has_no_veto() -> None:
    time, period = labelled(4.0)
    stretch = progress_of(time, period)
    shaken = np.sin(2 * np.pi * 1.37 * time) * 1e-3  # does not repeat after 2 s
    periods = split_periods(replace(stretch, position=np.stack([stretch.position[:, 0], shaken], axis=1)))
    assert periods is not None
    assert repeats(periods, 10.0, np.zeros(2))
    periods = split_periods(replace(stretch, position=np.stack([stretch.position[:, 0], 100 * shaken], axis=1)))
    assert periods is not None
    assert not repeats(periods, 10.0, np.zeros(2))


@pytest.mark.parametrize("periods", [2, 4, 9])
def test_an_average_of_periods_has_a_square_root_less_noise(periods: int) -> None:
    rng = np.random.default_rng(5)
    time, period = labelled(float(periods))
    clean = torque_of(MOTION, time)
    effort = clean + rng.normal(0.0, 0.5, clean.shape)
    recording = record(MOTION, time, period=period, effort=effort)
    (motion,) = Conditioner.survey(recording, robot()).motions(None)
    assert motion.repetitions == periods
    assert (motion.mean_torque - clean[:LENGTH]).std() == pytest.approx(0.5 / np.sqrt(periods), rel=0.1)
    np.testing.assert_allclose(motion.acceleration, MOTION.derivative(time[:LENGTH], 2), atol=1e-8)


def test_a_torque_missed_in_one_period_is_averaged_over_the_others() -> None:
    time, period = labelled(3.0)
    effort = torque_of(MOTION, time)
    effort[LENGTH + 50 : LENGTH + 90, 0] = np.nan
    (motion,) = Conditioner.survey(record(MOTION, time, period=period, effort=effort), robot()).motions(5.0)
    assert motion.repetitions == 3
    np.testing.assert_allclose(motion.mean_torque, torque_of(MOTION, time[:LENGTH]), atol=1e-10)
    assert (~motion.measured).sum() == 40
    assert motion.band.reduce_mask(np.any(motion.measured, axis=0).T).all()


def test_a_torque_missed_in_every_period_falls_back_to_what_was_measured() -> None:
    time, period = labelled(12.0)
    effort = torque_of(MOTION, time)
    effort[(np.arange(len(time)) % LENGTH >= 180), 0] = np.nan
    conditioner = Conditioner.survey(record(MOTION, time, period=period, effort=effort), robot())
    motions = list(conditioner.motions(8.0))
    assert conditioner.summary(8.0).averaged_periods == 0
    used = np.sum([motion.band.reduce_mask(motion.measured[0].T).sum(axis=1) for motion in motions], axis=0)
    assert used[0] > 0.3 * used[1] > 0
