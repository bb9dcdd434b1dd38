"""How long a stop takes, from its request on, alone and with 200 readers: answered, last command, arm stopped.

Service, control process and simulated arm as in `benchmark_readers.py`, whose readers these are. Every stop is of a
run of its own, which moves; the moments are of the machine's clocks: when the request is sent, when it is answered,
when the loop has last told the arm to go on, and when the arm has braked and the control process let go of it.
"""

import argparse
import os
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

import httpx2  # noqa: E402
import numpy as np  # noqa: E402

from benchmarks.benchmark_readers import begin, followed, readers  # noqa: E402
from server.http.serving import served  # noqa: E402
from tauscope.recording.journal_reading import read_journal  # noqa: E402
from tauscope.runtime.states import RunState  # noqa: E402
from tauscope.server.control.run import RunWorkspace  # noqa: E402

MOTION_S = 60.0
"""Longer than any run is left to move."""

RATE_HZ = 200.0
MOMENTS = ("answered", "the last command of the motion", "the arm has stopped")


def stopped(client: httpx2.Client, runs: Path, number: int, count: int) -> tuple[float, float, float]:
    """Seconds from the request for a stop until each of the `MOMENTS`."""
    run = begin(client, MOTION_S, RATE_HZ)
    with readers(str(client.base_url), run["links"]["self"], count):
        while client.get(run["links"]["self"]).json()["state"] != RunState.RUNNING:
            time.sleep(0.05)
        time.sleep(0.5 + 0.013 * (number % 10))  # at another place of a cycle each time
        sent, sent_ns = datetime.now(UTC), time.monotonic_ns()
        answer = client.post(run["links"]["stop"])
        answered_ns = time.monotonic_ns()
        if answer.status_code != 202:
            raise SystemExit(answer.text)
        ended = followed(client, run)
    workspace = RunWorkspace(runs / run["id"])
    record = workspace.read_record()
    if record is None or ended["state"] != RunState.STOPPED:
        raise SystemExit(f"{run['id']}: is {ended['state']}")
    last_ns = int(read_journal(workspace.recording("mcap")).rows["time_ns"][-1])
    (at,) = (each.at for each in record.history if each.state is RunState.STOPPING)
    return 1e-9 * (answered_ns - sent_ns), max(0.0, 1e-9 * (last_ns - sent_ns)), (at - sent).total_seconds()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readers", type=int, default=200)
    parser.add_argument("--stops", type=int, default=100)
    words = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} before\n")
    print("| readers | stops | until | p50 [ms] | p90 [ms] | p99 [ms] | longest [ms] |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory(prefix="bench-") as folder, served(Path(folder) / "data") as service:
        for count in (0, words.readers):
            runs = Path(folder) / "data" / "runs"
            times = np.array([stopped(service.client, runs, number, count) for number in range(words.stops)])
            for what, column in zip(MOMENTS, times.T, strict=True):
                figures = [f"{1e3 * value:.1f}" for value in (*np.percentile(column, [50, 90, 99]), column.max())]
                print(f"| {count} | {words.stops} | {what} | {' | '.join(figures)} |", flush=True)


if __name__ == "__main__":
    main()
