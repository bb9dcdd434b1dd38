"""A robot of two joints, and motions that it can play."""

import json
from typing import Any

import numpy as np

from tauscope.server.http.robots.models import EXAMPLE_ROBOT
from tauscope.trajectory import MoveSegment, Trajectory, trajectory_json

ROBOT: dict[str, Any] = EXAMPLE_ROBOT
ROBOT_FILE = json.dumps(ROBOT).encode()


def move_document() -> dict[str, Any]:
    """A straight move of one second, as a trajectory document."""
    move = MoveSegment(np.zeros(2), np.array([0.3, -0.2]), 1.0)
    return json.loads(trajectory_json(Trajectory("two-joint-arm", ("joint1", "joint2"), (move,))))


def move_csv() -> bytes:
    """The same as samples."""
    time = np.linspace(0.0, 1.0, 101)
    s = time**3 * (10.0 - 15.0 * time + 6.0 * time**2)
    lines = [f"{t:.2f},{0.3 * x!r},{-0.2 * x!r}" for t, x in zip(time.tolist(), s.tolist(), strict=True)]
    return "\n".join(["t,q1,q2", *lines, ""]).encode()
