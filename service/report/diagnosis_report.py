"""The diagnosis as a page: the verdict, the findings, and the residuals that they are about."""

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from service.diagnosis import Diagnosis, DiagnosisDocument
from service.diagnosis.plots import DiagnosisPlots, ResidualHistogram, diagnosis_plots
from service.report.diagnosis_words import VERDICTS, difference_table, residual_table, shift_table
from service.report.page import Drawing, KeyFigure, Page, Part, Section, render
from service.report.provenance import Provenance
from service.report.quantities import significant
from service.report.svg import MEASURED, MUTED, PREDICTED, draw_svg
from service.report.table import Table
from service.report.tables import input_table

ROW_INCHES = 1.1


def diagnosis_report(diagnosis: Diagnosis, document: DiagnosisDocument, provenance: Provenance) -> str:
    """A self-contained HTML page on a diagnosis.

    Parameters
    ----------
    diagnosis : Diagnosis
        the result
    document : DiagnosisDocument
        the same as plain data
    provenance : Provenance
        where it came from

    Returns
    -------
    str
        HTML with inline figures: no script, no request to anywhere
    """
    plots = diagnosis_plots(diagnosis)
    sentences = [f"{document.verdict}: {VERDICTS[document.verdict]}."]
    sentences += [f"{finding.statement}." for finding in document.findings]
    if document.next_experiment is not None:
        sentences.append(f"Next: {document.next_experiment.why}.")
    sections = [_residual_section(plots, document), _location_section(plots, document)]
    sections += [_parameter_section(document)] if document.parameter_differences or document.parameter_shifts else []
    sections += [_detectable_section(document), Section("reproduce", "Inputs", [Part(table=input_table(provenance))])]
    page = Page(
        kind="diagnosis",
        robot=document.robot,
        subtitle=f"compared with: {document.against} · band {significant(document.cutoff_hz, 3)} Hz · noise from "
        f"{document.noise_method} · {provenance.created.strftime('%Y-%m-%d %H:%M %Z').strip()}",
        key_figures=[
            KeyFigure("Verdict", document.verdict.replace("_", " "), "computed from tests"),
            KeyFigure("Findings", str(len(document.findings)), "effects that the model leaves out"),
        ],
        sentences=sentences,
        cautions=[],
        sections=sections,
        footer=", ".join(f"{name} {version}" for name, version in provenance.versions),
    )
    return render(page)


def _residual_section(plots: DiagnosisPlots, document: DiagnosisDocument) -> Section:
    """Residuals over time of the first recording, before and after."""
    first = plots.curves[0].recording
    curves = [curve for curve in plots.curves if curve.recording == first]

    def draw(figure: Figure) -> None:
        axes = np.atleast_1d(figure.subplots(len(curves), 1, sharex=True))
        for axis, curve in zip(axes, curves, strict=True):
            axis.plot(curve.time, curve.before, color=MEASURED, linewidth=0.8, label="before")
            axis.plot(curve.time, curve.after, color=PREDICTED, linewidth=0.6, label="after")
            axis.set_title(curve.joint)
        axes[-1].set_xlabel("t [s]")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left", ncols=2, borderpad=0.0)

    svg = Markup(draw_svg("residuals", 0.8 + ROW_INCHES * len(curves), draw))  # noqa: S704 - our own drawing
    caption = f"{first}: torque that the model leaves without (grey) and with the findings, in the common band."
    figure = Drawing(svg, "Residual of every joint over time, before and after", caption)
    return Section("residuals", "Residuals", [Part(figure=figure, table=residual_table(document))])


def _location_section(plots: DiagnosisPlots, document: DiagnosisDocument) -> Section:
    """Where the mismatch is: rms by velocity, position, load, acceleration."""
    parts = []
    for number, joint in enumerate(document.joints, start=1):
        own = [each for each in plots.histograms if each.joint == joint]
        if not own:
            continue
        svg = Markup(_histograms(f"location-{number}", own))  # noqa: S704 - as above
        label = f"Residual of {joint} by velocity, position, load and acceleration"
        parts.append(Part(title=joint, figure=Drawing(svg, label, "Rms in bins of equal count; dashed: the noise.")))
    return Section("location", "Where", parts)


def _histograms(name: str, own: list[ResidualHistogram]) -> str:
    def draw(figure: Figure) -> None:
        axes = np.atleast_1d(figure.subplots(1, len(own), sharey=True))
        for axis, each in zip(axes, own, strict=True):
            axis.stairs(each.before, each.edges, color=MEASURED, label="before")
            axis.stairs(each.after, each.edges, color=PREDICTED, label="after")
            axis.axhline(each.noise, color=MUTED, linewidth=0.8, linestyle=(0, (3, 2)))
            axis.set_xlabel(each.variable)

    return draw_svg(name, 1.9, draw)


def _parameter_section(document: DiagnosisDocument) -> Section:
    parts = []
    if document.parameter_differences:
        parts.append(Part(title="What the simulation has wrong", table=difference_table(document)))
    if document.parameter_shifts:
        parts.append(Part(title="What the left-out effects had done", table=shift_table(document)))
    return Section("parameters", "Parameters", parts)


def _detectable_section(document: DiagnosisDocument) -> Section:
    """What would have been seen."""
    rows = [
        (
            entry.effect,
            entry.joint or "whole arm",
            "nothing shows it" if entry.minimum is None else f"{significant(entry.minimum, 2)} {entry.unit}",
        )
        for entry in document.detectable
    ]
    return Section("detectable", "What would have been seen", [Part(table=Table(("effect", "joint", "from"), rows, 2))])
