"""What the left-out effects had been doing to the other parameters."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from tauscope.diagnosis import DiagnosisDocument
from tauscope.number_text import power_of_ten
from tauscope.report.svg import BAND, MUTED, PREDICTED, draw_svg

MOST = 14
ROW_INCHES = 0.22
LONGEST_LABEL = 58
TICKS = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 10000.0)
"""Standard errors at the ticks: linear up to the first, logarithmic from there."""


def shift_figure(name: str, document: DiagnosisDocument) -> str:
    """Draw how far parameters moved when the findings were added, in standard errors."""
    entries = document.parameter_shifts[:MOST]
    return _bars(name, [e.parameter for e in entries], [e.shift_in_std for e in entries])


def difference_figure(name: str, document: DiagnosisDocument) -> str:
    """Draw how far the arm's parameters are from the simulation's, in standard errors."""
    entries = document.parameter_differences[:MOST]
    return _bars(name, [e.parameter for e in entries], [e.difference_in_std for e in entries])


def _bars(name: str, labels: Sequence[str], values: Sequence[float]) -> str:
    """One bar a parameter, largest first; within the band nothing has moved."""
    places = np.arange(len(labels))
    shown = [label if len(label) <= LONGEST_LABEL else label[: LONGEST_LABEL - 1] + "…" for label in labels]

    def draw(figure: Figure) -> None:
        axis = figure.subplots()
        axis.axvspan(-1.96, 1.96, color=BAND, linewidth=0)
        axis.barh(places, values, height=0.55, color=PREDICTED)
        axis.axvline(0.0, color=MUTED, linewidth=0.6)
        axis.set_xscale("symlog", linthresh=TICKS[0])
        shown_ticks = [tick for tick in TICKS if tick <= 1.2 * np.max(np.abs(values))]
        axis.set_xticks([*(-tick for tick in reversed(shown_ticks)), 0.0, *shown_ticks])
        axis.xaxis.set_major_formatter(lambda value, _: power_of_ten(value))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.set_yticks(places, shown)
        axis.set_ylim(len(labels) - 0.4, -0.6)
        axis.grid(visible=False, axis="y")
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
        axis.set_xlabel("standard errors (band: ± 1.96)")

    return draw_svg(name, 0.6 + ROW_INCHES * (len(labels) + 1), draw)
