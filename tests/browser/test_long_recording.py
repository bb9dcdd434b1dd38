"""Seven joints × 100,000 samples: all there, thinned without losing a peak, zoomed in step."""

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, expect

from api.serving import served
from browser.conftest import PATIENCE_MS

pytestmark = [pytest.mark.system, pytest.mark.slow]

SAMPLES, JOINTS = 100_000, 7
FRAMES = """
async () => {
  const canvas = document.querySelector('.canvas');
  canvas.focus();
  const times = [];
  const frame = () => new Promise((done) => requestAnimationFrame(done));
  for (let k = 0; k < 60; k += 1) {
    const begun = performance.now();
    canvas.dispatchEvent(new KeyboardEvent('keydown', { key: k % 6 < 3 ? '+' : '-', bubbles: true }));
    await frame();
    await frame();
    times.push((performance.now() - begun) / 2);
  }
  return times.sort((a, b) => a - b);
}
"""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder with a long recording, as an operator puts it there."""
    folder = tmp_path_factory.mktemp("long")
    (folder / "recordings").mkdir()
    rng = np.random.default_rng(7)
    time = np.arange(SAMPLES) / 1000.0
    position = np.sin(np.outer(time, 0.3 + 0.1 * np.arange(JOINTS)))
    torque = 5.0 * position + rng.normal(size=(SAMPLES, JOINTS))
    torque[54_321, 3] = 60.0
    heads = ["t", *(f"q{j + 1}" for j in range(JOINTS)), *(f"tau{j + 1}" for j in range(JOINTS))]
    columns = np.hstack([time[:, None], position, torque])
    np.savetxt(
        folder / "recordings" / "long.csv", columns, delimiter=",", header=",".join(heads), comments="", fmt="%.6g"
    )
    return folder


def test_a_long_recording_is_plotted_and_zoomed(chromium: Browser, data: Path) -> None:
    with served(data) as service:
        page = chromium.new_page(viewport={"width": 1280, "height": 860})
        page.set_default_timeout(PATIENCE_MS)
        page.goto(f"{service.client.base_url}/#/recordings/long.csv".replace("//#", "/#"))
        expect(page.locator(".canvas canvas").nth(1)).to_be_visible()
        expect(page.locator(".figures")).to_contain_text("100000")
        thinned = page.evaluate(
            """async () => {
              const { getSamples } = await import('/page/api.js');
              const { thinned } = await import('/page/plots.js');
              const { columns, shown } = await getSamples('long.csv');
              const whole = thinned(columns.t, [columns.tau4], 0, 100, 1000);
              const part = thinned(columns.t, [columns.tau4], 54.3, 54.35, 1000);
              const peak = (values) => Math.max(...values);
              return { shown, rows: whole[0].length, peak: peak(whole[1]), part: part[0].length, again: peak(part[1]) };
            }"""
        )
        assert thinned["shown"] == SAMPLES
        assert thinned["rows"] == 2000
        assert thinned["peak"] == thinned["again"] == 60.0
        assert 50 <= thinned["part"] <= 54
        times = page.evaluate(FRAMES)
        print(f"frames while zooming: median {times[30]:.1f} ms, 95 % {times[57]:.1f} ms, longest {times[-1]:.1f} ms")
        page.close()
