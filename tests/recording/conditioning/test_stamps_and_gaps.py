"""From stamps to a uniform grid: rates, holes, gaps, and what is never invented."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recording.conditioning.synthetic import harmonics, record, robot, torque_of
from tauscope.errors import RecordingError
from tauscope.recording.conditioning.timing import SHORTEST_STRETCH, find_stretches, row_at
from tauscope.recording.conditioning.uniform import Stretch, read_stretch, uniform_grid
from tauscope.recording.recording import Recording

MOTION = harmonics()


def whole(recording: Recording) -> Stretch:
    """The only stretch of a recording."""
    timing = find_stretches(recording)
    assert len(timing.rows) == 1
    return read_stretch(recording, robot(recording.joint_count), *timing.rows[0], timing)


@pytest.mark.parametrize("origin_s", [0.0, 12345.678, 1.7e9 + 0.123456])
@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 240.0, 1000.0, 4000.0])
def test_a_regular_clock_is_recognised_wherever_it_starts(origin_s: float, rate_hz: float) -> None:
    time = np.arange(3000) / rate_hz
    stretch = whole(record(MOTION, origin_s + time, position=MOTION.derivative(time, 0)))
    assert not stretch.resampled
    assert stretch.rate_hz == pytest.approx(rate_hz, rel=2e-7 if origin_s > 1e9 else 1e-10)
    assert stretch.start_s == pytest.approx(origin_s, abs=1e-3 / rate_hz, rel=0)
    np.testing.assert_array_equal(stretch.position, MOTION.derivative(time, 0))


@pytest.mark.parametrize(
    ("rate_hz", "decimals"),
    [(480.0, 3), (400.0, 3), (240.0, 3), (60.0, 2), (333.3, 3), (800.0, 4), (2048.0, 4), (3000.0, 4), (700.0, 3)],
)
def test_stamps_rounded_to_few_digits_do_not_jitter(rate_hz: float, decimals: int) -> None:
    true = np.arange(5000) / rate_hz
    stretch = whole(record(MOTION, np.round(true, decimals), position=MOTION.derivative(true, 0)))
    assert not stretch.resampled
    assert len(stretch.position) == 5000
    assert stretch.rate_hz == pytest.approx(rate_hz, rel=2e-4)
    assert stretch.measured.all()


def test_stamps_rounded_and_subtracted_from_epoch_seconds_keep_their_rounding() -> None:
    stamps = np.round(1.7e9 + np.arange(4000) / 480.0, 3)
    stretch = whole(record(MOTION, stamps - stamps[0]))
    assert not stretch.resampled
    assert stretch.rate_hz == pytest.approx(480.0, rel=1e-5)


@pytest.mark.parametrize("decimals", [3, 4, 9])
@pytest.mark.parametrize("missing", [[700], [300, 301, 302], [5, 100, 1900], list(range(10, 1990, 11))])
def test_missing_rows_are_bridged_and_masked_and_nothing_else(decimals: int, missing: list[int]) -> None:
    time = np.arange(2000) / 1000.0
    kept = np.delete(np.arange(2000), missing)
    stretch = whole(record(MOTION, np.round(time[kept], decimals)))
    assert not stretch.resampled
    assert len(stretch.position) == 2000
    np.testing.assert_array_equal(np.flatnonzero(~stretch.measured.all(axis=1)), missing)
    np.testing.assert_allclose(stretch.position, MOTION.derivative(time, 0), atol=1e-9)


def test_jittered_stamps_are_resampled_to_the_motion_and_its_torque() -> None:
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 500.0 + rng.uniform(-4e-4, 4e-4, 4000)
    stretch = whole(record(MOTION, time))
    grid = stretch.start_s + np.arange(len(stretch.position)) / stretch.rate_hz
    assert stretch.resampled
    assert stretch.rate_hz == pytest.approx(500.0, rel=1e-3)
    np.testing.assert_allclose(stretch.position[4:-4], MOTION.derivative(grid, 0)[4:-4], atol=1e-9)
    np.testing.assert_allclose(stretch.torque[4:-4], torque_of(MOTION, grid)[4:-4], atol=1e-7)
    assert stretch.measured.all()


def test_a_hole_among_jittered_stamps_is_masked() -> None:
    rng = np.random.default_rng(1)
    time = np.delete(np.arange(2000) / 500.0 + rng.uniform(-2e-4, 2e-4, 2000), [700, 701, 702])
    stretch = whole(record(MOTION, time))
    grid = stretch.start_s + np.arange(len(stretch.position)) / stretch.rate_hz
    unmeasured = grid[~stretch.measured.all(axis=1)]
    assert len(unmeasured) == 3
    assert ((unmeasured > time[699]) & (unmeasured < time[700])).all()


@pytest.mark.parametrize("jitter", [0.0, 2e-4])
def test_a_missed_torque_is_masked_for_its_joint_alone_and_stays_finite(jitter: float) -> None:
    rng = np.random.default_rng(2)
    time = np.arange(2000) / 500.0 + rng.uniform(-jitter, jitter, 2000)
    effort = torque_of(MOTION, time)
    effort[100:150, 1] = np.nan
    effort[:3, 0] = np.nan
    stretch = whole(record(MOTION, time, effort=effort))
    grid = stretch.start_s + np.arange(len(stretch.position)) / stretch.rate_hz
    assert np.isfinite(stretch.torque).all()
    assert not stretch.measured[(grid >= time[100]) & (grid <= time[149]), 1].any()
    assert not stretch.measured[grid <= time[2] - 1e-9, 0].any()
    assert (~stretch.measured).sum(axis=0) == pytest.approx([3, 50], abs=2)


def test_a_joint_without_any_torque_is_masked_throughout() -> None:
    time = np.arange(500) / 500.0
    effort = torque_of(MOTION, time)
    effort[:, 0] = np.nan
    stretch = whole(record(MOTION, time, effort=effort))
    assert np.isfinite(stretch.torque).all()
    assert not stretch.measured[:, 0].any()
    assert stretch.measured[:, 1].all()


@pytest.mark.parametrize(
    ("rate_hz", "bridged", "split"), [(1000.0, 11, 14), (200.0, 4, 6), (50.0, 1, 3), (100.0, 4, 6)]
)
def test_long_gaps_split_and_short_ones_do_not(rate_hz: float, bridged: int, split: int) -> None:
    time = np.arange(1000) / rate_hz
    for missing, pieces in ((bridged, 1), (split, 2)):
        timing = find_stretches(record(MOTION, np.delete(time, slice(400, 400 + missing))))
        assert len(timing.rows) == pieces
        assert timing.gaps == pieces - 1


def test_pieces_too_short_are_counted_and_left_out() -> None:
    time = np.concatenate([np.arange(500), 1000 + np.arange(20), 2000 + np.arange(500)]) / 1000.0
    position = MOTION.derivative(time, 0)
    position[[3, 700], 1] = np.nan
    timing = find_stretches(record(MOTION, time, position=position))
    assert timing.rows == ((0, 500), (520, 1020))
    assert (timing.samples, timing.missed, timing.dropped, timing.gaps) == (1020, 2, 20, 2)


def test_rows_without_a_position_at_the_ends_of_a_stretch_are_not_part_of_it() -> None:
    time = np.arange(600) / 1000.0
    position = MOTION.derivative(time, 0)
    position[:7] = np.nan
    position[300:340, 0] = np.nan
    position[-3:, 1] = np.nan
    assert find_stretches(record(MOTION, time, position=position)).rows == ((7, 300), (340, 597))


@pytest.mark.parametrize("within", [1e-6, 1.37e-5])
def test_stamps_in_bursts_neither_split_nor_explode(within: float) -> None:
    bursts = np.arange(500)[:, None] * 4e-3 + np.arange(4) * within
    recording = record(MOTION, bursts.ravel())
    timing = find_stretches(recording)
    stretch = whole(recording)
    assert timing.rate_hz == pytest.approx(1000.0, rel=2e-3)
    assert len(stretch.position) <= 2 * len(recording)
    assert np.isfinite(stretch.position).all()


def test_a_slower_part_is_never_blown_up_without_bound() -> None:
    time = np.concatenate([np.linspace(0.0, 0.2999, 3000), np.linspace(0.3, 6.288, 500)])
    timing = find_stretches(record(MOTION, time))
    rows = np.array(timing.rows)
    span = (time[rows[:, 1] - 1] - time[rows[:, 0]]) * timing.rate_hz
    assert (span <= 40 * (rows[:, 1] - rows[:, 0])).all()


def test_packets_lost_on_a_fast_bus_are_no_bursts() -> None:
    lost = [k for start in range(200, 20000, 500) for k in range(start, start + 90)]
    time = np.delete(np.linspace(0.0, 1.9999, 20000), lost)
    timing = find_stretches(record(MOTION, time))
    assert timing.rate_hz == pytest.approx(1e4)
    assert timing.gaps == 40  # 9 ms are 90 samples: too many to invent


def test_too_few_positions_are_refused_by_name() -> None:
    time = np.arange(200) / 100.0
    position = MOTION.derivative(time, 0)
    position[20:, 1] = np.nan
    with pytest.raises(RecordingError, match=r"^test\.csv: only 20 rows have a position.*check which q columns"):
        find_stretches(record(MOTION, time, position=position))


def test_nothing_but_gaps_is_refused() -> None:
    # A pause after every eight samples: no piece is long enough.
    pauses = np.repeat(0.5 * np.arange(50), 8) + np.arange(400) / 1000.0
    with pytest.raises(RecordingError, match=r"^test\.csv: broken by 49 gaps into pieces"):
        find_stretches(record(MOTION, pauses))


def test_rows_are_found_by_their_instant() -> None:
    time = np.cumsum(np.random.default_rng(0).uniform(0.001, 0.005, 300))
    recording = record(MOTION, time)
    for instant in (-1.0, time[7], time[7] + 1e-12, 0.5, 20.0):
        assert row_at(recording, instant, (0, 300)) == np.searchsorted(time, instant)


def test_a_grid_is_refused_where_samples_lie_between_its_points() -> None:
    assert uniform_grid(np.array([0.0, 1.0, 2.31234567, 3.0]), 1.0) is None


def test_optional_columns_reach_the_grid_and_lasting_losses_take_a_joint_out() -> None:
    time = np.delete(np.arange(1000) / 500.0, [200])
    velocity = MOTION.derivative(time, 1)
    velocity[50:53, 1] = np.nan
    velocity[[100, 101, 300], 0] = np.nan
    stretch = whole(record(MOTION, time, velocity=velocity))
    assert stretch.velocity is not None
    assert stretch.acceleration is None
    np.testing.assert_allclose(stretch.velocity[:, 0], MOTION.derivative(np.arange(1000) / 500.0, 1)[:, 0], atol=1e-4)
    assert np.isnan(stretch.velocity[:, 1]).all()


@given(
    rate_hz=st.sampled_from([50.0, 187.3, 1000.0]),
    jitter=st.sampled_from([0.0, 0.005, 0.2]),
    missing_rows=st.floats(0.0, 0.2),
    missing_torque=st.floats(0.0, 0.4),
    pauses=st.lists(st.tuples(st.integers(0, 400), st.floats(0.2, 2.0)), max_size=4),
    origin_s=st.sampled_from([0.0, 1.7e9]),
    seed=st.integers(0, 2**16),
)
def test_whatever_is_missing_nothing_is_invented(
    rate_hz: float,
    jitter: float,
    missing_rows: float,
    missing_torque: float,
    pauses: list[tuple[int, float]],
    origin_s: float,
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    time = (np.arange(400) + rng.uniform(-jitter, jitter, 400)) / rate_hz
    for row, pause in pauses:
        time[row:] += pause
    time = time[rng.random(400) >= missing_rows]
    effort = torque_of(MOTION, time)
    effort[rng.random(effort.shape) < missing_torque] = np.nan
    position = MOTION.derivative(time, 0)
    position[rng.random(len(time)) < 0.02, 0] = np.nan
    recording = record(MOTION, origin_s + time, position=position, effort=effort)
    try:
        timing = find_stretches(recording)
    except RecordingError:
        return
    complete = np.all(np.isfinite(position), axis=1)
    kept = sum(int(complete[start:stop].sum()) for start, stop in timing.rows)
    assert timing.samples == kept + timing.missed + timing.dropped
    for start, stop in timing.rows:
        assert complete[start:stop].sum() >= SHORTEST_STRETCH
        stretch = read_stretch(recording, robot(), start, stop, timing)
        assert np.isfinite(stretch.position).all()
        assert np.isfinite(stretch.torque).all()
        here = np.isfinite(effort[start:stop]) & complete[start:stop, None]
        if stretch.resampled:
            grid = stretch.start_s - origin_s + np.arange(len(stretch.position)) / stretch.rate_hz
            for joint in range(2):
                stamps = time[start:stop][here[:, joint]]
                distance = np.abs(grid[stretch.measured[:, joint], None] - stamps)
                assert np.sort(distance, axis=1)[:, :1].max(initial=0.0) * stretch.rate_hz < 0.7501
        else:
            np.testing.assert_array_equal(stretch.measured.sum(axis=0), here.sum(axis=0))
        # Filled torque stays between what was measured; nothing is extrapolated.
        known = np.where(here, effort[start:stop], np.nan)
        if np.isfinite(known).any(axis=0).all() and not stretch.resampled:
            assert (stretch.torque <= np.nanmax(known, axis=0) + 1e-9).all()
            assert (stretch.torque >= np.nanmin(known, axis=0) - 1e-9).all()
