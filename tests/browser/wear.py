"""An arm whose friction has grown in six weeks, as a service knows it: identified three times, a schedule set up."""

import json
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from server.http.serving import Served, served
from server.queue.paper_files import PAPER_ROBOT
from tauscope.robot import read_robot
from tauscope_sim.motion import random_fourier_motion
from tauscope_sim.recording import simulate_recording, write_recording_csv

ROBOT = "paper-arm"
VISCOUS = (0.5, 0.75, 1.0)
"""Of joint 1, as it was at each identification [Nm s/rad]."""

AGES = (timedelta(weeks=6), timedelta(weeks=3), timedelta(0))
NIGHTLY = {
    "kind": "identification",
    "cron": "0 2 * * mon-fri",
    "timezone": "Europe/Berlin",
    "window": {"start": "22:00", "end": "05:00"},
    "recordings": {"pattern": "cell3-*.csv"},
}


def make_history(data: Path) -> list[str]:
    """A data folder with three identifications of an arm that wears, the oldest first; returns their identifiers."""
    with served(data) as service:
        made = [identify(service, data, age, viscous) for age, viscous in enumerate(VISCOUS)]
    for identifier, age in zip(made, AGES, strict=True):
        state = data / "identifications" / identifier / "state.json"
        record = json.loads(state.read_text(encoding="utf-8"))
        created = datetime.fromisoformat(record["created"]) - age
        state.write_text(json.dumps({**record, "created": created.isoformat()}), encoding="utf-8")
    # The index is made anew from the folders at the next start, and the models are judged by their age.
    for file in data.glob("tauscope.db*"):
        file.unlink()
    return made


def identify(service: Served, data: Path, number: int, viscous: float) -> str:
    """Identify the arm with a friction of that time; returns the identification's identifier."""
    files = [
        ("robot", ("arm.yaml", PAPER_ROBOT.read_bytes())),
        ("recordings", (f"train-{number}.csv", recorded(data, 2 * number + 1, viscous))),
        ("held_out", (f"held-{number}.csv", recorded(data, 2 * number + 2, viscous))),
    ]
    answer = service.client.post("/api/v1/identifications", files=files)
    assert answer.status_code == 202, answer.text
    here = answer.headers["location"]
    service.client.get(f"{here}/events")  # answered to its end when the identification has ended
    assert service.client.get(here).json()["state"] == "succeeded"
    return answer.json()["id"]


def recorded(folder: Path, seed: int, viscous: float) -> bytes:
    """A recording of the paper's arm with another viscous friction at its first joint."""
    robot, rng = read_robot(PAPER_ROBOT), np.random.default_rng(seed)
    assert robot.model is not None
    assert robot.model.friction is not None
    friction = (replace(robot.model.friction[0], viscous=viscous), *robot.model.friction[1:])
    worn = replace(robot, model=replace(robot.model, friction=friction))
    motion = random_fourier_motion(worn.joints, rng)
    recording = simulate_recording(worn, motion, rate_hz=100.0, periods=2, noise_std=[0.5, 0.3, 0.7], rng=rng)
    path = folder / f"recorded-{seed}.csv"
    write_recording_csv(path, recording, worn.joints)
    content = path.read_bytes()
    path.unlink()
    return content


def set_up_schedule(service: Served, like: str, **changes: Any) -> dict[str, Any]:
    """A schedule that repeats something; returns what the service says of it."""
    body = {"like": like, "definition": changes}
    answer = service.client.put("/api/v1/schedules/cell3-nightly", json=body)
    assert answer.status_code == 200, answer.text
    return answer.json()
