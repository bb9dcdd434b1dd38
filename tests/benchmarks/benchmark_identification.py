"""Whole identification of a 6-joint arm from 10,000 samples: ours against FIGAROH; time and memory of long recordings.

    python tests/benchmarks/benchmark_identification.py [--repeats R] [--long SAMPLES ...] [--json OUT]

Ours: read the CSV file, condition, regressor, base parameters, WLS, covariance, and also what FIGAROH's figure leaves
out: noise, autocorrelation of the residual, the physically consistent model. FIGAROH (the `bench` group of
pyproject.toml): its basic regressor with friction and offset, elimination, double QR and weighted least squares, on
exact q̇ and q̈ already in memory. The two are timed by turns; the ratio is that of the medians. `--long` identifies a
recording of that many samples in a process of its own and prints seconds and peak memory.
"""

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from statistics import median

import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS)]

from arms import ur5_like  # noqa: E402
from pinocchio_arm import pinocchio_model  # noqa: E402
from tauscope.identification import identify  # noqa: E402
from tauscope.recording import read_recording  # noqa: E402
from tauscope.robot import FrictionShape, Joint, LinkInertia, Model, Robot  # noqa: E402
from tauscope_sim.motion import FourierMotion  # noqa: E402
from tauscope_sim.recording import simulate_recording, write_recording_csv  # noqa: E402

RATE_HZ = 500.0
NOISE_STD = 0.3
JOINTS = 6


def benchmark_arm() -> Robot:
    """A UR5-like arm with plausible links and a friction curve of known shape."""
    arm = ur5_like()
    links = tuple(
        LinkInertia(3.0 - 0.4 * j, np.array([0.1, 0.05, 0.02]), np.diag([0.05, 0.06, 0.07])) for j in range(JOINTS)
    )
    joints = tuple(Joint(j.name, j.type, friction_shape=FrictionShape(200.0, 10.0)) for j in arm.joints)
    return replace(arm, joints=joints, model=Model(links=links))


def motion(period_s: float) -> FourierMotion:
    """A fixed Fourier motion that excites every joint."""
    rng = np.random.default_rng(0)
    cosine, sine = (rng.normal(0.0, 0.3, (JOINTS, 5)) for _ in range(2))
    return FourierMotion(period_s, np.zeros(JOINTS), cosine, sine)


def main() -> None:
    """Measure, print, and write JSON where asked."""
    parser = argparse.ArgumentParser(description="Whole identification against FIGAROH, medians of one run.")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--long", type=int, nargs="*", default=[], help="also identify recordings of so many samples")
    parser.add_argument("--json", type=Path, help="write the figures here")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(_identify_long(Path(options.child[0]), options.child[1])))
        return
    with tempfile.TemporaryDirectory() as folder:
        figures = compare(Path(folder), options.repeats) if options.repeats else {}
        figures["long"] = [measure_long(Path(folder), samples) for samples in options.long]
    print(json.dumps(figures, indent=1))
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1))


def compare(folder: Path, repeats: int) -> dict[str, object]:
    """Median seconds of both for 10,000 samples, and their ratio."""
    arm = benchmark_arm()
    recording = simulate_recording(
        arm,
        motion(20.0),
        rate_hz=RATE_HZ,
        periods=1,
        noise_std=[NOISE_STD] * JOINTS,
        rng=np.random.default_rng(1),
    )
    path = folder / "recording.csv"
    write_recording_csv(path, recording, arm.joints)

    def ours() -> None:
        identify(arm, [read_recording(path, JOINTS)])

    exact = recording.exact
    figaroh = figaroh_identification(arm, exact.position, exact.velocity, exact.acceleration, recording.torque)
    times = _by_turns((ours, figaroh), repeats)
    return {
        "samples": len(recording.time),
        "ours_s": times[0],
        "figaroh_s": times[1],
        "ratio": times[1] / times[0],
    }


def figaroh_identification(
    arm: Robot, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, torque: np.ndarray
) -> Callable[[], None]:
    """FIGAROH's regressor, elimination, double QR and weighted least squares as one call."""
    parameter = import_module("figaroh.identification.parameter")
    regressor_tools = import_module("figaroh.tools.regressor")
    double_qr = import_module("figaroh.tools.qrdecomposition").double_QR
    robot = import_module("pinocchio.robot_wrapper").RobotWrapper(pinocchio_model(arm))
    names = [name for name in robot.model.names if name != "universe"]
    config = {
        "has_friction": True,
        "has_actuator_inertia": True,
        "has_joint_offset": True,
        "is_joint_torques": True,
        "is_external_wrench": False,
        "force_torque": None,
        "has_coupled_wrist": False,
        "act_Jid": list(range(1, JOINTS + 1)),
        "act_idxv": list(range(JOINTS)),
        "active_joints": names,
        "idx_act_joints": list(range(JOINTS)),
        "fv": [0.0] * JOINTS,
        "fs": [0.0] * JOINTS,
        "off": [0.0] * JOINTS,
        "Ia": [0.0] * JOINTS,
    }
    flat = torque.T.ravel()

    def run() -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            standard = parameter.get_standard_parameters(robot.model, config)
            standard |= parameter.add_standard_additional_parameters(robot.model, config)
            regressor = regressor_tools.build_regressor_basic(robot, q, qd, qdd, config)
            eliminated, remaining = regressor_tools.get_index_eliminate(regressor, standard)
            reduced = regressor_tools.build_regressor_reduced(regressor, eliminated)
            base, _, _, values, *_ = double_qr(flat, reduced, remaining)
            # Its own function for weighted least squares builds a dense matrix of samples by samples; the same formula:
            residual = (flat - base @ values).reshape(JOINTS, -1)
            weight = np.repeat(1.0 / np.linalg.norm(residual, axis=1), residual.shape[1])
            np.linalg.lstsq(base * weight[:, None], flat * weight, rcond=None)

    return run


def measure_long(folder: Path, samples: int) -> dict[str, float]:
    """Seconds and peak memory of one identification in a process of its own."""
    arm = benchmark_arm()
    path = folder / f"long-{samples}.csv"
    period = simulate_recording(
        arm, motion(20.0), rate_hz=RATE_HZ, periods=1, noise_std=[NOISE_STD] * JOINTS, rng=np.random.default_rng(2)
    )
    header = ",".join(["t", *(f"q{j + 1}" for j in range(JOINTS)), *(f"tau{j + 1}" for j in range(JOINTS))])
    rows = [",".join(f"{value:.8g}" for value in row) for row in np.hstack([period.position, period.torque])]
    with path.open("w") as file:
        file.write(header + "\n")
        for sample in range(samples):
            file.write(f"{sample / RATE_HZ:.6f},{rows[sample % len(rows)]}\n")
    command = [sys.executable, __file__, "--child", str(path), str(samples)]
    figures = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    path.unlink()
    return figures


def _identify_long(path: Path, samples: str) -> dict[str, float]:
    start = time.perf_counter()
    identify(benchmark_arm(), [read_recording(path, JOINTS)])
    seconds = time.perf_counter() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"samples": float(samples), "seconds": seconds, "peak_memory_mb": peak}


def _by_turns(calls: tuple[Callable[[], None], ...], repeats: int) -> list[float]:
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(repeats + 1):
        for call, taken in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            taken.append(time.perf_counter() - start)
    return [median(taken[1:]) for taken in times]


if __name__ == "__main__":
    main()
