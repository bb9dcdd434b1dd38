"""The table that the page begins with: simulated and real arms, what is right, wrong, missed, and how long it takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from concealed.real.concealed_outcome import CONCEALED
from concealed.real.judging.concealed_table import judge_all
from concealed.real.judging.judge import Judged
from concealed.real.trials import REAL
from concealed.running.kept import Outcome
from concealed.scoring.calibration import Claim, calibration_error
from concealed.scoring.figures import CONFIDENT, POOR_SERIES, interval
from concealed.scoring.harm import worse_joints

GOOD = (
    "sound",
    "weak",
    "moderate",
    "strong",
    "constant",
    "event",
    "pair",
    "triple",
    "pair-one-joint",
    "drift-beside",
    "form",
    "unknown",
    "sign",
)
KNOWN = "real"
HEAD = ("trials on", "trials", "right", "wrong and confident", "missed", "joints made worse", "calibration", "time")


@dataclass(frozen=True)
class Counted:
    """One trial as the table counts it.

    right : bool
        all that is concealed is within a finding's set; where nothing is, nothing is named
    missed : bool
        something that is there is in no set, or the trial failed
    confident : bool
        a wrong name with p > `CONFIDENT`
    worse : (int, int)
        joints that the findings make worse, of how many
    claims : list of (float, bool)
        probability of each finding, and whether it is right
    seconds : float or None
        of the diagnosis; None where the trial failed
    """

    right: bool
    missed: bool
    confident: bool = False
    worse: tuple[int, int] = (0, 0)
    claims: list[Claim] = field(default_factory=list)
    seconds: float | None = None


FAILED = Counted(right=False, missed=True)


def overview(outcomes: Sequence[Outcome]) -> str:
    """The table in Markdown; a row without trials says so."""
    rows: dict[str, list[Counted]] = {
        "simulated arms, good recordings": [_count(each) for each in outcomes if each["series"] in GOOD],
        "simulated arms, poor recordings": [_count(each) for each in outcomes if each["series"] in POOR_SERIES],
        "real arms, an effect concealed": count_concealed(outcomes),
        "real arms, as others know them": [_count(each) for each in outcomes if _is_known(each)],
    }
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    return "\n".join([*lines, *(f"| {name} | {' | '.join(_cells(these))} |" for name, these in rows.items())])


def count_concealed(outcomes: Sequence[Outcome]) -> list[Counted]:
    """Trials on real recordings, each beside the same set untouched: what is said there too is neither right nor wrong.

    A trial whose set has no untouched diagnosis is left out until there is one, unless it failed itself.
    """
    failed = [FAILED for each in outcomes if each["series"] == CONCEALED and "score" not in each]
    return [*(_beside(each, told) for each, told in judge_all(outcomes)), *failed]


def _beside(each: Outcome, told: Judged) -> Counted:
    named = all(one.named for one in told.effects)
    return Counted(named, not named, bool(told.confident), _worse(each), told.claims, each["seconds"])


def _count(each: Outcome) -> Counted:
    """A trial on a simulated arm, or on real recordings as they are."""
    if "score" not in each:
        return FAILED
    score = each["score"]
    claims: list[Claim] = [(float(p), bool(right)) for p, right in score["probabilities"]]
    if each["series"] == "unknown":
        right = score["verdict"] in ("partly_explained", "unexplained") and not _is_confident(claims)
    elif each["truth"]["hidden"]:
        right = bool(score["named"])
    else:
        right = not score["claimed"]
    missed = bool(each["truth"]["hidden"]) and not right
    return Counted(right, missed, _is_confident(claims), _worse(each), claims, each["seconds"])


def _worse(each: Outcome) -> tuple[int, int]:
    return len(worse_joints(each)), len(each["diagnosis"]["joints"])


def _is_known(each: Outcome) -> bool:
    """Recordings as they are, of which others have found something."""
    told = REAL.get(each["arm"] or "") if each["series"] == KNOWN else None
    return told is not None and told.edit is None and bool(told.labels)


def _is_confident(claims: Sequence[Claim]) -> bool:
    return any(p > CONFIDENT and not right for p, right in claims)


def _cells(these: Sequence[Counted]) -> list[str]:
    if not these:
        return ["0", *["not tried"] * (len(HEAD) - 2)]
    claims = [claim for each in these for claim in each.claims]
    worse, joints = (sum(each.worse[place] for each in these) for place in (0, 1))
    seconds = [each.seconds for each in these if each.seconds is not None]
    return [
        str(len(these)),
        _share(these, lambda each: each.right),
        _share(these, lambda each: each.confident),
        _share(these, lambda each: each.missed),
        f"{worse} of {joints}",
        f"{calibration_error(claims):.2f} of {len(claims)}" if claims else "nothing named",
        f"{np.mean(seconds):.1f} s" if seconds else "",
    ]


def _share(these: Sequence[Counted], counts: Callable[[Counted], bool]) -> str:
    hits = sum(counts(each) for each in these)
    low, high = interval(hits, len(these))
    return f"{hits / len(these):.0%} ({low:.0%} to {high:.0%})"
