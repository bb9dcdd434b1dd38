"""Seven joints × 100,000 samples: all there, thinned without losing a peak, drawn no finer than the screen."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from browser.long_recording import JOINTS, PEAK, SAMPLES, ZOOM, open_long_recording, write_long_recording
from server.http.serving import served

pytestmark = [pytest.mark.system, pytest.mark.slow]

POINTS_A_COLUMN = 4
"""Most that a curve draws in a column of pixels: in, lowest, highest, out."""


@pytest.fixture(scope="module")
def page(chromium: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """The page of the long recording."""
    folder = tmp_path_factory.mktemp("long")
    write_long_recording(folder)
    with served(folder) as service:
        shown = open_long_recording(chromium, service)
        yield shown
        shown.close()


def test_a_long_recording_is_thinned_without_losing_a_peak(page: Page) -> None:
    thinned = page.evaluate(
        """async () => {
          const { getSamples } = await import('/page/api.js');
          const { thinned } = await import("/page/thinning.js");
          const { columns, shown } = await getSamples('long.csv');
          const whole = thinned(columns.t, [columns.tau4], 0, 100, 1000);
          const part = thinned(columns.t, [columns.tau4], 54.3, 54.35, 1000);
          const peak = (values) => Math.max(...values);
          return { shown, rows: whole[0].length, peak: peak(whole[1]), part: part[0].length, again: peak(part[1]) };
        }"""
    )
    assert thinned["shown"] == SAMPLES
    assert thinned["rows"] == 4000
    assert thinned["peak"] == thinned["again"] == PEAK
    assert 50 <= thinned["part"] <= 54


def test_what_is_drawn_while_zooming_is_bounded_by_the_screen(page: Page) -> None:
    width = page.locator(".canvas canvas").first.evaluate("(canvas) => canvas.width")
    drawn = page.evaluate(ZOOM, {"frames": 24, "counts": True})["drawn"]
    assert min(drawn) > 2 * JOINTS  # the zoom is drawn at every step
    assert max(drawn) <= 2 * JOINTS * POINTS_A_COLUMN * width
    assert max(drawn) < SAMPLES
