"""Home: files are dropped, a column is mended, and the verdict is read; an example is one click away."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, Route, expect

from browser.conftest import Visit
from server.http.serving import Served
from tauscope.server.page.router import example_files

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(600)]

VERDICT_MS = 200_000

DROP = """
(files) => {
  const transfer = new DataTransfer();
  for (const [name, text] of Object.entries(files)) transfer.items.add(new File([text], name));
  document.querySelector(".drop").dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true }));
}
"""


def rename_robot(name: str) -> str:
    """A recording of the example as another tool names its columns, the positions of its joints the wrong way round."""
    text = example_files()[name].decode()
    return text.replace("t,q1,q2,tau1,tau2", "timestamp,pos_2,pos_1,torque_1,torque_2", 1)


def read(page: Page) -> None:
    """Wait until every file that was dropped has been read."""
    expect(page.get_by_role("region", name="Recordings").get_by_role("listitem").first).to_be_visible()
    expect(page.get_by_text("Reading …")).to_have_count(0)


def with_a_tentative_finding(route: Route) -> None:
    """The result with a second finding that held-out motion does not confirm, and a warning."""
    result = route.fetch().json()
    other = {"effect": "backlash", "joint": "shoulder", "confirmed": False, "held_out_change": None}
    result["tentative"] = [{**result["findings"][0], **other}]
    warning = {"code": "weak-excitation", "joint": "elbow", "text": "the motion is slow", "remedy": "move faster"}
    route.fulfill(json={**result, "warnings": [warning]})


@pytest.fixture(scope="module")
def diagnosis() -> dict[str, str]:
    """Where the diagnosis of the example is."""
    return {}


def test_the_example_is_diagnosed_with_two_clicks(visit: Visit, tmp_path: Path, diagnosis: dict[str, str]) -> None:
    page = visit.page
    visit.go("/")
    page.get_by_role("button", name="Try the example").click()
    read(page)
    expect(page.get_by_label("Use of example-held-out.csv")).to_have_value("held_out")
    expect(page.get_by_label("Position of elbow")).to_have_value("q2")
    assert visit.barriers() == []
    visit.keep("page-home", tmp_path)
    page.get_by_role("button", name="Diagnose", exact=True).click()
    expect(page.get_by_text("spring is missing at elbow").first).to_be_visible(timeout=VERDICT_MS)
    diagnosis["url"] = page.url
    visit.go("/")
    recent = page.get_by_role("region", name="Recent robots")
    expect(recent.get_by_role("link", name="spring is missing at elbow")).to_be_visible()
    expect(recent).to_contain_text("explained")
    assert visit.barriers() == []


def test_confirmed_and_tentative_findings_stand_apart(visit: Visit, tmp_path: Path, diagnosis: dict[str, str]) -> None:
    page = visit.page
    page.route("**/result", with_a_tentative_finding)
    page.goto(diagnosis["url"])
    expect(page.get_by_role("heading", level=1)).to_contain_text("spring is missing at elbow")
    confirmed = page.get_by_role("region", name="Confirmed findings")
    tentative = page.get_by_role("region", name="Tentative findings")
    expect(confirmed.get_by_role("heading", level=3)).to_have_text("Joint spring at elbow")
    expect(tentative.get_by_role("heading", level=3)).to_have_text("Backlash at shoulder")
    expect(tentative).to_contain_text("not confirmed")
    page.get_by_text("1 warning", exact=True).click()
    expect(page.get_by_text("the motion is slow; move faster.")).to_be_visible()
    assert visit.barriers() == []
    visit.keep("page-findings", tmp_path)


def test_the_arm_moves_with_the_plots_coloured_by_its_residual(
    visit: Visit, tmp_path: Path, diagnosis: dict[str, str]
) -> None:
    page = visit.page
    page.goto(diagnosis["url"])
    motion = page.get_by_role("region", name="Residual over the motion")
    expect(motion.locator("canvas")).to_be_visible()
    slider, elbow = page.get_by_label("Time of the motion"), motion.locator('[data-joint="2"]')
    area = motion.locator(".u-over")
    box = area.bounding_box()
    assert box is not None
    area.hover(position={"x": 0.5 * box["width"], "y": 20})
    expect(slider).to_have_attribute("aria-valuetext", re.compile(r"^(9\.|10\.)"))
    expect(elbow).to_have_class(re.compile("h[5-7]$"))
    visit.keep("page-motion", tmp_path)
    motion.get_by_role("button", name="With them").click()
    expect(elbow).to_have_class(re.compile("h[0-2]$"))
    drawn = elbow.inner_html()
    motion.get_by_role("img").focus()
    page.keyboard.press("ArrowUp")
    assert elbow.inner_html() != drawn
    page.mouse.move(5, 5)
    motion.get_by_role("button", name="Play").click()
    expect(slider).not_to_have_attribute("aria-valuetext", re.compile(r"^(9\.|10\.)"))
    motion.get_by_role("button", name="Pause").click()
    expect(motion.locator(".reading").last).not_to_be_empty()
    assert visit.barriers() == []


def test_a_simulated_arm_without_a_model_takes_that_of_its_last_diagnosis(visit: Visit, tmp_path: Path) -> None:
    """After the example was diagnosed."""
    page = visit.page
    visit.go("/new")
    bare = example_files()["example-arm.yaml"].decode().partition("model:")[0]
    robot = {"name": "bare.yaml", "mimeType": "application/yaml", "buffer": bare.encode()}
    page.get_by_label("Robot file").set_input_files(robot)  # pyright: ignore[reportArgumentType]
    expect(page.get_by_text("The robot file states no model")).to_be_visible()
    expect(page.get_by_role("button", name="Begin")).to_be_disabled()
    visit.keep("page-no-model", tmp_path)
    page.get_by_role("button", name="Use the model of its diagnosis").click()
    expect(page.get_by_text("The robot file states no model")).to_have_count(0)
    expect(page.get_by_role("button", name="Begin")).to_be_enabled()
    page.get_by_label("Robot file").set_input_files(robot)  # pyright: ignore[reportArgumentType]
    expect(page.get_by_text("The robot file states no model")).to_be_visible()
    page.locator("#backend").select_option("CANopen drives")
    expect(page.get_by_role("button", name="Begin")).to_be_enabled()


def test_what_failed_is_no_robot_of_the_next_campaign_and_an_entry_is_removed_with_undo(
    visit: Visit, service: Served, tmp_path: Path
) -> None:
    """After the example was diagnosed: a bad file of the same robot fails, and changes nothing."""
    robot = example_files()["example-arm.yaml"].partition(b"model:")[0]
    files = {"robot": ("arm.yaml", robot), "recordings": ("bad.csv", b"t,q1,tau1\n0,1,x\n")}
    answer = service.client.post("/api/v1/identifications", files=files)
    assert answer.status_code == 202, answer.text
    service.client.get(f"{answer.headers['location']}/events", timeout=60)
    page = visit.page
    visit.go("/robots/example-arm")
    link = page.get_by_role("link", name="New campaign with it")
    expect(link).to_have_attribute("href", re.compile("^#/new.robot=(diagnoses|identifications)/"))
    assert answer.json()["id"] not in (link.get_attribute("href") or "")
    visit.go("/identifications")
    entry = page.get_by_role("listitem").first
    expect(entry).to_contain_text("failed")
    entry.get_by_role("button", name="Remove example-arm").click()
    visit.keep("page-undo", tmp_path)
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_role("listitem").first).to_contain_text("failed")
    page.get_by_role("listitem").first.get_by_role("button", name="Remove example-arm").click()
    with page.expect_response(lambda response: response.request.method == "DELETE") as removed:
        visit.go("/robots")  # leaving counts as thought
    assert removed.value.status == 204
    assert service.client.get(answer.headers["location"]).status_code == 404


def test_files_of_another_tool_are_dropped_and_a_column_is_mended(
    visit: Visit, service: Served, tmp_path: Path
) -> None:
    page = visit.page
    visit.go("/")
    expect(page.locator(".drop")).to_be_visible()
    files = {"example-arm.yaml": example_files()["example-arm.yaml"].decode(), "notes.md": "none"}
    files |= {name: rename_robot(name) for name in example_files() if name.endswith(".csv")}
    page.evaluate(DROP, files)
    read(page)
    expect(page.get_by_text("Guessed from the names")).to_be_visible()
    expect(page.get_by_text("Not used: notes.md")).to_be_visible()
    with page.expect_response("**/mappings/check"):
        page.get_by_label("Position of shoulder").select_option("pos_2")
    read(page)
    expect(page.get_by_label("Position of elbow")).to_have_value("pos_1")
    visit.keep("page-mapping", tmp_path)
    with page.expect_response("**/api/v1/identifications") as answer:
        page.get_by_role("button", name="Identify only").click()
    handed_in = answer.value.json()
    columns = handed_in["options"]["columns"]
    assert (columns["q1"], columns["q2"], columns["t"]) == ("pos_2", "pos_1", "timestamp")
    expect(page.get_by_text("The model explains")).to_be_visible(timeout=VERDICT_MS)


def test_a_unit_is_mended_with_one_click_and_a_folder_is_taken_whole(visit: Visit, tmp_path: Path) -> None:
    folder = tmp_path / "arm"
    folder.mkdir()
    (folder / "example-arm.yaml").write_bytes(example_files()["example-arm.yaml"])
    header, *rows = example_files()["example-train.csv"].decode().splitlines()
    cells = [row.split(",") for row in rows]
    lines = [",".join([t, *(f"{57.29578 * float(q):.4f}" for q in (q1, q2)), *rest]) for t, q1, q2, *rest in cells]
    (folder / "degrees.csv").write_text("\n".join([header, *lines, ""]), encoding="utf-8")
    page = visit.page
    visit.go("/")
    page.locator("#folder").set_input_files(folder)
    read(page)
    expect(page.get_by_role("alert").filter(has_text="beyond its limits")).to_be_visible()
    expect(page.get_by_role("button", name="Diagnose", exact=True)).to_be_disabled()
    visit.keep("page-refused", tmp_path)
    with page.expect_response("**/mappings/check"):
        page.get_by_role("button", name="Read q in deg").click()
    read(page)
    expect(page.get_by_label("Unit of position")).to_have_value("deg")
    expect(page.get_by_role("button", name="Diagnose", exact=True)).to_be_enabled()


def test_without_a_connection_nothing_is_lost(visit: Visit, service: Served) -> None:
    page = visit.page
    visit.go("/")
    page.get_by_role("button", name="Try the example").click()
    read(page)
    before = len(service.client.get("/api/v1/diagnoses").json()["diagnoses"])
    visit.context.set_offline(True)
    page.get_by_role("button", name="Diagnose", exact=True).click()
    expect(page.get_by_text("The service does not answer. Check the connection, and try again.")).to_be_visible()
    expect(page.get_by_label("Use of example-train.csv")).to_be_visible()
    visit.context.set_offline(False)
    expect(page.locator("#link-state")).to_have_text("Connected")
    with page.expect_response("**/api/v1/diagnoses") as answer:
        page.get_by_role("button", name="Diagnose", exact=True).click()
    assert answer.value.status == 202
    page.get_by_role("button", name="Cancel").click()
    expect(page.get_by_role("status").filter(has_text="cancelled")).to_be_visible()
    assert len(service.client.get("/api/v1/diagnoses").json()["diagnoses"]) == before + 1


def test_home_fits_a_phone(visit: Visit, tmp_path: Path) -> None:
    page = visit.page
    page.set_viewport_size({"width": 390, "height": 844})
    page.emulate_media(color_scheme="dark")
    visit.go("/")
    page.get_by_role("button", name="Try the example").click()
    read(page)
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert visit.barriers() == []
    page.screenshot(path=tmp_path / "phone.png", full_page=True)
