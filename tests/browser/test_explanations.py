"""A problem on the page leads to the page of its code, which the service shows itself."""

from pathlib import Path

import pytest
from playwright.sync_api import expect

from browser.conftest import Visit

pytestmark = [pytest.mark.system, pytest.mark.slow]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_problem_leads_to_what_it_means(visit: Visit, tmp_path: Path, scheme: str) -> None:
    page = visit.page
    visit.go("/recordings")
    page.get_by_label("Keep a recording").set_input_files(
        {"name": "a,b.csv", "mimeType": "text/csv", "buffer": b"t,q1,tau1\n0,0,0\n"}
    )
    problem = page.get_by_role("status").filter(has_text="file name 'a,b.csv'")
    with visit.context.expect_page() as opened:
        problem.get_by_role("link", name="What invalid-request means").click()
    explanation = opened.value
    explanation.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    expect(explanation.get_by_role("heading", name="invalid-request")).to_be_visible()
    expect(explanation.get_by_role("heading", name="What to do")).to_be_visible()
    expect(explanation.get_by_text("HTTP status 422 (Unprocessable")).to_be_visible()
    shown = Visit(visit.url, visit.context, explanation)
    assert shown.barriers() == []
    shown.keep(f"explanation-{scheme}", tmp_path)
    explanation.set_viewport_size({"width": 320, "height": 720})
    assert explanation.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_every_explanation_and_the_interface_fit_a_phone(visit: Visit) -> None:
    visit.page.set_viewport_size({"width": 320, "height": 720})
    for path in ("/docs", "/docs/errors/acquisition", "/docs/errors/lease-needed", "/docs/how-to/let-others-in"):
        visit.page.goto(f"{visit.url}{path}")
        assert visit.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), path
        assert visit.barriers() == [], path
