"""Pictures of the proof: SVG on a ground of its own, so that light and dark pages show the same.

Colours are those of Okabe and Ito (2008) and a map whose lightness grows evenly; no meaning hangs on colour alone.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from numpy.typing import NDArray

from concealed.baselines.comparison import picture as baselines_picture
from concealed.running.kept import Outcome
from concealed.scoring.breakdown import (
    Count,
    arm_of,
    confusion,
    counts,
    coverage,
    effect_of,
    named,
    single,
    strength_of,
)
from concealed.scoring.calibration import bins, calibration_error, claims
from concealed.scoring.figures import AS_ORACLE, Figure, Standing, done, interval, sizes

BLUE, ORANGE, GREEN, VERMILION, GREY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#666666"
STANDING = {
    Standing.SHOWN: (GREEN, "o"),
    Standing.MET: (BLUE, "s"),
    Standing.SHORT: (ORANGE, "D"),
    Standing.MISSED: (VERMILION, "X"),
}
STYLE: dict[Any, Any] = {
    "svg.hashsalt": "tauscope",  # the same figures give the same bytes
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}


def draw_all(outcomes: Sequence[Outcome], figures: Sequence[Figure], folder: Path) -> list[str]:
    """Every picture that these outcomes can fill; the names of those drawn."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []
    with mpl.rc_context(STYLE):
        for name, picture in {
            "headline": lambda: headline_picture(figures),
            "by-strength": lambda: shares_picture(single(outcomes), "s", lambda each: f"{strength_of(each):g}"),
            "by-arm": lambda: shares_picture(single(outcomes), "arm", arm_of),
            "confusion": lambda: confusion_picture(outcomes),
            "calibration": lambda: calibration_picture(outcomes),
            "coverage": lambda: coverage_picture(coverage(outcomes)),
            "set-size": lambda: histogram(sizes(outcomes), "effects in a set that holds the truth", None),
            "oracle": lambda: histogram(
                [each["oracle_ratio"] for each in outcomes if "oracle_ratio" in each],
                "held-out rms ÷ that of a diagnosis that knows the form",
                AS_ORACLE,
            ),
            "time": lambda: time_picture(done(outcomes)),
            "baselines": lambda: baselines_picture(outcomes),
        }.items():
            canvas = picture()
            if canvas is not None:
                canvas.savefig(folder / f"{name}.svg", metadata={"Date": None}, bbox_inches="tight")
                drawn.append(name)
    return drawn


def _axes(width: float, height: float) -> tuple[Canvas, Axes]:
    canvas = Canvas(figsize=(width, height), layout="constrained")
    return canvas, canvas.add_subplot()


def headline_picture(figures: Sequence[Figure]) -> Canvas | None:
    """Every share with its interval, and its target."""
    shown = [each for each in figures if each.hits is not None and each.count and each.id != "failed"]
    if not shown:
        return None
    canvas, axes = _axes(8.5, 0.32 * len(shown) + 1.2)
    for row, each in enumerate(reversed(shown)):
        colour, marker = (GREY, "o") if each.standing is None else STANDING[each.standing]
        axes.plot([each.low, each.high], [row, row], color=colour, lw=2)
        axes.plot(each.value, row, marker, color=colour, ms=6)
        if each.target is not None:
            axes.plot([each.target, each.target], [row - 0.38, row + 0.38], color="black", lw=1.2)
    axes.set_yticks(range(len(shown)), [f"{each.words}  ({each.hits}/{each.count})" for each in reversed(shown)])
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel("share of trials, 95 % interval; upright line: target")
    axes.grid(axis="x", color="#dddddd", lw=0.6)
    return canvas


def shares_picture(outcomes: Sequence[Outcome], words: str, group: Any) -> Canvas | None:
    """Truth within a set, by effect and something else."""
    if not outcomes:
        return None
    effects = sorted({effect_of(each) for each in outcomes})
    groups = sorted({group(each) for each in outcomes}, key=lambda told: (len(told), told))
    found = counts(outcomes, lambda each: (effect_of(each), group(each)), named)
    values = np.full((len(effects), len(groups)), np.nan)
    texts = np.full(values.shape, "", dtype=object)
    for (effect, one), (hits, count) in found.items():
        place = effects.index(effect), groups.index(one)
        values[place], texts[place] = hits / count, f"{hits}/{count}"
    canvas, axes = _axes(2.6 + 0.75 * len(groups), 0.26 * len(effects) + 1.0)
    _heat(axes, values, texts, effects, groups)
    axes.set_xlabel(f"{words}; truth within a finding's set")
    return canvas


def confusion_picture(outcomes: Sequence[Outcome]) -> Canvas | None:
    """What was concealed and what was named first."""
    truths, answers, table = confusion(outcomes)
    if not truths:
        return None
    rows = table.sum(axis=1, keepdims=True)
    texts = np.where(table > 0, table.astype(str), "").astype(object)
    canvas, axes = _axes(0.3 * len(answers) + 2.6, 0.26 * len(truths) + 2.4)
    _heat(axes, np.where(table > 0, table / np.maximum(rows, 1), np.nan), texts, truths, answers)
    axes.set_xticks(range(len(answers)), answers, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_ylabel("concealed (for forms and laws: the family)")
    axes.set_xlabel("effect of the first finding")
    return canvas


def _heat(axes: Axes, values: NDArray[np.float64], texts: NDArray[Any], rows: list[str], columns: list[str]) -> None:
    """Shares as lightness, with their counts written in."""
    axes.imshow(values, cmap="cividis", vmin=0.0, vmax=1.0, aspect="auto")
    for row, column in np.ndindex(values.shape):
        if texts[row, column]:
            ink = "white" if values[row, column] < 0.5 else "black"
            axes.text(column, row, str(texts[row, column]), ha="center", va="center", color=ink, fontsize=8)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xticks(range(len(columns)), columns)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def calibration_picture(outcomes: Sequence[Outcome]) -> Canvas | None:
    """Reliability diagram: what findings claim, and how many of them are right."""
    findings = [claim for trial in claims(done(outcomes)) for claim in trial]
    if not findings:
        return None
    canvas, axes = _axes(4.6, 4.2)
    axes.plot([0, 1], [0, 1], color=GREY, lw=1, ls="--")
    for each in bins(findings):
        low, high = interval(each.hits, each.count)
        axes.plot([each.claimed, each.claimed], [low, high], color=BLUE, lw=2)
        axes.plot(each.claimed, each.right, "o", color=BLUE, ms=6)
        axes.annotate(f"{each.count}", (each.claimed, each.right), (6, -10), textcoords="offset points", fontsize=8)
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), xlabel="probability that findings claim", ylabel="share that is right")
    axes.set_title(f"calibration error {calibration_error(findings):.3f}, {len(findings)} findings", fontsize=9)
    return canvas


def coverage_picture(found: dict[str, Count]) -> Canvas | None:
    """Parameters within their intervals, by effect."""
    if not found:
        return None
    canvas, axes = _axes(7.0, 0.24 * len(found) + 1.0)
    for row, (hits, count) in enumerate(reversed(found.values())):
        low, high = interval(hits, count)
        axes.plot([low, high], [row, row], color=BLUE, lw=2)
        axes.plot(hits / count, row, "o", color=BLUE, ms=5)
    axes.axvline(0.95, color="black", lw=1.0)
    axes.set_yticks(range(len(found)), [f"{name}  ({h}/{n})" for name, (h, n) in reversed(found.items())])
    axes.set(xlim=(-0.02, 1.02), xlabel="share of 95 % intervals that hold the truth")
    axes.grid(axis="x", color="#dddddd", lw=0.6)
    return canvas


def histogram(values: Sequence[float], words: str, limit: float | None) -> Canvas | None:
    """How often which value."""
    if not values:
        return None
    canvas, axes = _axes(5.5, 2.8)
    axes.hist(values, bins=min(30, max(5, len(set(np.round(values, 3))))), color=BLUE, edgecolor="white")
    if limit is not None:
        axes.axvline(limit, color="black", lw=1.0)
    axes.set(xlabel=words, ylabel="trials")
    return canvas


def time_picture(outcomes: Sequence[Outcome]) -> Canvas | None:
    """Time of a diagnosis by arm."""
    if not outcomes:
        return None
    arms = sorted({arm_of(each) for each in outcomes})
    canvas, axes = _axes(5.5, 0.5 * len(arms) + 1.2)
    axes.boxplot(
        [[each["seconds"] for each in outcomes if arm_of(each) == arm] for arm in arms],
        orientation="horizontal",
        tick_labels=arms,
        medianprops={"color": VERMILION},
    )
    axes.set_xlabel("time of a diagnosis [s]")
    return canvas
