"""Friction curves of all joints."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tauscope.report.friction_curve import FrictionCurve
from tauscope.report.svg import BAND, MEASURED, MUTED, PREDICTED, draw_svg

COLUMNS = 3
ROW_INCHES = 2.25
DEVIATIONS = 1.96
"""Standard errors to either side: 95 % of a normal distribution."""


def friction_figure(
    name: str, curves: Sequence[FrictionCurve], titles: Sequence[str], units: Sequence[tuple[str, str]]
) -> str:
    """Draw the friction of every joint over velocity.

    Parameters
    ----------
    units : sequence of (str, str)
        units of velocity and of torque, one pair a joint
    """
    columns = min(COLUMNS, max(len(curves), 2))
    rows = math.ceil(len(curves) / columns)

    def draw(figure: Figure) -> None:
        axes = np.atleast_2d(figure.subplots(rows, columns, squeeze=False)).ravel()
        for axis in axes[len(curves) :]:
            axis.set_axis_off()
        for axis, curve, title, (velocity_unit, torque_unit) in zip(axes, curves, titles, units, strict=False):
            _draw_curve(axis, curve)
            axis.set_title(title)
            axis.set_xlabel(f"velocity [{velocity_unit}]")
            axis.set_ylabel(f"friction [{torque_unit}]")
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=len(labels), borderpad=0.0)

    return draw_svg(name, 0.3 + ROW_INCHES * rows, draw)


def _draw_curve(axis: Axes, curve: FrictionCurve) -> None:
    """The curve, solid where recordings exist, dashed beyond; its band; and the recordings' own means."""
    inside = (curve.velocity >= curve.seen[0]) & (curve.velocity <= curve.seen[1])
    low, high = (curve.torque + sign * DEVIATIONS * curve.std for sign in (-1.0, 1.0))
    axis.fill_between(curve.velocity, low, high, color=BAND, linewidth=0, label="95 % confidence")
    axis.plot(
        curve.bin_velocity,
        curve.bin_torque,
        linestyle="none",
        marker="o",
        markersize=2.4,
        markeredgewidth=0,
        color=MEASURED,
        label="measured less rigid body, mean a velocity bin",
    )
    axis.plot(curve.velocity, curve.torque, color=PREDICTED, linestyle=(0, (2, 2)), linewidth=0.9, label="no data")
    axis.plot(curve.velocity[inside], curve.torque[inside], color=PREDICTED, linewidth=1.3, label="model")
    for edge in curve.seen:
        axis.axvline(edge, color=MUTED, linewidth=0.5)
    axis.margins(x=0.0)
