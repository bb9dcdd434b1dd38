"""Frame times while seven joints × 100,000 samples are zoomed. Run it alone on the machine:

pytest -m benchmark -p no:xdist -s --timeout=0 tests/browser/test_zoom_frames.py
"""

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser

from browser.long_recording import JOINTS, SAMPLES, ZOOM, open_long_recording, write_long_recording
from server.http.serving import served

pytestmark = pytest.mark.benchmark

FRAMES = 300
PERCENTILES = (50, 90, 95, 99, 100)


def test_frame_times_while_zooming(chromium: Browser, tmp_path: Path) -> None:
    """Nothing is asserted of the times; a frame is never shorter than the screen's, 16.7 ms at 60 Hz."""
    write_long_recording(tmp_path)
    with served(tmp_path) as service:
        page = open_long_recording(chromium, service)
        page.evaluate(ZOOM, {"frames": 30, "counts": False})
        times = page.evaluate(ZOOM, {"frames": FRAMES, "counts": False})["times"]
        page.close()
    assert len(times) == FRAMES
    row = ", ".join(f"p{p} {np.percentile(times, p):.1f} ms" for p in PERCENTILES)
    print(f"\n{JOINTS} joints x {SAMPLES} samples, {FRAMES} zooms: {row}")
    print(f"longer than two frames of 60 Hz: {100 * np.mean(np.array(times) > 33.4):.1f} %")
