"""Base parameters with their error bars, one panel a unit."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tauscope.identification.result import BaseParameterEntry
from tauscope.report.quantities import base_parameter_unit
from tauscope.report.svg import MUTED, PREDICTED, draw_svg

ROW_INCHES = 0.19
DEVIATIONS = 1.96
"""Standard errors to either side: 95 % of a normal distribution."""

LONGEST_LABEL = 62


def parameter_figure(name: str, entries: Sequence[BaseParameterEntry]) -> str:
    """Draw base parameters with their 95 % intervals."""
    panels: dict[str, list[BaseParameterEntry]] = {}
    for entry in entries:
        panels.setdefault(base_parameter_unit(entry.terms), []).append(entry)
    heights = [len(panel) + 2.0 for panel in panels.values()]

    def draw(figure: Figure) -> None:
        axes = np.ravel(figure.subplots(len(panels), 1, squeeze=False, height_ratios=heights))
        for axis, (unit, panel) in zip(axes, panels.items(), strict=True):
            _draw_panel(axis, panel)
            axis.set_xlabel(f"[{unit}]")

    return draw_svg(name, 0.25 * len(panels) + ROW_INCHES * sum(heights), draw)


def _draw_panel(axis: Axes, entries: Sequence[BaseParameterEntry]) -> None:
    """One row a parameter, from the top."""
    places = np.arange(len(entries))
    values = np.array([entry.value for entry in entries])
    reach = DEVIATIONS * np.array([entry.std or 0.0 for entry in entries])
    axis.axvline(0.0, color=MUTED, linewidth=0.6)
    axis.errorbar(
        values,
        places,
        xerr=reach,
        linestyle="none",
        marker="o",
        markersize=3.2,
        color=PREDICTED,
        elinewidth=1.1,
        capsize=2.2,
    )
    axis.set_yticks(places, [_shortened(entry.name) for entry in entries])
    axis.set_ylim(len(entries) - 0.4, -0.6)
    axis.grid(visible=False, axis="y")
    axis.tick_params(axis="y", length=0)
    axis.spines["left"].set_visible(False)


def _shortened(name: str) -> str:
    """A label that leaves room for the drawing; the table has all of it."""
    return name if len(name) <= LONGEST_LABEL else name[: LONGEST_LABEL - 1] + "…"
