"""What baselines claim: the first of a ranking where its score reaches a threshold, and nothing otherwise.

The thresholds are those with which each does best on trials of the development range: half the share of sound trials
without a claim, half the share of trials of one effect whose first choice is right.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from concealed.running.kept import Outcome

TUNED = Path(__file__).with_name("thresholds.yaml")
BASELINES = ("correlation", "sparse", "bic")
NAMES = {
    "tauscope": "Tauscope",
    "correlation": "correlation with the residual, no projection",
    "sparse": "sparse regression on the residual (STLSQ)",
    "bic": "BIC over single effects",
}
Rankings = dict[str, Any]
"""As `rankings` gives them."""


@dataclass(frozen=True)
class Claim:
    """What a method says of a trial.

    first : str or None
        ``effect@joint``; None where it claims nothing
    """

    first: str | None


def claim(rankings: Rankings, baseline: str, threshold: float) -> Claim:
    """A baseline's claim."""
    ranking = rankings[baseline]
    if baseline == "sparse":
        return Claim(str(ranking[f"{threshold:g}"][0][0]) if ranking[f"{threshold:g}"] else None)
    place, score = ranking[0]
    return Claim(str(place) if score >= threshold else None)


def claim_of_tauscope(each: Outcome) -> Claim:
    """Tauscope's first finding."""
    told = each["score"]["told"]
    return Claim(str(told[0].split(" ")[0]) if told else None)


def right(found: Claim, labels: Sequence[Sequence[str]]) -> bool:
    """Whether the first choice is among the right answers; where nothing is concealed, whether nothing is claimed."""
    if not labels:
        return found.first is None
    return any(found.first in one for one in labels)


def balanced(rights: Sequence[bool], sound: Sequence[bool]) -> float:
    """Mean of the two shares: sound trials without a claim, others whose first choice is right."""
    hits, quiet = np.asarray(rights), np.asarray(sound)
    return 0.5 * (float(hits[quiet].mean()) + float(hits[~quiet].mean()))


def best_threshold(trials: Sequence[tuple[Rankings, Sequence[Sequence[str]]]], baseline: str) -> tuple[float, float]:
    """The threshold with which a baseline does best on some trials, and how well it does; the largest of equals."""
    sound = [not labels for _, labels in trials]

    def score(threshold: float) -> float:
        return balanced([right(claim(told, baseline, threshold), labels) for told, labels in trials], sound)

    if baseline == "sparse":
        candidates = [float(limit) for limit in trials[0][0]["sparse"]]
    else:
        scores = np.unique([told[baseline][0][1] for told, _ in trials])
        candidates = [*((scores[:-1] + scores[1:]) / 2.0).tolist(), float(scores[-1]) * 1.01]
    return max(((threshold, score(threshold)) for threshold in candidates), key=lambda told: (told[1], told[0]))


def thresholds() -> dict[str, float]:
    """The tuned thresholds."""
    told = YAML(typ="safe").load(TUNED.read_text(encoding="utf-8"))
    return {baseline: float(told[baseline]) for baseline in BASELINES}
