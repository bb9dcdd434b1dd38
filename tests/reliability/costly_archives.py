"""Small files that are costly to read, of the formats that pack, index or generate: MCAP, bags, NumPy, MJCF."""

import bz2
import gzip
import io
import json
import lzma
import struct
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import numpy as np
from scipy.io import savemat

from reliability.costly_inputs import SMALL, mcap_file, mcap_record, mcap_text
from tauscope.recording.mcap_format import MCAP_MAGIC

_STATE = b"\0\1\0\0" + bytes(12)


def write_indexed_mcap(message: bytes, listed: int, encoding: bytes = b"cdr") -> bytes:
    """An MCAP file with one message in a packed chunk, which its index lists `listed` times."""
    import zstandard

    schema = struct.pack("<H", 1) + mcap_text(b"sensor_msgs/msg/JointState") + mcap_text(b"ros2msg") + mcap_text(b"")
    channel = struct.pack("<HH", 1, 1) + mcap_text(b"/joint_states") + mcap_text(encoding) + mcap_text(b"")
    content = mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + message)
    packed = zstandard.compress(content, 19)
    chunk = struct.pack("<QQQII", 0, 0, len(content), 0, 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    head = MCAP_MAGIC + mcap_record(1, struct.pack("<II", 0, 0)) + mcap_record(0x7F, bytes(SMALL // 2))
    chunk_at, chunk_record = len(head), mcap_record(6, chunk)
    index = mcap_record(7, struct.pack("<HI", 1, 16 * listed) + struct.pack("<QQ", 0, 0) * listed)
    index_at = chunk_at + len(chunk_record)
    end = mcap_record(15, struct.pack("<I", 0))
    start = index_at + len(index) + len(end)
    chunk_index = struct.pack("<QQQQ", 0, 0, chunk_at, len(chunk_record)) + struct.pack("<I", 10)
    chunk_index += struct.pack("<HQ", 1, index_at) + struct.pack("<Q", len(index)) + mcap_text(b"zstd")
    chunk_index += struct.pack("<QQ", len(packed), len(content))
    statistics = struct.pack("<QHIIIIQQ", listed, 1, 1, 0, 0, 1, 0, 0) + struct.pack("<IHQ", 10, 1, listed)
    summary = mcap_record(3, schema) + mcap_record(4, channel) + mcap_record(8, chunk_index)
    summary += mcap_record(11, statistics)
    footer = mcap_record(2, struct.pack("<QQI", start, 0, 0))
    return head + chunk_record + index + end + summary + footer + MCAP_MAGIC


def write_indexed_bombs() -> Iterator[tuple[str, bytes]]:
    """MCAP files whose index leads to much more than they hold."""
    yield "listed often.mcap", write_indexed_mcap(_STATE, 2000)
    yield "large and listed often.mcap", write_indexed_mcap(bytes(2_000_000), 2000)
    names = struct.pack("<I", 5_000_000) + struct.pack("<I", 0) * 5_000_000
    yield "names.mcap", write_indexed_mcap(_STATE[:-4] + names, 1)
    yield "numbers.mcap", write_indexed_mcap(_STATE + struct.pack("<I", 4_000_000) + bytes(32_000_000), 1)
    yield "wide states.mcap", write_wide_states()
    yield "json.mcap", write_indexed_mcap(b'{"position":[' + b"0," * 15_000_000 + b"0]}", 1, b"json")
    yield "json depth.mcap", write_indexed_mcap(b"[" * 20_000_000, 1, b"json")
    yield "json objects.mcap", write_indexed_mcap(b"[" + b"{}," * 10_000_000 + b"{}]", 1, b"json")


def write_wide_states() -> bytes:
    """An MCAP file of twelve chunks, each with hundreds of messages of four thousand zeros."""
    schema = struct.pack("<H", 1) + mcap_text(b"sensor_msgs/msg/JointState") + mcap_text(b"ros2msg") + mcap_text(b"")
    channel = struct.pack("<HH", 1, 1) + mcap_text(b"/joint_states") + mcap_text(b"cdr") + mcap_text(b"")
    zeros = struct.pack("<I", 4000) + bytes(4 + 32_000)
    state = b"\0\1\0\0" + bytes(16) + zeros + struct.pack("<I", 0) + zeros
    message = mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + state)
    whole = mcap_file(mcap_record(3, schema) + mcap_record(4, channel) + message * 500)
    return whole + whole[len(MCAP_MAGIC) + 17 :] * 11


def write_bag_field(name: bytes, value: bytes) -> bytes:
    """A field of a header of a ROS 1 bag."""
    return struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value


def write_bag_record(fields: dict[bytes, bytes], data: bytes) -> bytes:
    """A record of a ROS 1 bag."""
    header = b"".join(write_bag_field(name, value) for name, value in fields.items())
    return struct.pack("<I", len(header)) + header + struct.pack("<I", len(data)) + data


def write_bag_bombs() -> Iterator[tuple[str, bytes]]:
    """ROS 1 bags of packed zeros, and of many records."""
    head = b"#ROSBAG V2.0\n"
    for compression, pack in ((b"bz2", bz2.compress), (b"lz4", lz4.frame.compress)):
        size = 200_000_000 if compression == b"bz2" else 20_000_000
        fields = {b"op": b"\x05", b"compression": compression, b"size": struct.pack("<I", size)}
        yield f"{compression.decode()}.bag", head + write_bag_record(fields, pack(bytes(size)))
    yield "records.bag", head + write_bag_record({b"op": b"\x07"}, b"") * (SMALL // 14)
    yield "fields.bag", head + write_bag_record({b"op": b"\x07", **{b"%d" % n: b"" for n in range(5000)}}, b"")


def write_member(content: bytes) -> bytes:
    """A zip archive of one packed array."""
    text = io.BytesIO()
    with zipfile.ZipFile(text, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("t.npy", content)
    return text.getvalue()


def write_npy(header: str, content: bytes = b"") -> bytes:
    """An array by its header."""
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header.encode() + b"\n" + content


def write_npz_bombs() -> Iterator[tuple[str, bytes]]:
    """NumPy archives of zeros, of stated sizes, and of many arrays."""
    head = "{'descr': '<f8', 'fortran_order': False, 'shape': (%s,)}"
    yield "zeros.npz", write_member(write_npy(head % 4_000_000, bytes(32_000_000)))
    yield "stated.npz", write_member(write_npy(head % 10**12, bytes(80)))
    yield "wide.npz", write_member(write_npy(head % "2, 2000000", bytes(32_000_000)))
    yield "nested.npz", write_member(write_npy("(" * 9000))
    text = io.BytesIO()
    arrays: dict[str, Any] = {f"a{n}": np.zeros(1) for n in range(400)}
    np.savez_compressed(text, **arrays)
    yield "many.npz", text.getvalue()


def write_matlab(arrays: dict[str, Any]) -> bytes:
    """A packed MATLAB file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "x.mat")
        savemat(path, arrays, do_compression=True)
        return path.read_bytes()


def write_array_bombs() -> Iterator[tuple[str, bytes]]:
    """MATLAB files of zeros, and JSON that is deep, wide or of many objects."""
    for name, shape in (("zeros", (4_000_000, 1)), ("wide", (2, 2_000_000))):
        yield f"{name}.mat", write_matlab({"q": np.zeros(shape)})
    yield "many.mat", write_matlab({f"a{n}": np.zeros(1) for n in range(400)})
    for suffix, pack in (("gz", gzip.compress), ("bz2", bz2.compress), ("xz", lzma.compress)):
        yield f"zeros.csv.{suffix}", pack(bytes(30_000_000))
        yield f"twice.csv.{suffix}", pack(pack(bytes(30_000_000)))
    yield "deep.json", b'{"a": ' * (SMALL // 6)
    yield "keys.json", json.dumps({f"k{n}": [n] for n in range(SMALL // 14)}).encode()
    yield "objects.jsonl", b"{}\n" * (SMALL // 3)
    yield "sparse.jsonl", b"".join(b'{"k%d":1}\n' % n for n in range(SMALL // 12))


def write_mjcf_bombs() -> Iterator[tuple[str, str]]:
    """MJCF files that have MuJoCo generate much."""
    body = "<worldbody><body><joint/><geom size='1'/></body>%s</worldbody>"
    wrap = "<mujoco>%s</mujoco>"
    yield "depth.xml", wrap % ("<worldbody>" + "<body>" * (SMALL // 7))
    yield "replicate.xml", wrap % (body % "<replicate count='1000000'><body><geom size='1'/></body></replicate>")
    yield (
        "replicate twice.xml",
        wrap % (body % "<replicate count='1000'><replicate count='1000'><geom size='1'/></replicate></replicate>"),
    )
    yield (
        "texture.xml",
        wrap % ("<asset><texture name='a' type='2d' builtin='flat' width='20000' height='20000'/></asset>" + body % ""),
    )
    yield (
        "hfield.xml",
        wrap % ("<asset><hfield name='a' nrow='20000' ncol='20000' size='1 1 1 1'/></asset>" + body % ""),
    )
    yield (
        "flex.xml",
        wrap % (body % "<body><flexcomp name='f' type='grid' count='300 300 30' spacing='1 1 1' dim='3'/></body>"),
    )
    yield "bodies.xml", wrap % (body % ("<body><joint/><geom size='1'/></body>" * (SMALL // 40)))
    yield "size.xml", wrap % ("<size memory='100G' nuserdata='1000000000'/>" + body % "")
    chain = "<body><joint axis='0 0 1'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
    yield "chain.xml", wrap % ("<worldbody>" + chain * 900 + "</body>" * 900 + "</worldbody>")


def write_document_bombs() -> Iterator[tuple[str, str]]:
    """Trajectories that are short to write and long to make."""
    joints = ["joint1", "joint2", "joint3"]
    head = {"schema": "tauscope.trajectory/1", "robot": "paper-arm", "joints": joints}
    still = {"kind": "hold", "position": [0.0, 0.0, 0.0], "duration_s": 1e9}
    yield "long.json", json.dumps({**head, "segments": [still]})
    yield "numbers.json", '{"schema": ' + "9" * SMALL + "}"
    yield "objects.json", "{" + ",".join(f'"k{n}": 0' for n in range(SMALL // 12)) + "}"
    yield "digits.csv", "t,q1,q2,q3\n" + "1" * SMALL + "x,0,0,0\n"
    yield "far.csv", "t,q1,q2,q3\n0,0,0,0\n1e300,0,0,0\n"
