"""The program that holds the lease is killed in the middle of the motion: the arm stops, and the run says why."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from server.http.event_stream import read_events
from server.http.serving import served
from server.queue.paper_files import PAPER_ROBOT
from server.queue.waiting import wait_until
from shared_data import REPOSITORY
from tauscope.trajectory import Trajectory, trajectory_json
from tauscope.trajectory.segments import MoveSegment

pytestmark = pytest.mark.realtime

BEFORE = ("created", "connecting", "enabling", "ramping")
HOLDER = """
import sys
from pathlib import Path
from tauscope.client import Client
client = Client(sys.argv[1])
with client.lease("paper-arm", ttl_s=1.0) as lease:
    client.arm(lease)
    backend = {"name": "sim", "time": "real", "start": [0.0, 0.6, 0.6]}
    run = client.run(Path(sys.argv[2]), lease, Path(sys.argv[3]), backend=backend)
    print(run.id, flush=True)
    client.wait(run)
"""


def long_motion() -> str:
    """A move of a minute."""
    move = MoveSegment(np.array([0.0, 0.6, 0.6]), np.array([0.5, 1.0, 0.0]), 60.0)
    return trajectory_json(Trajectory("paper-arm", ("joint1", "joint2", "joint3"), (move,)))


def test_the_arm_stops_when_its_holder_is_killed(tmp_path: Path) -> None:
    motion = tmp_path / "motion.json"
    motion.write_text(long_motion())
    with served(tmp_path / "data") as service:
        address = str(service.client.base_url)
        arguments = [sys.executable, "-c", HOLDER, address, str(PAPER_ROBOT), str(motion)]
        with subprocess.Popen(arguments, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as holder:
            assert holder.stdout is not None
            run = f"/api/v1/runs/{holder.stdout.readline().strip()}"
            wait_until(lambda: service.client.get(run).json()["state"] not in BEFORE)
            assert service.client.get(run).json()["state"] == "running"
            holder.send_signal(signal.SIGKILL)
        wait_until(lambda: service.client.get(run).json()["state"] not in ("running", "stopping"))
        status = service.client.get(run).json()
        told = list(read_events(service.client.get(f"{run}/events").text.split("\n")))
        assert service.client.get("/api/v1/leases").json() == {"leases": []}
    assert status["state"] == "stopped", status
    assert status["percent"] < 50.0
    assert any("no sign of life for 1 s" in event.data.get("step", "") for event in told)
    entries = [json.loads(line) for line in (tmp_path / "data" / "audit.jsonl").read_text().splitlines()]
    assert "lease ended" in [entry["action"] for entry in entries]
