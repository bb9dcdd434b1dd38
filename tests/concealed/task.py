"""One trial from its draw to its score: made, sealed, diagnosed apart, opened, compared."""

import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from concealed.baselines.columns import ground
from concealed.baselines.comparison import RANKED
from concealed.baselines.ranking import rankings
from concealed.generator.case import Case
from concealed.generator.trial import Trial
from concealed.real.concealed_outcome import concealed_outcome, untouched_outcome
from concealed.real.outcome import real_outcome
from concealed.running.kept import Key, Outcome
from concealed.scoring.oracle import against_oracle, oracle
from concealed.scoring.plain import plain
from concealed.scoring.score import compared
from concealed.sealing.sealed import Sealed, diagnosis_apart, made, sealed, with_recommended
from concealed.sealing.truth import opened

FOLLOWED = ("aliased",)
"""Series in which the recommended motion is played and the diagnosis repeated."""

REAL = "real"
"""Series of the trials on recordings of real arms; the arm is the trial's name there."""


@dataclass(frozen=True)
class Task:
    """A trial to make.

    series : str
        what is tried
    seed : int
        of everything that is drawn
    arm : str or None
        drawn where None
    commit : str
        of the source that makes it and diagnoses it
    with_oracle : bool
        whether it is compared with a diagnosis that knows the form
    """

    series: str
    seed: int
    arm: str | None = None
    commit: str = ""
    with_oracle: bool = False

    @property
    def key(self) -> Key:
        return self.series, self.seed, self.arm


def outcome(task: Task) -> Outcome:
    """The trial's outcome; where it could not be made or diagnosed, why.

    Everything that a reader needs to draw it again is in it, and the diagnosis itself, so that it can be scored anew.
    """
    told: Outcome = {"series": task.series, "seed": task.seed, "arm": task.arm, "commit": task.commit}
    told["began"] = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    try:
        return {**told, **_outcome_of_series(task)}
    except Exception as error:  # whatever it is, the other trials go on and this one is counted as failed
        return {**told, "error": repr(error)}


def _outcome_of_series(task: Task) -> Outcome:
    match task.series:
        case "real":
            return real_outcome(task.arm or "")
        case "real-concealed":
            return concealed_outcome(task.seed, task.arm, with_oracle=task.with_oracle)
        case "real-untouched":
            return untouched_outcome(task.arm or "")
        case _:
            return _tried(task)


def _tried(task: Task) -> Outcome:
    with (
        tempfile.TemporaryDirectory(prefix="concealed-") as where,
        tempfile.TemporaryDirectory(prefix="vault-") as vault,
    ):
        case, trial = made(task.series, task.seed, task.arm)
        these = sealed(case, trial, Path(where), Path(vault))
        print(f"sealed {case.name} {these.seal}", flush=True)
        return _diagnosed(task, case, trial, these)


def _diagnosed(task: Task, case: Case, trial: Trial, these: Sealed) -> Outcome:
    plans = task.series in FOLLOWED
    found, seconds = diagnosis_apart(these.folder, plans=plans)
    again = diagnosis_apart(these.folder) if plans and with_recommended(these) else None
    truth = opened(these.truth, these.seal)
    held_out_s = sum(float(each.samples().time[-1]) for each in trial.held_out)
    drawn = {**case.as_dict(), "held_out_s": held_out_s}
    told: dict[str, Any] = {"name": case.name, "case": drawn, "seal": these.seal, "truth": asdict(truth)}
    told |= {"score": asdict(compared(truth, found, seconds)), "seconds": seconds, "diagnosis": plain(found)}
    if task.series in RANKED:
        told["baselines"] = rankings(ground(trial.robot, trial.train))
    if again is not None:
        told |= {"again": asdict(compared(truth, *again)), "diagnosis_again": plain(again[0])}
    if task.with_oracle and again is None and trial.concealed.entries:
        best = oracle(trial)
        told |= {"oracle_ratio": against_oracle(found, best), "oracle": plain(best)["fit"]}
    return told
