"""Makes the data folder of a version by driving its service; the result is committed, this runs once a release.

python tests/server/store/make_snapshot.py tests/server/store/snapshots/0.1.0.tar.xz
"""

import sys
import tarfile
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from starlette.testclient import TestClient

from server.conftest import connected
from server.queue.executors import InlineExecutor, ManualExecutor
from tauscope.server.http import Settings, create_app

ROBOT = {
    "name": "snapshot-arm",
    "kinematics": {"dh": [{"theta": 0.0, "d": 0.1, "a": 0.3, "alpha": 1.5707963267948966}]},
    "gravity": [0, -9.81, 0],
    "joints": [
        {
            "name": "shoulder",
            "limits": {"position": [-2.0, 2.0], "velocity": 3.0, "acceleration": 20.0, "torque": 40.0},
            "friction_shape": {"k_v": 500, "delta": 10},
        }
    ],
    "model": {
        "links": [
            {
                "mass": 2.0,
                "first_moment": [-0.3, 0.0, 0.0],
                "inertia": {"xx": 0.01, "yy": 0.08, "zz": 0.08, "xy": 0, "xz": 0, "yz": 0},
            }
        ],
        "friction": [{"stiction": 1.0, "stribeck": 0.0, "viscous": 0.4}],
    },
}


def recording(seed: int) -> bytes:
    """Eight seconds at 50 Hz of a link in gravity, with friction."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 8, 0.02)
    w = 2 * np.pi * np.array([0.25, 0.625, 1.0])
    a = rng.uniform(0.2, 0.5, 3)
    q = np.sin(np.outer(t, w)) @ a
    qd = np.cos(np.outer(t, w)) @ (a * w)
    qdd = -np.sin(np.outer(t, w)) @ (a * w**2)
    tau = 0.08 * qdd + 2.9 * np.cos(q) + np.arctan(500 * qd) * 2 / np.pi + 0.4 * qd + 0.05 * rng.standard_normal(t.size)
    rows = "\n".join(f"{a:.2f},{b:.6f},{c:.4f}" for a, b, c in zip(t, q, tau, strict=True))
    return f"t,q1,tau1\n{rows}\n".encode()


def wait(client: TestClient, here: str) -> dict[str, Any]:
    """The state of an item once it has ended."""
    for _ in range(1200):
        answer = client.get(here).json()
        if answer["state"] in ("succeeded", "failed", "finished", "cancelled", "interrupted"):
            return answer
        time.sleep(0.05)
    raise TimeoutError(here)


def fill(folder: Path) -> None:
    """One item of every kind, and of every way to end."""
    api = "/api/v1"
    with connected(create_app(Settings(data_folder=folder), InlineExecutor())) as client:

        def post(path: str, **document: Any) -> dict[str, Any]:
            answer = client.post(f"{api}/{path}", json={"robot": ROBOT, **document})
            while answer.status_code == 409:  # the run has ended, and is being put in order
                time.sleep(0.05)
                answer = client.post(f"{api}/{path}", json={"robot": ROBOT, **document})
            assert answer.status_code == 202, answer.text
            return answer.json()

        for name, seed in (("monday.csv", 1), ("tuesday.csv", 2), ("wednesday.csv", 3)):
            client.post(f"{api}/recordings", files={"file": (name, recording(seed))})
        client.post(f"{api}/recordings", files={"file": ("broken.csv", b"t,q1\n0,0\n")})
        post("identifications", recordings=["monday.csv"], held_out=["tuesday.csv"])
        post("identifications", recordings=["broken.csv"])
        post("diagnoses", recordings=["monday.csv"], held_out=["tuesday.csv"])
        motion = {"duration_s": 4.0, "harmonics": 3, "periods": 1, "slow_postures": 0, "closing_period": False}
        excitation = post("excitations", options=motion)
        run = post("runs", excitation=excitation["id"], rate_hz=50.0)
        print(wait(client, run["links"]["self"])["state"])
        campaign = post(
            "campaigns", excitation={**motion, "periods": 2}, held_out={"periods": 1}, run={"rate_hz": 50.0}
        )
        print(wait(client, campaign["links"]["self"])["state"])
        lost = post("identifications", recordings=["tuesday.csv"])
    (folder / "identifications" / lost["id"] / "state.json").write_bytes(b'{"form": "tausc')
    with connected(create_app(Settings(data_folder=folder), ManualExecutor())) as client:
        answer = client.post(
            f"{api}/identifications", json={"robot": ROBOT, "recordings": ["monday.csv"], "held_out": ["wednesday.csv"]}
        )
        assert answer.status_code == 202


def main(target: Path) -> None:
    """Make the folder, and pack it without owners and with its times."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / "data"
        fill(folder)

        def anonymous(entry: tarfile.TarInfo) -> tarfile.TarInfo | None:
            entry.uid = entry.gid = 0
            entry.uname = entry.gname = ""
            return None if entry.name.endswith("/.lock") else entry

        with tarfile.open(target, "w:xz") as archive:
            archive.add(folder, "data", filter=anonymous)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
