"""What costly requests do to other callers: the next reading, and a stop beside everything at once.

`bomb` is an MCAP file of some kilobytes with millions of records; eight clients ask for its report and leave. The stops
are sent beside four clients that have robot files of 1 MB checked, one that sends recordings, one that has a diagnosis
made, and 200 readers. All of these are processes of their own: the clock is read by a process that does nothing else.
"""

import argparse
import json
import os
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from http.client import HTTPConnection
from multiprocessing import get_context
from pathlib import Path

import httpx2
import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from benchmarks.benchmark_readers import readers  # noqa: E402
from reliability.costly_inputs import write_mcap_bombs  # noqa: E402
from server.http.serving import served  # noqa: E402
from server.queue.paper_files import PAPER_ROBOT, write_recording  # noqa: E402

MOST_NEXT_S = 5.0
"""How long the next caller may wait, the start of a process included [s]."""

MOST_STOP_S = 0.05
"""99 of 100 stops are answered within this time on two quiet cores [s]."""

CSV = b"t,q1,tau1\n" + b"".join(b"%.2f,0.1,%.1f\n" % (0.01 * k, k % 3) for k in range(50))
YAML = b"name: " + b"a " * 500_000
API = "/api/v1"


def main() -> None:
    """Print the times; exit status 1 where one is too long."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=300)
    parser.add_argument("--readers", type=int, default=200)
    words = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before")
    with tempfile.TemporaryDirectory() as folder:
        recordings = [write_recording(Path(folder) / f"{seed}.csv", seed=seed).read_bytes() for seed in (1, 2)]
        with served(Path(folder) / "data") as service:
            next_s = time_next_caller(service.client)
            print(f"the next caller after eight that left: {next_s:.2f} s (at most {MOST_NEXT_S:g})", flush=True)
            stop_s = time_stops(service.client, recordings, words.readers, words.stops)
    sys.exit(next_s > MOST_NEXT_S or stop_s > MOST_STOP_S)


def time_next_caller(client: httpx2.Client) -> float:
    """How long a report takes behind eight of a bomb whose clients have gone [s]."""
    bomb = dict(write_mcap_bombs())["empty records"]
    for name, content in (("bomb.mcap", bomb), ("plain.csv", CSV)):
        client.post(f"{API}/recordings", files={"file": (name, content)})
    address = (client.base_url.host, client.base_url.port)
    for _ in range(8):
        with socket.create_connection(address) as connection:
            host = f"{address[0]}:{address[1]}"
            connection.sendall(f"GET {API}/recordings/bomb.mcap/report HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            time.sleep(0.05)
    began = time.monotonic()
    client.get(f"{API}/recordings/plain.csv/report").raise_for_status()
    return time.monotonic() - began


def time_stops(client: httpx2.Client, recordings: list[bytes], reader_count: int, stops: int) -> float:
    """p99 of a stop, alone and beside ever more [s]."""
    base, p99_s = str(client.base_url).rstrip("/"), 0.0
    with ExitStack() as stack:
        for beside in ("nothing", "a YAML flood", "uploads", "a diagnosis", f"{reader_count} readers"):
            if beside.endswith("readers"):
                stack.enter_context(readers(base, f"{API}/recordings", reader_count))
            elif beside != "nothing":
                stack.enter_context(load(base, beside, recordings))
            time.sleep(0.0 if beside == "nothing" else 3.0)  # everything has begun
            p99_s = _time_stops(base, beside, stops)
    return p99_s


def _time_stops(base: str, beside: str, stops: int) -> float:
    """p99 of stops, which are printed [s]."""
    times = []
    connection = HTTPConnection(base.removeprefix("http://"), timeout=60)
    for _ in range(stops):
        began = time.monotonic()
        connection.request("POST", f"{API}/stop")
        answer = connection.getresponse()
        answer.read()
        times.append(time.monotonic() - began)
        if answer.status != 202:
            raise SystemExit(f"a stop was answered {answer.status}")
        time.sleep(0.05)
    connection.close()
    p50, p90, p99 = 1e3 * np.percentile(times, [50, 90, 99])
    figures = f"p50 {p50:.1f}, p90 {p90:.1f}, p99 {p99:.1f}, longest {1e3 * max(times):.1f} ms"
    print(f"stop, and beside it {beside}: {figures} (at most {1e3 * MOST_STOP_S:g})", flush=True)
    return 1e-3 * p99


@contextmanager
def load(base: str, kind: str, recordings: list[bytes]) -> Iterator[None]:
    """A process that sends requests of one kind until this ends."""
    process = get_context("spawn").Process(target=send, args=(base, kind, recordings), daemon=True)
    process.start()
    try:
        yield
    finally:
        process.terminate()
        process.join()


def send(base: str, kind: str, recordings: list[bytes]) -> None:
    """Send requests of one kind without end."""
    client = httpx2.Client(base_url=base, timeout=60)
    if kind == "a YAML flood":
        for _ in range(3):
            threading.Thread(target=flood, args=(base,), daemon=True).start()
        flood(base)
    number = 0
    while kind == "uploads":
        number += 1
        client.post(f"{API}/recordings", files={"file": (f"{number}.csv", recordings[0] + b"\n" * number)})
    files = [("robot", ("arm.yaml", PAPER_ROBOT.read_bytes())), ("recordings", ("a.csv", recordings[0]))]
    files.append(("held_out", ("b.csv", recordings[1])))
    while True:
        answer = client.post(f"{API}/diagnoses", files=files, data={"request": json.dumps({})})
        answer.raise_for_status()
        while client.get(answer.headers["location"]).json()["state"] in ("queued", "running"):
            time.sleep(0.5)


def flood(base: str) -> None:
    """Have large robot files checked, without end; the body is made once."""
    request = httpx2.Request("POST", f"{base}{API}/robots/check", files={"robot": ("arm.yaml", YAML)})
    body, headers = request.read(), {"Content-Type": request.headers["content-type"]}
    connection = HTTPConnection(base.removeprefix("http://"), timeout=60)
    while True:
        connection.request("POST", f"{API}/robots/check", body, headers)
        connection.getresponse().read()


if __name__ == "__main__":
    main()
