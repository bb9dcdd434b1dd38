"""Whole recordings through the conditioner: closed forms, seams, counts, and whatever users may send."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recording.conditioning.synthetic import Harmonics, harmonics, own_samples, record, robot, torque_of
from tauscope.errors import RecordingError
from tauscope.recording.conditioning import Conditioner, conditioner
from tauscope.recording.conditioning.common_band import Decimator, HarmonicBand
from tauscope.recording.conditioning.uniform import Stretch, read_stretch
from tauscope.recording.recording import Recording
from tauscope.recording.table import SpooledTable

MOTION = harmonics()


@pytest.mark.parametrize("origin_s", [0.0, 1.7e9])
@pytest.mark.parametrize(("rate", "cutoff"), [(1000.0, None), (1000.0, 5.0), (200.0, 8.0), (50.0, 5.0), (100.0, 40.0)])
def test_smoothed_motion_equals_the_closed_form(origin_s: float, rate: float, cutoff: float | None) -> None:
    motion = harmonics(fundamental_hz=0.05)  # its highest harmonic, 0.25 Hz, is far inside every band
    time = np.arange(round(30.0 * rate)) / rate
    recording = record(motion, origin_s + time, position=motion.derivative(time, 0), effort=torque_of(motion, time))
    (piece,) = Conditioner.survey(recording, robot()).motions(cutoff)
    exact = [motion.derivative(piece.time - origin_s, order) for order in range(3)]
    stamps = 0.0 if origin_s == 0.0 else 3e-7  # a quarter of a microsecond is the last digit of epoch seconds
    inner = slice(len(piece.time) // 20, -(len(piece.time) // 20))
    for order, values in enumerate((piece.position, piece.velocity, piece.acceleration)):
        # Just inside the trimmed edges a few ten-thousandths are left of what the filter could not see.
        np.testing.assert_allclose(values, exact[order], atol=3e-4)
        np.testing.assert_allclose(values[inner], exact[order][inner], atol=2e-6 + 4 * stamps)
    first = round((piece.time[0] - origin_s) * rate)
    np.testing.assert_array_equal(piece.torque[0], torque_of(motion, time)[first : first + len(piece.time)])


@pytest.mark.parametrize("cutoff", [3.0, 10.0])
def test_torque_and_motion_keep_the_same_band_without_a_delay(cutoff: float) -> None:
    """A torque made of the motion stays made of it after filtering, even where the band bends both."""
    rate = 500.0
    time = np.arange(15000) / rate
    lively = Harmonics(np.array([0.4, 1.7, 2.9]), np.full((2, 3), 0.1), np.ones((2, 3)), np.zeros(2))
    (piece,) = Conditioner.survey(record(lively, time), robot()).motions(cutoff)
    modelled = (piece.acceleration + 2.0 * piece.velocity + 3.0 * piece.position).T
    measured = piece.band.reduce(piece.torque[0].T)
    error = piece.band.reduce(modelled) - measured
    # The motion's own smoothing ends an octave above the band: 0.4 % at its edge.
    assert np.abs(error).max() < 0.006 * np.abs(measured).max()
    lags = np.arange(-3, 4)
    correlation = [
        np.sum(measured[:, 5:-5] * np.roll(piece.band.reduce(modelled), lag, axis=1)[:, 5:-5]) for lag in lags
    ]
    assert lags[np.argmax(correlation)] == 0


def spooled(recording: Recording) -> Recording:
    """The same rows, read from a temporary file."""
    table = SpooledTable(recording.table.names)
    table.append(recording.table.rows(0, len(recording)))
    return Recording(recording.name, recording.joint_count, recording.effort_kind, table)


@pytest.fixture
def small_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long recordings, made cheap."""
    monkeypatch.setattr(conditioner, "WINDOW_ROWS", 1500)


@pytest.mark.usefixtures("small_windows")
@pytest.mark.parametrize("cutoff", [None, 45.0, 20.0, 4.0, 1.5])
@pytest.mark.parametrize("lost", [0, 300])
def test_windows_join_without_seam(cutoff: float | None, lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rate, rng = 200.0, np.random.default_rng(0)
    kept = np.sort(rng.choice(14000, 14000 - lost, replace=False))
    recording = record(MOTION, kept / rate)
    survey = Conditioner.survey(spooled(recording), robot())
    pieces = list(survey.motions(cutoff))
    assert len(pieces) > 3
    counted = np.concatenate([own_samples(piece) for piece in pieces])
    np.testing.assert_allclose(np.diff(counted), 1.0 / rate, atol=1e-9)  # each instant once, none left out
    outputs = sum(piece.band.reduce(piece.torque[0].T).shape[1] for piece in pieces)
    monkeypatch.setattr(conditioner, "WINDOW_ROWS", 1 << 20)
    (whole,) = survey.motions(cutoff)
    assert len(counted) == len(whole.time)
    expected = whole.band.reduce(whole.torque[0].T).shape[1]
    assert outputs == expected if lost == 0 else abs(outputs - expected) <= len(pieces)
    joined = np.concatenate([piece.acceleration[piece.own] for piece in pieces])
    np.testing.assert_allclose(joined, whole.acceleration, atol=2e-3 * np.abs(whole.acceleration).max())


@pytest.mark.usefixtures("small_windows")
def test_decimated_rows_of_windows_are_those_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = record(MOTION, np.arange(14000) / 200.0)
    survey = Conditioner.survey(recording, robot())
    joined = np.concatenate([piece.band.reduce(piece.torque[0].T) for piece in survey.motions(4.0)], axis=1)
    monkeypatch.setattr(conditioner, "WINDOW_ROWS", 1 << 20)
    (whole,) = survey.motions(4.0)
    np.testing.assert_allclose(joined, whole.band.reduce(whole.torque[0].T), atol=1e-12)


@pytest.mark.usefixtures("small_windows")
def test_long_periodic_recordings_are_averaged_in_groups(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conditioner, "AVERAGED_ROWS", 4000)
    motion = harmonics(fundamental_hz=0.2)  # 5 s: 1000 samples
    time = np.arange(23456) / 200.0
    period = np.where(time < 105.0, np.floor(time / 5.0 + 1e-9), np.nan)  # 21 periods, then something else
    survey = Conditioner.survey(record(motion, time, period=period), robot())
    pieces = list(survey.motions(8.0))
    averaged = [piece for piece in pieces if piece.repetitions > 1]
    assert sum(piece.repetitions for piece in averaged) == 21
    assert max(piece.repetitions for piece in averaged) <= 4 == survey.summary(8.0).averaged_periods
    rest = np.concatenate([own_samples(piece) for piece in pieces if piece.repetitions == 1])
    assert rest[0] == pytest.approx(105.0)
    assert rest[-1] > time[-1] - 0.5
    for piece in pieces:
        np.testing.assert_allclose(piece.acceleration, motion.derivative(piece.time, 2), atol=2e-3)


def test_a_conditioner_of_the_first_rows_alone_averages_what_lies_in_them() -> None:
    motion = harmonics(fundamental_hz=0.2)
    time = np.arange(9000) / 200.0
    survey = Conditioner.survey(record(motion, time, period=np.floor(time / 5.0 + 1e-9)), robot())
    beginning = replace(survey, timing=replace(survey.timing, rows=((0, 3500),)))
    averaged, rest = beginning.motions(6.0)
    assert (averaged.repetitions, rest.repetitions) == (3, 1)
    assert rest.time[-1] < 17.5
    (averaged,) = survey.motions(6.0)
    assert averaged.repetitions == 9


def test_a_period_longer_than_a_window_is_averaged_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conditioner, "WINDOW_ROWS", 700)
    monkeypatch.setattr(conditioner, "LONGEST_PERIOD", 1400)
    motion = harmonics(fundamental_hz=0.2)
    time = np.arange(3000) / 200.0
    survey = Conditioner.survey(record(motion, time, period=np.floor(time / 5.0 + 1e-9)), robot())
    (piece,) = survey.motions(8.0)
    assert piece.repetitions == 3
    assert isinstance(piece.band, HarmonicBand)
    monkeypatch.setattr(conditioner, "LONGEST_PERIOD", 900)
    assert all(piece.repetitions == 1 for piece in survey.motions(8.0))


def test_what_lies_before_and_after_the_periods_is_used_up_to_them() -> None:
    motion = harmonics(fundamental_hz=0.2)
    time = np.arange(8000) / 200.0
    period = np.full(8000, np.nan)
    period[2500:5500] = np.repeat(np.arange(3.0), 1000)
    pieces = list(Conditioner.survey(record(motion, time, period=period), robot()).motions(6.0))
    before, averaged, after = pieces
    assert averaged.repetitions == 3
    assert averaged.time[0] == pytest.approx(12.5)
    assert own_samples(before)[-1] == pytest.approx(12.495)
    assert own_samples(after)[0] == pytest.approx(27.5)
    centres = []
    for piece in (before, after):
        assert isinstance(piece.band, Decimator)
        rows = piece.band.reduce(piece.torque[0].T).shape[1]
        middle = piece.time[0] + (len(piece.band.kernel) - 1) / 2 / 200.0
        centres.append(middle + np.arange(rows) * piece.band.factor / 200.0)
    assert 12.5 - 0.06 < centres[0][-1] < 12.5 + 0.06
    assert 27.5 - 0.06 < centres[1][0] < 27.5 + 0.06


def test_a_joint_that_turns_on_and_on_is_averaged_with_its_ramp() -> None:
    wave = harmonics(joints=1, fundamental_hz=0.5)
    time = np.arange(1200) / 200.0
    position = wave.derivative(time, 0) + np.pi * time[:, None]
    recording = record(wave, time, position=position, period=np.floor(time / 2.0 + 1e-9))
    (piece,) = Conditioner.survey(recording, robot(1)).motions(None)
    assert piece.repetitions == 3
    np.testing.assert_allclose(piece.position, position[:400], atol=1e-9)
    np.testing.assert_allclose(piece.velocity, wave.derivative(time[:400], 1) + np.pi, atol=1e-8)
    np.testing.assert_allclose(piece.acceleration, wave.derivative(time[:400], 2), atol=1e-6)


def test_motion_that_differs_between_periods_keeps_its_progress() -> None:
    time = np.arange(3000) / 200.0
    changing = MOTION.derivative(time, 0) * (1.0 + 0.3 * time[:, None] / 15.0)
    survey = Conditioner.survey(record(MOTION, time, position=changing, period=np.floor(time / 5.0 + 1e-9)), robot())
    (piece,) = survey.motions(6.0)
    assert piece.repetitions == 1
    assert piece.period is not None
    np.testing.assert_allclose(piece.period, piece.time / 5.0, atol=1e-9)
    assert survey.summary(6.0).averaged_periods == 0


def test_an_idle_head_does_not_hide_the_noise() -> None:
    rate, rng = 200.0, np.random.default_rng(0)
    time = np.arange(150_000) / rate
    position = MOTION.derivative(time, 0)
    position[:60_000] = position[60_000]
    position += rng.normal(0.0, 1e-4, position.shape)
    limit = Conditioner.survey(record(MOTION, time, position=position), robot()).noise.limit_hz
    part = slice(70_000, 100_000)
    moving = Conditioner.survey(record(MOTION, time[part], position=position[part]), robot()).noise.limit_hz
    assert limit is not None
    assert moving is not None
    assert limit == pytest.approx(moving, rel=0.3)


def test_what_was_missing_is_counted() -> None:
    time = np.delete(np.arange(4000), slice(2000, 2100)) / 500.0
    position, effort = MOTION.derivative(time, 0), torque_of(MOTION, time)
    position[[10, 20, 30], 0] = np.nan
    effort[100:140, 1] = np.nan
    effort[20, 0] = np.nan
    summary = Conditioner.survey(record(MOTION, time, position=position, effort=effort), robot()).summary(5.0)
    assert summary.model_dump() == {
        "recording": "test.csv",
        "samples": 3900,
        "missed_positions": 3,
        "dropped": 0,
        "missed_torques": [1, 40],
        "gaps": 1,
        "rate_hz": pytest.approx(500.0),
        "resampled": False,
        "averaged_periods": 0,
        "position_noise_std": pytest.approx([0.0, 0.0], abs=1e-7),
        "velocity_source": ["position", "position"],
    }


@pytest.mark.parametrize("cutoff", [0.05, 1.0])
def test_a_band_that_takes_all_of_a_recording_is_refused(cutoff: float) -> None:
    survey = Conditioner.survey(record(MOTION, np.arange(300) / 200.0), robot())
    with pytest.raises(RecordingError, match=rf"^test\.csv: too short for a band of {cutoff:.3g} Hz.*record longer"):
        list(survey.motions(cutoff))


@pytest.mark.parametrize("cutoff", [None, 40.0, 6.0])
@pytest.mark.parametrize("kind", ["still", "one moves", "constant torque", "spike", "single joint", "huge positions"])
def test_odd_but_legal_recordings_pass(kind: str, cutoff: float | None) -> None:
    joints = 1 if kind == "single joint" else 2
    motion = harmonics(joints)
    time = np.arange(800) / 100.0
    position = motion.derivative(time, 0)
    effort = torque_of(motion, time)
    if kind == "still":
        position[:] = 0.3
    elif kind == "one moves":
        position[:, 0] = -1.0
    elif kind == "constant torque":
        effort[:] = 0.0
    elif kind == "spike":
        effort[400, 0] = 1e12
    elif kind == "huge positions":
        position += 1e7
    survey = Conditioner.survey(record(motion, time, position=position, effort=effort), robot(joints))
    for piece in survey.motions(cutoff):
        for values in (piece.position, piece.velocity, piece.acceleration, piece.torque):
            assert np.isfinite(values).all()
        assert piece.measured.all()
    assert survey.summary(cutoff).samples == 800


def test_the_stretch_of_residuals_is_made_as_callers_make_it() -> None:
    residual = np.zeros((100, 2))
    stretch = Stretch(0.0, 100.0, residual, residual, np.ones((100, 2), dtype=bool), None, False)
    assert stretch.velocity is None
    assert stretch.acceleration is None


@given(
    rate=st.sampled_from([50.0, 187.3, 1000.0]),
    count=st.integers(32, 900),
    cutoff=st.sampled_from([None, 2.0, 9.0, 21.0, 60.0]),
    jitter=st.sampled_from([0.0, 0.15]),
    lost=st.floats(0.0, 0.15),
    lost_torque=st.floats(0.0, 0.3),
    period=st.one_of(st.none(), st.integers(33, 300)),
    joints=st.integers(1, 3),
    seed=st.integers(0, 2**16),
)
def test_whatever_is_sent_comes_out_finite_counted_and_in_order(
    rate: float,
    count: int,
    cutoff: float | None,
    jitter: float,
    lost: float,
    lost_torque: float,
    period: int | None,
    joints: int,
    seed: int,
) -> None:
    rng = np.random.default_rng(seed)
    motion = harmonics(joints, fundamental_hz=rate / (period or 200), seed=seed)
    index = np.flatnonzero(rng.random(count) >= lost)
    time = (index + rng.uniform(-jitter, jitter, len(index))) / rate
    effort = torque_of(motion, time)
    effort[rng.random(effort.shape) < lost_torque] = np.nan
    label = None if period is None else np.floor(index / period)
    position = motion.derivative(time, 0) + rng.normal(0.0, 1e-5, (len(time), joints))
    if len(time) < 10:
        return
    try:
        survey = Conditioner.survey(record(motion, time, position=position, effort=effort, period=label), robot(joints))
        pieces = list(survey.motions(cutoff))
    except RecordingError as error:
        refusal = str(error)
    else:
        refusal = ""
    assert "\n" not in refusal
    if refusal:
        return
    stretches = [read_stretch(survey.recording, survey.robot, *rows, survey.timing) for rows in survey.timing.rows]
    available = sum(len(stretch.position) for stretch in stretches)
    used = 0
    previous = -np.inf
    for piece in pieces:
        for values in (piece.position, piece.velocity, piece.acceleration, piece.torque, piece.mean_torque):
            assert np.isfinite(values).all()
        assert piece.torque.shape == piece.measured.shape == (piece.repetitions, *piece.position.shape)
        torque = piece.band.reduce(np.ascontiguousarray(piece.mean_torque.T))
        assert torque.shape == piece.band.reduce_mask(np.any(piece.measured, axis=0).T).shape
        assert np.isfinite(torque).all()
        own = own_samples(piece)
        assert len(own) == 0 or own[0] > previous - 1e-9
        previous = own[-1] if len(own) else previous
        used += piece.repetitions * len(own)
    assert used <= available + sum(piece.repetitions for piece in pieces)
    summary = survey.summary(cutoff)
    assert summary.samples == len(time)
    assert max(piece.repetitions for piece in pieces) == max(summary.averaged_periods, 1)
    missed = np.isnan(effort).sum(axis=0)
    if summary.dropped == 0:
        np.testing.assert_array_equal(summary.missed_torques, missed)
