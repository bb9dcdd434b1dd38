"""Whether those who read disturb the control loop: its lateness in a run without readers, and with 200 of them.

The service is a process of its own, as `tauscope serve` runs it; the arm is simulated, by the clock, in another one.
Each reader is a connection that asks again as soon as it is answered: for the run, the lists, the search, the metrics;
and every tenth follows the run's events. Both runs are of the same motion, one after the other, alternating.
"""

import argparse
import asyncio
import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

import httpx2  # noqa: E402
import numpy as np  # noqa: E402

from server.http.serving import served  # noqa: E402
from server.queue.paper_files import PAPER_ROBOT  # noqa: E402
from tauscope.trajectory import Trajectory, trajectory_json  # noqa: E402
from tauscope.trajectory.segments import MoveSegment  # noqa: E402

RUNS = "/api/v1/runs"
START = [0.0, 0.6, 0.6]
PATHS = (RUNS, "/api/v1/items", "/api/v1/recordings", "/metrics", "/healthz")
FOLLOWERS = 10
"""One reader in so many follows the events."""


def swing(duration_s: float) -> bytes:
    """A slow move of the paper's arm."""
    move = MoveSegment(np.array(START), np.array([0.5, 1.0, 0.0]), duration_s)
    return trajectory_json(Trajectory("paper-arm", ("joint1", "joint2", "joint3"), (move,))).encode()


def begin(client: httpx2.Client, duration_s: float, rate_hz: float) -> dict[str, Any]:
    """A run by the clock."""
    request = {"rate_hz": rate_hz, "backend": {"time": "real", "start": START}}
    files = {"robot": ("arm.yaml", PAPER_ROBOT.read_bytes()), "trajectory": ("swing.json", swing(duration_s))}
    answer = client.post(RUNS, files=files, data={"request": json.dumps(request)})
    if answer.status_code != 202:
        raise SystemExit(answer.text)
    return answer.json()


def followed(client: httpx2.Client, run: dict[str, Any]) -> dict[str, Any]:
    """The run once it has ended."""
    with client.stream("GET", run["links"]["events"]) as answer:
        for _ in answer.iter_lines():
            pass
    return client.get(run["links"]["self"]).json()


async def read(base: str, run: str, count: int, tell: Connection) -> None:
    """Read until the other end of the pipe says that it is enough; how many answers of which status there were."""
    limits = httpx2.Limits(max_connections=None)
    seen: Counter[str] = Counter()

    async def ask(client: httpx2.AsyncClient, number: int) -> None:
        while True:
            try:
                answer = await client.get(run if number % 2 else PATHS[number // 2 % len(PATHS)])
                seen[str(answer.status_code)] += 1
            except httpx2.HTTPError as error:
                seen[type(error).__name__] += 1

    async def follow(client: httpx2.AsyncClient) -> None:
        async with client.stream("GET", f"{run}/events") as answer:
            async for line in answer.aiter_lines():
                seen["events"] += line.startswith("event:")

    async with httpx2.AsyncClient(base_url=base, timeout=60, limits=limits) as client:
        tasks = [
            asyncio.create_task(follow(client) if number % FOLLOWERS == 0 else ask(client, number))
            for number in range(count)
        ]
        await asyncio.to_thread(tell.recv)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    tell.send(dict(seen))


def _read_here(base: str, run: str, count: int, tell: Connection) -> None:
    """The same, as the main function of a process."""
    asyncio.run(read(base, run, count, tell))


@contextmanager
def readers(base: str, run: str, count: int) -> Iterator[dict[str, int]]:
    """A process with so many connections; filled with what it has seen on leaving."""
    seen: dict[str, int] = {}
    if count == 0:
        yield seen
        return
    context = get_context("spawn")
    ours, its = context.Pipe()
    process = context.Process(target=_read_here, args=(base, run, count, its))
    process.start()
    try:
        yield seen
    finally:
        ours.send(None)
        if ours.poll(60):
            seen.update(ours.recv())
        process.join(60)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readers", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--rate", type=float, default=200.0, help="of the control loop [Hz]")
    parser.add_argument("--repeats", type=int, default=3)
    words = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before\n")
    print("| readers | p50 [us] | p99 [us] | p99.9 [us] | max [us] | missed periods | state | answers |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="bench-") as folder, served(Path(folder) / "data") as service:
        for _ in range(words.repeats):
            for count in (0, words.readers):
                run = begin(service.client, words.seconds, words.rate)
                with readers(str(service.client.base_url), run["links"]["self"], count) as seen:
                    ended = followed(service.client, run)
                print(_row(count, ended, seen), flush=True)


def _row(count: int, ended: dict[str, Any], seen: dict[str, int]) -> str:
    """One run."""
    timing = ended["timing"]
    late = [f"{timing['lateness_us'][name]:.0f}" for name in ("p50", "p99", "p99.9", "max")]
    missed = f"{timing['missed_periods']} of {timing['cycles'] + timing['missed_periods']}"
    answers = ", ".join(f"{number} x {what}" for what, number in sorted(seen.items())) or "-"
    return f"| {count} | {' | '.join(late)} | {missed} | {ended['state']} | {answers} |"


if __name__ == "__main__":
    main()
