"""Curves with fewer points, and SVG that can stand in a page."""

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from matplotlib.figure import Figure

from tauscope.report.curves import envelope_indices
from tauscope.report.figures import worst_part
from tauscope.report.svg import PREDICTED, draw_svg

curves = arrays.arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e6, 1e6) | st.just(np.nan))


@given(curves, st.integers(2, 60))
def test_few_points_keep_the_extremes_in_order(values: np.ndarray, most: int) -> None:
    kept = envelope_indices(values, most)
    assert len(kept) <= most
    assert (np.diff(kept) > 0).all()
    if not np.isnan(values).all():
        assert np.nanmin(values[kept]) == np.nanmin(values)
        assert np.nanmax(values[kept]) == np.nanmax(values)


def test_a_gap_is_not_drawn_over() -> None:
    values = np.sin(np.arange(10000) / 50)
    values[4000:6000] = np.nan
    kept = values[envelope_indices(values, 200)]
    assert np.isnan(kept).sum() == 20  # one of each bucket in the gap


def test_the_worst_part_is_found() -> None:
    residual = np.random.default_rng(1).normal(scale=0.1, size=2000)
    residual[1300:1400] += 1.0
    residual[100] = np.nan
    part = worst_part(residual, 0.1)
    assert part.start <= 1300 < 1400 <= part.stop
    assert part.stop - part.start == 200


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_short_pieces_have_a_worst_part(count: int) -> None:
    part = worst_part(np.ones(count), 0.1)
    assert 0 <= part.start < part.stop <= count


def drawing(name: str, label: str = "label") -> str:
    def draw(figure: Figure) -> None:
        axis = figure.subplots()
        axis.plot(np.linspace(0, 1, 500), np.random.default_rng(0).normal(size=500), color=PREDICTED, label=label)
        axis.legend()

    return draw_svg(name, 2.0, draw)


def test_a_drawing_has_neither_address_nor_size_of_its_own() -> None:
    svg = drawing("fit")
    assert svg.startswith("<svg viewBox=")
    assert "http" not in svg
    assert "<!" not in svg
    assert "metadata" not in svg
    assert "var(--predicted)" in svg
    assert "font-family: var(--sans)" in svg
    assert "DejaVu" not in svg
    assert "<style" not in svg
    ElementTree.fromstring(svg)


def test_two_drawings_share_no_name() -> None:
    first, second = (set(re.findall(r' id="([^"]+)"', drawing(name))) for name in ("a", "b"))
    assert first
    assert first.isdisjoint(second)
    assert all(name.startswith("a-") for name in first)


def test_a_drawing_is_the_same_on_every_run() -> None:
    assert drawing("fit") == drawing("fit")


@pytest.mark.parametrize("label", ["$\\alpha$", "a < b & c", '"quoted"', "</svg>", "--><script>"])
def test_labels_are_text_and_nothing_else(label: str) -> None:
    tree = ElementTree.fromstring(drawing("fit", label))
    assert label in [element.text for element in tree.iter("text")]
    assert not list(tree.iter("script"))
