"""A diagnosis in tables, the same on terminal and page."""

from tauscope.diagnosis import DiagnosisDocument
from tauscope.number_text import ABSENT, percent, significant
from tauscope.report.diagnosis_words import effect_title
from tauscope.report.table import Table

MOST_SHIFTS = 12
"""Rows of the parameters that findings have moved most."""


def located_table(document: DiagnosisDocument) -> Table:
    """Where the mismatch is, joint by joint."""
    rows = []
    for entry in document.mismatch:
        place, time = entry.where, entry.time
        rows.append(
            (
                entry.joint,
                "yes" if entry.significant else "no",
                ABSENT if place is None else place.variable.replace("_", " "),
                significant(entry.excess_rms, 3),
                ABSENT if place is None else " … ".join(significant(value, 3) for value in place.range),
                ABSENT if place is None else percent(place.share),
                ABSENT if time is None else " … ".join(significant(value, 3) for value in time.range),
            )
        )
    columns = ("joint", "more than noise", "concentrated in", "excess rms", "from … to", "share", "time [s]")
    return Table(columns, rows, words=3)


def detectable_table(document: DiagnosisDocument) -> Table:
    """The smallest size that these data would have shown: a row an effect, a column a joint."""
    places: list[str | None] = [*document.joints, None]
    found = {(entry.effect, entry.joint): entry for entry in document.detectable}
    places = [place for place in places if any(joint == place for _, joint in found)]
    rows = []
    for effect in dict.fromkeys(entry.effect for entry in document.detectable):
        own = [found.get((effect, place)) for place in places]
        units = list(dict.fromkeys(entry.unit for entry in own if entry is not None))
        sizes = ["" if entry is None else significant(entry.minimum, 2) for entry in own]
        rows.append((effect_title(effect), ", ".join(units), *sizes))
    return Table(("effect", "unit", *(place or "whole arm" for place in places)), rows, words=2)


def residual_table(document: DiagnosisDocument) -> Table:
    """Residuals before and after, on training and held-out recordings."""
    train, held_out = document.fit.train, document.fit.held_out
    columns = ["joint", "before", "after"]
    values = [train.rms_before, train.rms_after]
    if held_out is not None:
        columns += ["held out before", "held out after"]
        values += [held_out.rms_before, held_out.rms_after]
    rows = [(name, *(significant(row[place], 3) for row in values)) for place, name in enumerate(document.joints)]
    return Table(tuple(columns), rows, words=1)


def difference_table(document: DiagnosisDocument) -> Table:
    """What the simulation has wrong."""
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.simulation, e.real)), significant(e.difference_in_std, 3))
        for e in document.parameter_differences
    ]
    return Table(("parameter", "simulation", "arm", "standard errors"), rows, words=1)


def shift_table(document: DiagnosisDocument) -> Table:
    """What the left-out effects had done to the parameters."""
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.before, e.after)), significant(e.shift_in_std, 3))
        for e in document.parameter_shifts[:MOST_SHIFTS]
    ]
    return Table(("parameter", "before", "after", "standard errors"), rows, words=1)


def headroom_table(document: DiagnosisDocument) -> Table:
    """What a black box still predicts of held-out motion; no row where it was not asked for."""
    rows = [
        (
            entry.joint,
            *(significant(value, 3) for value in (entry.plain, entry.explained, entry.black_box, entry.floor)),
            entry.floor_kind.replace("_", " "),
            " ± ".join(f"{100.0 * value:.0f}" for value in (entry.share, entry.share_std) if value is not None),
            "yes" if entry.refuted else "no",
        )
        for entry in document.headroom or ()
    ]
    columns = ("joint", "plain", "explained", "black box", "floor", "floor from", "predicted [%]", "refuted")
    return Table(columns, rows, words=1)
