"""A trial sealed: recordings and robot file in one folder, the truth in a file elsewhere, its hash told beforehand."""

import contextlib
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tauscope
from concealed.generator.arms import file_without_truth
from concealed.generator.case import Case, drawn
from concealed.generator.motions import Planned
from concealed.generator.trial import Trial
from concealed.sealing.truth import truth_of
from tauscope.diagnosis.documents.document import DiagnosisDocument
from tauscope.errors import ScenarioError
from tauscope.recording import EffortKind, Recording, write_recording
from tauscope.trajectory import read_trajectory

Array = NDArray[np.float64]

REACHED = 0.3
"""Relative error of s up to which a trial counts as one of its series."""

MOST_ATTEMPTS = 16
DIAGNOSIS_S = 900.0
"""A diagnosis that takes longer has failed [s]."""

RESULT, NEXT = "diagnosis.json", "next.json"
PASSED_ON = ("PATH", "HOME", "LANG", "TMPDIR", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
"""Variables of the environment that the diagnosing process inherits."""


@dataclass(frozen=True, eq=False)
class Sealed:
    """What was sealed.

    trial : Trial
        the trial; the diagnosing process never sees it
    case : Case
        what was drawn
    folder : Path
        what the diagnosing process sees
    truth : Path
        opened afterwards
    seal : str
        SHA-256 of the truth
    """

    trial: Trial
    case: Case
    folder: Path
    truth: Path
    seal: str


def made(series: str, seed: int, arm: str | None = None) -> tuple[Case, Trial]:
    """The trial of a series and a seed: drawn anew where the effect could not be made as strong as wanted.

    Nor can it where that takes a transmission too soft to carry the arm.
    """
    kept = drawn(series, seed, arm).arm  # or arms on which effects hardly show would be tried less
    for attempt in range(MOST_ATTEMPTS):
        case = drawn(series, seed, kept, attempt)
        with contextlib.suppress(ScenarioError):
            concealed = case.concealed()
            if abs(concealed.strength - case.wanted) <= REACHED * case.wanted:
                return case, case.recorded(concealed)
    raise ValueError(f"{series} {seed}: no effect of {MOST_ATTEMPTS} drawn reaches the strength asked for")


def sealed(case: Case, trial: Trial, where: Path, vault: Path) -> Sealed:
    """Write what may be seen into one place, and what may not into another of which no word is said there."""
    folder, truth = where / case.name, vault / f"{case.name}.json"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    constants = nominal_constants(case, trial.robot.joint_count)
    file_without_truth(trial.arm, folder / "robot.yaml", states_friction=True, torque_constants=constants)
    for kind, recordings in (("train", trial.train), ("held-out", trial.held_out)):
        for number, recording in enumerate(recordings, 1):
            write_recording(_logged(recording, constants), folder / f"{kind}{number}.csv")
    return Sealed(trial, case, folder, truth, truth_of(trial, case).seal(truth))


def nominal_constants(case: Case, joint_count: int) -> Array | None:
    """Torque constants (n,) that the robot file states where currents are logged [Nm/A]; None where torque is.

    A recorded current is the reported torque over this constant: where the report is g times the torque, the arm's own
    constant is the nominal one over g.
    """
    if not case.logs_current:
        return None
    return np.round(np.random.default_rng([case.seed, 13]).uniform(0.3, 3.0, joint_count), 3)


def _logged(recording: Recording, constants: Array | None) -> Recording:
    """The recording as the logger writes it."""
    if constants is None:
        return recording
    told = recording.samples()
    return Recording.from_arrays(
        recording.name,
        told.time,
        told.position,
        told.effort / constants,
        effort_kind=EffortKind.CURRENT,
        period=told.period,
    )


def diagnosis_apart(folder: Path, *, plans: bool = False, more: Sequence[str] = ()) -> tuple[DiagnosisDocument, float]:
    """The user's own command, in a process that is told nothing but the folder; its document and its time [s].

    It could not even import what draws the truth: its environment names the program's own source and no other.
    """
    train, held_out = (sorted(each.name for each in folder.glob(f"{kind}*.csv")) for kind in ("train", "held-out"))
    command = [sys.executable, "-m", "tauscope.cli", "diagnose", "robot.yaml", *train, "--json", RESULT]
    command += [*more, *(["--next-trajectory", NEXT] if plans else []), "--held-out", *held_out]
    begin = time.perf_counter()
    done = subprocess.run(
        command, cwd=folder, env=apart(), capture_output=True, text=True, timeout=DIAGNOSIS_S, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{folder.name}: exit {done.returncode}: {done.stderr.strip()[-500:]}")
    found = DiagnosisDocument.model_validate_json((folder / RESULT).read_text(encoding="utf-8"))
    return found, time.perf_counter() - begin


def apart() -> dict[str, str]:
    """Environment of the diagnosing process."""
    kept = {name: os.environ[name] for name in PASSED_ON if name in os.environ}
    return {**kept, "PYTHONPATH": str(Path(tauscope.__file__).resolve().parents[1])}


def with_recommended(these: Sealed) -> bool:
    """Play the motion that the diagnosis asked for on the true arm, and lay its recording beside the others."""
    planned = these.folder / NEXT
    if not planned.exists():
        return False
    motion = Planned("recommended", read_trajectory(planned, these.trial.robot))
    recording = these.trial.recorded(motion, these.case.seed)
    constants = nominal_constants(these.case, these.trial.robot.joint_count)
    write_recording(_logged(recording, constants), these.folder / f"train{len(these.trial.train) + 1}.csv")
    (these.folder / RESULT).unlink()
    return True
