"""Names that want to be markup stay text: of robots and joints, of files, of columns."""

import pytest
from playwright.sync_api import expect

from browser.conftest import Visit
from server.conftest import RECORDINGS
from server.http.serving import Served

pytestmark = [pytest.mark.system, pytest.mark.slow]

MARKUP = '<img src=x onerror="window.taken=1"><script>window.taken=1</script>'
ROBOT = f"""
name: '{MARKUP}'
kinematics:
  dh:
    - {{theta: 0.0, d: 0.3, a: 0.2, alpha: 0.0}}
gravity: [0, 0, -3.7]
joints:
  - name: '{MARKUP} joint'
"""


def untouched(visit: Visit) -> None:
    assert visit.page.evaluate("window.taken") is None
    assert visit.page.locator("main img, main script, main iframe").count() == 0


def test_a_robot_and_its_joints_are_text(visit: Visit) -> None:
    page = visit.page
    visit.go("/new")
    page.get_by_label("Robot file").set_input_files(
        {"name": "hostile.yaml", "mimeType": "application/yaml", "buffer": ROBOT.encode()}
    )
    expect(page.get_by_role("heading", name=MARKUP)).to_be_visible()
    expect(page.get_by_role("cell", name=f"{MARKUP} joint").first).to_be_visible()
    untouched(visit)


def test_a_file_name_is_text_where_it_is_refused(visit: Visit) -> None:
    page = visit.page
    visit.go("/recordings")
    page.get_by_label("Keep a recording").set_input_files(
        {"name": f"{MARKUP.replace('/', '')}.csv", "mimeType": "text/csv", "buffer": b"t,q1,tau1\n0,0,0\n1,1,1\n"}
    )
    expect(page.get_by_role("status").filter(has_text="onerror")).to_be_visible()
    untouched(visit)


def test_a_column_s_name_is_text_where_it_is_told(visit: Visit, service: Served) -> None:
    head = MARKUP.replace(",", "").replace('"', "'")
    rows = "".join(f"{k / 100},{k / 1000},{k % 7}\n" for k in range(300))
    content = f"t,q1,{head}\n{rows}".encode()
    assert service.client.post(RECORDINGS, files={"file": ("columns.csv", content)}).status_code == 201
    visit.go("/recordings/columns.csv")
    expect(visit.page.get_by_role("alert").filter(has_text=f"the columns are t, q1, {head[:60]}")).to_be_visible()
    untouched(visit)


def test_a_robot_of_the_list_and_its_address_are_text(visit: Visit, service: Served) -> None:
    parts = {
        "robot": ("hostile.yaml", ROBOT.encode()),
        "recordings": ("short.csv", b"t,q1,tau1\n0,0,0\n1,0.1,1\n2,0,0\n"),
    }
    assert service.client.post("/api/v1/identifications", files=parts).status_code == 202
    visit.go("/robots")
    visit.page.get_by_role("link", name=MARKUP).click()
    expect(visit.page.get_by_role("heading", name=MARKUP, level=1)).to_be_visible()
    expect(visit.page.get_by_role("img", name=f"Kinematic chain of {MARKUP}")).to_be_visible()
    untouched(visit)


def test_an_address_is_text(visit: Visit) -> None:
    visit.go(f"/recordings/{MARKUP.replace('/', '')}")
    expect(visit.page.get_by_role("heading", name="This cannot be shown")).to_be_visible()
    untouched(visit)
