"""Uploads made to do harm: they are refused in words, quickly, and nothing of them stays."""

import io
import zipfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from starlette.testclient import TestClient

from server.conftest import RECORDINGS
from server.http.motions import ROBOT
from server.http.problem_check import assert_problem
from tauscope.recording import inflation

CHECK = "/api/v1/robots/check"
URDF_ROBOT = b"name: arm\nkinematics:\n  urdf: {file: arm.urdf, base: base, tip: tool}\n"
ENTITIES = b'<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>'
OUTSIDE = b'<?xml version="1.0"?><!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>'


def report(client: TestClient, name: str, content: bytes) -> str:
    """What the check of a kept recording says against it."""
    assert client.post(RECORDINGS, files={"file": (name, content)}).status_code == 201
    return assert_problem(client.get(f"{RECORDINGS}/{name}/report"), "recording", 422)["detail"]


@pytest.fixture
def small_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound that a test can reach in a second."""
    monkeypatch.setattr(inflation, "ALWAYS_ACCEPTED_BYTES", 2**20)


@pytest.mark.usefixtures("small_bounds")
def test_a_parquet_bomb(client: TestClient) -> None:
    still = pa.array([0.0] * 500_000)
    file = io.BytesIO()
    pq.write_table(pa.table({"t": still, "q1": still, "tau1": still}), file, compression="zstd")
    assert len(file.getvalue()) < 500_000 * 24 / inflation.LARGEST_RATIO
    assert "unpacks to 12000000 bytes" in report(client, "bomb.parquet", file.getvalue())


@pytest.mark.usefixtures("small_bounds")
@pytest.mark.parametrize(
    ("kind", "index", "words"),
    [
        ("sensor_msgs/msg/JointState", IndexType.ALL, "times its size"),
        ("sensor_msgs/msg/JointState", IndexType.NONE, "times its size"),
        ("X", IndexType.NONE, "times its size"),
        ("X", IndexType.ALL, "it holds the topics /x"),  # nothing is unpacked
    ],
)
def test_an_mcap_bomb(client: TestClient, kind: str, index: IndexType, words: str) -> None:
    file = io.BytesIO()
    writer = Writer(file, compression=CompressionType.ZSTD, index_types=index)
    writer.start()
    channel = writer.register_channel("/x", "json", writer.register_schema(kind, "jsonschema", b"{}"))
    for number in range(30):
        writer.add_message(channel, number, b"0" * 2**20, number)
    writer.finish()
    assert len(file.getvalue()) < 30 * 2**20 / inflation.LARGEST_RATIO
    assert words in report(client, "bomb.mcap", file.getvalue())


def test_what_packs_well_and_is_small_is_no_bomb() -> None:
    inflation.require_plausible_inflation(1, inflation.ALWAYS_ACCEPTED_BYTES, "log.parquet")
    inflation.require_plausible_inflation(2**30, inflation.LARGEST_RATIO * 2**30, "log.parquet")


def test_an_archive_is_no_recording(client: TestClient) -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("log.csv", b"0" * 10**7)
    assert "bomb.csv" in report(client, "bomb.csv", file.getvalue())


@pytest.mark.parametrize("content", [b"t," + b"q" * 3_000_000, b"0," * 1_500_000, b"t,q1,tau1\n" + b"1" * 3_000_000])
def test_a_csv_of_one_endless_line(content: bytes, client: TestClient) -> None:
    assert len(report(client, "line.csv", content)) < 500


def test_a_csv_of_very_many_columns(client: TestClient) -> None:
    header = ",".join(["t", *(f"q{k},tau{k}" for k in range(1, 20_001))])
    assert len(report(client, "wide.csv", f"{header}\n0\n1\n".encode())) < 500


@pytest.mark.parametrize("urdf", [ENTITIES, OUTSIDE], ids=["entities", "external entity"])
def test_xml_entities(urdf: bytes, client: TestClient) -> None:
    answer = client.post(CHECK, files={"robot": ("arm.yaml", URDF_ROBOT), "urdf": ("arm.urdf", urdf)})
    assert answer.status_code == 422
    assert "DOCTYPE" in answer.text
    assert "root:" not in answer.text


def test_a_yaml_of_aliases(client: TestClient) -> None:
    levels = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    levels += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    answer = client.post(CHECK, files={"robot": ("arm.yaml", "\n".join(levels).encode())})
    assert_problem(answer, "robot-file", 422)


@pytest.mark.parametrize("text", ["!!python/object/apply:os.system ['true']", "!!python/name:os.system ''"])
def test_a_yaml_that_would_call(text: str, client: TestClient) -> None:
    assert_problem(client.post(CHECK, files={"robot": ("arm.yaml", f"name: {text}\n".encode())}), "robot-file", 422)


def test_json_nested_without_end(client: TestClient) -> None:
    text = b'{"robot": ' + b"[" * 200_000 + b"]" * 200_000 + b"}"
    answer = client.post(CHECK, content=text, headers={"content-type": "application/json"})
    assert answer.status_code == 422


def files_below(folder: Path) -> set[Path]:
    """All files but the audit log, which grows by every refusal."""
    return {path for path in folder.rglob("*") if path.is_file() and path.name != "audit.jsonl"}


@pytest.mark.parametrize(
    "name", ["../x.csv", "/etc/x.csv", "..", ".hidden", "a/b.csv", "a\\b.csv", "a\x00.csv", "%2e%2e"]
)
def test_names_that_lead_elsewhere(name: str, client: TestClient, tmp_path: Path) -> None:
    before = files_below(tmp_path)
    answer = client.post(RECORDINGS, files={"file": (name, b"t,q1,tau1\n")})
    assert answer.status_code == 422
    assert files_below(tmp_path) == before
    assert client.get(f"{RECORDINGS}/{name.replace('/', '%2F').replace(chr(0), '%00')}/content").status_code in (
        404,
        422,
    )


def test_a_robot_names_no_file_of_the_server(client: TestClient) -> None:
    robot = {**ROBOT, "kinematics": {"urdf": {"file": "/etc/passwd", "base": "a", "tip": "b"}}}
    assert "was not sent" in assert_problem(client.post(CHECK, json={"robot": robot}), "robot-file", 422)["detail"]
