"""Small files that are costly to read: bombs of every format, and what a seeded generator makes of their parts."""

import json
import random
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import zstandard

from tauscope.recording.mcap_format import MCAP_MAGIC

SMALL = 100_000
"""Largest file that counts as small [bytes]."""

Write = Callable[[Path], None]


def write_yaml_bombs() -> Iterator[tuple[str, str]]:
    """Texts that a YAML reader may take long for."""
    yield "brackets", "[" * SMALL
    yield "braces", "{a: " * (SMALL // 4)
    yield "entries", "[" + "1," * (SMALL // 2 - 1) + "]"
    yield "keys", "".join(f"k{number}: 1\n" for number in range(SMALL // 9))
    yield "scalar", "name: " + "a" * SMALL
    yield "words", "name: " + "a " * (SMALL // 2)
    yield "quoted", 'name: "' + "\\x41" * (SMALL // 4) + '"'
    yield "folded", "name: >\n" + "  a\n" * (SMALL // 4)
    yield "comments", "name: x\n" + "# c\n" * (SMALL // 4)
    yield "blank", "name: x\n" + "\n" * SMALL
    yield "documents", "---\n" * (SMALL // 4)
    yield "anchors", "".join(f"k{number}: &a{number} 1\n" for number in range(SMALL // 16))
    yield "laughs", "\n".join(["a0: &a0 [x]", *(f"a{n}: &a{n} [{f'*a{n - 1},' * 9}]" for n in range(1, 12))])
    yield "complex keys", "? a\n" * (SMALL // 4)
    yield "numbers", "k: " + "9" * SMALL
    yield "directives", "%TAG ! x\n" * (SMALL // 9)
    yield "tags", "k: " + "!!str " * (SMALL // 6) + "x"
    yield "indents", "".join(f"{' ' * depth}k:\n" for depth in range(400))
    yield "json", json.dumps({"name": "x", "joints": [{}] * (SMALL // 4)})


def write_xml_bombs() -> Iterator[tuple[str, str]]:
    """Texts that a URDF reader may take long for."""
    yield "depth", "<robot name='x'>" + "<a>" * (SMALL // 3)
    yield "siblings", "<robot name='x'>" + "<link/>" * (SMALL // 7) + "</robot>"
    yield "attributes", "<robot " + " ".join(f"a{n}=''" for n in range(SMALL // 10)) + "/>"
    yield (
        "laughs",
        (
            "<!DOCTYPE r [<!ENTITY a0 'x'>"
            + "".join(f"<!ENTITY a{n} '{f'&a{n - 1};' * 10}'>" for n in range(1, 10))
            + "]><robot name='&a9;'/>"
        ),
    )
    links = "".join(f"<link name='l{n}'/>" for n in range(800))
    joints = "".join(
        f"<joint name='j{n}' type='revolute'><parent link='l{n}'/><child link='l{n + 1}'/></joint>" for n in range(799)
    )
    yield "chain", f"<robot name='x'>{links}{joints}</robot>"
    fixed = joints.replace("revolute", "fixed")
    yield "fixed chain", f"<robot name='x'>{links}{fixed}</robot>"
    star = "".join(
        f"<joint name='j{n}' type='revolute'><parent link='l0'/><child link='l{n + 1}'/></joint>" for n in range(799)
    )
    yield "star", f"<robot name='x'>{links}{star}</robot>"
    yield "mjcf", "<mujoco><worldbody>" + "<body>" * (SMALL // 6)


def write_csv_bombs() -> Iterator[tuple[str, str]]:
    """Texts that a CSV reader may take long for."""
    rows = "".join(f"{n},0,0\n" for n in range(SMALL // 12))
    yield "rows", "t,q1,tau1\n" + rows
    yield "columns", ",".join(["t", *(f"q{n}" for n in range(1, 8000)), *(f"tau{n}" for n in range(1, 8000))])
    yield "wide", ",".join(f"c{n}" for n in range(9000)) + "\n" + ",".join(["1"] * 9000)
    yield "digits", "t,q1,tau1\n" + "9" * SMALL + ",0,0\n"
    yield "exponents", "t,q1,tau1\n" + "1e999999999,0,0\n" * (SMALL // 16)
    yield "quotes", "t,q1,tau1\n" + '"' * SMALL
    yield "comments", "# x\n" * (SMALL // 4) + "t,q1,tau1\n0,0,0\n"
    yield "empty lines", "t,q1,tau1\n" + "\n" * SMALL
    yield "header", "t" * SMALL
    yield "numbers in a name", "1a" * (SMALL // 2)
    yield "digits in a name", "t,q1,tau1,q" + "1" * (SMALL // 2)
    yield "same names", ",".join(["q1"] * (SMALL // 3))
    yield "alike names", ",".join(f"actual_q_{n}" for n in range(SMALL // 14)) + "\n"
    yield "semicolons", "t;q1;tau1\n" + "0,1;0,2;0,3\n" * (SMALL // 12)
    yield "words", "t,q1,tau1\n" + "a,b,c\n" * (SMALL // 6)
    yield "times", "t,q1,tau1\n" + "2026-11-29T07:00:00.000Z,0,0\n" * (SMALL // 30)


def mcap_file(content: bytes, compression: bytes = b"zstd", declared: int | None = None) -> bytes:
    """An MCAP file of one chunk."""
    packed = zstandard.compress(content, 19) if compression == b"zstd" else content
    size = len(content) if declared is None else declared
    body = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression
    body += struct.pack("<Q", len(packed)) + packed
    header = struct.pack("<II", 0, 0)
    return MCAP_MAGIC + struct.pack("<BQ", 1, len(header)) + header + struct.pack("<BQ", 6, len(body)) + body


def mcap_record(kind: int, body: bytes) -> bytes:
    """A record of an MCAP file."""
    return struct.pack("<BQ", kind, len(body)) + body


def mcap_text(text: bytes) -> bytes:
    """A string as MCAP writes it."""
    return struct.pack("<I", len(text)) + text


def write_mcap_bombs() -> Iterator[tuple[str, bytes]]:
    """Files that an MCAP reader may take long for."""
    schema = mcap_record(
        3, struct.pack("<H", 1) + mcap_text(b"sensor_msgs/msg/JointState") + mcap_text(b"ros2msg") + mcap_text(b"")
    )
    channel = mcap_record(
        4, struct.pack("<HH", 1, 1) + mcap_text(b"/joint_states") + mcap_text(b"cdr") + mcap_text(b"")
    )
    message = mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0))
    state = b"\0\1\0\0" + bytes(12)
    yield "empty records", mcap_file(mcap_record(0x80, b"") * 7_000_000)
    yield "short records", mcap_file(mcap_record(0x80, b"x") * 6_000_000)
    yield "empty messages", mcap_file(schema + channel + message * 2_000_000)
    yield (
        "joint states",
        mcap_file(schema + channel + mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + state) * 1_000_000),
    )
    many = state + struct.pack("<I", 2**30)
    yield "many names", mcap_file(schema + channel + mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + many) * 1000)
    yield (
        "long message",
        mcap_file(schema + channel + mcap_record(5, struct.pack("<HIQQ", 1, 0, 0, 0) + bytes(60_000_000))),
    )
    yield "large chunk", mcap_file(mcap_record(0x80, bytes(200_000_000)))
    yield "stated size", mcap_file(b"x", declared=2**27)
    yield (
        "channels",
        mcap_file(
            b"".join(
                mcap_record(4, struct.pack("<HH", n, 1) + mcap_text(b"/t%d" % n) + mcap_text(b"cdr") + mcap_text(b""))
                for n in range(60_000)
            )
        ),
    )
    one = mcap_file(mcap_record(0x80, bytes(60_000_000)))
    chunk = one[len(MCAP_MAGIC) + 17 :]
    yield "chunks", one + chunk * 16


def write_rosbag_bomb(path: Path) -> None:
    """A rosbag2 database whose messages are zeros."""
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
        database.execute(
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)"
        )
        database.execute("INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr')")
        rows = ((n, 1, n, b"\0\1\0\0" + bytes(12)) for n in range(2000))
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
    database.close()


def write_parquet_bomb(path: Path) -> None:
    """A Parquet file of many equal rows."""
    import pyarrow
    import pyarrow.parquet

    rows = 20_000_000
    column = pyarrow.DictionaryArray.from_arrays(pyarrow.array([0]).take(pyarrow.repeat(0, rows)), pyarrow.array([0.5]))
    table = pyarrow.table(dict.fromkeys(("t", "q1", "tau1"), column))
    pyarrow.parquet.write_table(table, path, compression="zstd")


def write_trajectory_bombs() -> Iterator[tuple[str, str]]:
    """Documents that a trajectory reader may take long for."""
    yield "depth", "[" * SMALL
    yield (
        "segments",
        json.dumps({"schema": "tauscope.trajectory/1", "robot": "x", "joints": ["j"], "segments": [{}] * (SMALL // 4)}),
    )
    yield "csv", "t,q1\n" + "".join(f"{n}.0,0\n" for n in range(SMALL // 10))


def mix(texts: list[str], seed: int) -> str:
    """A text made of pieces of others, repeated."""
    choice = random.Random(seed)
    pieces = []
    for _ in range(choice.randint(1, 6)):
        text = choice.choice(texts)
        start = choice.randrange(max(1, len(text)))
        pieces.append(text[start : start + choice.randint(1, 60)] * choice.randint(1, 2000))
    return "".join(pieces)[:SMALL]
