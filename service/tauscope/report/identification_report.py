"""The identification as a page: what an engineer reads, shows and files."""

from collections.abc import Iterator, Sequence

from tauscope.identification import Identification, IdentificationDocument, document
from tauscope.number_text import counted, percent, significant
from tauscope.recording import Recording
from tauscope.report import tables
from tauscope.report.curves import MOST_SERIES, TorqueSeries, friction_curve, torque_series
from tauscope.report.figures import friction_figure, parameter_figure, residual_figure, torque_columns, torque_figure
from tauscope.report.page import Drawing, KeyFigure, Numbers, Page, Part, Section, render
from tauscope.report.provenance import Provenance
from tauscope.report.words import band_words, cautions, fit_sentences, masked_samples, noise_ratio, noise_words

_FRICTION_EQUATION = "τ_f(q̇) = τ_s A(K_v q̇) + τ_sc A(δ q̇) + τ_v q̇ + offset,  A(x) = (2/π) arctan x"


def identification_report(
    identification: Identification,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    provenance: Provenance,
) -> str:
    """A self-contained HTML page. Raises RecordingError where a recording cannot be conditioned again."""
    result = document(identification)
    train = [torque_series(identification, recording) for recording in recordings[:MOST_SERIES]]
    judged = [torque_series(identification, recording) for recording in held_out[:1]]
    sections = [
        _fit_section(result, identification),
        *(_torque_section(result, identification, series, "held-out") for series in judged),
        _torque_section(result, identification, train[0], "own"),
        _friction_section(result, identification, train),
        _parameter_section(result),
        _link_section(result),
        Section("data", "Recordings", [Part(table=tables.conditioning_table(result))]),
    ]
    return render(
        Page(
            kind="identification",
            robot=result.robot,
            facts=_facts(result),
            key_figures=list(_key_figures(result)),
            sentences=fit_sentences(result),
            cautions=cautions(result),
            story=sections,
            provenance=provenance,
        )
    )


def _facts(result: IdentificationDocument) -> list[str]:
    counts = [(len(result.conditioning), ""), (len(result.held_out_conditioning), " held out")]
    recordings = ", ".join(f"{counted(count, 'recording')}{what}" for count, what in counts if count)
    return [counted(len(result.joints), "joint"), recordings, result.estimator.upper(), f"band {band_words(result)}"]


def _key_figures(result: IdentificationDocument) -> Iterator[KeyFigure]:
    train, held_out = result.fit.train, result.fit.held_out
    if held_out is not None:
        yield KeyFigure("Relative error, held out", percent(held_out.relative_error), "‖τ − τ̂‖ / ‖τ‖ in the band")
    yield KeyFigure("Relative error", percent(train.relative_error), "on the model's own recordings")
    ratios = [noise_ratio(*pair) for pair in zip((held_out or train).rms, result.noise_std, strict=True)]
    worst = max(range(len(ratios)), key=ratios.__getitem__)
    yield KeyFigure("Residual / noise", significant(ratios[worst], 3), f"at {result.joints[worst]}, the largest of all")
    yield KeyFigure("Condition number", significant(result.condition_number, 3), "of the unweighted regressor")
    samples = sum(entry.samples for entry in (*result.conditioning, *result.held_out_conditioning))
    yield KeyFigure("Samples", f"{samples:,}".replace(",", " "), f"{masked_samples(result)} masked")


def _fit_section(result: IdentificationDocument, identification: Identification) -> Section:
    figure = Drawing(
        residual_figure("fit", result),
        "Residual of every joint as a multiple of its sensor noise",
        "Residual rms at the recorded rate, unfiltered, as a multiple of the sensor noise σ"
        f" ({noise_words(result.noise_method)})."
        " A joint at one has nothing but noise left.",
    )
    return Section("fit", "Fit", [Part(figure=figure, table=tables.fit_table(result, identification.robot))])


def _torque_section(
    result: IdentificationDocument, identification: Identification, series: TorqueSeries, kind: str
) -> Section:
    parts = []
    for joint, name in enumerate(result.joints):
        unit = identification.robot.joints[joint].type.torque_unit
        svg = torque_figure(f"{kind}-{joint + 1}", series, joint, result.noise_std[joint], unit)
        label = f"Torque of {name}, measured and predicted, and their difference"
        caption = f"{name}: torque at the recorded rate above, what the model leaves below; right, the shaded tenth."
        drawing = Drawing(svg, label, caption)
        numbers = Numbers(f"Numbers of {name}", text=tables.csv_text(torque_columns(series, joint)))
        parts.append(Part(title=name, figure=drawing, numbers=numbers))
    length = series.time[-1] - series.time[0]
    shown = f"{series.recording}, {significant(length, 3)} s at {significant(series.rate_hz, 4)} Hz"
    if series.repetitions > 1:
        shown += f"; the first of {series.repetitions} periods that were averaged"
    title = "Torque on a held-out recording" if kind == "held-out" else "Torque on the model's own recording"
    return Section(f"torque-{kind}", title, parts, [f"{shown}."])


def _friction_section(
    result: IdentificationDocument, identification: Identification, series: Sequence[TorqueSeries]
) -> Section:
    types = [joint.type for joint in identification.robot.joints]
    curves = [friction_curve(identification, series, joint) for joint in range(len(types))]
    units = [(f"{kind.unit}/s", kind.torque_unit) for kind in types]
    figure = Drawing(
        friction_figure("friction", curves, result.joints, units),
        "Friction of every joint over its velocity",
        "Solid where recordings exist, between the upright lines; dashed beyond. The band follows from the standard"
        " errors alone; the dots are the recordings' own: measured torque less that of the rigid body.",
    )
    curve_numbers = [
        Part(numbers=Numbers(f"Numbers of {name}", text=tables.csv_text(curve.columns)))
        for name, curve in zip(result.joints, curves, strict=True)
    ]
    parts = [Part(figure=figure), *curve_numbers, Part(table=tables.friction_table(result), note=_FRICTION_EQUATION)]
    if result.rotor_inertia:
        parts.append(Part(title="Reflected rotor inertia", table=tables.rotor_table(result)))
    return Section("friction", "Friction", parts)


def _parameter_section(result: IdentificationDocument) -> Section:
    undetermined = set(result.undetermined)
    known = [entry for entry in result.base_parameters if entry.name not in undetermined]
    parts = []
    if known:
        caption = "Estimates with 95 % intervals, one panel a unit; inertias about the link frames' origins."
        svg = parameter_figure("parameters", known)
        parts.append(Part(figure=Drawing(svg, "Base parameters with their 95 % intervals", caption)))
    note = f"No motion of this arm shows {', '.join(result.unidentifiable)}." if result.unidentifiable else None
    parts.append(Part(table=tables.base_parameter_table(result), note=note))
    return Section("parameters", "Base parameters", parts)


def _link_section(result: IdentificationDocument) -> Section:
    sentence = (
        "The most probable full parameter set: every pseudo-inertia positive definite, friction not negative."
        " Data determine their base parameters; the prior determines the rest of each."
    )
    return Section("links", "Links", [Part(table=tables.link_table(result))], [sentence])
