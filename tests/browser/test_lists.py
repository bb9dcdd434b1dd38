"""Lists show what was found, and are searched by words and by outcome."""

import json
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from server.http.serving import Served

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(120)]

COUNT = 8


def diagnosis(number: int) -> dict[str, object]:
    """A diagnosis as the service lists it: even ones succeeded."""
    failed = {"code": "recording", "detail": "log.csv: column q1 is missing"} if number % 2 else None
    return {
        "id": f"20261103T10150{number}Z-1f2e3d4c",
        "robot": f"arm-{number % 3}",
        "state": "failed" if failed else "succeeded",
        "problem": failed,
        "created": f"2026-11-0{number + 1}T10:15:02Z",
        "recordings": [{"name": f"run-{number}.csv"}],
    }


@pytest.fixture
def page(chromium: Browser, service: Served) -> Iterator[Page]:
    """The list of eight diagnoses, half of which failed."""
    found = [diagnosis(number) for number in reversed(range(COUNT))]
    figures = {"verdict": "explained", "headline": "A spring is missing at joint2."}
    items = [{"id": each["id"], "is_here": True, "figures": {} if each["problem"] else figures} for each in found]
    shown = chromium.new_page()
    answers = {"**/api/v1/diagnoses?*": {"diagnoses": found}, "**/api/v1/items?*": {"items": items, "before": None}}
    for address, answer in answers.items():
        body = json.dumps(answer)
        shown.route(address, lambda route, _, body=body: route.fulfill(body=body, content_type="application/json"))
    shown.goto(f"{service.client.base_url}/#/diagnoses")
    expect(shown.get_by_role("listitem")).to_have_count(COUNT)
    yield shown
    shown.close()


def test_a_list_shows_what_was_found(page: Page) -> None:
    first, second = page.get_by_role("listitem").nth(0), page.get_by_role("listitem").nth(1)
    expect(first).to_contain_text("failed log.csv: column q1 is missing")
    expect(second).to_contain_text("explained A spring is missing at joint2.")
    expect(page.get_by_text("succeeded")).to_have_count(0)


def test_a_list_is_searched_filtered_and_ordered(page: Page) -> None:
    items, count = page.get_by_role("listitem"), page.get_by_role("status").filter(has_text="of 8")
    page.get_by_label("Search").fill("spring arm-0")
    expect(items).to_have_count(2)
    expect(count).to_have_text("2 of 8")
    page.get_by_label("Order").select_option("oldest first")
    expect(items.first).to_contain_text("run-0.csv")
    page.get_by_label("Search").fill("")
    page.get_by_label("Outcome").select_option("failed")
    expect(items).to_have_count(4)
    page.get_by_label("Search").fill("nothing of the kind")
    expect(page.get_by_text("Nothing matches.")).to_be_visible()
