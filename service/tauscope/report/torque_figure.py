"""Torque of one joint over time: as it was measured, as models predict it, and what is left."""

from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from tauscope.diagnosis.documents.residual_spectrum import ResidualSpectrum
from tauscope.diagnosis.documents.torque_overlay import TorqueOverlay
from tauscope.number_text import power_of_ten
from tauscope.recording.recording import Array
from tauscope.report.series import TorqueSeries, envelope_indices
from tauscope.report.svg import BAND, INK, MEASURED, MUTED, PREDICTED, RESIDUAL, draw_svg

PROOF_INCHES = 3.5


def proof_figure(name: str, overlay: TorqueOverlay, spectrum: ResidualSpectrum | None, unit: str) -> Markup:
    """Draw torque, residual and the residual's spectrum of one joint, without and with the findings."""
    time, measured, before, after = (
        np.array(values) for values in (overlay.time, overlay.measured, overlay.before, overlay.after)
    )

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
    """Draw one joint's torque and residual, whole and enlarged where they differ most.

    `joint`: joint index, from 0; `noise_std`: σ of the sensor noise [Nm or N].
    """
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
    """The stretch of this share of a residual whose mean square is greatest.

    `residual`: (N,), NaN where nothing was measured.
    """
    length = min(max(int(len(residual) * share), 2), len(residual))
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(residual) ** 2)])
    start = int(np.argmax(total[length:] - total[:-length]))
    return slice(start, start + length)


def plot_envelope(axis: Axes, time: Array, values: Array, most: int, **style: Any) -> None:
    """Draw a curve over the whole width of an axis by as many points as keep its look. `time`, `values`: (N,)."""
    kept = envelope_indices(values, most)
    axis.plot(time[kept], values[kept], **style)
    axis.margins(x=0.0)
