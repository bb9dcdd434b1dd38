"""No small file of any format costs more than a second of processor time or 200 MB; else it is refused at the bound."""

import statistics
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest

from reliability.costly_archives import (
    write_array_bombs,
    write_bag_bombs,
    write_document_bombs,
    write_indexed_bombs,
    write_mjcf_bombs,
    write_npz_bombs,
)
from reliability.costly_inputs import (
    mix,
    write_csv_bombs,
    write_mcap_bombs,
    write_parquet_bomb,
    write_rosbag_bomb,
    write_trajectory_bombs,
    write_xml_bombs,
    write_yaml_bombs,
)
from server.queue.paper_files import PAPER_ROBOT
from tauscope.errors import TauscopeError
from tauscope.robot import check_robot, read_robot
from tauscope.server.queue.received_files import check_kept_recording, check_received_robot
from tauscope.server.queue.worker_pool import WorkerPool
from tauscope.trajectory import read_trajectory

MOST_S = 1.0
"""Processor time that a small file may take, on a machine that does `work_plainly` in `PLAIN_S` [s]."""

PLAIN_S = 0.006

MOST_BYTES = 200 * 2**20
"""Memory that it may take."""

SEEDS = 40


def measure(kind: str, path: Path) -> tuple[float, int, str]:
    """Processor time, memory at its peak, and what came of it; in a worker process."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak begins anew
    before, began = read_memory("VmRSS"), time.process_time()
    try:
        if kind == "robot":
            check_robot(path)
        elif kind == "received robot":
            check_received_robot(path.parent, path.name)
        elif kind == "trajectory":
            read_trajectory(path, read_robot(PAPER_ROBOT))
        else:
            check_kept_recording(path, None)
        outcome = "read"
    except TauscopeError as error:
        outcome = str(error)
    return time.process_time() - began, read_memory("VmHWM") - before, outcome


def work_plainly() -> float:
    """Processor time of a fixed piece of work [s]."""
    began, entries = time.process_time(), {}
    for number in range(40_000):
        entries[str(number)] = number
    return time.process_time() - began


def measure_slowness() -> float:
    """How many times longer this machine takes, as long as it has other work."""
    return max(1.0, statistics.median(work_plainly() for _ in range(50)) / PLAIN_S)


def read_memory(name: str) -> int:
    """Memory of this process, as the kernel counts it [bytes]."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))


@pytest.fixture(scope="module")
def pool(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorkerPool]:
    with WorkerPool(1, deadline_s=60.0) as pool:
        folder = tmp_path_factory.mktemp("warm")
        for kind, name in (("robot", "x.yaml"), ("recording", "x.csv"), ("recording", "x.mcap"), ("robot", "x.urdf")):
            pool.submit(measure, kind, Path(name)).result()  # what it imports counts to no file
        for kind, name, content in (
            ("recording", "x.npz", dict(write_npz_bombs())["many.npz"]),
            ("recording", "x.bag", b"#ROSBAG V2.0\n"),
            (
                "received robot",
                "x.xml",
                b"<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>",
            ),
        ):
            (folder / name).write_bytes(content)
            pool.submit(measure, kind, folder / name).result()
        yield pool


def list_bombs() -> Iterator[tuple[str, str, bytes]]:
    """Kind, file name and content of every bomb of text or MCAP."""
    texts = {"yaml": list(write_yaml_bombs()), "urdf": list(write_xml_bombs()), "csv": list(write_csv_bombs())}
    for suffix, found in texts.items():
        kind = "recording" if suffix == "csv" else "robot"
        for name, text in found:
            yield kind, f"{name}.{suffix}", text.encode()
        for seed in range(SEEDS):
            yield kind, f"mix {seed}.{suffix}", mix([text for _, text in found], seed).encode()
    for name, text in write_trajectory_bombs():
        yield "trajectory", f"{name}.{'csv' if name == 'csv' else 'json'}", text.encode()
    for name, content in write_mcap_bombs():
        yield "recording", f"{name}.mcap", content
    for name, content in (*write_indexed_bombs(), *write_bag_bombs(), *write_npz_bombs(), *write_array_bombs()):
        yield "recording", name, content
    for name, text in write_mjcf_bombs():
        yield "received robot", name, text.encode()
    for name, text in write_document_bombs():
        yield "trajectory", name, text.encode()


@pytest.mark.slow
def test_no_small_file_is_costly(pool: WorkerPool, tmp_path: Path) -> None:
    found: list[str] = []
    files = [
        *((kind, name) for kind, name, _ in list_bombs()),
        ("recording", "bomb.db3"),
        ("recording", "bomb.parquet"),
    ]
    for _, name, content in list_bombs():
        (tmp_path / name).write_bytes(content)
    write_rosbag_bomb(tmp_path / "bomb.db3")
    write_parquet_bomb(tmp_path / "bomb.parquet")
    for kind, name in files:
        future: Future[tuple[float, int, str]] = pool.submit(measure, kind, tmp_path / name)
        seconds, size, outcome = future.result(120.0)
        if seconds > MOST_S:
            seconds /= pool.submit(measure_slowness).result(120.0)
        if seconds > MOST_S or size > MOST_BYTES:
            found.append(f"{name}: {seconds:.2f} s, {size / 2**20:.0f} MiB: {outcome[-120:]}")
    assert not found, "\n".join(found)


@pytest.mark.slow
def test_the_measure_sees_memory(pool: WorkerPool) -> None:
    used = pool.submit(hold, 50 * 2**20).result(60.0)
    assert used >= 50 * 2**20


def hold(size: int) -> int:
    """Take memory, and tell how much the measure sees of it."""
    before = read_memory("VmRSS")
    taken = bytearray(b"x") * size
    return read_memory("VmHWM") - before if taken else 0
