"""Outcomes counted: shares with their binomial intervals, by series."""

from collections.abc import Sequence

import numpy as np

from concealed.running.kept import Outcome
from concealed.scoring.figures import interval
from concealed.scoring.score import Parameter


def summary(outcomes: Sequence[Outcome]) -> str:
    """A table a series."""
    parts = []
    for series in dict.fromkeys(each["series"] for each in outcomes):
        these = [each for each in outcomes if each["series"] == series]
        done = [each for each in these if "error" not in each]
        failed = f", {len(these) - len(done)} failed" if len(done) < len(these) else ""
        parts.append(f"{series}: {len(done)} trials{failed}")
        parts += [f"  {words:<44} {share(hits)}" for words, hits in _rows(series, done)]
    return "\n".join(parts)


def share(hits: Sequence[bool]) -> str:
    """k of n, and the interval (Clopper and Pearson 1934) that holds the chance in 95 of 100 cases."""
    if not hits:
        return "none"
    low, high = interval(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} ({low:.0%} to {high:.0%})"


def _rows(series: str, done: Sequence[Outcome]) -> list[tuple[str, list[bool]]]:
    """What is counted in a series."""

    def of(key: str, where: str = "score") -> list[bool]:
        return [bool(each[where][key]) for each in done if where in each]

    if series.startswith("sound"):
        return [
            ("an effect is named (a false alarm)", of("claimed")),
            ("consistent", [each["score"]["verdict"] == "consistent" for each in done]),
        ]
    rows = [("not consistent", of("detected")), ("largest mismatch at the joint", of("located"))]
    if series == "unknown":
        told = [each["score"]["verdict"] in ("unexplained", "partly_explained") for each in done]
        return [*rows, ("unexplained or partly explained", told)]
    rows += [("joint of a finding right", of("placed")), ("truth within the set", of("named"))]
    rows += [("truth the first choice", of("first")), ("something else is named too", of("extra"))]
    rows.append(("confident (p > 0.9) and wrong", [_confident_and_wrong(each) for each in done]))
    if any("again" in each for each in done):
        rows.append(("… with the recommended motion: in the set", of("named", "again")))
    inside = [Parameter(**told).inside for each in done for told in each["score"]["parameters"]]
    rows.append(("95 % interval holds the parameter", inside))
    sizes = [each["score"]["size"] for each in done if np.isfinite(each["score"]["size"])]
    rows.append(
        (f"set of one effect (mean size {np.mean(sizes):.2f})" if sizes else "set of one", [s == 1 for s in sizes])
    )
    ratios = [each["oracle_ratio"] for each in done if "oracle_ratio" in each]
    if ratios:
        rows.append((f"held-out rms ≤ 1.05 oracle (largest {max(ratios):.2f})", [ratio <= 1.05 for ratio in ratios]))
    return rows


def _confident_and_wrong(each: Outcome) -> bool:
    return any(probability > 0.9 and not right for probability, right in each["score"]["probabilities"])
