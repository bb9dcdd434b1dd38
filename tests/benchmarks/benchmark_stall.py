"""What small costly requests do to other callers: the next reading, and a stop beside a flood of YAML.

`bomb` is an MCAP file of some kilobytes with millions of records; eight clients ask for its report and leave.
"""

import socket
import statistics
import sys
import tempfile
import threading
import time
from pathlib import Path

import httpx2

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from reliability.costly_inputs import write_mcap_bombs  # noqa: E402
from server.http.serving import served  # noqa: E402

MOST_NEXT_S = 5.0
"""How long the next caller may wait, the start of a process included [s]."""

MOST_STOP_S = 0.05
"""99 of 100 stops are answered within this time on two quiet cores [s]."""

CSV = b"t,q1,tau1\n" + b"".join(b"%.2f,0.1,%.1f\n" % (0.01 * k, k % 3) for k in range(50))
STOPS = 100


def main() -> None:
    """Print both times; exit status 1 where one is too long."""
    with tempfile.TemporaryDirectory() as folder, served(Path(folder) / "data") as service:
        next_s, stop_s = time_next_caller(service.client), time_stops(service.client)
    print(f"the next caller after eight that left: {next_s:.2f} s (at most {MOST_NEXT_S:g})")
    print(f"stop beside a flood of YAML, p99: {stop_s * 1e3:.0f} ms (at most {MOST_STOP_S * 1e3:g})")
    sys.exit(next_s > MOST_NEXT_S or stop_s > MOST_STOP_S)


def time_next_caller(client: httpx2.Client) -> float:
    """How long a report takes behind eight of a bomb whose clients have gone [s]."""
    bomb = dict(write_mcap_bombs())["empty records"]
    for name, content in (("bomb.mcap", bomb), ("plain.csv", CSV)):
        client.post("/api/v1/recordings", files={"file": (name, content)})
    address = (client.base_url.host, client.base_url.port)
    for _ in range(8):
        with socket.create_connection(address) as connection:
            host = f"{address[0]}:{address[1]}"
            connection.sendall(f"GET /api/v1/recordings/bomb.mcap/report HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            time.sleep(0.05)
    began = time.monotonic()
    client.get("/api/v1/recordings/plain.csv/report").raise_for_status()
    return time.monotonic() - began


def time_stops(client: httpx2.Client) -> float:
    """p99 of a stop while four clients have robot files of 1 MB checked [s]."""
    text, is_over = b"name: " + b"a " * 500_000, threading.Event()

    def flood() -> None:
        with httpx2.Client(base_url=client.base_url, timeout=60) as own:
            while not is_over.is_set():
                own.post("/api/v1/robots/check", files={"robot": ("arm.yaml", text)})

    threads = [threading.Thread(target=flood) for _ in range(4)]
    for thread in threads:
        thread.start()
    times = []
    for _ in range(STOPS):
        began = time.monotonic()
        client.post("/api/v1/stop").raise_for_status()
        times.append(time.monotonic() - began)
        time.sleep(0.05)
    is_over.set()
    for thread in threads:
        thread.join()
    return statistics.quantiles(times, n=100)[-1]


if __name__ == "__main__":
    main()
