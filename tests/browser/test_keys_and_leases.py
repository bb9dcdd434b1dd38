"""A service that asks for keys, in the browser: what a key allows is said in words, and Stop works with every one."""

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from browser.conftest import Visit
from browser.test_moving_arm import begin, state
from patience import eventually
from server.auth.keyed import make_keys
from server.http.serving import Served, served
from server.queue.paper_files import PAPER_ROBOT
from tauscope.client import ApiError, Client, HeldLease
from tauscope.server.auth.keys import KeyFile, Scope

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(1200)]

KEYS: dict[str, str] = {}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A service with a key of each scope and one that has expired; the client has that of the operator."""
    data = tmp_path_factory.mktemp("data")
    KEYS.update({scope.value: key for scope, key in make_keys(data).items()})
    made = datetime.now(UTC) - timedelta(days=100)
    KEYS["expired"] = KeyFile(data).add("night shift", Scope.MOVE, made, timedelta(days=90))[1]
    with served(data) as running:
        running.client.headers["authorization"] = f"Bearer {KEYS['admin']}"
        yield running


@pytest.fixture(autouse=True)
def free_arm(service: Served) -> None:
    """The arm is nobody's when a test begins: the run before says ``stopped`` while it still closes its bus."""
    client = Client(str(service.client.base_url), KEYS["admin"])

    def is_free() -> bool:
        try:
            with client.lease("paper-arm"):
                return True
        except ApiError as problem:
            if problem.problem_code not in ("busy", "leased"):
                raise
            return False

    assert eventually(is_free, within_s=60.0)


@pytest.fixture
def held(service: Served) -> Iterator[HeldLease]:
    """The lease of the arm in the hands of somebody else, who may move it."""
    other = Client(str(service.client.base_url), KEYS["admin"])
    with other.lease("paper-arm", ttl_s=30.0) as lease:
        other.arm(lease)
        yield lease


def begun(service: Served, held: HeldLease) -> str:
    """A run of whoever holds the lease, under way: one that is stopped before has nothing to stop yet."""
    identifier = begin(service, {"Lease-Token": held.token})
    assert eventually(lambda: state(service, identifier) in ("ramping", "running"), within_s=60.0)
    return identifier


def enter(page: Page, key: str) -> None:
    page.get_by_label("Key", exact=True).fill(KEYS.get(key, key))
    page.get_by_role("button", name="Go on").click()


def choose_robot(page: Page) -> None:
    page.get_by_label("Robot file").set_input_files(PAPER_ROBOT)


def test_a_key_is_asked_for_in_a_panel_that_leaves_stop_within_reach(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    visit.go("/")
    panel = page.get_by_role("dialog", name="An API key is needed")
    expect(panel).to_contain_text("no API key came with the request")
    assert visit.barriers() == []
    visit.keep("page-key", tmp_path)
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_role("alert").filter(has_text="Stop was refused: no API key came")).to_be_visible()
    enter(page, "tsk_00000000_wrong")
    expect(panel).to_contain_text("the API key is not known, or was revoked")
    enter(page, "read")
    expect(panel).to_be_hidden()
    expect(page.get_by_text("None yet")).to_be_visible()
    expect(page.locator("#link-state")).to_have_text("Connected")
    page.reload()
    expect(page.get_by_text("None yet")).to_be_visible()
    expect(panel).to_be_hidden()


def test_the_panel_fits_a_phone(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    page.set_viewport_size({"width": 320, "height": 720})
    visit.go("/")
    expect(page.get_by_role("button", name="Go on")).to_be_in_viewport()
    expect(page.get_by_role("button", name="Stop")).to_be_in_viewport()
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_role("alert").filter(has_text="Stop was refused")).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    visit.keep("key-phone", tmp_path)


def test_a_key_that_only_looks_is_told_so_and_another_one_begins(visit: Visit, service: Served, tmp_path: Path) -> None:
    page = visit.page
    visit.go("/new")
    enter(page, "read")
    choose_robot(page)
    said = page.get_by_role("status").filter(has_text="needs a key of scope analyse; the one of read has read")
    expect(said).to_be_visible()
    expect(said.get_by_role("link", name="What forbidden means")).to_be_visible()
    expect(page.get_by_role("button", name="Begin")).to_be_disabled()
    said.get_by_role("button", name="Use another key").click()
    enter(page, "analyse")
    choose_robot(page)
    expect(page.get_by_role("heading", name="paper-arm")).to_be_visible()
    page.get_by_role("button", name="Begin").click()
    refused = page.get_by_role("status").filter(has_text="needs a key of scope move; the one of analyse has analyse")
    expect(refused).to_be_visible()
    visit.keep("page-forbidden", tmp_path)
    page.get_by_role("contentinfo").get_by_role("button", name="Use another key").click()
    enter(page, "move")
    choose_robot(page)
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_role("heading", name="paper-arm", level=1)).to_be_visible()
    mine = page.get_by_role("status").filter(has_text="This tab has the lease of paper-arm on sim")
    expect(mine).to_be_visible()
    (lease,) = service.client.get("/api/v1/leases").json()["leases"]
    assert (lease["holder"], lease["armed"]) == ("move", True)
    visit.keep("page-lease", tmp_path)
    page.reload()
    expect(mine).to_be_visible()
    with page.expect_response(lambda answer: answer.url.endswith(f"{lease['id']}/heartbeat") and answer.ok):
        pass
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Stop was sent, and the service has taken it.")).to_be_visible()
    expect(page.get_by_text("cancelled").first).to_be_visible()
    expect(mine).to_be_hidden()
    # The page forgets the lease before it gives it back, so that a second end cannot give it back twice.
    assert eventually(lambda: service.client.get("/api/v1/leases").json() == {"leases": []}, within_s=9.0)


def test_an_arm_of_somebody_else_is_not_moved_but_stopped(
    visit: Visit, service: Served, held: HeldLease, tmp_path: Path
) -> None:
    page = visit.page
    identifier = begun(service, held)
    visit.go("/new")
    enter(page, "move")
    choose_robot(page)
    expect(page.get_by_role("heading", name="paper-arm")).to_be_visible()
    page.get_by_role("button", name="Begin").click()
    said = page.get_by_role("status").filter(has_text="paper-arm on sim: admin has its lease")
    expect(said).to_be_visible()
    expect(said.get_by_role("link", name="What leased means")).to_be_visible()
    expect(page.get_by_role("button", name="Begin")).to_be_enabled()
    visit.keep("page-leased", tmp_path)
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Stop was sent, and the service has taken it.")).to_be_visible()
    visit.go(f"/runs/{identifier}")
    expect(page.get_by_text("stopped").first).to_be_visible()
    assert state(service, identifier) == "stopped"


def test_a_key_that_has_expired_says_so_and_still_stops(visit: Visit, service: Served, held: HeldLease) -> None:
    page = visit.page
    identifier = begun(service, held)
    visit.go("/runs")
    enter(page, "expired")
    panel = page.get_by_role("dialog", name="An API key is needed")
    expect(panel).to_contain_text("the API key of night shift has expired")
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Stop was sent, and the service has taken it.")).to_be_visible()
    enter(page, "read")
    expect(panel).to_be_hidden()
    visit.go(f"/runs/{identifier}")
    expect(page.get_by_text("stopped").first).to_be_visible()
    assert state(service, identifier) == "stopped"


def test_a_lease_that_is_taken_away_is_told(visit: Visit, service: Served) -> None:
    page = visit.page
    visit.go("/new")
    enter(page, "move")
    choose_robot(page)
    expect(page.get_by_role("heading", name="paper-arm")).to_be_visible()
    page.get_by_role("button", name="Begin").click()
    expect(page.get_by_text("This tab has the lease of paper-arm on sim")).to_be_visible()
    expect(page).to_have_url(re.compile("#/campaigns/"))  # else the lease is lost before anything was begun by it
    taken = service.client.post("/api/v1/leases", json={"robot": "paper-arm", "backend": "sim", "take": True})
    assert taken.status_code == 201, taken.text
    expect(page.get_by_role("alert").filter(has_text="The lease of paper-arm on sim is lost")).to_be_visible()
    expect(page.get_by_text("This tab has the lease")).to_be_hidden()
