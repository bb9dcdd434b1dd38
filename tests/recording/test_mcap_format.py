import json
import struct

import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType

from recording.recording_files import (
    arrays,
    encoded_messages,
    every_cut,
    joint_state,
    message_of,
    messages,
    outcome,
    rows_of,
    write_log,
    write_plain_log,
)
from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording import Reading, convert_recording, read_recording

MOTION = arrays()


def log_file(tmp_path, topics=None, **options):
    return write_log(tmp_path / "log.mcap", {"/joint_states": messages()} if topics is None else topics, **options)


def test_positions_efforts_velocities_and_relative_time(tmp_path):
    recording = read_recording(log_file(tmp_path), 2)
    samples = recording.samples()
    assert recording.table.names == ("t", "q1", "q2", "tau1", "tau2", "qd1", "qd2")
    assert np.allclose(samples.time, MOTION["time"], rtol=0, atol=1e-15)
    assert samples.velocity is not None
    for field in ("position", "effort", "velocity"):
        assert np.array_equal(getattr(samples, field), MOTION[field])


@pytest.mark.parametrize(
    "options", [{"use_chunking": False}, {"enable_data_crcs": True}, {"index_types": IndexType.NONE}]
)
def test_containers_of_other_writers(tmp_path, options):
    path = write_plain_log(tmp_path / "log.mcap", encoded_messages(messages()), **options)
    assert np.array_equal(read_recording(path).samples().position, MOTION["position"])


@pytest.mark.parametrize("compression", CompressionType)
def test_compressions(tmp_path, compression):
    path = write_plain_log(tmp_path / "log.mcap", encoded_messages(messages()), compression=compression)
    assert np.array_equal(read_recording(path).samples().position, MOTION["position"])


def test_many_messages_of_changing_layout(tmp_path):
    log = messages(10_000)
    for index in (17, 5000, 5001):
        log[index][1]["header"]["frame_id"] = "another frame"
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}, chunk_size=2**20))
    assert np.array_equal(recording.samples().effort, arrays(10_000)["effort"])


def big_endian(message):
    """CDR in network byte order, by hand: our own machine's encoder only writes little-endian."""
    stamp = message["header"]["stamp"]
    body = struct.pack(">iI", stamp["sec"], stamp["nanosec"]) + struct.pack(">I", 1) + b"\0"

    def aligned(body, size):
        return body + b"\0" * (-len(body) % size)

    body = aligned(body, 4) + struct.pack(">I", len(message["name"]))
    for name in message["name"]:
        body = aligned(body, 4) + struct.pack(">I", len(name) + 1) + name.encode() + b"\0"
    for field in ("position", "velocity", "effort"):
        body = aligned(body, 4) + struct.pack(">I", len(message[field]))
        if message[field]:
            body = aligned(body, 8) + struct.pack(f">{len(message[field])}d", *message[field])
    return b"\0\0\0\0" + body


def test_network_byte_order(tmp_path):
    path = write_plain_log(tmp_path / "log.mcap", [(time, big_endian(message)) for time, message in messages()])
    samples = read_recording(path).samples()
    assert np.array_equal(samples.position, MOTION["position"])
    assert np.array_equal(samples.effort, MOTION["effort"])
    assert np.allclose(samples.time, MOTION["time"], rtol=0, atol=1e-15)


def test_json_messages(tmp_path):
    log = messages()
    log[3][1]["effort"][1] = None
    encoded = [(time, json.dumps(message).encode()) for time, message in log]
    path = write_plain_log(tmp_path / "log.mcap", encoded, encoding="json", schema_encoding="jsonschema")
    expected = MOTION["effort"].copy()
    expected[3, 1] = np.nan
    samples = read_recording(path).samples()
    assert np.array_equal(samples.effort, expected, equal_nan=True)
    assert np.allclose(samples.time, MOTION["time"], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"[1]", "message 5: not a JointState message (the JSON message is not an object)"),
        (b"{", "message 5: not a JointState message (EOF while parsing"),
        (b'{"position": "x"}', "message 5: not a JointState message (field position is not a list of numbers)"),
        (b'{"position": [1, "2"]}', "message 5: not a JointState message (field position is not a list of numbers)"),
        (b'{"name": [1]}', "message 5: not a JointState message (field name is not a list of joint names)"),
        (b'{"header": {"stamp": {"sec": "1"}}}', "message 5: not a JointState message (field header.stamp is not sec"),
    ],
)
def test_bad_json_messages(tmp_path, text, expected):
    encoded = [(time, json.dumps(message).encode()) for time, message in messages()]
    encoded[4] = (encoded[4][0], text)
    path = write_plain_log(tmp_path / "log.mcap", encoded, encoding="json", schema_encoding="jsonschema")
    assert expected in message_of(lambda: read_recording(path))


def test_log_time_where_no_message_has_a_stamp(tmp_path):
    log = messages()
    for _, message in log:
        message["header"]["stamp"] = {"sec": 0, "nanosec": 0}
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert np.allclose(recording.samples().time, MOTION["time"], rtol=0, atol=1e-15)


@pytest.mark.parametrize("rows", [(7,), (0, 3)])
def test_log_time_where_single_messages_have_no_stamp(tmp_path, rows):
    log = [(time + 5_000_000, message) for time, message in messages()]
    for row in rows:
        log[row][1]["header"]["stamp"] = {"sec": 0, "nanosec": 0}
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert np.allclose(recording.samples().time, MOTION["time"], rtol=0, atol=1e-12)
    assert f"{len(rows)} message" in recording.warnings[0].text


def test_simulated_time_may_start_at_zero(tmp_path):
    log = [(10**18 + k, message) for k, (_, message) in enumerate(messages(start_ns=0))]
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert np.allclose(recording.samples().time, MOTION["time"], rtol=0, atol=1e-15)


def test_the_robots_joints_are_picked_and_ordered_by_name(tmp_path):
    log = messages(joints=3, names=("lift", "elbow", "gripper"))
    path = log_file(tmp_path, {"/joint_states": log})
    motion = arrays(joints=3)
    assert np.array_equal(read_recording(path).samples().position, motion["position"])
    picked = read_recording(path, joint_names=("elbow", "lift")).samples()
    assert np.array_equal(picked.position, motion["position"][:, [1, 0]])
    assert np.array_equal(picked.effort, motion["effort"][:, [1, 0]])
    with pytest.raises(RecordingMismatchError, match=r"\(lift, elbow, gripper\), the robot has 3 \(a, b, c\)"):
        read_recording(path, joint_names=("a", "b", "c"))
    with pytest.raises(RecordingMismatchError, match=r"the robot has 2 \(elbow, wrist\): wrist is missing"):
        read_recording(path, joint_names=("elbow", "wrist"))
    with pytest.raises(RecordingMismatchError, match=r"carries 3 joints \(lift, elbow, gripper\), the robot has 2 "):
        read_recording(path, joint_names=("a", "b"))
    with pytest.raises(RecordingMismatchError, match="column q3 belongs to no joint"):
        read_recording(path, 2)


def test_messages_of_a_gripper_on_the_same_topic_are_passed_over(tmp_path):
    arm = messages(names=("lift", "elbow"))
    gripper = [(time + 1, joint_state(time + 1, [0.1], [0.2], (), ["finger"])) for time, _ in arm]
    path = log_file(tmp_path, {"/joint_states": arm + gripper})
    picked = read_recording(path, joint_names=("lift", "elbow"))
    assert np.array_equal(picked.samples().position, MOTION["position"])


def test_messages_that_name_only_some_of_the_joints(tmp_path):
    log = messages(names=("lift", "elbow"))
    log[20][1]["name"] = ["lift", "finger"]
    path = log_file(tmp_path, {"/joint_states": log})
    recording = read_recording(path, joint_names=("lift", "elbow"))
    assert np.array_equal(recording.samples().position, np.delete(MOTION["position"], 20, axis=0))
    (note,) = recording.notes
    assert note.code == "other-publisher"
    assert "topic /joint_states: 1 message holds only the joints lift, finger; left out" in note.text


def test_joints_that_change_order_from_message_to_message(tmp_path):
    log = messages(names=("lift", "elbow"))
    for _, message in log[1::2]:
        for field in ("name", "position", "velocity", "effort"):
            message[field].reverse()
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert np.array_equal(recording.samples().position, MOTION["position"])


@pytest.mark.parametrize("offset", [0.02, 0.5])
def test_a_second_publisher_of_all_joints_is_left_out(tmp_path, offset):
    smooth = np.sin(np.arange(400)[:, None] * [0.01, 0.013])
    log = []
    for k, (position, effort) in enumerate(zip(smooth, np.cos(3.0 * smooth), strict=True)):
        log.append((4_000_000 * k, joint_state(4_000_000 * k, position, effort, (), ["lift", "elbow"])))
        late = 4_000_000 * k + 2_000_000
        log.append((late, joint_state(late, position[::-1] + offset, 0.9 * effort[::-1], (), ["elbow", "lift"])))
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert np.array_equal(recording.samples().position, smooth)
    (note,) = recording.notes
    assert "400 messages hold another state of the same joints; left out" in note.text


def test_one_of_several_topics(tmp_path):
    other = messages(50)
    both = {"/arm/joint_states": other, "/joint_states": messages()}
    assert len(read_recording(log_file(tmp_path, both))) == 40
    message = message_of(lambda: read_recording(log_file(tmp_path, {"/b": messages(), "/a": other})))
    assert "several topics carry joint states (/a, /b); choose one with --topic" in message
    path = log_file(tmp_path, {"/b": messages(), "/a": other})
    assert len(read_recording(path, reading=Reading(topic="/a"))) == 50
    message = message_of(lambda: read_recording(path, reading=Reading(topic="/c")))
    assert "no topic /c carries joint states; those that do: /a, /b" in message


def test_a_topic_with_efforts_is_preferred(tmp_path):
    for effort in ([], [np.nan, np.nan]):
        without = messages()
        for _, message in without:
            message["effort"] = effort
        path = log_file(tmp_path, {"/joint_states": without, "/arm": messages(), "/other": without})
        assert np.array_equal(read_recording(path).samples().effort, MOTION["effort"])


def test_another_publisher_of_the_same_joints_without_efforts(tmp_path):
    arm = messages(names=("lift", "elbow"))
    other = [(time + 1, joint_state(time + 1, [0.0, 0.0], [], (), ["lift", "elbow"])) for time, _ in arm[1::3]]
    for names in (("elbow", "lift"), None):
        recording = read_recording(
            log_file(tmp_path, {"/joint_states": other[:1] + arm + other[1:]}), joint_names=names
        )
        order = [1, 0] if names else [0, 1]
        assert np.array_equal(recording.samples().effort, MOTION["effort"][:, order])
        assert f"{len(other)} messages hold no effort; left out" in recording.notes[0].text


def test_a_gripper_without_efforts_is_none_of_the_arms_business(tmp_path):
    arm = messages(names=("lift", "elbow"))
    gripper = [(time - 1, joint_state(time - 1, [0.1], [], (), ["finger"])) for time, _ in arm]
    path = log_file(tmp_path, {"/joint_states": gripper + arm})
    for names in (("lift", "elbow"), None):
        recording = read_recording(path, joint_names=names)
        assert recording.notes == ()
        assert np.array_equal(recording.samples().position, MOTION["position"])


def test_messages_without_velocities_between_others(tmp_path):
    recording = read_recording(log_file(tmp_path, {"/joint_states": edited(4, velocity=[])}))
    velocity = recording.samples().velocity
    assert velocity is not None
    assert np.flatnonzero(np.isnan(velocity[:, 0])).tolist() == [4]


def test_a_fault_in_a_topic_that_is_not_wanted_does_not_matter(tmp_path):
    path = log_file(tmp_path, {"/joint_states": messages(), "/broken": [(5, joint_state(5, [1.0], []))]})
    assert len(read_recording(path)) == 40


def edited(index, **fields):
    log = messages()
    log[index][1].update(fields)
    return log


NO_EFFORT = messages()
for _time, _message in NO_EFFORT:
    _message["effort"] = []

BAD_LOGS = [
    (edited(4, effort=[1.0]), "message 5: 2 positions and 1 efforts"),
    (edited(4, velocity=[1.0]), "message 5: 2 positions and 1 velocities"),
    (edited(4, name=["joint1", "joint2", "x"]), "message 5: 3 joint names and 2 positions"),
    (
        edited(4, name=["joint1", "joint2", "joint2"], position=[1.0] * 3, effort=[1.0] * 3, velocity=[1.0] * 3),
        "message 5: a joint is named twice (joint1, joint2, joint2)",
    ),
    (edited(4, position=[1.0, np.inf]), "message 5, column q2: the value is infinite"),
    (edited(14, header=messages()[2][1]["header"]), "message 15, column t: time runs backwards"),
    (NO_EFFORT, "topic /joint_states: carries no effort"),
    (messages(5), "holds only 5 samples"),
    ([], "no sensor_msgs/msg/JointState message was recorded"),
]


@pytest.mark.parametrize(("log", "expected"), BAD_LOGS, ids=[expected for _, expected in BAD_LOGS])
def test_bad_messages_are_refused_with_their_number(tmp_path, log, expected):
    path = log_file(tmp_path, {"/joint_states": log})
    message = message_of(lambda: read_recording(path))
    assert message.startswith(f"{path}: ")
    assert expected in message


@pytest.mark.parametrize(("row", "words"), [(3, "1 row has the time"), (2, "1 row came after a later one")])
def test_a_repeated_or_late_stamp_is_mended(tmp_path, row, words):
    log = edited(4, header=messages()[row][1]["header"])
    recording = read_recording(log_file(tmp_path, {"/joint_states": log}))
    assert (np.diff(recording.samples().time) > 0).all()
    assert words in recording.warnings[0].text


def test_missed_samples_are_nan(tmp_path):
    recording = read_recording(log_file(tmp_path, {"/joint_states": edited(4, effort=[1.0, np.nan])}))
    assert np.isnan(recording.samples().effort).sum() == 1


def test_a_late_stamp_in_a_log_without_stamps(tmp_path):
    log = messages(5000)
    for _, message in log[:4500]:
        message["header"]["stamp"] = {"sec": 0, "nanosec": 0}
    expected = "message 4501: has a time stamp where the messages before it have none"
    assert expected in message_of(lambda: read_recording(log_file(tmp_path, {"/joint_states": log})))


@pytest.mark.parametrize(
    ("encoding", "schema"),
    [("ros1", "sensor_msgs/Imu"), ("protobuf", "JointState"), ("cdr", "std_msgs/msg/String")],
)
def test_other_messages_are_named(tmp_path, encoding, schema):
    path = write_plain_log(tmp_path / "log.mcap", encoded_messages(messages()), encoding=encoding, schema=schema)
    assert f"it holds the topics /joint_states ({schema}, {encoding})" in message_of(lambda: read_recording(path))


@pytest.mark.parametrize(
    "data", [b"", b"\0\1\0\0", b"\0\7\0\0" + b"\0" * 40, b"\0\1\0\0" + b"\xff" * 40, b"\0\1\0\0" + b"\0" * 80]
)
def test_bytes_that_are_no_joint_state(tmp_path, data):
    encoded = encoded_messages(messages())
    encoded[7] = (encoded[7][0], data)
    path = write_plain_log(tmp_path / "log.mcap", encoded)
    message = message_of(lambda: read_recording(path))
    assert "topic /joint_states, message 8: " in message


def test_every_truncation_is_said_and_its_readable_part_can_be_recovered(tmp_path):
    path = log_file(tmp_path)
    whole = rows_of(read_recording(path))
    data = path.read_bytes()
    recovered = set()
    for length in every_cut(data, 150):
        path.write_bytes(data[:length])
        message = message_of(lambda: read_recording(path))
        target = tmp_path / f"{length}.csv"
        result = outcome(lambda target=target: read_recording(convert_recording(path, target, recover=True).target))
        assert path.read_bytes() == data[:length]
        if length < 8:
            continue
        assert "the file is truncated" in message or "does not end as an MCAP file does" in message
        if result.rows is None:
            assert not target.exists()
            assert "nothing to keep" in result.message
            continue
        assert (
            f"{len(result.rows)} samples before that point can be read: `tauscope recording convert --recover`"
            in message
        )
        assert np.array_equal(result.rows, whole[: len(result.rows)])
        recovered.add(len(result.rows))
    assert len(recovered) > 1
    assert max(recovered) == len(whole)


def test_a_damaged_chunk_is_told_from_a_truncated_file(tmp_path):
    path = log_file(tmp_path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x10
    path.write_bytes(data)
    with pytest.raises(RecordingError, match="the file is damaged: the record at byte"):
        read_recording(path)


def places_of_chunks(data):
    """Byte at which each chunk begins."""
    at, found = 8, []
    while at < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, at)
        found += [at] if opcode == Opcode.CHUNK else []
        at += 9 + length
    return found


@pytest.mark.parametrize("kind", [Opcode.MESSAGE_INDEX, 0x86])
def test_a_chunk_whose_kind_was_damaged_is_not_passed_over_in_silence(tmp_path, kind):
    """Neither as an index, which says how long it is, nor as a kind that nobody knows: messages are counted."""
    path = write_log(tmp_path / "log.mcap", {"/joint_states": messages()}, chunk_size=1024)
    data = bytearray(path.read_bytes())
    data[places_of_chunks(data)[1]] = kind
    path.write_bytes(data)
    assert "the file is damaged" in message_of(lambda: read_recording(path))


def test_a_log_without_chunks_is_held_to_the_checksum_of_its_data(tmp_path):
    path = write_plain_log(
        tmp_path / "log.mcap", encoded_messages(messages()), use_chunking=False, enable_data_crcs=True
    )
    data = path.read_bytes()
    position = struct.pack("<d", MOTION["position"][7, 1])
    path.write_bytes(data.replace(position, struct.pack("<d", 1.5)))
    assert "its data fail their checksum; 40 samples" in message_of(lambda: read_recording(path))


def test_bytes_behind_the_end(tmp_path):
    path = log_file(tmp_path)
    path.write_bytes(path.read_bytes() + b"more")
    assert "does not end as an MCAP file does; 40 samples" in message_of(lambda: read_recording(path))


def test_a_chunk_that_claims_to_be_huge_is_refused_before_memory_is_asked_for(tmp_path):
    frame = bytearray(zstandard.ZstdCompressor().compress(b"x" * 100_000))
    frame[5:9] = struct.pack("<I", 0xF0000000)
    assert zstandard.frame_content_size(bytes(frame)) > 2**31
    start = struct.pack("<QQQI", 0, 0, 100, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(frame))
    body = start + bytes(frame)
    path = tmp_path / "log.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(body)) + body)
    assert "implausible chunk size" in message_of(lambda: read_recording(path))


def test_a_chunk_whose_data_claim_more_bytes_than_can_be_counted(tmp_path):
    path = log_file(tmp_path)
    data = path.read_bytes()
    at = data.index(b"zstd") + 4
    path.write_bytes(data[:at] + b"\xff" * 8 + data[at + 8 :])
    assert "the file is damaged: the record at byte" in message_of(lambda: read_recording(path))


@pytest.mark.parametrize(
    ("name", "content"), [("empty.mcap", b""), ("text.mcap", b"t,q1,tau1\n"), ("short.mcap", b"\x89MCA")]
)
def test_files_that_are_no_mcap(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content)
    assert name in message_of(lambda: read_recording(path))
