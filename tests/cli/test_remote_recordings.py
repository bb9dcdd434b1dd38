"""Recordings on a local S3 server and on web servers, read as files of the disk are, and no more of them."""

import csv
import re
import sys
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType

from cli.conftest import Ended
from cli.simulated_files import SimulatedFiles
from recording.recording_files import arrays, messages, rows_of, write_database, write_log
from recording.test_mcap_index import write_camera_log
from server.queue.executors import InlineExecutor
from tauscope.errors import MissingExtraError, RecordingError
from tauscope.recording import read_recording
from tauscope.recording.reading import read_header

pytest.importorskip("upath")
s3fs: Any = pytest.importorskip("s3fs")
moto_server: Any = pytest.importorskip("moto.server")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
FILES = ("log.mcap", "log.db3", "log.npz", "log.csv", "log.parquet", "bag")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, files: SimulatedFiles) -> Path:
    """A recording in each format, and a robot with its own."""
    folder, motion = tmp_path_factory.mktemp("lab"), arrays(400)
    write_camera_log(folder / "log.mcap", CompressionType.NONE, mixes=True)
    write_database(folder / "log.db3", messages(400))
    np.savez(folder / "log.npz", t=motion["time"], q1=motion["position"][:, 0], tau1=motion["effort"][:, 0])
    rows = np.column_stack([motion["time"], motion["position"], motion["effort"]])
    lines = ["t,q1,q2,tau1,tau2", *(",".join(map(repr, row)) for row in rows.tolist())]
    (folder / "log.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    if arrow := pytest.importorskip("pyarrow"):
        from pyarrow import parquet

        names = lines[0].split(",")
        parquet.write_table(arrow.table(dict(zip(names, rows.T, strict=True))), folder / "log.parquet")
    (folder / "bag").mkdir()
    for number in (0, 1):
        write_log(
            folder / "bag" / f"x_{number}.mcap", {"/joint_states": messages(400)[200 * number : 200 * number + 200]}
        )
    metadata = "rosbag2_bagfile_information: {relative_file_paths: [x_0.mcap, x_1.mcap]}\n"
    (folder / "bag" / "metadata.yaml").write_text(metadata, encoding="utf-8")
    (folder / "robot.yaml").write_bytes(files.robot.read_bytes())
    (folder / "train.csv").write_bytes(files.train[0].read_bytes())
    return folder


@pytest.fixture(scope="module")
def bucket(folder: Path) -> Iterator[str]:
    """The folder on a local S3 server."""
    server = moto_server.ThreadedMotoServer("127.0.0.1", 0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "AWS_ENDPOINT_URL": f"http://{host}:{port}",
            "AWS_ACCESS_KEY_ID": "key",
            "AWS_SECRET_ACCESS_KEY": "secret",
            "AWS_DEFAULT_REGION": "us-east-1",
            "AWS_EC2_METADATA_DISABLED": "true",
        }.items():
            patch.setenv(name, value)
        store = s3fs.S3FileSystem()
        store.mkdir("lab")
        store.put(str(folder), "lab/night 1/", recursive=True)
        name = next(path for path in store.find("lab") if path.endswith("robot.yaml"))
        yield f"s3://{name.removesuffix('/robot.yaml')}"
        s3fs.S3FileSystem.clear_instance_cache()
    server.stop()


class Ranges(SimpleHTTPRequestHandler):
    """A web server that sends the ranges that it is asked for, and counts their bytes."""

    served: list[int]

    def do_GET(self) -> None:
        data = Path(self.translate_path(self.path)).read_bytes()
        first, last = map(int, re.findall(r"\d+", self.headers.get("Range", f"bytes=0-{len(data) - 1}")))
        part = data[first : last + 1]
        self.served.append(len(part))
        self.send_response(206)
        self.send_header("Content-Range", f"bytes {first}-{first + len(part) - 1}/{len(data)}")
        self.send_header("Content-Length", str(len(part)))
        self.end_headers()
        self.wfile.write(part)

    def log_message(self, *words: Any) -> None:
        """Say nothing."""


class WholeFiles(SimpleHTTPRequestHandler):
    """Python's own web server, which knows no ranges."""

    def log_message(self, *words: Any) -> None:
        """Say nothing."""


@pytest.fixture
def serve(folder: Path) -> Iterator[Callable[[type], str]]:
    servers: list[ThreadingHTTPServer] = []

    def start(handler: type) -> str:
        servers.append(ThreadingHTTPServer(("127.0.0.1", 0), partial(handler, directory=str(folder))))
        Thread(target=servers[-1].serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{servers[-1].server_port}"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


@pytest.mark.parametrize("name", FILES)
def test_an_object_is_read_as_a_file_is(bucket: str, folder: Path, name: str) -> None:
    recording = read_recording(f"{bucket}/{name}")
    assert recording.name == f"{bucket}/{name}"
    assert np.array_equal(rows_of(recording), rows_of(read_recording(folder / name)))


@pytest.mark.parametrize("name", [name for name in FILES if name != "bag"])
@pytest.mark.parametrize("handler", [Ranges, pytest.param(WholeFiles, marks=pytest.mark.slow)])
def test_a_web_page_is_read_as_a_file_is(serve: Callable[[type], str], folder: Path, handler: type, name: str) -> None:
    Ranges.served = []
    recording = read_recording(f"{serve(handler)}/{name}")
    assert np.array_equal(rows_of(recording), rows_of(read_recording(folder / name)))


def test_the_index_leads_to_the_ranges_that_are_read(serve: Callable[[type], str], folder: Path) -> None:
    path = write_camera_log(folder / "large.mcap", CompressionType.ZSTD, mixes=False)
    Ranges.served = []
    read_recording(f"{serve(Ranges)}/large.mcap")
    assert sum(Ranges.served) < 0.3 * path.stat().st_size


def test_columns_of_an_object_are_named(bucket: str, folder: Path) -> None:
    for name in ("log.csv", "log.parquet"):
        assert read_header(Path(f"{bucket}/{name}")) == read_header(folder / name)


def test_commands_and_manifests_take_urls(
    bucket: str, run: Callable[..., Ended], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tauscope.cli.fleet_command.open_executor", lambda *_: InlineExecutor())
    ended = run("identify", f"{bucket}/robot.yaml", f"{bucket}/train.csv", "--json", tmp_path / "out.json")
    assert (ended.status, f"{bucket}/train.csv" in (tmp_path / "out.json").read_text(encoding="utf-8")) == (0, True)
    manifest = f"name,robot,recordings,held_out\narm,{bucket}/robot.yaml,{bucket}/train.csv,\n"
    (tmp_path / "fleet.csv").write_text(manifest, encoding="utf-8")
    assert run("fleet", "identify", tmp_path / "fleet.csv", "--out", tmp_path / "out").status == 0
    with (tmp_path / "out" / "table.csv").open(newline="", encoding="utf-8") as file:
        assert [row["state"] for row in csv.DictReader(file)] == ["succeeded"]


def refusal(url: str) -> str:
    with pytest.raises(RecordingError) as caught:
        read_recording(url)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_cannot_be_read_is_said_in_one_line(bucket: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert refusal(f"{bucket}/none.csv") == f"{bucket}/none.csv: no such file"
    assert refusal("s3://nowhere/none.csv") == "s3://nowhere/none.csv: no such file"
    assert refusal("https://127.0.0.1:1/log.csv").startswith("https://127.0.0.1:1/log.csv: Cannot connect to host")
    s3fs.S3FileSystem.clear_instance_cache()
    monkeypatch.delenv("AWS_ACCESS_KEY_ID")
    monkeypatch.delenv("AWS_SECRET_ACCESS_KEY")
    assert "no permission to read it (Unable to locate credentials); sign in" in refusal(f"{bucket}/log.csv")
    s3fs.S3FileSystem.clear_instance_cache()


@pytest.mark.parametrize(("url", "package"), [("s3://a/b", "s3fs"), ("gs://a/b", "gcsfs"), ("https://a/b", "aiohttp")])
def test_a_missing_extra_is_named(url: str, package: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(
        MissingExtraError, match=r"^reading \w+:// needs the cloud extra: pip install 'tauscope\[cloud\]'$"
    ):
        read_recording(url)
