"""``python -m tauscope_sim ROBOT --out recording.csv``: a simulated recording of the arm in a robot file."""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tauscope.errors import TauscopeError
from tauscope.robot import read_robot
from tauscope_sim.motion import LEAST_HARMONICS, random_fourier_motion
from tauscope_sim.recording import simulate_recording, write_recording_csv


def main(arguments: Sequence[str] | None = None) -> int:
    """Simulate a recording and write it; the exit status: 0 done, 1 a file does not allow it (2: wrong usage)."""
    options = _parser().parse_args(arguments)
    try:
        rows = _simulate(options)
    except TauscopeError as error:
        sys.stderr.write(f"error: {error}\n")
        return 1
    sys.stdout.write(f"wrote {options.out}: {rows} samples, simulated from {options.robot}\n")
    return 0


def _simulate(options: argparse.Namespace) -> int:
    robot = read_robot(options.robot)
    motion_rng, noise_rng = np.random.default_rng(options.seed).spawn(2)
    motion = random_fourier_motion(robot.joints, motion_rng, period_s=options.period, harmonics=options.harmonics)
    recording = simulate_recording(
        robot,
        motion,
        rate_hz=options.rate,
        periods=options.periods,
        noise_std=options.noise_std,
        position_noise_std=options.position_noise_std,
        encoder_step=options.encoder_step,
        rng=noise_rng,
    )
    write_recording_csv(options.out, recording, robot.joints, as_current=options.current)
    return len(recording.time)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tauscope_sim",
        description="Write a simulated recording of an arm on a random Fourier motion within its joint limits.",
    )
    parser.add_argument("robot", type=Path, metavar="ROBOT", help="robot file with a model block")
    parser.add_argument("--out", type=Path, required=True, metavar="CSV", help="recording to write; must not exist")
    parser.add_argument("--seed", type=_count(0), default=0, help="seed of the motion and of the noise (default 0)")
    parser.add_argument("--rate", type=_positive, default=100.0, metavar="HZ", help="samples per second (default 100)")
    parser.add_argument("--period", type=_positive, default=10.0, metavar="S", help="duration of a period (default 10)")
    parser.add_argument("--periods", type=_count(1), default=3, metavar="P", help="number of periods (default 3)")
    parser.add_argument(
        "--harmonics", type=_count(LEAST_HARMONICS), default=5, metavar="M", help="harmonics, 2 or more (default 5)"
    )
    per_joint = {"type": _not_negative, "nargs": "+", "default": 0.0}
    parser.add_argument("--noise-std", **per_joint, metavar="NM", help="torque noise, one value or one a joint [Nm]")
    parser.add_argument("--position-noise-std", **per_joint, metavar="RAD", help="position noise, likewise [rad]")
    parser.add_argument("--encoder-step", **per_joint, metavar="RAD", help="resolution of the encoders, likewise [rad]")
    parser.add_argument("--current", action="store_true", help="write drive units (i1…) in place of torque (tau1…)")
    return parser


def _positive(text: str) -> float:
    value = _not_negative(text)
    if value == 0.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not above zero")
    return value


def _not_negative(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not (np.isfinite(value) and value >= 0.0):
        raise argparse.ArgumentTypeError(f"{text!r} is negative or not finite")
    return value


def _count(least: int) -> Callable[[str], int]:
    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if value < least:
            raise argparse.ArgumentTypeError(f"{text!r} is below {least}")
        return value

    return parse


if __name__ == "__main__":
    sys.exit(main())
