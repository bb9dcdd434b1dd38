import csv

import numpy as np
import pytest

from recording.recording_files import rows_of
from shared_data import SHARED_DATA, needs_shared_data
from tauscope.recording import EffortKind, check_recording, read_recording, write_recording

pytestmark = needs_shared_data

FILES = sorted(SHARED_DATA.glob("*/*.csv")) if SHARED_DATA.is_dir() else []
JOINTS = {
    "emps": 1,
    "kuka-lwr4": 7,
    "franka-panda": 7,
    "double-pendulum": 2,
    "bam-xl330": 1,
    "odrive-cogging": 1,
    "staubli-tx40": 6,
}


@pytest.mark.parametrize("path", FILES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_real_recording_reads_as_the_csv_module_reads_it(path):
    recording = read_recording(path, JOINTS[path.parent.name])
    with path.open() as file:
        lines = [line for line in csv.reader(file) if not line[0].startswith("#")]
    header, expected = lines[0], np.array([[float(field) for field in line] for line in lines[1:]])
    assert sorted(recording.table.names) == sorted(header)
    assert np.array_equal(rows_of(recording), expected[:, [header.index(name) for name in recording.table.names]])
    assert (recording.effort_kind is EffortKind.CURRENT) == ("i1" in header)
    report = check_recording(path)
    assert report.samples == len(expected)
    assert report.ignored_columns == ()


def test_the_saturated_drive_is_noticed():
    path = SHARED_DATA / "bam-xl330" / "held-out-5.csv"
    assert [level for level, _ in check_recording(path).joints[0].clipped] == [7.1]


def test_a_real_recording_survives_every_format(tmp_path):
    made = read_recording(SHARED_DATA / "franka-panda" / "held-out-1.csv")
    for suffix in (".csv", ".mcap"):
        write_recording(made, tmp_path / f"copy{suffix}")
        back = read_recording(tmp_path / f"copy{suffix}", 7)
        assert np.allclose(rows_of(back)[:, 0], rows_of(made)[:, 0], rtol=0, atol=1e-9)
        assert np.array_equal(rows_of(back)[:, 1:], rows_of(made)[:, 1:])
