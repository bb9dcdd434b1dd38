"""Residuals of all joints in units of their noise: on the model's own recordings, and on others."""

import numpy as np
from matplotlib.figure import Figure

from tauscope.identification import IdentificationDocument
from tauscope.report.svg import HELD_OUT, MUTED, PREDICTED, draw_svg
from tauscope.report.words import noise_ratio

ROW_INCHES = 0.24


def residual_figure(name: str, document: IdentificationDocument) -> str:
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
        axis.set_yticks(places, document.joints)
        axis.set_ylim(len(places) - 0.4, -0.6)
        axis.set_xlim(0.0, 1.15 * largest if np.isfinite(largest) else None)
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
        axis.set_xlabel("residual rms / noise σ")
        handles, labels = axis.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper left", ncols=3, borderpad=0.0)

    return draw_svg(name, 0.8 + ROW_INCHES * (len(places) + 1), draw)
