"""The rollout as a page: real and simulated motion, and their errors."""

from matplotlib.figure import Figure

from tauscope.closed_loop import tables
from tauscope.closed_loop.result import RolloutDocument
from tauscope.closed_loop.rollout import Rollout, Trace
from tauscope.number_text import counted, significant
from tauscope.report.curves import envelope_indices
from tauscope.report.figures import plot_envelope
from tauscope.report.page import Drawing, KeyFigure, Numbers, Page, Part, Section, render
from tauscope.report.provenance import Provenance
from tauscope.report.svg import HELD_OUT, INK, MEASURED, PREDICTED, RESIDUAL, draw_svg
from tauscope.report.tables import csv_text

HEIGHT_INCHES = 3.4

MOST_POINTS = 1400  # points a curve; two a pixel
COLOURS = {"stated": HELD_OUT, "identified": PREDICTED, "findings": RESIDUAL, "refined": INK}


def rollout_page(rollout: Rollout, provenance: Provenance) -> str:
    """A self-contained HTML page on a rollout."""
    document = rollout.document
    worst = max(rollout.traces, key=lambda trace: max(trace.entry.models[-1].rms))
    names = [joint.name for joint in rollout.robot.joints]
    parts = [_motion(worst, joint, name) for joint, name in enumerate(names)]
    errors = [Part(table=tables.summary_table(document)), Part(table=tables.recording_table(document))]
    refined = document.refinement
    refinement = [] if refined is None else [Part(table=tables.refinement_table(refined))]
    sections = [
        Section("errors", "Position error", errors),
        *([Section("refinement", "Refined parameters", refinement)] if refinement else []),
        Section("motion", "Motion where the error is largest", parts, [f"{worst.motion.name}."]),
    ]
    counts = [counted(len(names), "joint"), counted(len(rollout.traces), "recording")]
    return render(
        Page(
            kind="rollout",
            robot=document.robot,
            facts=[*counts, "closed loop in MuJoCo"],
            key_figures=_key_figures(document),
            sentences=list(tables.rollout_sentences(document)),
            cautions=[warning.sentence for warning in document.warnings],
            story=sections,
            provenance=provenance,
        )
    )


def _key_figures(document: RolloutDocument) -> list[KeyFigure]:
    figures = []
    for entry in document.summary:
        place = max(range(len(entry.rms)), key=entry.rms.__getitem__)
        value = f"{significant(tables.MILLI * entry.rms[place], 3)} mrad"
        figures.append(
            KeyFigure(tables.MODEL_WORDS[entry.model].capitalize(), value, f"rms at {document.joints[place]}")
        )
    return figures


def _motion(trace: Trace, joint: int, name: str) -> Part:
    time, real = trace.motion.rows, trace.motion.measured[:, joint]
    curves = {model: positions[:, joint] for model, positions in trace.simulated.items()}

    def draw(figure: Figure) -> None:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
        plot_envelope(above, time, real, MOST_POINTS, color=MEASURED, linewidth=0.9, label="real")
        for model, curve in curves.items():
            style = {"color": COLOURS[model], "linewidth": 1.0, "label": tables.MODEL_WORDS[model]}
            plot_envelope(above, time, curve, MOST_POINTS, **style)
            plot_envelope(below, time, tables.MILLI * (curve - real), MOST_POINTS, color=COLOURS[model], linewidth=0.7)
        above.set_ylabel("position [rad, m]")
        above.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, borderaxespad=0.0, borderpad=0.2)
        below.set_ylabel("error [mrad, mm]")
        below.set_xlabel("time [s]")

    svg = draw_svg(f"motion-{joint + 1}", HEIGHT_INCHES, draw)
    kept = envelope_indices(real, MOST_POINTS // 2)
    columns = {"time": time, "real": real, **curves}
    numbers = Numbers(f"Numbers of {name}", text=csv_text({key: each[kept].tolist() for key, each in columns.items()}))
    caption = f"{name}: real and simulated position above, simulated less real below."
    return Part(title=name, figure=Drawing(svg, f"Motion of {name}, real and simulated", caption), numbers=numbers)
