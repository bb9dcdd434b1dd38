"""The result of a rollout as tables and sentences."""

from collections.abc import Iterator

from tauscope.closed_loop.result import RefinementEntry, RolloutDocument
from tauscope.number_text import ABSENT, significant
from tauscope.report.tables import Table

# Models in words: the identified one is without findings of a diagnosis.
MODEL_WORDS = {"stated": "robot file", "identified": "identified", "findings": "with findings", "refined": "refined"}
MILLI = 1e3

LEAST_P = 1e-3  # p below which its size says nothing


def summary_table(document: RolloutDocument) -> Table:
    """Mean rms and largest error of every joint by model, in mrad."""
    rows = [
        (joint, MODEL_WORDS[entry.model], _milli(entry.rms[place]), _milli(entry.worst[place]))
        for place, joint in enumerate(document.joints)
        for entry in document.summary
    ]
    return Table(("joint", "model", "rms [mrad, mm]", "largest [mrad, mm]"), rows, words=2)


def recording_table(document: RolloutDocument) -> Table:
    """Errors by recording, joint and model: by time between restarts, at reversals, and the lag."""
    entries = [entry for recording in document.recordings for entry in recording.models[0].horizons]
    horizons = sorted({entry.horizon_s for entry in entries if entry.horizon_s is not None})
    rows = []
    for recording in document.recordings:
        for place, joint in enumerate(document.joints):
            for entry in recording.models:
                by_horizon = {each.horizon_s: each.rms[place] for each in entry.horizons}
                errors = [*map(by_horizon.get, horizons), entry.rms[place], entry.reversals[place]]
                lag = significant(MILLI * entry.lag[place], 2)
                rows.append((recording.recording, joint, MODEL_WORDS[entry.model], *map(_milli, errors), lag))
    heads = [f"{horizon:g} s" for horizon in horizons]
    return Table(("recording", "joint", "model", *heads, "free", "reversals", "lag [ms]"), rows, words=3)


def refinement_table(entry: RefinementEntry) -> Table:
    """Refined parameters with their standard errors, and p of no such term."""
    rows = []
    for each in entry.parameters:
        p_value = ABSENT if each.p_value is None else "< 0.001" if each.p_value < LEAST_P else f"{each.p_value:.3f}"
        rows.append((each.name, significant(each.value, 3), significant(each.std, 2), each.unit, p_value))
    return Table(("parameter", "value", "± std", "unit", "p"), rows, words=1)


def rollout_sentences(document: RolloutDocument) -> Iterator[str]:
    """How the motion was driven, what it came to, and what the simulation lacks."""
    if document.drive == "loop":
        delays = ", ".join(ABSENT if delay is None else f"{MILLI * delay:.1f}" for delay in document.delay)
        yield f"MuJoCo gets the recorded commands through the stated loops; delay {delays} ms."
    else:
        yield "MuJoCo gets the recorded torque, and a stabiliser of 1 Hz draws it to the recorded motion."
        models = [entry for recording in document.recordings for entry in recording.models]
        largest = [max(entry.stabiliser_rms) for entry in models if entry.stabiliser_rms]
        if largest:
            yield f"The stabiliser's torque is at most {significant(max(largest), 2)} Nm or N rms."
    first, last = document.summary[0], document.summary[-1]
    if first is not last:
        before, after = (MILLI * sum(entry.rms) / len(entry.rms) for entry in (first, last))
        change = "falls" if after < before else "rises"
        yield (
            f"From {MODEL_WORDS[first.model]} to {MODEL_WORDS[last.model]} the mean rms error {change} from"
            f" {significant(before, 3)} to {significant(after, 3)} mrad."
        )
    if document.refinement is not None:
        yield from _refinement_sentences(document.refinement)
    for text in document.left_out:
        yield f"Not simulated: {text}."


def _refinement_sentences(entry: RefinementEntry) -> Iterator[str]:
    before, after = (significant(MILLI * value, 3) for value in (entry.rms_before, entry.rms_after))
    yield f"The refinement lowers the error of {entry.segments} segments of 0.3 s from {before} to {after} mrad."
    if entry.left_out:
        yield f"Not significant, left out: {', '.join(entry.left_out)}."
    if entry.is_better:
        yield "On the judging recordings the refined model is the best: use it."
    else:
        yield "On the judging recordings another model is better: do not use the refined one."


def _milli(value: float | None) -> str:
    return ABSENT if value is None else significant(MILLI * value, 3)
