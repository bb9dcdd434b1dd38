"""Figures of the reports: parameters, residuals, friction, motion."""

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter, NullLocator

from tauscope.diagnosis import DiagnosisDocument
from tauscope.diagnosis.documents.plots import ResidualHistogram
from tauscope.diagnosis.documents.residual_spectrum import ResidualSpectrum
from tauscope.diagnosis.documents.torque_overlay import TorqueOverlay
from tauscope.identification import IdentificationDocument
from tauscope.identification.result import BaseParameterEntry
from tauscope.number_text import power_of_ten, significant
from tauscope.recording.recording import Array
from tauscope.report.curves import FrictionCurve, TorqueSeries, envelope_indices
from tauscope.report.svg import BAND, HELD_OUT, INK, MEASURED, MUTED, PREDICTED, RESIDUAL, draw_svg
from tauscope.report.tables import Table
from tauscope.report.words import base_parameter_unit, noise_ratio
from tauscope.trajectory import Trajectory

# Multiples of the noise between the shades: the lightest is nothing but noise.
LEVELS = (1.1, 1.3, 1.6, 2.0, 3.0, 5.0, 10.0)
VARIABLES = ("velocity", "position", "load", "acceleration", "time")

_WIDTH, _LABELS, _GAP = 920.0, 104.0, 14.0
_ROW, _TOP, _LEGEND = 22.0, 24.0, 44.0
_MOST_LETTERS = 16


def heat_map(histograms: Sequence[ResidualHistogram], joints: Sequence[str], *, after: bool) -> Markup:
    """Draw the map."""
    height = _TOP + _ROW * len(joints) + _LEGEND
    group = (_WIDTH - _LABELS - _GAP * (len(VARIABLES) - 1)) / len(VARIABLES)
    parts = [f'<svg class="heat" viewBox="0 0 {_WIDTH:g} {height:g}">']
    for place, variable in enumerate(VARIABLES):
        left = _LABELS + place * (group + _GAP)
        parts.append(f'<text x="{left:.1f}" y="{_TOP - 9:g}">{variable}</text>')
        words = ("start", "end") if variable == "time" else ("lowest", "highest")
        below = _TOP + _ROW * len(joints) + 12
        parts.append(f'<text class="small" x="{left:.1f}" y="{below:g}">{words[0]}</text>')
        right = left + group
        parts.append(f'<text class="small" x="{right:.1f}" y="{below:g}" text-anchor="end">{words[1]}</text>')
        for row, joint in enumerate(joints):
            own = next((each for each in histograms if (each.joint, each.variable) == (joint, variable)), None)
            if own is not None:
                parts += _cells(own, left, _TOP + _ROW * row, group, after=after)
    for row, joint in enumerate(joints):
        name = escape(_shorten(joint, _MOST_LETTERS))
        parts.append(f'<text x="0" y="{_TOP + _ROW * row + 14:g}">{name}</text>')
    parts += _legend(height - 14.0)
    return Markup("".join([*parts, "</svg>"]))  # noqa: S704 - our own drawing; names are escaped


def heat_table(histograms: Sequence[ResidualHistogram]) -> Table:
    """The numbers of both maps."""
    rows = [
        (each.joint, each.variable, *(significant(number, 3) for number in cell), significant(each.noise, 3))
        for each in histograms
        for cell in zip(each.edges, each.edges[1:], each.before, each.after, strict=False)
    ]
    return Table(("joint", "variable", "from", "to", "rms before", "rms after", "noise"), rows, words=2)


def _cells(own: ResidualHistogram, left: float, top: float, width: float, *, after: bool) -> Iterator[str]:
    """One joint's cells of one variable; a line where the variable changes sign."""
    values = own.after if after else own.before
    step = width / len(values)
    for place, value in enumerate(values):
        ratio = value / own.noise if own.noise > 0.0 else float("inf")
        low, high = own.edges[place], own.edges[place + 1]
        title = f"{own.variable} {significant(low, 3)} … {significant(high, 3)}: {significant(ratio, 3)} × noise"
        x, level = left + place * step, bisect_right(LEVELS, ratio)
        yield (
            f'<rect class="h{level}" x="{x:.2f}" y="{top:g}" width="{step:.2f}" height="{_ROW - 3:g}">'
            f"<title>{escape(own.joint)}, {title}</title></rect>"
        )
    if own.edges[0] < 0.0 < own.edges[-1]:
        zero = max(place for place, edge in enumerate(own.edges) if edge <= 0.0)
        share = -own.edges[zero] / max(own.edges[zero + 1] - own.edges[zero], 1e-300)
        x = left + (zero + share) * step
        yield f'<path class="zero" d="M{x:.2f} {top:g}v{_ROW - 3:g}"/>'


def _legend(top: float) -> Iterator[str]:
    words = ("noise", *(f"> {level:g} ×" for level in LEVELS))
    x = _LABELS
    for level, word in enumerate(words):
        yield f'<rect class="h{level}" x="{x:g}" y="{top - 9:g}" width="16" height="11"/>'
        yield f'<text class="small" x="{x + 20:g}" y="{top:g}">{word}</text>'
        x += 78.0
    yield f'<path class="zero" d="M{x + 4:g} {top - 9:g}v11"/>'
    yield f'<text class="small" x="{x + 10:g}" y="{top:g}">zero</text>'


PARAMETER_ROW_INCHES = 0.19
DEVIATIONS = 1.96  # standard errors to either side: 95 % of a normal distribution
LONGEST_LABEL = 62


def parameter_figure(name: str, entries: Sequence[BaseParameterEntry]) -> Markup:
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

    return draw_svg(name, 0.25 * len(panels) + PARAMETER_ROW_INCHES * sum(heights), draw)


def _draw_panel(axis: Axes, entries: Sequence[BaseParameterEntry]) -> None:
    places = np.arange(len(entries))
    values = np.array([entry.value for entry in entries])
    reach = DEVIATIONS * np.array([entry.std or 0.0 for entry in entries])
    axis.axvline(0.0, color=MUTED, linewidth=0.6)
    axis.errorbar(values, places, xerr=reach, fmt="o", markersize=3.2, color=PREDICTED, elinewidth=1.1, capsize=2.2)
    axis.grid(visible=False, axis="y")
    _name_rows(axis, [_shorten(entry.name, LONGEST_LABEL) for entry in entries])


def _name_rows(axis: Axes, names: Sequence[str]) -> None:
    """A row a name, the first on top."""
    axis.set_yticks(np.arange(len(names)), names)
    axis.set_ylim(len(names) - 0.4, -0.6)
    axis.tick_params(axis="y", length=0)
    axis.spines["left"].set_visible(False)


def _shorten(name: str, longest: int) -> str:
    return name if len(name) <= longest else name[: longest - 1] + "…"


RESIDUAL_ROW_INCHES = 0.24


def residual_figure(name: str, document: IdentificationDocument) -> Markup:
    """Draw every joint's residual as a multiple of its noise."""
    fits = {"own recordings": (document.fit.train, PREDICTED, "o")}
    if document.fit.held_out is not None:
        fits["held out"] = (document.fit.held_out, HELD_OUT, "D")
    places = np.arange(len(document.joints))

    def draw(figure: Figure) -> None:
        axis = figure.subplots()
        axis.axvline(1.0, color=MUTED, linewidth=0.9, linestyle=(0, (3, 2)), label="nothing but noise")
        largest = 1.0
        for label, (fit, colour, marker) in fits.items():
            ratios = [noise_ratio(rms, noise) for rms, noise in zip(fit.rms, document.noise_std, strict=True)]
            largest = max(largest, *ratios)
            axis.plot(ratios, places, linestyle="none", marker=marker, markersize=4.5, color=colour, label=label)
        _name_rows(axis, document.joints)
        axis.set_xlim(0.0, 1.15 * largest if np.isfinite(largest) else None)
        axis.set_xlabel("residual rms / noise σ")
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3, borderpad=0.0)

    return draw_svg(name, 0.8 + RESIDUAL_ROW_INCHES * (len(places) + 1), draw)


MOST = 14
SHIFT_ROW_INCHES = 0.22
LONGEST_SHIFT_LABEL = 58
# Standard errors at the ticks: linear up to the first, logarithmic from there.
TICKS = (3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 10000.0)


def shift_figure(name: str, document: DiagnosisDocument) -> Markup:
    """Draw how far parameters moved when the findings were added, in standard errors."""
    entries = document.parameter_shifts[:MOST]
    return _bars(name, [e.parameter for e in entries], [e.shift_in_std for e in entries])


def difference_figure(name: str, document: DiagnosisDocument) -> Markup:
    """Draw how far the arm's parameters are from the simulation's, in standard errors."""
    entries = document.parameter_differences[:MOST]
    return _bars(name, [e.parameter for e in entries], [e.difference_in_std for e in entries])


def _bars(name: str, labels: Sequence[str], values: Sequence[float]) -> Markup:

    def draw(figure: Figure) -> None:
        axis = figure.subplots()
        axis.axvspan(-1.96, 1.96, color=BAND, linewidth=0)
        axis.barh(np.arange(len(labels)), values, height=0.55, color=PREDICTED)
        axis.axvline(0.0, color=MUTED, linewidth=0.6)
        axis.set_xscale("symlog", linthresh=TICKS[0])
        shown_ticks = [tick for tick in TICKS if tick <= 1.2 * np.max(np.abs(values))]
        axis.set_xticks([*(-tick for tick in reversed(shown_ticks)), 0.0, *shown_ticks])
        axis.xaxis.set_major_formatter(lambda value, _: power_of_ten(value))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.grid(visible=False, axis="y")
        _name_rows(axis, [_shorten(label, LONGEST_SHIFT_LABEL) for label in labels])
        axis.set_xlabel("standard errors (band: ± 1.96)")

    return draw_svg(name, 0.6 + SHIFT_ROW_INCHES * (len(labels) + 1), draw)


MOST_SAMPLES = 700
MOTION_ROW_INCHES = 0.55


def motion_figure(name: str, trajectory: Trajectory, joints: list[str]) -> Markup:
    """Draw every joint's position over time."""
    sampled = trajectory.evaluate(np.linspace(0.0, trajectory.duration_s, MOST_SAMPLES))

    def draw(figure: Figure) -> None:
        axes = np.atleast_1d(figure.subplots(len(joints), 1, sharex=True))
        for number, (axis, joint) in enumerate(zip(axes, joints, strict=True)):
            axis.plot(sampled.time, sampled.position[:, number], color=PREDICTED, linewidth=0.9)
            axis.set_ylabel(_shorten(joint, 12), rotation=0, ha="right", va="center")
            axis.margins(x=0.0)
        axes[-1].set_xlabel("time [s]")

    return draw_svg(name, 0.5 + MOTION_ROW_INCHES * len(joints), draw)


COLUMNS = 3
FRICTION_ROW_INCHES = 2.25


def friction_figure(
    name: str, curves: Sequence[FrictionCurve], titles: Sequence[str], units: Sequence[tuple[str, str]]
) -> Markup:
    """Draw the friction of every joint over velocity; `units` of velocity and torque, one pair a joint."""
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

    return draw_svg(name, 0.3 + FRICTION_ROW_INCHES * rows, draw)


def _draw_curve(axis: Axes, curve: FrictionCurve) -> None:
    """The curve, solid where recordings exist, dashed beyond; its band; and the recordings' own means."""
    inside = (curve.velocity >= curve.seen[0]) & (curve.velocity <= curve.seen[1])
    low, high = (curve.torque + sign * DEVIATIONS * curve.std for sign in (-1.0, 1.0))
    axis.fill_between(curve.velocity, low, high, color=BAND, linewidth=0, label="95 % confidence")
    dots = {"markersize": 2.4, "markeredgewidth": 0, "color": MEASURED}
    label = "measured less rigid body, mean a velocity bin"
    axis.plot(curve.bin_velocity, curve.bin_torque, "o", label=label, **dots)
    axis.plot(curve.velocity, curve.torque, color=PREDICTED, linestyle=(0, (2, 2)), linewidth=0.9, label="no data")
    axis.plot(curve.velocity[inside], curve.torque[inside], color=PREDICTED, linewidth=1.3, label="model")
    for edge in curve.seen:
        axis.axvline(edge, color=MUTED, linewidth=0.5)
    axis.margins(x=0.0)


PROOF_INCHES = 3.5


def proof_figure(name: str, overlay: TorqueOverlay, spectrum: ResidualSpectrum | None, unit: str) -> Markup:
    """Draw torque, residual and the residual's spectrum of one joint, without and with the findings."""
    time, measured, before, after = map(np.array, (overlay.time, overlay.measured, overlay.before, overlay.after))

    def draw(figure: Figure) -> None:
        # t: torque, r: residual below it, s: spectrum beside both
        axes = figure.subplot_mosaic("ts;rs", height_ratios=(1.5, 1.0), width_ratios=(2.3, 1.0))
        torque, residual = axes["t"], axes["r"]
        residual.sharex(torque)
        torque.tick_params(labelbottom=False)
        torque.plot(time, measured, color=MEASURED, linewidth=2.2, label="measured")
        torque.plot(time, before, color=RESIDUAL, linewidth=0.9, label="model without the findings")
        torque.plot(time, after, color=PREDICTED, linewidth=0.9, label="with them")
        torque.set_ylabel(f"torque [{unit}]")
        torque.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.0, borderpad=0.2)
        reach = 2.0 * overlay.noise
        residual.axhspan(-reach, reach, color=BAND, linewidth=0, label="± 2 σ of the noise")
        residual.plot(time, measured - before, color=RESIDUAL, linewidth=0.8)
        residual.plot(time, measured - after, color=PREDICTED, linewidth=0.8)
        residual.legend(loc="lower left", bbox_to_anchor=(0.0, 0.98), borderaxespad=0.0, borderpad=0.1)
        residual.set_ylabel(f"residual [{unit}]")
        residual.set_xlabel("time [s]")
        torque.margins(x=0.0)
        _draw_spectrum(axes["s"], spectrum, unit)

    return draw_svg(name, PROOF_INCHES, draw)


def _draw_spectrum(axis: Axes, spectrum: ResidualSpectrum | None, unit: str) -> None:
    axis.set_title("residual spectrum", color=INK)
    if spectrum is None:
        axis.text(0.5, 0.5, "motion too short", ha="center", va="center", transform=axis.transAxes, color=MUTED)
        axis.set_axis_off()
        return
    axis.semilogy(spectrum.frequency, spectrum.before, color=RESIDUAL, linewidth=0.9)
    axis.semilogy(spectrum.frequency, spectrum.after, color=PREDICTED, linewidth=0.9)
    dashes = (0, (3, 2))
    axis.semilogy(spectrum.frequency, spectrum.noise, color=MUTED, linewidth=1.1, linestyle=dashes, label="noise")
    axis.yaxis.set_major_formatter(lambda value, _: power_of_ten(value))
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.legend(loc="upper right", borderaxespad=0.0)
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(f"density [({unit})²/Hz]")
    axis.margins(x=0.0)


HEIGHT_INCHES = 3.5
MOST_POINTS = 1400  # points a curve over the whole width; two a pixel
MOST_POINTS_ENLARGED = 700
ENLARGED_SHARE = 0.1  # part of the time that is enlarged: where the residual's mean square is greatest


def torque_figure(name: str, series: TorqueSeries, joint: int, noise_std: float, unit: str) -> Markup:
    """Draw one joint's torque and residual, whole and enlarged where they differ most."""
    enlarged = worst_part(series.residual[:, joint], ENLARGED_SHARE)

    def draw(figure: Figure) -> None:
        axes = figure.subplots(2, 2, sharex="col", sharey="row", height_ratios=(1.7, 1.0), width_ratios=(2.4, 1.0))
        everything = slice(0, len(series.time))
        for column, (rows, most) in enumerate(((everything, MOST_POINTS), (enlarged, MOST_POINTS_ENLARGED))):
            torque, residual, time = axes[0, column], axes[1, column], series.time[rows]
            measured, predicted = series.measured[rows, joint], series.predicted[rows, joint]
            plot_envelope(torque, time, measured, most, color=MEASURED, linewidth=0.9, label="measured")
            plot_envelope(torque, time, predicted, most, color=PREDICTED, linewidth=1.2, label="model")
            residual.axhspan(-2.0 * noise_std, 2.0 * noise_std, color=BAND, linewidth=0, label="± 2 σ of the noise")
            difference = measured - predicted
            plot_envelope(residual, time, difference, most, color=RESIDUAL, linewidth=0.7, label="measured − model")
        start, stop = series.time[enlarged.start], series.time[enlarged.stop - 1]
        for axis in axes[:, 0]:
            axis.axvspan(start, stop, color=MUTED, alpha=0.12, linewidth=0)
        axes[0, 0].set_ylabel(f"torque [{unit}]")
        axes[1, 0].set_ylabel(f"residual [{unit}]")
        axes[0, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.0, borderpad=0.2)
        axes[0, 1].set_title("where they differ most", color=INK)
        axes[1, 0].legend(loc="upper left", bbox_to_anchor=(0.0, 1.22), ncols=2, borderaxespad=0.0, borderpad=0.1)
        for axis in axes[1]:
            axis.set_xlabel("time [s]")

    return draw_svg(name, HEIGHT_INCHES, draw)


def torque_columns(series: TorqueSeries, joint: int) -> dict[str, list[float]]:
    """Numbers of the drawing: the samples that keep the residual's look. `joint`: joint index, from 0."""
    kept = envelope_indices(series.residual[:, joint], MOST_POINTS_ENLARGED)
    columns = {"time": series.time, "measured": series.measured[:, joint], "model": series.predicted[:, joint]}
    return {name: values[kept].tolist() for name, values in columns.items()}


def worst_part(residual: Array, share: float) -> slice:
    """The stretch of this share of `residual`, (N,), NaN where missed, whose mean square is greatest."""
    length = min(max(int(len(residual) * share), 2), len(residual))
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(residual) ** 2)])
    start = int(np.argmax(total[length:] - total[:-length]))
    return slice(start, start + length)


def plot_envelope(axis: Axes, time: Array, values: Array, most: int, **style: Any) -> None:
    """Draw a curve over the whole width of an axis by as many points as keep its look. `time`, `values`: (N,)."""
    kept = envelope_indices(values, most)
    axis.plot(time[kept], values[kept], **style)
    axis.margins(x=0.0)
