"""The result of a diagnosis as tables and sentences on a terminal."""

from collections.abc import Sequence

from rich.console import Console

from tauscope.cli.terminal import plain, table
from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.result import FindingEntry
from tauscope.number_text import significant
from tauscope.report.tables import Table, difference_table, headroom_table, residual_table, shift_table
from tauscope.report.words import MOST_FINDINGS, VERDICTS, noise_words, refutations


def show_diagnosis(console: Console, document: DiagnosisDocument) -> None:
    """Show the verdict, the findings, and what they change."""
    console.print(plain(f"Robot {document.robot}: {document.headline}"), soft_wrap=True)
    console.print(plain(f"Verdict {document.verdict}: {VERDICTS[document.verdict]}"), soft_wrap=True)
    console.print(plain(f"Noise: {noise_words(document.noise_method)}"), soft_wrap=True)
    for warning in document.warnings:
        console.print(plain(f"! {warning.sentence}."), soft_wrap=True)
    console.print()
    _show_findings(console, document.findings)
    if document.tentative:
        console.print(plain("Tentative: held-out motion does not confirm these"), soft_wrap=True)
        _show_findings(console, document.tentative)
    for sentence in document.wrong_values:
        console.print(plain(f"* {sentence}"), soft_wrap=True)
    if document.wrong_values:
        console.print()
    console.print(table("Mismatch with the nominal model", _mismatch(document)))
    console.print(table("Residual at the recorded rate [Nm or N]", residual_table(document)))
    if document.headroom is not None:
        title = f"Headroom: held-out residual below {significant(document.cutoff_hz, 3)} Hz [Nm or N]"
        console.print(table(title, headroom_table(document)))
        for sentence in refutations(document):
            console.print(plain(f"* {sentence}"), soft_wrap=True)
    if document.parameter_differences:
        console.print(table("What the simulation has wrong", difference_table(document)))
    if document.parameter_shifts:
        console.print(table("What the left-out effects had done to the parameters", shift_table(document)))
    invisible = sorted({e.effect + (f"@{e.joint}" if e.joint else "") for e in document.detectable if not e.visible})
    if invisible:
        console.print(plain(f"No such data can show: {', '.join(invisible)}"), soft_wrap=True)
    if document.next_experiment is not None:
        console.print(plain(f"Next: {document.next_experiment.why}"), soft_wrap=True)


def _show_findings(console: Console, findings: Sequence[FindingEntry]) -> None:
    """The first few, and how many more there are."""
    for finding in findings[:MOST_FINDINGS]:
        console.print(plain(f"* {finding.statement}"), soft_wrap=True)
    if len(findings) > MOST_FINDINGS:
        console.print(plain(f"  and {len(findings) - MOST_FINDINGS} more, see --json"), soft_wrap=True)
    if findings:
        console.print()


def _mismatch(document: DiagnosisDocument) -> Table:
    rows = []
    for entry in document.mismatch:
        place = entry.where or entry.time
        where = "" if place is None else f"{place.variable} {place.range[0]:.3g} … {place.range[1]:.3g}"
        rows.append((entry.joint, "yes" if entry.significant else "no", where, significant(entry.excess_rms, 3)))
    return Table(("joint", "significant", "mostly at", "excess rms"), rows, words=3)
