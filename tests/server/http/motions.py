"""A robot of two joints, and motions that it can play."""

import json
from typing import Any

import numpy as np

from tauscope.trajectory import Trajectory, trajectory_json
from tauscope.trajectory.segments import MoveSegment

ROBOT: dict[str, Any] = {
    "name": "two-joint-arm",
    "kinematics": {
        "dh": [
            {"theta": 0.0, "d": 0.3, "a": 0.0, "alpha": 1.5707963267948966},
            {"theta": 0.0, "d": 0.0, "a": 0.5, "alpha": 0.0},
        ]
    },
    "joints": [
        {"name": "joint1", "limits": {"position": [-2.9, 2.9], "velocity": 2.0}},
        {"name": "joint2", "limits": {"position": [-2.9, 2.9], "velocity": 2.0}},
    ],
    "model": {
        "links": [
            {
                "mass": 2.0,
                "first_moment": [0.0, 0.0, 0.0],
                "inertia": {"xx": 0.02, "yy": 0.02, "zz": 0.02, "xy": 0.0, "xz": 0.0, "yz": 0.0},
            },
            {
                "mass": 1.0,
                "first_moment": [-0.25, 0.0, 0.0],
                "inertia": {"xx": 0.01, "yy": 0.09, "zz": 0.09, "xy": 0.0, "xz": 0.0, "yz": 0.0},
            },
        ]
    },
}
ROBOT_FILE = json.dumps(ROBOT).encode()
QUICK_DESIGN = {
    "duration_s": 4.0,
    "harmonics": 2,
    "periods": 2,
    "starts": 1,
    "slow_postures": 0,
    "closing_period": False,
}
"""Options of an excitation that is designed within a tenth of a second."""


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
