"""The journal of a run: exact, readable by others, and readable whenever its writer dies."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pydantic_core import to_json

from shared_data import REPOSITORY
from tauscope.errors import RecordingError
from tauscope.recording import EffortKind, read_recording
from tauscope.recording.journal import JournalWriter
from tauscope.recording.journal_reading import Journal, journal_recording, read_journal
from tauscope.recording.journal_rows import JournalHeader, Phase, journal_row_type

RATE = 500.0
RAMP = 100


def header(joints: int = 2, *, unit: str = "Nm", mode: str = "position", has_velocity: bool = True) -> JournalHeader:
    names = tuple(f"joint{joint}" for joint in range(1, joints + 1))
    factor = tuple(1.0 if unit == "Nm" else 0.25 * joint for joint in range(1, joints + 1))
    return JournalHeader("arm", names, RATE, mode, unit, factor, has_velocity, 1_700_000_000_000_000_000)


def rows(count: int = 600, joints: int = 2, seed: int = 3) -> np.ndarray:
    """Cycles of a ramp and a motion, some of their samples missed."""
    rng = np.random.default_rng(seed)
    table = np.zeros(count, dtype=journal_row_type(joints))
    table["time_ns"] = 5_000_000_000 + np.arange(count) * 2_000_000 + rng.integers(0, 900_000, count)
    table["lateness_ns"] = rng.integers(0, 900_000, count)
    table["phase"] = np.where(np.arange(count) < RAMP, Phase.RAMP, Phase.MOTION)
    table["period"] = np.where(np.arange(count) < RAMP, np.nan, np.arange(count) // 250)
    for group in (
        "position",
        "velocity",
        "effort",
        "temperature",
        "voltage",
        "reference",
        "reference_velocity",
        "command",
    ):
        table[group] = rng.normal(size=(count, joints))
    table["position"][rng.random((count, joints)) < 0.02] = np.nan
    return table


def written(path: Path, table: np.ndarray, head: JournalHeader) -> Path:
    writer = JournalWriter(path, head)
    for start in range(0, len(table), 7):
        writer.write_rows(table[start : start + 7])
    writer.write_event(int(table["time_ns"][-1]), {"event": "state", "state": "stopping"})
    writer.close()
    writer.close()
    return path


def assert_equal_rows(found: np.ndarray, expected: np.ndarray) -> None:
    """Bit for bit, NaN included."""
    for name in expected.dtype.names or ():
        np.testing.assert_array_equal(found[name], expected[name], err_msg=name)


def test_every_number_comes_back_exactly(tmp_path: Path) -> None:
    table = rows()
    journal = read_journal(written(tmp_path / "journal.mcap", table, header()))
    assert journal.damage is None
    assert journal.header == header()
    assert journal.events == ({"event": "state", "state": "stopping"},)
    assert_equal_rows(journal.rows, table)


def test_the_mcap_library_reads_it_through_its_index(tmp_path: Path) -> None:
    table = rows()
    path = written(tmp_path / "journal.mcap", table, header())
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) >= 12, "a chunk holds about a tenth of a second"
        messages = [message for *_, message in reader.iter_decoded_messages(topics=["/joint_states"])]
    assert len(messages) == len(table)
    for row, message in zip(table, messages, strict=True):
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        assert stamp == row["time_ns"] + header().epoch_offset_ns
        assert message.name == ["joint1", "joint2"]
        np.testing.assert_array_equal(message.position, row["position"])
        np.testing.assert_array_equal(message.velocity, row["velocity"])
        np.testing.assert_array_equal(message.effort, row["effort"])


def test_a_user_reads_it_as_a_recording(tmp_path: Path) -> None:
    table = rows()
    path = written(tmp_path / "journal.mcap", table, header())
    samples = read_recording(path, joint_names=["joint2", "joint1"]).samples()
    np.testing.assert_array_equal(samples.position, table["position"][:, ::-1])
    np.testing.assert_array_equal(samples.effort, table["effort"][:, ::-1])
    np.testing.assert_allclose(samples.time, (table["time_ns"] - table["time_ns"][0]) * 1e-9, atol=1e-12)


def test_the_recording_is_the_motion_without_the_ramp(tmp_path: Path) -> None:
    table = rows()
    recording = journal_recording(read_journal(written(tmp_path / "journal.mcap", table, header())), "run")
    samples, motion = recording.samples(), table[RAMP:]
    assert samples.time[0] == 0.0
    np.testing.assert_array_equal(samples.time, (motion["time_ns"] - motion["time_ns"][0]) * 1e-9)
    for ours, group in {
        "position": "position",
        "effort": "effort",
        "velocity": "velocity",
        "reference": "reference",
        "effort_command": "command",
        "temperature": "temperature",
        "period": "period",
    }.items():
        np.testing.assert_array_equal(getattr(samples, ours), motion[group], err_msg=ours)


def test_effort_that_is_held_between_samples_is_that_of_the_samples(tmp_path: Path) -> None:
    """What a drive reports it has held since the command before: the mean of both sides belongs to the sample."""
    table, head = rows(), header(mode="torque")
    path = written(tmp_path / "journal.mcap", table, head)
    recording = journal_recording(read_journal(path), "run")
    reported, effort = table["effort"][RAMP:], recording.samples().effort
    np.testing.assert_allclose(effort[:-1], 0.5 * (reported[:-1] + reported[1:]), rtol=1e-15)
    assert np.isnan(effort[-1]).all(), "what it held after the last sample nobody tells"


def test_effort_beside_a_missed_sample_is_unknown(tmp_path: Path) -> None:
    table = rows()
    kept = np.delete(table, RAMP + 7)
    recording = journal_recording(read_journal(written(tmp_path / "journal.mcap", kept, header(mode="torque"))), "run")
    assert np.flatnonzero(np.isnan(recording.samples().effort[:, 0])).tolist() == [6, len(kept) - RAMP - 1]


def test_what_nobody_reported_is_no_column(tmp_path: Path) -> None:
    table = rows()
    for group in ("velocity", "temperature", "voltage", "command", "period"):
        table[group] = np.nan
    path = written(tmp_path / "journal.mcap", table, header(has_velocity=False))
    recording = journal_recording(read_journal(path), "run")
    assert recording.table.names == ("t", "q1", "q2", "tau1", "tau2", "qref1", "qref2")
    assert "qd1" not in read_recording(path).table.names


def test_drive_units_become_torque_for_others_and_stay_currents_for_us(tmp_path: Path) -> None:
    table, head = rows(), header(unit="mA")
    path = written(tmp_path / "journal.mcap", table, head)
    torque = read_recording(path).samples().effort
    np.testing.assert_array_equal(torque, table["effort"] * head.torque_per_effort)
    recording = journal_recording(read_journal(path), "run")
    assert recording.effort_kind is EffortKind.CURRENT
    np.testing.assert_allclose(recording.samples().effort, table["effort"][RAMP:], rtol=1e-15)


def test_no_more_than_a_fifth_of_a_second_is_held_back(tmp_path: Path) -> None:
    table = rows(1500, joints=7)
    path = tmp_path / "journal.mcap"
    writer = JournalWriter(path, header(7))
    for count in range(1, len(table) + 1):
        writer.write_rows(table[count - 1 : count])
        if count % 97 == 0:
            safe = len(read_journal(path).rows)
            assert count - safe <= 0.2 * RATE, f"after {count} cycles only {safe} are safe"
    writer.close()


class Whole:
    """A journal's bytes, its rows, and a place for damaged copies."""

    def __init__(self, folder: Path) -> None:
        self.table = rows(300)
        self.content = written(folder / "whole.mcap", self.table, header()).read_bytes()
        self.damaged = folder / "damaged.mcap"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    return Whole(tmp_path_factory.mktemp("journal"))


def read_or_refused(path: Path) -> Journal | None:
    """The journal, or None where it is refused in one line."""
    try:
        return read_journal(path)
    except RecordingError as error:
        message = str(error)
    assert "\n" not in message
    return None


@given(share=st.floats(0.0, 1.0))
def test_cut_anywhere_the_rows_before_come_back(whole: Whole, share: float) -> None:
    content, table, path = whole.content, whole.table, whole.damaged
    size = int(share * len(content))
    path.write_bytes(content[:size])
    journal = read_or_refused(path)
    if journal is None:
        assert share < 0.25, "more than the first chunk of a tenth of a second is lost"
        return
    assert (journal.damage is None) == (size == len(content))
    assert_equal_rows(journal.rows, table[: len(journal.rows)])


@given(place=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_is_never_passed_off_as_measured(whole: Whole, place: float, bit: int) -> None:
    content, table, path = whole.content, whole.table, whole.damaged
    damaged = bytearray(content)
    damaged[int(place * len(content))] ^= 1 << bit
    path.write_bytes(damaged)
    journal = read_or_refused(path)
    if journal is not None:
        assert_equal_rows(journal.rows, table[: len(journal.rows)])


def test_the_rows_before_a_kill_come_back(tmp_path: Path) -> None:
    """The writer kills itself in the middle of a chunk: what was flushed stands."""
    script = f"""
import os, signal, sys
sys.path[:0] = [{str(REPOSITORY / "tests" / "recording")!r}]
from pathlib import Path
from test_journal import header, rows
from tauscope.recording.journal import JournalWriter
writer = JournalWriter(Path({str(tmp_path / "journal.mcap")!r}), header())
table = rows(1000)
for k in range(983):
    writer.write_rows(table[k : k + 1])
os.kill(os.getpid(), signal.SIGKILL)
"""
    environment = {"PYTHONPATH": f"{REPOSITORY}:{REPOSITORY / 'tests'}", "OMP_NUM_THREADS": "1"}
    killed = subprocess.run([sys.executable, "-c", script], env=environment, check=False, timeout=60)
    assert killed.returncode == -9
    journal = read_journal(tmp_path / "journal.mcap")
    assert journal.damage is not None
    assert "truncated" in journal.damage
    assert 983 - len(journal.rows) <= 0.2 * RATE
    assert_equal_rows(journal.rows, rows(1000)[: len(journal.rows)])


def test_an_empty_or_foreign_file_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "journal.mcap"
    with pytest.raises(RecordingError, match="cannot be read"):
        read_journal(path)
    path.write_bytes(b"")
    with pytest.raises(RecordingError, match="truncated"):
        read_journal(path)


@pytest.mark.parametrize(
    ("key", "value"),
    [("joint_names", []), ("torque_per_effort", [1.0]), ("rate_hz", "fast"), ("epoch_offset_ns", None)],
)
def test_a_foreign_header_is_refused(key: str, value: object) -> None:
    data = json.loads(json.dumps(header().to_dict())) | {key: value}
    with pytest.raises(RecordingError, match="header"):
        JournalHeader.from_dict(data)


def test_a_run_that_never_moved_leaves_no_recording(tmp_path: Path) -> None:
    table = rows(RAMP)
    journal = read_journal(written(tmp_path / "journal.mcap", table, header()))
    with pytest.raises(RecordingError, match="before its motion began of 100 cycles of the ramp"):
        journal_recording(journal, "run")


def test_an_existing_journal_is_not_overwritten(tmp_path: Path) -> None:
    path = written(tmp_path / "journal.mcap", rows(50), header())
    before = path.read_bytes()
    with pytest.raises(FileExistsError):
        JournalWriter(path, header())
    assert path.read_bytes() == before


def test_a_journal_from_before_there_was_a_voltage_has_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def without_voltage(document: dict[str, Any], **options: Any) -> bytes:
        return to_json({key: value for key, value in document.items() if key != "voltage"}, **options)

    monkeypatch.setattr("tauscope.recording.journal.to_json", without_voltage)
    path = written(tmp_path / "journal.mcap", rows(), header())
    assert np.isnan(read_journal(path).rows["voltage"]).all()
    assert journal_recording(read_journal(path), "run").samples().voltage is None
