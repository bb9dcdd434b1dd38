"""The report printed by a browser: on A4, without a network, nothing wider than the paper."""

import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from diagnosis.diagnosed_arm import recordings
from diagnosis.test_diagnosis_of_simulated_arms import spring
from identification.simulated import paper_robot
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.next_experiment import plan_experiment
from tauscope.report.diagnosis_report import diagnosis_report
from tauscope.report.provenance import InputFile, Provenance

pytestmark = [pytest.mark.system, pytest.mark.slow]

A4_INSIDE_MARGINS = {"width": 680, "height": 1009}
"""180 by 267 mm at 96 pixels an inch."""

PROVENANCE = Provenance(
    ("tauscope", "diagnose", "robot.yaml", "motion-1.csv"),
    (InputFile("recording", "motion-1.csv", 12, "ab" * 32),),
    (("Python", "3.11"),),
    datetime(2026, 11, 24, tzinfo=UTC),
)

TOO_WIDE = """() => [...document.querySelectorAll("main *, body > *")]
  .filter((each) => each.checkVisibility() && each.getBoundingClientRect().right > window.innerWidth + 1)
  .map((each) => each.tagName + " " + each.className + " " + each.textContent.slice(0, 40))"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng = np.random.default_rng(5)
    found = diagnose(paper_robot(), recordings((1, 2), spring, rng), recordings((11,), spring, rng))
    planned = plan_experiment(found)
    path = tmp_path_factory.mktemp("report") / "report.html"
    path.write_text(
        diagnosis_report(found, document(found, planned, "next.json"), PROVENANCE, planned), encoding="utf-8"
    )
    return path


def test_it_prints_on_a4_without_a_network(chromium: Browser, report: Path) -> None:
    context = chromium.new_context(viewport=A4_INSIDE_MARGINS, offline=True)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(report.as_uri())
    page.emulate_media(media="print")
    assert page.evaluate(TOO_WIDE) == []
    paper = page.pdf(format="A4", prefer_css_page_size=True, print_background=True)
    context.close()
    assert paper.startswith(b"%PDF-")
    assert len(re.findall(rb"/Type\s*/Page\b", paper)) >= 3
