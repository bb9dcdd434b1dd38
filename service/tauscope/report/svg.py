"""Matplotlib figures as inline SVG that takes its colours and fonts from the page, and is the same on every run."""

import io
import re
from collections.abc import Callable
from threading import Lock
from typing import Any

import matplotlib as mpl
from markupsafe import Markup
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

INK = "#1b1f24"
MUTED = "#6b7178"
GRID = "#dde1e6"
MEASURED = "#8f969f"
PREDICTED = "#0072b2"
RESIDUAL = "#d55e00"
HELD_OUT = "#009e73"
# Colours to draw with, Okabe and Ito's; on the page each stands for a CSS variable (see `VARIABLES`).
BAND = "#cfe3f1"

VARIABLES = {INK: "--ink", MUTED: "--muted", GRID: "--grid", BAND: "--band"}
VARIABLES |= {MEASURED: "--measured", PREDICTED: "--predicted", RESIDUAL: "--residual", HELD_OUT: "--held-out"}

WIDTH_INCHES = 9.2  # width of every figure: text of 8 pt is then as large as the page's small print

_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "tauscope",
    "font.family": "DejaVu Sans",
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "grid.color": GRID,
    "lines.linewidth": 1.1,
    "lines.solid_joinstyle": "round",
    "path.simplify_threshold": 0.2,
    **dict.fromkeys(("font.size", "axes.labelsize", "legend.fontsize"), 8.0),
    **dict.fromkeys(("text.color", "axes.labelcolor", "xtick.labelcolor", "ytick.labelcolor"), INK),
    **dict.fromkeys(("axes.edgecolor", "xtick.color", "ytick.color"), MUTED),
    **dict.fromkeys(("axes.linewidth", "grid.linewidth", "xtick.major.width", "ytick.major.width"), 0.6),
    **dict.fromkeys(("axes.grid", "axes.axisbelow", "path.simplify"), True),
    **dict.fromkeys(("text.parse_math", "axes.spines.top", "axes.spines.right", "legend.frameon"), False),
    **dict.fromkeys(("figure.facecolor", "axes.facecolor", "savefig.facecolor"), "none"),
}

_DRAWING = Lock()  # matplotlib's settings belong to the whole process; one figure at a time has them


def draw_svg(name: str, height_inches: float, draw: Callable[[Figure], None]) -> Markup:
    """Draw a figure and return it as an ``<svg>`` element that can stand in a page beside others."""
    with _DRAWING, mpl.rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH_INCHES, height_inches), layout="constrained")
        canvas = FigureCanvasSVG(figure)
        draw(figure)
        text = io.StringIO()
        canvas.print_svg(text, metadata={"Date": None})
    return Markup(_adapt_to_page(text.getvalue(), name))  # noqa: S704 - our own drawing; its text is escaped


def _adapt_to_page(svg: str, name: str) -> str:
    """What a drawing needs to be part of a page: its own ids, the page's colours and fonts, short numbers."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<!--.*?-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", svg, flags=re.DOTALL)  # would hold for the whole page
    svg = re.sub(r' xmlns(:xlink)?="[^"]*"', "", svg)
    svg = svg.replace("xlink:href=", "href=")
    svg = re.sub(r'<svg [^>]*?viewBox="([^"]*)"[^>]*>', r'<svg viewBox="\1">', svg, count=1)
    svg = re.sub(r' id="', f' id="{name}-', svg)
    svg = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", svg)
    svg = re.sub(r' d="([^"]*)"', lambda path: f' d="{_shorten(path[1])}"', svg)
    svg = svg.replace("font-family: 'DejaVu Sans'", "font-family: var(--sans)")
    for colour, variable in VARIABLES.items():
        svg = svg.replace(colour, f"var({variable})")
    return re.sub(r">\s+<", "><", svg).strip()


def _shorten(path: str) -> str:
    rounded = re.sub(r"-?\d+\.\d+", lambda number: f"{float(number[0]):.2f}".rstrip("0").rstrip("."), path)
    return " ".join(rounded.split())
