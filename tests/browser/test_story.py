"""The whole story in a browser: from a robot file to a verdict, on the simulated arm."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from browser.conftest import Visit
from server.http.serving import Served
from server.queue.paper_files import PAPER_ROBOT

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(1800)]

CAMPAIGN_MS = 900_000  # on a busy machine


@pytest.fixture(scope="module")
def address() -> dict[str, str]:
    """Where the campaign is that the story is about."""
    return {}


def test_from_a_robot_file_to_the_report_in_hand(
    visit: Visit, service: Served, tmp_path: Path, address: dict[str, str]
) -> None:
    """Robot, excitation, run, identification, diagnosis, the next experiment with one click, the report downloaded."""
    begin_a_campaign(visit, tmp_path)
    watch_it_to_its_end(visit, tmp_path)
    address["campaign"] = visit.page.url
    read_the_diagnosis(visit, tmp_path)
    diagnosis = visit.page.url
    run_the_next_experiment(visit, service, tmp_path)
    visit.page.goto(diagnosis)
    report = download_the_proof(visit)
    assert "Joint spring" in report
    assert "<script" not in report


def begin_a_campaign(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    visit.go("/campaigns")
    expect(page.get_by_text("No campaign yet")).to_be_visible()
    page.get_by_role("link", name="New campaign").click()
    page.get_by_label("Robot file").set_input_files(PAPER_ROBOT)
    expect(page.get_by_role("img", name="Kinematic chain of paper-arm")).to_be_visible()
    page.get_by_label("The simulated arm conceals").select_option("a spring")
    page.get_by_role("combobox", name="Motion").select_option("short")
    page.get_by_label("Plan a further motion").check()
    visit.keep("page-new-campaign", tmp_path)
    assert visit.barriers() == []
    page.get_by_role("button", name="Begin").click()


def watch_it_to_its_end(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    expect(page.get_by_role("heading", name="paper-arm")).to_be_visible()
    expect(page.get_by_text("Waiting for the arm").or_(page.get_by_text(" of ").first).first).to_be_visible(
        timeout=CAMPAIGN_MS
    )
    expect(page.get_by_text("The findings explain the whole residual.")).to_be_visible(timeout=CAMPAIGN_MS)
    expect(page.get_by_text("Joint spring at joint1")).to_be_visible()
    steps = page.locator(".steps li")
    expect(steps).to_have_count(6)
    assert set(steps.evaluate_all("(all) => all.map((each) => each.dataset.state)")) == {"succeeded", "finished"}
    visit.keep("page-campaign", tmp_path)
    assert visit.barriers() == []


def read_the_diagnosis(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    page.get_by_role("link", name="Read the diagnosis").click()
    headings = page.get_by_role("heading", level=2)
    expect(headings.first).to_have_text("Residual over the motion")
    sections = [
        "Residual over the motion",
        "Confirmed findings",
        "Next experiment",
        "Residual by state",
        "Proof",
        "Residual and parameters",
    ]
    assert [text for text in headings.all_inner_texts() if text != "Tentative findings"][:6] == sections
    expect(page.get_by_role("heading", level=1)).to_contain_text("spring is missing at joint1")
    expect(page.locator(".canvas canvas").first).to_be_visible()
    assert visit.barriers() == []
    visit.keep("page-diagnosis", tmp_path)
    page.locator('[data-cell="0-position-3"]').click()
    expect(page.locator("#where-joint")).to_have_value("joint1")
    expect(page.get_by_text("the chosen part marked")).to_be_visible()
    proof = page.locator("#proof")
    proof.scroll_into_view_if_needed()
    proof.get_by_role("button", name="joint2").click()
    expect(proof.get_by_text("Torque of joint2")).to_be_visible()


def run_the_next_experiment(visit: Visit, service: Served, tmp_path: Path) -> None:
    """One click: the arm that was diagnosed plays the planned motion, and is diagnosed again."""
    page = visit.page
    expect(page.locator("#next").get_by_text(re.compile("^Planned: "))).to_be_visible()
    page.get_by_role("button", name="Run it on the simulated arm, and diagnose again").click()
    page.wait_for_url("**/#/runs/*")
    run = service.client.get(f"/api/v1/runs/{page.url.rsplit('/', 1)[1].partition('?')[0]}").json()
    page.wait_for_url("**/#/diagnoses/*before=*", timeout=CAMPAIGN_MS)
    expect(page.get_by_text("Since the experiment")).to_be_visible(timeout=CAMPAIGN_MS)
    expect(page.locator(".change")).to_contain_text("Joint spring at joint1: ")
    visit.keep("page-change", tmp_path)
    visit.go(f"/runs/{run['id']}")
    expect(page.get_by_role("link", name="Look at the recording")).to_be_visible()
    visit.keep("page-run", tmp_path)
    run = service.client.get(f"/api/v1/runs/{run['id']}").json()
    (effect,) = run["backend"]["scenario"]["effects"]
    assert (run["state"], effect["effect"], run["recording"]["partial"]) == ("finished", "joint_spring", False)
    page.get_by_role("link", name="Look at the recording").click()
    expect(page.locator(".canvas canvas").nth(1)).to_be_visible()


def download_the_proof(visit: Visit) -> str:
    with visit.page.expect_download() as download:
        visit.page.get_by_role("button", name="Download the proof").click()
    return Path(download.value.path()).read_text(encoding="utf-8")


def test_the_identification_and_the_recording_are_shown(visit: Visit, tmp_path: Path, address: dict[str, str]) -> None:
    page = visit.page
    page.goto(address["campaign"])
    page.get_by_role("link", name="Read the identification").click()
    expect(page.get_by_role("heading", name="Friction", level=2)).to_be_visible()
    expect(page.locator(".canvas canvas").nth(2)).to_be_visible()
    assert visit.barriers() == []
    visit.keep("page-identification", tmp_path)
    page.go_back()
    page.get_by_role("link", name="Recording", exact=True).first.click()
    expect(page.get_by_text("repeated motion")).to_be_visible()
    expect(page.locator(".canvas canvas").nth(1)).to_be_visible()
    assert visit.barriers() == []


@pytest.mark.parametrize(
    ("name", "width", "height", "scheme"),
    [("phone", 320, 720, "light"), ("tablet", 834, 1112, "dark"), ("4k", 3840, 2160, "dark")],
)
def test_every_screen_holds_it_without_a_sideways_scroll(
    visit: Visit, tmp_path: Path, address: dict[str, str], name: str, width: int, height: int, scheme: str
) -> None:
    page = visit.page
    page.set_viewport_size({"width": width, "height": height})
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    page.goto(address["campaign"])
    page.get_by_role("link", name="Read the diagnosis").click()
    expect(page.locator(".canvas canvas").first).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    expect(page.get_by_role("button", name="Stop")).to_be_in_viewport()
    assert visit.barriers() == []
    visit.keep(f"page-{name}", tmp_path)


def test_it_is_worked_by_keyboard_alone(visit: Visit, address: dict[str, str]) -> None:
    page = visit.page
    visit.go("/campaigns")
    expect(page.get_by_role("link", name="New campaign")).to_be_visible()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to the content")).to_be_focused()
    names = []
    for _ in range(12):
        page.keyboard.press("Tab")
        names.append(page.evaluate("document.activeElement.textContent"))
    assert "Stop" in names
    assert "New campaign" in names
    page.goto(address["campaign"])
    page.get_by_role("link", name="Read the identification").click()
    plot = page.locator(".canvas").first
    expect(plot.locator("canvas")).to_be_visible()
    plot.focus()
    before = plot.screenshot()
    page.keyboard.press("+")
    page.wait_for_timeout(100)  # two frames: the plot is thinned and drawn anew
    assert plot.screenshot() != before
