"""A robot over time in the browser: its models, a parameter that drifts, an event to take note of, and a schedule."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from browser.conftest import Visit
from browser.wear import NIGHTLY, ROBOT, make_history, set_up_schedule
from server.http.serving import Served, served

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(1200)]

MOVED = "viscous joint1"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A service that knows an arm for six weeks; one schedule has been asked for, and found nothing to do."""
    data = tmp_path_factory.mktemp("data")
    models = make_history(data)
    with served(data) as running:
        set_up_schedule(running, models[-1], **NIGHTLY)
        asked = running.client.post("/api/v1/schedules/cell3-nightly/run", json={"reason": "a test"})
        assert asked.json()["state"] == "skipped", asked.text
        yield running


def test_models_trend_and_schedule_are_shown(visit: Visit, service: Served, tmp_path: Path) -> None:
    page = visit.page
    visit.go("/history")
    models = page.get_by_role("region", name="Models")
    expect(models.get_by_role("row")).to_have_count(4)
    newest, oldest = models.get_by_role("row").nth(1), models.get_by_role("row").nth(3)
    expect(newest).to_contain_text("in use")
    expect(newest).to_contain_text("passed every gate")
    expect(oldest).to_contain_text("was in use, reference")
    trend = service.client.get("/api/v1/trend", params={"robot": ROBOT}).json()
    (told,) = [each for each in trend["parameters"] if each["name"] == MOVED]
    expect(page.get_by_label("Parameter, the most moved first")).to_have_value(MOVED)
    first, last = told["points"][0]["value"], told["points"][-1]["value"]
    words = page.locator("#trend-words")
    expect(words).to_contain_text(f"From {first:#.3g} to {last:#.3g}")
    expect(words).to_contain_text(f"(+{100 * (last / first - 1):.0f} %)")
    expect(page.get_by_text("The line through all 3: ")).to_be_visible()
    drawn = page.locator("figure.plot").filter(has_text=MOVED).locator("canvas")
    expect(drawn).to_be_visible()
    assert drawn.evaluate(
        "(canvas) => canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((v) => v)"
    )
    schedules = page.get_by_role("article", name="cell3-nightly")
    for words in (f"identification of {ROBOT}", "0 2 * * mon-fri (Europe/Berlin)", "from 22:00 to 05:00"):
        expect(schedules).to_contain_text(words)
    (asked,) = service.client.get("/api/v1/schedules/cell3-nightly/firings").json()["firings"]
    expect(schedules).to_contain_text(f"skipped, {asked['reason']}")
    due = service.client.get("/api/v1/schedules/cell3-nightly").json()["next_due"]
    moment = page.evaluate("async (due) => (await import('/page/dom.js')).moment(due)", due)
    expect(schedules).to_contain_text(f"Due next{moment}")
    assert visit.barriers() == []
    visit.keep("page-over-time", tmp_path)
    page.screenshot(path=tmp_path / "whole.png", full_page=True)


def test_another_parameter_is_drawn_when_it_is_chosen(visit: Visit) -> None:
    page = visit.page
    visit.go("/history")
    page.get_by_label("Parameter, the most moved first").select_option("stiction joint2")
    expect(page.locator("figure.plot")).to_contain_text("stiction joint2")
    expect(page.locator("#trend-words")).to_contain_text("standard errors of the difference")


def test_it_fits_a_phone(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    page.set_viewport_size({"width": 320, "height": 720})
    visit.go("/history")
    expect(page.locator("figure.plot canvas")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    expect(page.get_by_role("button", name="Stop")).to_be_in_viewport()
    page.screenshot(path=tmp_path / "phone.png", full_page=True)


def test_a_drift_is_taken_note_of_and_stop_stays_within_reach(visit: Visit, service: Served) -> None:
    page = visit.page
    visit.go("/history")
    event = page.get_by_role("listitem").filter(has_text="joint1: viscous friction +")
    expect(event).to_contain_text("in 6 weeks")
    event.get_by_label("What is it about?").fill("gear oil changed")
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Nothing was moving.")).to_be_visible()
    event.get_by_role("button", name="Take note").click()
    expect(page.get_by_text("No open drift alerts.")).to_be_visible()
    (kept,) = service.client.get("/api/v1/events").json()["events"]
    assert (kept["parameter"], kept["note"]) == (MOVED, "gear oil changed")
