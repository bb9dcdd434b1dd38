"""One trial of an effect concealed in real recordings: drawn, sealed, diagnosed apart, opened, compared."""

import resource
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from concealed.real.concealing.draw import RealCase, draw_case
from concealed.real.concealing.ground import Ground, ground_of_set
from concealed.real.concealing.sizing import torque_left
from concealed.real.judging.solvable import solve_case
from concealed.running.kept import Outcome
from concealed.scoring.plain import plain
from concealed.scoring.score import compared
from concealed.sealing.sealed import diagnosis_apart
from concealed.sealing.truth import Hidden, Truth, opened

CONCEALED, UNTOUCHED = "real-concealed", "real-untouched"
"""Series of the trials, and of the same sets as they are: each diagnosed once, whatever number of trials it serves."""


def concealed_outcome(seed: int, set_name: str | None, *, with_oracle: bool = False) -> Outcome:
    """What the diagnosis finds in the trial of a seed."""
    case = draw_case(seed, set_name)
    return _outcome(case, truth_of_case(case), with_oracle=with_oracle)


def untouched_outcome(set_name: str) -> Outcome:
    """What it finds in a set in which nothing is concealed, written by the same way."""
    case = RealCase(0, set_name, ground_of_set(set_name), ())
    return _outcome(case, truth_of_case(case), with_oracle=False)


def _outcome(case: RealCase, truth: Truth, *, with_oracle: bool) -> Outcome:
    with (
        tempfile.TemporaryDirectory(prefix="concealed-") as where,
        tempfile.TemporaryDirectory(prefix="vault-") as vault,
    ):
        folder, sealed = Path(where) / "trial", Path(vault) / "truth.json"
        case.write(folder)
        seal = truth.seal(sealed)
        print(f"sealed {case.name} {seal}", flush=True)
        begin = _children_s()
        found, seconds = diagnosis_apart(folder)
        processor = _children_s() - begin
        truth = opened(sealed, seal)
        solved = solve_case(case, folder) if with_oracle and case.effects else None
    told: dict[str, Any] = {"name": case.name, "case": truth.case, "seal": seal, "truth": asdict(truth)}
    told |= {"score": asdict(compared(truth, found, seconds)), "seconds": seconds, "diagnosis": plain(found)}
    told["processor_s"] = processor
    if solved is not None:
        told["solved"] = [each.as_dict() for each in solved]
    return told


def _children_s() -> float:
    """Time that the processes begun by this one have had of a processor: the same on a busy machine [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def truth_of_case(case: RealCase) -> Truth:
    """What a trial conceals; the parameters are those of all that it holds of the same effect."""
    hidden = [
        Hidden(
            labels=list(each.concealment.labels),
            also=[],
            joints=[label.partition("@")[2] or None for label in each.concealment.labels],
            parameters=each.concealment.parameters(each.total),
        )
        for each in case.effects
    ]
    told = {
        "arm": case.set_name,
        "places": [(each.concealment.kind, each.concealment.joint) for each in case.effects],
        "wanted": case.effects[0].multiple or 0.0 if case.effects else 0.0,
        "effects": [each.as_dict(case.ground) for each in case.effects],
        "held_out_s": held_out_seconds(case.ground),
        "held_out_rms": concealed_rms(case),
    }
    strengths = [each.reached for each in case.effects]
    scale = [float(each) for each in case.ground.nominal.scale]
    return Truth(told, hidden, float(np.mean(strengths)) if strengths else 0.0, scale)


def held_out_seconds(ground: Ground) -> float:
    """Length of all held-out recordings."""
    return float(sum(each.time[-1] for each in ground.passages if each.held_out))


def concealed_rms(case: RealCase) -> list[float]:
    """Rms of each joint, on held-out rows, of what a nominal model of the training rows leaves of all effects."""
    ground, left = case.ground, None
    for each in case.effects:
        own = torque_left(ground, each.concealment, each.size)
        left = own if left is None else [a + b for a, b in zip(left, own, strict=True)]
    if left is None:
        return [0.0] * ground.robot.joint_count
    rows = np.concatenate([one for one, passage in zip(left, ground.passages, strict=True) if passage.held_out])
    return [float(each) for each in np.sqrt(np.mean(rows**2, axis=0))]
