"""The proof: torque of one joint as it was measured, and as the models without and with the findings say it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from tauscope.diagnosis.documents.residual_spectrum import ResidualSpectrum
from tauscope.diagnosis.documents.torque_overlay import TorqueOverlay
from tauscope.number_text import power_of_ten
from tauscope.report.svg import BAND, INK, MEASURED, MUTED, PREDICTED, RESIDUAL, draw_svg

HEIGHT_INCHES = 3.5


def proof_figure(name: str, overlay: TorqueOverlay, spectrum: ResidualSpectrum | None, unit: str) -> str:
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

    return draw_svg(name, HEIGHT_INCHES, draw)


def _draw_spectrum(axis: Axes, spectrum: ResidualSpectrum | None, unit: str) -> None:
    """Residual's density without and with the findings, and the noise's."""
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
