import sqlite3

import numpy as np
import pytest
import zstandard

from recording.recording_files import arrays, message_of, messages, snapshot, write_database, write_log
from tauscope.recording import read_recording

MOTION = arrays()


def bag(folder, files, storage="mcap"):
    folder.mkdir(exist_ok=True)
    names = "".join(f"\n    - {file}" for file in files)
    text = (
        f"rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {storage}\n  relative_file_paths:{names}\n"
    )
    (folder / "metadata.yaml").write_text(text)
    return folder


def test_an_mcap_bag_in_two_files(tmp_path):
    folder = bag(tmp_path / "bag", ["bag_0.mcap", "bag_1.mcap"])
    log = messages()
    write_log(folder / "bag_0.mcap", {"/joint_states": log[:25]})
    write_log(folder / "bag_1.mcap", {"/joint_states": log[25:]})
    before = snapshot(folder)
    samples = read_recording(folder, 2).samples()
    assert np.array_equal(samples.position, MOTION["position"])
    assert np.allclose(samples.time, MOTION["time"], rtol=0, atol=1e-15)
    assert snapshot(folder) == before


def test_a_sqlite_bag(tmp_path):
    folder = bag(tmp_path / "bag", ["bag_0.db3"], "sqlite3")
    write_database(folder / "bag_0.db3", messages())
    before = snapshot(folder)
    for path in (folder, folder / "bag_0.db3"):
        recording = read_recording(path, 2)
        assert np.array_equal(recording.samples().effort, MOTION["effort"])
        assert recording.table.names[-1] == "qd2"
    assert snapshot(folder) == before


@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
@pytest.mark.parametrize("states_suffix", [False, True])
def test_a_bag_whose_files_are_compressed(tmp_path, suffix, states_suffix):
    folder = bag(tmp_path / "bag", [f"bag_0{suffix}" + ".zstd" * states_suffix])
    plain = tmp_path / f"plain{suffix}"
    if suffix == ".db3":
        write_database(plain, messages())
    else:
        write_log(plain, {"/joint_states": messages()})
    (folder / f"bag_0{suffix}.zstd").write_bytes(zstandard.ZstdCompressor().compress(plain.read_bytes()))
    assert np.array_equal(read_recording(folder, 2).samples().effort, MOTION["effort"])
    cut = zstandard.ZstdCompressor().compress(plain.read_bytes())[:-200]
    (folder / f"bag_0{suffix}.zstd").write_bytes(cut)
    assert message_of(lambda: read_recording(folder)).startswith(f"{folder}/bag_0{suffix}")


def test_names_with_characters_that_mean_something_in_an_address(tmp_path):
    path = write_database(tmp_path / "a bag?#100%.db3", messages())
    assert len(read_recording(path)) == 40


def test_an_unclosed_database(tmp_path):
    path = write_database(tmp_path / "bag.db3", messages())
    (tmp_path / "bag.db3-wal").write_bytes(b"rows")
    assert "was not closed (bag.db3-wal holds samples)" in message_of(lambda: read_recording(path))


def test_a_database_of_something_else(tmp_path):
    path = tmp_path / "other.db3"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE x(y)")
    connection.commit()
    connection.close()
    assert "not a readable rosbag2 database (no such table: topics)" in message_of(lambda: read_recording(path))


def test_a_cut_database(tmp_path):
    path = write_database(tmp_path / "bag.db3", messages(400))
    data = path.read_bytes()
    for length in range(16, len(data), len(data) // 40):
        path.write_bytes(data[:length])
        assert "the database is truncated" in message_of(lambda: read_recording(path))


def test_a_damaged_database(tmp_path):
    path = write_database(tmp_path / "bag.db3", messages(400))
    data = bytearray(path.read_bytes())
    page = int.from_bytes(data[16:18], "big")
    data[page * 3 : page * 3 + 16] = b"\xff" * 16
    path.write_bytes(data)
    message = message_of(lambda: read_recording(path))
    assert "the database is damaged" in message or "not a readable rosbag2 database" in message


def test_a_database_whose_table_names_are_no_text(tmp_path):
    path = write_database(tmp_path / "bag.db3", messages())
    path.write_bytes(path.read_bytes().replace(b"messages", b"mess\x80ges"))
    assert "not a readable rosbag2 database" in message_of(lambda: read_recording(path))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "relative_file_paths is missing"),
        ("a: [", "metadata.yaml: not a YAML file"),
        ("- 1", "relative_file_paths is missing"),
        ("rosbag2_bagfile_information: 3", "relative_file_paths is missing"),
        ("rosbag2_bagfile_information: {relative_file_paths: []}", "the bag has no files"),
        ("rosbag2_bagfile_information: {relative_file_paths: 3}", "relative_file_paths is missing"),
        ("rosbag2_bagfile_information: {relative_file_paths: [gone.mcap]}", "names gone.mcap, which is not there"),
        ("rosbag2_bagfile_information: {relative_file_paths: [../out.mcap]}", "names out.mcap, which is not there"),
        ("rosbag2_bagfile_information: {relative_file_paths: [x.mcap.zstd]}", "cannot be decompressed ("),
        ("rosbag2_bagfile_information: {relative_file_paths: [..]}", "which is not there"),
        ("\x00", "not a YAML file"),
    ],
)
def test_bad_metadata(tmp_path, text, expected):
    write_log(tmp_path / "out.mcap", {"/joint_states": messages()})
    folder = tmp_path / "bag"
    folder.mkdir()
    (folder / "metadata.yaml").write_text(text)
    (folder / "x.mcap.zstd").write_bytes(b"x")
    assert expected in message_of(lambda: read_recording(folder))


def test_a_damaged_file_of_a_bag_is_named(tmp_path):
    folder = bag(tmp_path / "bag", ["bag_0.mcap"])
    path = write_log(folder / "bag_0.mcap", {"/joint_states": messages()})
    path.write_bytes(path.read_bytes()[:-20])
    assert message_of(lambda: read_recording(folder)).startswith(f"{path}: the file is truncated")
