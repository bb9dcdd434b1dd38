"""The diagnosis as a page that tells one story: where, what, how much, the proof, what next."""

import shlex
from collections.abc import Iterator, Sequence

from tauscope.diagnosis import Diagnosis, DiagnosisDocument
from tauscope.diagnosis.documents.plots import DiagnosisPlots, diagnosis_plots
from tauscope.diagnosis.documents.result import FindingEntry
from tauscope.diagnosis.next_experiment import PlannedExperiment
from tauscope.number_text import chance, counted, significant
from tauscope.report import tables
from tauscope.report.figures import difference_figure, heat_map, heat_table, motion_figure, proof_figure, shift_figure
from tauscope.report.page import Card, Drawing, Fold, KeyFigure, Numbers, Page, Part, Section, render
from tauscope.report.provenance import Provenance
from tauscope.report.words import (
    MOST_FINDINGS,
    constancy_sentence,
    doubts,
    effect_title,
    file_title,
    finding_facts,
    location_sentence,
    noise_ratios,
    noise_words,
    place_title,
    summary_sentences,
)
from tauscope.robot import JointType


def diagnosis_report(
    diagnosis: Diagnosis, document: DiagnosisDocument, provenance: Provenance, planned: PlannedExperiment | None = None
) -> str:
    """A self-contained HTML page on a diagnosis."""
    plots = diagnosis_plots(diagnosis)
    units = [joint.type.torque_unit for joint in diagnosis.robot.joints]
    sections = [
        _where(plots, document, [joint.type for joint in diagnosis.robot.joints]),
        _what(document),
        _how_much(document),
        _proof(plots, document, units),
        *_headroom(document),
        _next(document, planned),
        _detectable(document),
    ]
    return render(
        Page(
            kind="diagnosis",
            robot=document.robot,
            headline=document.headline,
            facts=[counted(len(document.joints), "joint"), f"band {significant(document.cutoff_hz, 3)} Hz"],
            key_figures=list(_key_figures(document)),
            sentences=list(summary_sentences(document)),
            cautions=list(doubts(document)),
            story=sections,
            provenance=provenance,
        )
    )


def _key_figures(document: DiagnosisDocument) -> Iterator[KeyFigure]:
    yield KeyFigure("Verdict", document.verdict.replace("_", " "), "computed from tests, not chosen")
    names = ", ".join(dict.fromkeys(effect_title(finding.effect) for finding in document.findings[:3]))
    yield KeyFigure("Findings", str(len(document.findings)), names or "nothing is named")
    before, after, held_out = noise_ratios(document)
    most = max(range(len(before)), key=before.__getitem__)
    yield KeyFigure(
        "Residual / noise",
        f"{significant(before[most], 3)} → {significant(after[most], 3)}",
        f"{document.joints[most]}, {'held-out' if held_out else 'its own'} motion",
    )
    source = "repeated periods" if document.noise_method == "periods" else "the residual"
    yield KeyFigure("Noise known from", source, noise_words(document.noise_method))


def _where(plots: DiagnosisPlots, document: DiagnosisDocument, types: list[JointType]) -> Section:
    caption = (
        "Each cell holds as many samples as any other of its row and group; its shade is the rms of the residual in it,"
        " as a multiple of the noise."
    )
    label = "Residual of every joint by velocity, position, load, acceleration and time, as a multiple of the noise"
    drawn = heat_map(plots.histograms, document.joints, after=False)
    parts = [Part(title="What the model leaves", figure=Drawing(drawn, f"{label}, before", caption))]
    if document.findings:
        drawn = heat_map(plots.histograms, document.joints, after=True)
        parts.append(Part(title="What is left with the findings", figure=Drawing(drawn, f"{label}, after", "")))
    numbers = Numbers("Numbers of the maps", heat_table(plots.histograms))
    parts.append(Part(table=tables.located_table(document), numbers=numbers))
    pairs = zip(document.mismatch, types, strict=True)
    sentences = [location_sentence(entry, joint_type) for entry, joint_type in pairs if entry.significant]
    return Section("where", "Where", parts, sentences or ["At no joint is there more than noise."])


def _what(document: DiagnosisDocument) -> Section:
    """Findings, ranked: the first few, then the others and the tentative ones, folded."""
    cards, tentative = (_cards(entries, document.joints) for entries in (document.findings, document.tentative))
    parts = [Part(card=card) for card in cards[:MOST_FINDINGS]]
    if len(cards) > MOST_FINDINGS:
        parts.append(Part(fold=Fold(f"{counted(len(cards) - MOST_FINDINGS, 'more finding')}", cards[MOST_FINDINGS:])))
    if tentative:
        title = f"Tentative: held-out motion does not confirm {counted(len(tentative), 'effect')}"
        parts.append(Part(fold=Fold(title, tentative)))
    sentences = [] if cards else ["No effect of the catalogue is named."]
    if len(cards) > 1:
        sentences = ["In order of the residual energy that each explains."]
    return Section("what", "What", parts, sentences)


def _cards(entries: Sequence[FindingEntry], joints: Sequence[str]) -> list[Card]:
    cards = []
    for rank, entry in enumerate(entries, start=1):
        title, place, facts = effect_title(entry.effect), place_title(entry.joint), finding_facts(entry, joints)
        odds = chance(entry.probability)
        cards.append(Card(rank, title, place, entry.probability, odds, entry.statement, facts))
    return cards


def _how_much(document: DiagnosisDocument) -> Section:
    parts = [Part(title="Residual rms at the recorded rate", table=tables.residual_table(document))]
    if document.parameter_differences:
        svg = difference_figure("differences", document)
        drawing = Drawing(svg, "How far the simulation's parameters are off", "The arm less what it is compared with.")
        differences = tables.difference_table(document)
        parts.append(Part(title="What the simulation has wrong", figure=drawing, table=differences))
    if document.parameter_shifts:
        drawing = Drawing(
            shift_figure("shifts", document),
            "How far parameters moved when the findings were added",
            "What the left-out effects had been hiding in: estimates with the findings less those without.",
        )
        parts.append(Part(title="What had been absorbed where", figure=drawing, table=tables.shift_table(document)))
    return Section("how-much", "How much", parts, [constancy_sentence(document)])


def _proof(plots: DiagnosisPlots, document: DiagnosisDocument, units: list[str]) -> Section:
    spectra = {spectrum.joint: spectrum for spectrum in plots.spectra}
    held_out = any(overlay.held_out for overlay in plots.overlays)
    parts = []
    for number, (overlay, unit) in enumerate(zip(plots.overlays, units, strict=True), start=1):
        spectrum = spectra.get(overlay.joint)
        names = ("time", "measured", "before", "after")
        text = tables.csv_text({name: getattr(overlay, name) for name in names})
        if spectrum is not None:
            names = ("frequency", "before", "after", "noise")
            text += "\n\n" + tables.csv_text({name: getattr(spectrum, name) for name in names})
        drawing = Drawing(
            proof_figure(f"proof-{number}", overlay, spectrum, unit),
            f"Torque of {overlay.joint}, measured and modelled without and with the findings",
            f"{file_title(overlay.recording)}, the stretch in which the findings take most off the residual.",
        )
        numbers = Numbers(f"Numbers of {overlay.joint}", text=text)
        parts.append(Part(title=overlay.joint, figure=drawing, numbers=numbers))
    motion = "on held-out motion, from which neither model was made" if held_out else "on the model's own motion"
    band = f"Torque below {significant(document.cutoff_hz, 3)} Hz {motion}."
    return Section("proof", "The proof", parts, [band])


def _headroom(document: DiagnosisDocument) -> Iterator[Section]:
    if document.headroom is None:
        return
    sentence = (
        "A black box learned from the training recordings what the findings leave there. The table shows the rms of the"
        f" held-out residual below {significant(document.cutoff_hz, 3)} Hz, and the part of its energy that the black"
        " box predicts."
    )
    statements = [entry.statement for entry in document.headroom]
    yield Section("headroom", "Headroom", [Part(table=tables.headroom_table(document))], [sentence, *statements])


def _next(document: DiagnosisDocument, planned: PlannedExperiment | None) -> Section:
    wanted = document.next_experiment
    if wanted is None:
        return Section("next", "What next", [], ["Nothing is open that another motion would decide."])
    sentences = [f"{wanted.why[:1].upper()}{wanted.why[1:]}."]
    if wanted.separates:
        sentences.append(f"It tells apart: {', '.join(wanted.separates)}.")
    parts = []
    if planned is not None:
        svg = motion_figure("next-motion", planned.trajectory, list(document.joints))
        length = significant(planned.trajectory.duration_s, 3)
        caption = f"{length} s, within the robot file's limits, from rest to rest."
        parts.append(Part(figure=Drawing(svg, "Positions of the motion to record next", caption)))
    words = ["tauscope", "run", "ROBOT.yaml", "--trajectory", wanted.trajectory or "NEXT.json", "--out", "next.csv"]
    note = None if wanted.trajectory else "`tauscope diagnose … --next-trajectory NEXT.json` writes the motion."
    return Section("next", "What next", [*parts, Part(command=shlex.join(words), note=note)], sentences)


def _detectable(document: DiagnosisDocument) -> Section:
    sentence = (
        "The smallest size of each effect that nine of ten such data sets would have shown. What is smaller may be"
        " there and not be named; – stands where no torque along this motion shows it, or it is one with a parameter."
    )
    part = Part(table=tables.detectable_table(document))
    return Section("detectable", "What would have been seen", [part], [sentence])
