"""The trials on real recordings as a table: what was concealed, and what was said beyond the untouched recordings."""

from collections.abc import Sequence

from concealed.real.trials import REAL
from concealed.running.kept import Outcome

SERIES = "real"


def real_outcomes(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Trials on real recordings, in their order."""
    order = list(REAL)
    these = [each for each in outcomes if each["series"] == SERIES]
    return sorted(these, key=lambda each: order.index(each["arm"]))


def table(outcomes: Sequence[Outcome]) -> str:
    """A row a trial; empty where there is none."""
    these = real_outcomes(outcomes)
    if not these:
        return ""
    plain = {each["case"]["arm"]: _said(each) for each in these if each["arm"] and _is_untouched(each)}
    head = ["recordings", "concealed, or found by others", "named", "value", "also said", "verdict"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *(_row(each, plain) for each in these)])


def _row(each: Outcome, plain: dict[str, list[str]]) -> str:
    told = REAL[each["arm"]]
    start = f"| {told.recordings} | {told.words} |"
    if "score" not in each:
        return f"{start} error: {each['error'][:120].replace('|', '/')} | | | |"
    known = [] if _is_untouched(each) else plain.get(told.recordings, [])
    others = [f"`{one}`{' (there before)' if one in known else ''}" for one in _said(each) if one not in told.labels]
    return f"{start} {_named(each)} | {_values(each)} | {', '.join(others)} | {each['score']['verdict']} |"


def _named(each: Outcome) -> str:
    if not REAL[each["arm"]].labels:
        return "rightly nothing" if not each["score"]["claimed"] else "**an effect is named**"
    if each["score"]["first"]:
        return "yes"
    return "in a set" if each["score"]["named"] else "**no**"


def _values(each: Outcome) -> str:
    """Concealed and found values of the parameters."""
    found = [
        f"{one['name']} = {one['value']:.3g} ± {one['std']:.1g} ({one['truth']:g} concealed)"
        for one in each["score"]["parameters"]
    ]
    return "; ".join(found)


def _said(each: Outcome) -> list[str]:
    """First choices of all findings."""
    return [str(one.split(" ")[0]) for one in each["score"]["told"]] if "score" in each else []


def _is_untouched(each: Outcome) -> bool:
    return REAL[each["arm"]].edit is None
