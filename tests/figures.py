"""Reports without their figures."""

import pytest


def leave_figures_undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put an empty drawing in the place of every figure."""
    monkeypatch.setattr("tauscope.report.figures.draw_svg", lambda *_: "<svg></svg>")
