"""A recording of seven joints and 100,000 samples, and what a browser does while it is zoomed."""

from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, Page, expect

from browser.conftest import PATIENCE_MS
from server.http.serving import Served

SAMPLES, JOINTS = 100_000, 7
PEAK = 60.0
"""A single sample far beyond all others, of joint 4: thinning must not lose it."""

ZOOM = """
async ({ frames, counts }) => {
  const canvas = document.querySelector('.canvas');
  canvas.focus();
  const next = () => new Promise((done) => requestAnimationFrame(done));
  const drawn = [];
  const times = [];
  const lineTo = Path2D.prototype.lineTo;
  let points = 0;
  if (counts) Path2D.prototype.lineTo = function (...at) { points += 1; return lineTo.apply(this, at); };
  let before = await next();
  for (let k = 0; k < frames; k += 1) {
    points = 0;
    canvas.dispatchEvent(new KeyboardEvent('keydown', { key: k % 6 < 3 ? '+' : '-', bubbles: true }));
    await next();
    const now = await next();
    times.push((now - before) / 2);
    drawn.push(points);
    before = now;
  }
  Path2D.prototype.lineTo = lineTo;
  return { times, drawn };
}
"""
"""Zooms in and out at every second frame: the time of a frame, and what was drawn in it where that is counted."""


def write_long_recording(folder: Path) -> None:
    """Put it into a data folder, as an operator does."""
    (folder / "recordings").mkdir()
    rng = np.random.default_rng(7)
    time = np.arange(SAMPLES) / 1000.0
    position = np.sin(np.outer(time, 0.3 + 0.1 * np.arange(JOINTS)))
    torque = 5.0 * position + rng.normal(size=(SAMPLES, JOINTS))
    torque[54_321, 3] = PEAK
    heads = ["t", *(f"q{j + 1}" for j in range(JOINTS)), *(f"tau{j + 1}" for j in range(JOINTS))]
    columns = np.hstack([time[:, None], position, torque])
    path = folder / "recordings" / "long.csv"
    np.savetxt(path, columns, delimiter=",", header=",".join(heads), comments="", fmt="%.6g")


def open_long_recording(chromium: Browser, service: Served) -> Page:
    """The page that shows it, drawn."""
    page = chromium.new_page(viewport={"width": 1280, "height": 860})
    page.set_default_timeout(PATIENCE_MS)
    page.goto(f"{str(service.client.base_url).rstrip('/')}/#/recordings/long.csv")
    expect(page.locator(".canvas canvas").nth(1)).to_be_visible()
    expect(page.locator(".figures")).to_contain_text(str(SAMPLES))
    return page
