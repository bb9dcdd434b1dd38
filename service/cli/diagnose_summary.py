"""The result of a diagnosis as tables and sentences on a terminal."""

from rich.console import Console

from service.cli.terminal import plain, table
from service.diagnosis import DiagnosisDocument
from service.report.quantities import significant
from service.report.table import Table

VERDICTS = {
    "consistent": "nothing but noise is left",
    "explained": "the findings bring the residual to the noise",
    "partly_explained": "the findings improve the fit, and a significant remainder stays",
    "unexplained": "a significant mismatch that nothing in the catalogue explains",
    "inconclusive": "the parameters do not hold from one recording to the next, and nothing can be named",
}


def show_diagnosis(console: Console, document: DiagnosisDocument) -> None:
    """Show the verdict, the findings, and what they change.

    Parameters
    ----------
    console : Console
        where to
    document : DiagnosisDocument
        the result
    """
    console.print(plain(f"Robot {document.robot}: {document.verdict}: {VERDICTS[document.verdict]}"), soft_wrap=True)
    console.print()
    for finding in document.findings:
        console.print(plain(f"* {finding.statement}"), soft_wrap=True)
    if document.findings:
        console.print()
    console.print(table("Mismatch with the nominal model", _mismatch(document)))
    console.print(table("Residual at the recorded rate [Nm or N]", _residuals(document)))
    if document.parameter_differences:
        console.print(table("What the simulation has wrong", _differences(document)))
    if document.parameter_shifts:
        console.print(table("What the left-out effects had done to the parameters", _shifts(document)))
    invisible = sorted({e.effect + (f"@{e.joint}" if e.joint else "") for e in document.detectable if not e.visible})
    if invisible:
        console.print(plain(f"No such data can show: {', '.join(invisible)}"), soft_wrap=True)
    if document.next_experiment is not None:
        console.print(plain(f"Next: {document.next_experiment.why}"), soft_wrap=True)


def _mismatch(document: DiagnosisDocument) -> Table:
    rows = []
    for entry in document.mismatch:
        place = entry.where or entry.time
        where = "" if place is None else f"{place.variable} {place.range[0]:.3g} … {place.range[1]:.3g}"
        rows.append((entry.joint, "yes" if entry.significant else "no", where, significant(entry.excess_rms, 3)))
    return Table(("joint", "significant", "mostly at", "excess rms"), rows, words=3)


def _residuals(document: DiagnosisDocument) -> Table:
    train, held_out = document.fit.train, document.fit.held_out
    columns = ["joint", "before", "after"]
    values = [train.rms_before, train.rms_after]
    if held_out is not None:
        columns += ["held out before", "held out after"]
        values += [held_out.rms_before, held_out.rms_after]
    rows = [(name, *(significant(row[place], 3) for row in values)) for place, name in enumerate(document.joints)]
    return Table(tuple(columns), rows, words=1)


def _differences(document: DiagnosisDocument) -> Table:
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.simulation, e.real)), significant(e.difference_in_std, 3))
        for e in document.parameter_differences
    ]
    return Table(("parameter", "simulation", "arm", "standard errors"), rows, words=1)


def _shifts(document: DiagnosisDocument) -> Table:
    rows = [
        (e.parameter, *(significant(value, 4) for value in (e.before, e.after)), significant(e.shift_in_std, 3))
        for e in document.parameter_shifts[:12]
    ]
    return Table(("parameter", "before", "after", "standard errors"), rows, words=1)
