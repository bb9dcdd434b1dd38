"""Reports without their figures."""

import pytest


def leave_figures_undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put an empty drawing in the place of every figure."""
    for name in ("figures", "torque_figure"):
        monkeypatch.setattr(f"tauscope.report.{name}.draw_svg", lambda *_: "<svg></svg>")
