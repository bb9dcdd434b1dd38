"""Where the residual is: a map of joints × state, each cell the residual in it as a multiple of the noise."""

from bisect import bisect_right
from collections.abc import Iterator, Sequence

from markupsafe import Markup, escape

from tauscope.diagnosis.documents.plots import ResidualHistogram
from tauscope.number_text import significant
from tauscope.report.table import Table

LEVELS = (1.1, 1.3, 1.6, 2.0, 3.0, 5.0, 10.0)
"""Multiples of the noise between the shades: the lightest is nothing but noise."""

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
        name = joint if len(joint) <= _MOST_LETTERS else joint[: _MOST_LETTERS - 1] + "…"
        parts.append(f'<text x="0" y="{_TOP + _ROW * row + 14:g}">{escape(name)}</text>')
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
    """The shades, from noise to far above it."""
    words = ("noise", *(f"> {level:g} ×" for level in LEVELS))
    x = _LABELS
    for level, word in enumerate(words):
        yield f'<rect class="h{level}" x="{x:g}" y="{top - 9:g}" width="16" height="11"/>'
        yield f'<text class="small" x="{x + 20:g}" y="{top:g}">{word}</text>'
        x += 78.0
    yield f'<path class="zero" d="M{x + 4:g} {top - 9:g}v11"/>'
    yield f'<text class="small" x="{x + 10:g}" y="{top:g}">zero</text>'
