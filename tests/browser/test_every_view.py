"""Every view of the page, after a campaign: nothing jumps, nobody is kept out, in both schemes."""

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from browser.campaign import ROBOT, make_campaign, views_of
from browser.conftest import Visit
from server.http.serving import Served

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(1200)]

NO_JUMP = 0.01
"""Most that a view may shift while it fills; up to 0.1 counts as good (Cumulative Layout Shift, Web Vitals)."""

WATCH_SHIFTS = """
window.shift = { sum: 0, of: [] };
new PerformanceObserver((list) => {
  for (const entry of list.getEntries()) {
    window.shift.sum += entry.value;
    window.shift.of.push(...entry.sources.map(({ node }) => node?.outerHTML?.slice(0, 120)));
  }
}).observe({ type: "layout-shift", buffered: true });
"""

# Not Playwright's wait_for_function: it asks again by eval, which the page's Content-Security-Policy forbids.
UNTIL_IT_SHIFTS = """
(least) => new Promise((noticed) => {
  const look = () => (window.shift.sum > least ? noticed() : requestAnimationFrame(look));
  look();
})
"""


@pytest.fixture(scope="module")
def campaign(service: Served) -> dict[str, Any]:
    """What the service says of a campaign that has ended."""
    return make_campaign(service)


def settle(page: Page) -> None:
    """Wait until a view is there, with its plots."""
    expect(page.locator("main h1")).to_be_visible()
    expect(page.locator("main [aria-busy]")).to_have_count(0)
    page.wait_for_load_state("networkidle")
    expect(page.locator(".canvas:not(:has(canvas))")).to_have_count(0)


@pytest.mark.parametrize("width", [320, 834, 1280])
def test_no_view_jumps_while_it_fills(visit: Visit, campaign: dict[str, Any], width: int) -> None:
    page = visit.page
    page.set_viewport_size({"width": width, "height": 860})
    page.add_init_script(WATCH_SHIFTS)
    for name, path in views_of(campaign).items():
        page.goto("about:blank")
        visit.go(path)
        settle(page)
        shift = page.evaluate("window.shift")
        assert shift["sum"] < NO_JUMP, (name, shift)


def test_a_jump_would_be_noticed(visit: Visit) -> None:
    visit.page.add_init_script(WATCH_SHIFTS)
    visit.go("/")
    settle(visit.page)
    visit.page.evaluate("document.querySelector('main').style.paddingTop = '300px'")
    visit.page.evaluate(UNTIL_IT_SHIFTS, NO_JUMP)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_view_keeps_anybody_out(visit: Visit, campaign: dict[str, Any], scheme: str) -> None:
    page = visit.page
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    for name, path in views_of(campaign).items():
        visit.go(path)
        settle(page)
        assert visit.barriers() == [], name


def test_every_view_fits_a_phone(visit: Visit, campaign: dict[str, Any]) -> None:
    visit.page.set_viewport_size({"width": 320, "height": 720})
    for name, path in views_of(campaign).items():
        visit.go(path)
        settle(visit.page)
        assert visit.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), name
        expect(visit.page.get_by_role("button", name="Stop", exact=True)).to_be_in_viewport()


def test_a_robot_is_found_with_its_chain_and_what_is_known_of_it(
    visit: Visit, campaign: dict[str, Any], tmp_path: Path
) -> None:
    page = visit.page
    visit.go("/robots")
    page.get_by_role("link", name=ROBOT).click()
    expect(page.get_by_role("img", name=f"Kinematic chain of {ROBOT}")).to_be_visible()
    figures = page.locator(".figures")
    expect(figures).to_contain_text("at rest")
    expect(figures.get_by_role("link", name="explained")).to_be_visible()
    expect(page.get_by_role("region", name="Lately").get_by_role("listitem")).to_have_count(5)
    visit.keep("page-robot", tmp_path)
    page.get_by_role("link", name="New campaign with it").click()
    expect(page.get_by_role("heading", name=ROBOT)).to_be_visible()
    expect(page.get_by_role("button", name="Begin")).to_be_enabled()


def test_cells_of_the_map_are_reached_with_the_arrow_keys(visit: Visit, campaign: dict[str, Any]) -> None:
    page = visit.page
    visit.go(views_of(campaign)["diagnosis"])
    region = page.get_by_role("region", name="Residual by joint and state")
    region.focus()
    told = page.get_by_role("status").filter(has_text="× noise")
    for key, cell in {"ArrowRight": "0-velocity-0", "ArrowDown": "1-velocity-0", "ArrowUp": "0-velocity-0"}.items():
        page.keyboard.press(key)
        expect(page.locator(".heat .chosen")).to_have_attribute("data-cell", cell)
    expect(told).to_contain_text("joint1, velocity")
    page.keyboard.press("ArrowLeft")  # beyond the edge: it stays
    expect(page.locator(".heat .chosen")).to_have_attribute("data-cell", "0-velocity-0")
    count = region.locator("[data-cell^='0-velocity']").count()
    for _ in range(count):
        page.keyboard.press("ArrowRight")
    expect(page.locator(".heat .chosen")).to_have_attribute("data-cell", "0-position-0")
    expect(page.locator("#where-state")).to_have_value("position")
    expect(page.get_by_text("the chosen part marked")).to_be_visible()
