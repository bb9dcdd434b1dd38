import os

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from recording.recording_files import arrays, csv_text, message_of, messages, rows_of, snapshot, write_log
from tauscope.recording import EffortKind, Recording, convert_recording, read_recording, write_recording


def full_recording(**changes):
    motion = arrays(60)
    extra = {
        "acceleration": motion["velocity"] * 2,
        "reference": motion["position"] + 1e-9,
        "effort_command": motion["effort"] / 3,
        "temperature": np.full((60, 2), 31.5),
        "link_position": motion["position"] * 0.999,
        "period": np.repeat([np.nan, 0.0, 1.0], 20),
    }
    motion["effort"][4, 1] = np.nan
    return Recording.from_arrays("made", **{**motion, **extra, **changes})


@pytest.mark.parametrize("suffix", [".csv", ".parquet", ".CSV"])
@pytest.mark.parametrize("kind", EffortKind)
def test_exact_formats_keep_every_column_and_digit(tmp_path, suffix, kind):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    made = full_recording(effort_kind=kind)
    path = tmp_path / f"file{suffix}"
    assert write_recording(made, path) == ()
    back = read_recording(path)
    assert back.table.names == made.table.names
    assert back.effort_kind is kind
    assert np.array_equal(rows_of(back), rows_of(made), equal_nan=True)


def test_mcap_keeps_motion_and_says_what_it_cannot_hold(tmp_path):
    made = full_recording()
    path = tmp_path / "file.mcap"
    dropped = write_recording(made, path, joint_names=("lift", "elbow"))
    groups = ("qdd", "qref", "taucmd", "temp", "qlink")
    assert dropped == (*(f"{group}{joint}" for group in groups for joint in (1, 2)), "period")
    back = read_recording(path, joint_names=("lift", "elbow")).samples()
    samples = made.samples()
    assert np.allclose(back.time, samples.time, rtol=0, atol=0.5e-9)
    assert back.velocity is not None
    assert samples.velocity is not None
    for field in ("position", "effort", "velocity"):
        assert np.array_equal(getattr(back, field), getattr(samples, field), equal_nan=True)


def test_other_ros_tools_read_our_mcap(tmp_path):
    path = tmp_path / "file.mcap"
    write_recording(full_recording(), path, joint_names=("lift", "elbow"))
    with path.open("rb") as file:
        decoded = [
            entry.decoded_message
            for entry in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        ]
    assert len(decoded) == 60
    assert decoded[0].name == ["lift", "elbow"]
    assert decoded[7].position == arrays(60)["position"][7].tolist()
    assert decoded[7].header.stamp.nanosec == 28_000_000


def test_a_velocity_that_some_joints_lack_is_left_out_of_mcap(tmp_path):
    path = tmp_path / "file.csv"
    lines = csv_text().splitlines()
    path.write_text("\n".join(line + (",qd2" if line == lines[0] else ",1") for line in lines))
    conversion = convert_recording(path, tmp_path / "file.mcap")
    assert conversion.dropped_columns == ("qd2",)
    assert read_recording(tmp_path / "file.mcap").samples().velocity is None


def test_a_log_becomes_a_table(tmp_path):
    source = write_log(tmp_path / "log.mcap", {"/joint_states": messages(names=("lift", "elbow"))})
    conversion = convert_recording(source, tmp_path / "log.csv", joint_names=("elbow", "lift"))
    assert conversion.samples == 40
    assert conversion.damage is None
    assert np.array_equal(read_recording(conversion.target).samples().position, arrays()["position"][:, [1, 0]])
    assert (tmp_path / "log.csv").read_text().startswith("t,q1,q2,tau1,tau2,qd1,qd2\n")


def test_recover_keeps_the_readable_part_and_says_why(tmp_path):
    source = write_log(tmp_path / "log.mcap", {"/joint_states": messages()})
    source.write_bytes(source.read_bytes()[:-300])
    conversion = convert_recording(source, tmp_path / "log.csv", recover=True)
    assert conversion.samples == 40
    assert conversion.damage is not None
    assert "truncated" in conversion.damage
    whole = convert_recording(tmp_path / "log.csv", tmp_path / "again.csv", recover=True)
    assert whole.damage is None


def test_columns_that_nobody_reads_are_named(tmp_path):
    (tmp_path / "a.csv").write_text(
        csv_text().replace("\n", ",note\n", 1).replace("\n", ",\n").replace(",note,", ",note")
    )
    conversion = convert_recording(tmp_path / "a.csv", tmp_path / "b.csv")
    assert conversion.dropped_columns == ("note",)


def source_file(tmp_path):
    path = tmp_path / "source.csv"
    path.write_text(csv_text())
    return path


def test_an_existing_target_is_kept_unless_asked_otherwise(tmp_path):
    source = source_file(tmp_path)
    target = tmp_path / "target.csv"
    target.write_text("precious")
    assert "exists already" in message_of(lambda: convert_recording(source, target))
    assert "exists already" in message_of(lambda: write_recording(full_recording(), target))
    assert target.read_text() == "precious"
    convert_recording(source, target, overwrite=True)
    assert len(read_recording(target)) == 40


def test_the_source_is_never_written_to(tmp_path):
    source = source_file(tmp_path)
    (tmp_path / "link.csv").symlink_to(source)
    os.link(source, tmp_path / "hard.csv")
    before = snapshot(tmp_path)
    for target in ("source.csv", "link.csv", "hard.csv", "../" + tmp_path.name + "/source.csv"):
        expected = "is the source itself"
        assert expected in message_of(
            lambda target=target: convert_recording(source, tmp_path / target, overwrite=True)
        )
    bag = tmp_path / "bag"
    bag.mkdir()
    assert "lies within the source folder" in message_of(lambda: convert_recording(bag, bag / "x.csv"))
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize("target", ["file.txt", "file", "file.db3", "file.bag"])
def test_formats_that_cannot_be_written(tmp_path, target):
    message = message_of(lambda: convert_recording(source_file(tmp_path), tmp_path / target))
    assert "use .csv, .parquet, .mcap" in message
    assert "use .csv, .parquet, .mcap" in message_of(lambda: write_recording(full_recording(), tmp_path / target))


def late(offset):
    motion = arrays()
    return Recording.from_arrays("made", motion["time"] + offset, motion["position"], motion["effort"])


@pytest.mark.parametrize(
    ("recording", "names", "expected"),
    [
        (full_recording(effort_kind=EffortKind.CURRENT), None, "JointState holds torques and this recording currents"),
        (late(1.7e12), None, "is beyond a ROS time stamp"),
        (full_recording(time=np.arange(60) * 1e-10), None, "samples less than 1 ns apart"),
        (full_recording(), ("a",), "1 joint names for 2 joints"),
    ],
)
def test_what_mcap_cannot_hold_is_refused_and_nothing_is_left(tmp_path, recording, names, expected):
    path = tmp_path / "file.mcap"
    assert expected in message_of(lambda: write_recording(recording, path, joint_names=names))
    assert list(tmp_path.iterdir()) == []


def test_time_before_zero_survives_mcap_as_relative_time(tmp_path):
    write_recording(late(-5.0), tmp_path / "file.mcap")
    assert np.allclose(read_recording(tmp_path / "file.mcap").samples().time, arrays()["time"], rtol=0, atol=1e-9)


def test_a_folder_that_is_not_there(tmp_path):
    message = message_of(lambda: write_recording(full_recording(), tmp_path / "gone" / "file.csv"))
    assert "cannot be written (No such file or directory)" in message


def test_nothing_is_left_where_writing_fails(tmp_path, monkeypatch):
    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    message = message_of(lambda: write_recording(full_recording(), tmp_path / "file.csv"))
    assert "file.csv: cannot be written (No space left on device)" in message
    assert list(tmp_path.iterdir()) == []
