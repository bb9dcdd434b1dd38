"""Plots: thinned curves look like whole ones, values are read at the cursor, and a plot is saved as a file."""

import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page, expect

from browser.conftest import Visit
from server.conftest import RECORDINGS
from server.http.serving import Served

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(300)]

SAMPLES, BUCKETS = 3000, 60
NAME = "two-joints.csv"
RATE_HZ = 100.0

THIN = """
async ({ time, columns, buckets }) => {
  const { thinned } = await import("/page/thinning.js");
  const whole = columns.map((column) => Float64Array.from(column, (value) => value ?? NaN));
  return thinned(Float64Array.from(time), whole, time[0], time[time.length - 1], buckets);
}
"""


def motion() -> NDArray[np.float64]:
    """Time, two positions and two torques, 40 s."""
    t = np.arange(0.0, 40.0, 1.0 / RATE_HZ)
    return np.column_stack([t, np.sin(t), 2.0 - t / 20.0, 5.0 * np.cos(t), np.sign(np.sin(3.0 * t))])


@pytest.fixture(scope="module")
def page(chromium: Browser, service: Served) -> Iterator[Page]:
    """A page of the service, for its modules."""
    shown = chromium.new_page()
    shown.goto(str(service.client.base_url))
    yield shown
    shown.close()


@pytest.fixture(scope="module")
def kept(service: Served) -> str:
    """Path of the page that shows the motion."""
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in motion())
    answer = service.client.post(RECORDINGS, files={"file": (NAME, f"t,q1,q2,tau1,tau2\n{rows}\n")})
    assert answer.status_code == 201, answer.text
    return f"/recordings/{NAME}"


def curves(rng: np.random.Generator) -> NDArray[np.float64]:
    """Random walks, noise, falling and rising curves, spikes, steps, and one with gaps, one a column."""
    noise = rng.normal(size=(SAMPLES, 5))
    falling = -np.cumsum(rng.exponential(size=SAMPLES))
    spikes = np.where(rng.uniform(size=SAMPLES) < 0.002, 50.0 * noise[:, 2], 0.0)
    gaps = np.where(rng.uniform(size=SAMPLES) < 0.3, np.nan, noise[:, 4])
    gaps[1000:1200] = np.nan
    steps = np.floor(np.arange(SAMPLES) / 700.0)
    return np.column_stack([np.cumsum(noise[:, 0]), noise[:, 1], falling, -falling, spikes, steps, gaps])


def test_a_thinned_curve_enters_turns_and_leaves_each_column_as_the_whole_one_does(page: Page) -> None:
    rng = np.random.default_rng(7)
    for _ in range(8):
        whole = curves(rng)
        time = np.cumsum(rng.exponential(size=SAMPLES))
        given = [[None if np.isnan(value) else value for value in column] for column in whole.T]
        x, *drawn = page.evaluate(THIN, {"time": time.tolist(), "columns": given, "buckets": BUCKETS})
        assert np.all(np.diff(x) >= 0.0)
        edges = np.arange(BUCKETS + 1) * SAMPLES // BUCKETS
        for column, points in zip(whole.T, np.array(drawn, dtype=float), strict=True):
            for bucket, (start, stop) in enumerate(pairwise(edges)):
                part, four = column[start:stop], points[4 * bucket : 4 * bucket + 4]
                assert time[start] <= x[4 * bucket] <= x[4 * bucket + 3] <= time[stop - 1] + 1e-9
                if np.isnan(part).all():
                    assert np.isnan(four).all()
                    continue
                np.testing.assert_equal((four[0], four[3]), (part[0], part[-1]))
                assert (np.nanmin(four), np.nanmax(four)) == (np.nanmin(part), np.nanmax(part))
                assert (np.nanargmin(four) <= np.nanargmax(four)) == (np.nanargmin(part) <= np.nanargmax(part))
        assert np.all(np.diff(drawn[2]) <= 0.0)  # what falls is drawn falling: no saw teeth
        assert np.all(np.diff(drawn[3]) >= 0.0)
        line = page.evaluate(THIN, {"time": time.tolist(), "columns": [time.tolist()], "buckets": BUCKETS})
        np.testing.assert_allclose(line[1], line[0])  # a straight line stays one: no stairs


def readings(page: Page) -> list[str]:
    """Values at the cursor, of all plots."""
    return page.locator(".reading").all_inner_texts()


def open_recording(visit: Visit, kept: str) -> Page:
    visit.go(kept)
    expect(visit.page.locator(".canvas canvas")).to_have_count(2)
    return visit.page


def test_values_are_read_at_one_cursor_in_all_plots(visit: Visit, kept: str, tmp_path: Path) -> None:
    page = open_recording(visit, kept)
    assert set(readings(page)) == {""}
    area = page.locator(".u-over").first
    box = area.bounding_box()
    assert box is not None
    area.hover(position={"x": box["width"] / 4, "y": box["height"] / 2})
    expect(page.locator(".reading").last).not_to_be_empty()
    instant = page.locator(".instant").all_inner_texts()
    assert instant[0] == instant[1] != ""
    t = float(instant[0].removeprefix("at "))
    assert t == pytest.approx(10.0, abs=0.2)
    shown = [float(text.replace("−", "-")) for text in readings(page)]
    row = motion()[round(t * RATE_HZ)]
    assert shown == pytest.approx(row[1:], abs=2e-3)
    visit.keep("page-cursor", tmp_path)
    page.mouse.move(5, 5)
    expect(page.locator(".reading").first).to_be_empty()


def save(page: Page, kind: str) -> Path:
    with page.expect_download() as download:
        page.get_by_role("group", name="Save Position").get_by_role("button", name=kind).click()
    assert download.value.suggested_filename == f"position.{kind.lower()}"
    return Path(download.value.path())


def test_a_plot_is_saved_as_it_is_zoomed(visit: Visit, kept: str, tmp_path: Path) -> None:
    page = open_recording(visit, kept)
    page.locator(".canvas").first.focus()
    for _ in range(3):
        page.keyboard.press("+")
    page.wait_for_timeout(100)  # two frames: the plot is thinned and drawn anew
    header, *rows = save(page, "CSV").read_text(encoding="utf-8").splitlines()
    assert header == "time [s],q1,q2"
    times = [float(row.split(",")[0]) for row in rows]
    assert 0.0 < times[0] < times[-1] < 40.0
    assert len(rows) == pytest.approx((times[-1] - times[0]) * RATE_HZ, abs=2)
    svg = save(page, "SVG").read_text(encoding="utf-8")
    assert len(re.findall(r'<path d="M[^"]{100,}"', svg)) == 2
    assert ">Position<" in svg
    assert ">time [s]<" in svg
    (tmp_path / "position.svg").write_text(svg, encoding="utf-8")
    png = save(page, "PNG").read_bytes()
    assert png.startswith(b"\x89PNG")
    (tmp_path / "position.png").write_bytes(png)
    assert visit.barriers() == []


def test_another_recording_is_laid_over_and_taken_off(visit: Visit, kept: str, service: Served, tmp_path: Path) -> None:
    shifted = motion() + np.array([0.0, 0.25, 0.25, 1.0, 1.0])
    rows = "\n".join(",".join(f"{value:.6f}" for value in row) for row in shifted)
    service.client.post(RECORDINGS, files={"file": ("later.csv", f"t,q1,q2,tau1,tau2\n{rows}\n")})
    page = open_recording(visit, kept)
    with page.expect_response("**/later.csv/samples"):
        page.get_by_label("Overlay").select_option("later.csv")
    expect(page.get_by_role("button", name="q1, other")).to_be_visible()
    visit.keep("page-overlay", tmp_path)
    with page.expect_response("**/later.csv/samples"):
        page.get_by_label("Difference").check()
    expect(page.get_by_text("Position, difference", exact=True)).to_be_visible()
    with page.expect_download() as download:
        page.get_by_role("group", name="Save Torque, difference").get_by_role("button", name="CSV").click()
    _, *lines = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    np.testing.assert_allclose(values[:, 1:], -1.0, atol=1e-5)
    assert visit.barriers() == []
