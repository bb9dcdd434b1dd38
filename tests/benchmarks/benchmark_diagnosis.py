"""How long a diagnosis takes and how much memory: six joints, three recordings of 30 s at 500 Hz, the whole catalogue.

    python tests/benchmarks/benchmark_diagnosis.py

The arm is simulated in virtual time, sound, with a worn bearing, and with a spring beside that; then what no catalogue
has is added to the sound arm's torque, as large as its noise. Recordings are read from CSV, and each diagnosis runs in
a process of its own, from reading to the finished document. Run it alone.
"""

import json
import pickle
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from concealed.generator.arms import NOISE_STD, arm_named, without_truth  # noqa: E402
from concealed.generator.forward import Passage  # noqa: E402
from concealed.generator.unknown import UNKNOWN  # noqa: E402
from tauscope.diagnosis import diagnose, document  # noqa: E402
from tauscope.recording import Recording, read_recording, write_recording  # noqa: E402
from tauscope.robot import Robot  # noqa: E402
from tauscope.runtime.drivers import make_backend  # noqa: E402
from tauscope.runtime.options import RunOptions  # noqa: E402
from tauscope.runtime.run import run_trajectory  # noqa: E402
from tauscope.trajectory import FourierSegment, FourierSeries, Trajectory  # noqa: E402

ARM = "six"
RATE_HZ = 500.0
PERIOD_S = 10.0
PERIODS = 3
RECORDINGS = 3
HARMONICS = 5
REACH = 0.25
"""Part of the limits that the motions use, roughly."""

VISCOUS = {"effect": "asymmetric_viscous", "joint": 2, "amplitude": 4.0}
SPRING = {"effect": "joint_spring", "joint": 4, "stiffness": 1.5}

CASES: dict[str, list[dict[str, Any]]] = {
    "sound": [],
    "asymmetric viscous friction at joint 2": [VISCOUS],
    "the same, and a spring at joint 4": [VISCOUS, SPRING],
}

LAWS = ("vibration", "crossed_spring", "speed_in_waves", "slipstream", "bump")
STRANGE = 1
"""Joint, counted from 0, at which those act."""
SMOOTHED = 9
"""Samples over which the speed that such a law is given is a mean."""


def motion(robot: Robot, seed: int) -> Trajectory:
    """A random Fourier series about the middle of every range, at rest at the ends of each period."""
    rng, order = np.random.default_rng([seed, 9]), np.arange(1, HARMONICS + 1)
    speed = REACH * np.array([joint.limits.velocity for joint in robot.joints])[:, None]
    cosine, sine = rng.normal(size=(2, robot.joint_count, HARMONICS)) * speed / (2.0 * np.pi * order / PERIOD_S) / 3.0
    cosine -= cosine.mean(axis=1, keepdims=True)
    sine -= (sine @ order)[:, None] * order / (order @ order)
    ends = [joint.limits.position or (0.0, 0.0) for joint in robot.joints]
    middle = np.asarray(ends, dtype=np.float64).mean(axis=1)
    segment = FourierSegment(FourierSeries(PERIOD_S, middle, cosine, sine), PERIODS, 0)
    return Trajectory(robot.name, tuple(joint.name for joint in robot.joints), (segment,))


def record(robot: Robot, effects: list[dict[str, Any]], folder: Path) -> None:
    """Three recordings of the simulated arm, and what the diagnosis is told of it."""
    scenario = {"torque_noise_std": list(NOISE_STD[ARM]), "position_noise_std": 1e-5, "effects": effects}
    for number in range(RECORDINGS):
        played = motion(robot, number)
        path = folder / f"scenario-{number}.yaml"
        path.write_text(json.dumps({**scenario, "seed": number}))
        settings = {"scenario": str(path), "start": played.start.tolist()}
        run = folder / f"run-{number}"
        done = run_trajectory(
            robot,
            played,
            lambda settings=settings: make_backend("sim", robot, settings),
            run,
            RunOptions(rate_hz=RATE_HZ),
        )
        if done.problem is not None:
            raise SystemExit(f"the simulated run ended with {done.problem.detail}")
    (folder / "robot.pickle").write_bytes(pickle.dumps(without_truth(robot, states_friction=False)))


def add_law(law: str, folder: Path, into: Path) -> None:
    """The recordings of one folder with the torque of a law of no catalogue, in another."""
    (into / "robot.pickle").write_bytes((folder / "robot.pickle").read_bytes())
    for number in range(RECORDINGS):
        plain = read_recording(folder / f"run-{number}" / "recording.csv")
        seen = plain.samples()
        velocity = uniform_filter1d(np.gradient(seen.position, seen.time, axis=0), SMOOTHED, axis=0)
        passage = Passage(seen.position, velocity, seen.effort)
        torque = UNKNOWN[law](passage, STRANGE, np.random.default_rng(5))
        effort = seen.effort.copy()
        effort[:, STRANGE] += NOISE_STD[ARM][STRANGE] * torque / torque.std()
        changed = Recording.from_arrays(
            plain.name, seen.time, seen.position, effort, effort_kind=plain.effort_kind, period=seen.period
        )
        (into / f"run-{number}").mkdir()
        write_recording(changed, into / f"run-{number}" / "recording.csv")


def measured_here(folder: Path) -> dict[str, Any]:
    """A diagnosis in this process, its seconds and its memory."""
    robot = pickle.loads((folder / "robot.pickle").read_bytes())
    begun, cpu = time.perf_counter(), time.process_time()
    recordings = [read_recording(folder / f"run-{number}" / "recording.csv") for number in range(RECORDINGS)]
    found = document(diagnose(robot, recordings))
    return {
        "seconds": time.perf_counter() - begun,
        "processor_seconds": time.process_time() - cpu,
        "memory_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "verdict": found.verdict,
        "findings": [f"{each.effect}@{each.joint}" for each in found.findings],
    }


def main() -> None:
    """Print a line a case."""
    if sys.argv[1:2] == ["--in"]:
        print(json.dumps(measured_here(Path(sys.argv[2]))))
        return
    robot = arm_named(ARM)
    for name, effects in CASES.items():
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            record(robot, effects, Path(folder))
            tell(name, folder)
            for law in LAWS if not effects else ():
                with tempfile.TemporaryDirectory(prefix="bench-") as strange:
                    add_law(law, Path(folder), Path(strange))
                    tell(f"unknown: {law}", strange)


def tell(name: str, folder: str) -> None:
    """Diagnose a folder's recordings in a process of its own, and print the line."""
    words = [sys.executable, __file__, "--in", folder]
    told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
    print(
        f"{name}: {told['seconds']:.1f} s ({told['processor_seconds']:.1f} s of processor), "
        f"{told['memory_gb']:.2f} GB, {told['verdict']} {' '.join(told['findings'])}",
        flush=True,
    )


if __name__ == "__main__":
    main()
