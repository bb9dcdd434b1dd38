"""``tauscope demo``: the seed paper's arm, simulated, identified, and compared with the truth.

The robot file that the identification reads holds no model: what it finds, it finds in the recordings.
"""

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from ruamel.yaml import YAML

from service.cli.demo_folder import prepare_folder
from service.cli.identify_run import Outcome, Request, identify_files, write_outcome
from service.cli.identify_summary import show_identification
from service.cli.output_files import write_file
from service.cli.terminal import output, plain, shown_progress, table
from service.identification import Identification
from service.report.quantities import given, with_uncertainty
from service.report.table import Table
from service.robot import Robot, read_robot
from sim_backend.examples import example_robot
from sim_backend.motion import random_fourier_motion
from sim_backend.recording import simulate_recording
from sim_backend.recording_csv import write_recording_csv

NOISE_STD_NM = (0.5, 0.3, 0.7)
"""σ_τ of the seed paper's section 5."""

RATE_HZ = 200.0
PERIOD_S = 10.0
PERIODS = 5
TRAIN_SEED = 0
HELD_OUT_SEED = 1

ROBOT, TRAIN, HELD_OUT = "robot.yaml", "train.csv", "held-out.csv"
RESULT, REPORT = "identification.json", "report.html"
EXPORTS = ("friction.json", "friction.yaml", "friction.h", "friction.py", "model.xml")
FILES = (ROBOT, TRAIN, HELD_OUT, RESULT, REPORT, *EXPORTS)
"""What the demo writes, and may therefore write again."""


_HEADING = """\
The seed paper's arm, Table 1, as `tauscope demo` hands it to the identification: what its links weigh and how its
joints rub is left out. Of the friction curve only the shape constants are given."""


@dataclass(frozen=True)
class Comparison:
    """A parameter's truth beside its estimate.

    name : str
        of the parameter
    truth, value, std : float
        truth, estimate and the estimate's standard error
    """

    name: str
    truth: float
    value: float
    std: float

    @property
    def z(self) -> float:
        """The error in standard errors."""
        return (self.value - self.truth) / self.std


def run_demo(folder: Path) -> None:
    """Simulate, identify, compare, and say where everything is.

    Parameters
    ----------
    folder : Path
        where the files go

    Raises
    ------
    TauscopeError
        where the folder holds somebody else's files of the same names, or cannot be written
    """
    prepare_folder(folder, FILES)
    arm = read_robot(example_robot("paper_arm"))
    with shown_progress() as progress:
        progress("simulate recordings")
        write_file(folder / ROBOT, robot_text_without_model(example_robot("paper_arm")).encode())
        for name, seed in ((TRAIN, TRAIN_SEED), (HELD_OUT, HELD_OUT_SEED)):
            simulate_file(arm, folder / name, seed)
        request = Request(
            robot=folder / ROBOT,
            recordings=(folder / TRAIN,),
            held_out=(folder / HELD_OUT,),
            json=folder / RESULT,
            report=folder / REPORT,
            exports=tuple(folder / name for name in EXPORTS),
        )
        outcome = identify_files(request, progress)
        write_outcome(request, outcome, progress)
    _show(output(), folder, outcome, compare(arm, outcome.identification))


def simulate_file(arm: Robot, path: Path, seed: int) -> None:
    """Write a recording of the arm on a random motion, with sensor noise.

    Parameters
    ----------
    arm : Robot
        with its true model
    path : Path
        file to make
    seed : int
        of the motion and of the noise
    """
    motion_rng, noise_rng = np.random.default_rng(seed).spawn(2)
    recording = simulate_recording(
        arm,
        random_fourier_motion(arm.joints, motion_rng, period_s=PERIOD_S),
        rate_hz=RATE_HZ,
        periods=PERIODS,
        noise_std=NOISE_STD_NM,
        rng=noise_rng,
    )
    write_recording_csv(path, recording, arm.joints)


def robot_text_without_model(path: Path) -> str:
    """Text of a robot file without what it believes about links and friction; a heading says so.

    Parameters
    ----------
    path : Path
        robot file
    """
    yaml = YAML()
    yaml.width = 4096
    content = yaml.load(path.read_text(encoding="utf-8"))
    content.pop("model", None)
    content.yaml_set_start_comment(_HEADING)
    stream = io.StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()


def compare(arm: Robot, identification: Identification) -> list[Comparison]:
    """The estimate beside the truth: base parameters, then every joint's friction.

    Parameters
    ----------
    arm : Robot
        with its true model
    identification : Identification
        of the same arm

    Returns
    -------
    list of Comparison
        one a parameter, in the order of the model's columns
    """
    structure, std = identification.structure, np.sqrt(np.diag(identification.covariance))
    standard = np.concatenate([link.to_vector() for link in arm.model.links or ()])
    truth = dict(zip(structure.base.expressions, structure.base.project(standard), strict=True))
    for joint, friction in zip(arm.joints, arm.model.friction or (), strict=True):
        truth |= {f"{name} {joint.name}": getattr(friction, name) for name in ("stiction", "stribeck", "viscous")}
        truth[f"offset {joint.name}"] = 0.0
    rows = zip(structure.names, identification.parameters, std, strict=False)
    return [Comparison(name, float(truth[name]), float(value), float(error)) for name, value, error in rows]


def _show(console: Console, folder: Path, outcome: Outcome, comparisons: list[Comparison]) -> None:
    """The result, the truth, and where everything is."""
    show_identification(console, outcome.document, outcome.robot)
    rows = [
        (row.name, given(round(row.truth, 6)), *with_uncertainty(row.value, row.std), f"{row.z:+.2f}")
        for row in comparisons
    ]
    console.print()
    console.print(table("Truth and estimate", Table(("parameter", "truth", "estimate", "± std", "z"), rows)))
    rms = float(np.sqrt(np.mean([row.z**2 for row in comparisons])))
    console.print(
        plain(f"z is the error in standard errors; its rms over all {len(rows)} parameters is {rms:.2f} (1 expected)")
    )
    for name in FILES:
        console.print(plain(f"wrote {folder / name}"), soft_wrap=True)
