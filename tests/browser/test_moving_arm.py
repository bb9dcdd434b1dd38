"""An arm that moves: watched, found again after a reload and a lost connection, stopped from the page."""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path

import pytest
from playwright.sync_api import expect

from browser.conftest import Visit
from server.http.serving import Served
from server.queue.paper_files import PAPER_ROBOT

pytestmark = [pytest.mark.system, pytest.mark.slow, pytest.mark.timeout(1200)]

MOTION_S = 1500
"""Far longer than a test, however fast the simulated arm computes: it is not bound to the clock."""


def begin(service: Served, headers: Mapping[str, str] | None = None) -> str:
    """A slow motion of one joint; returns the run's identifier."""
    samples = [f"{k},{0.2 * math.sin(0.1 * math.pi * k) ** 2:.6f},0,0" for k in range(MOTION_S + 1)]
    trajectory = ("motion.csv", "t,q1,q2,q3\n" + "\n".join(samples) + "\n", "text/csv")
    request = {"backend": {"name": "sim", "time": "virtual"}, "rate_hz": 100, "feed_forward": False}
    answer = service.client.post(
        "/api/v1/runs",
        headers=headers,
        files={
            "request": (None, json.dumps(request), "application/json"),
            "robot": ("arm.yaml", PAPER_ROBOT.read_bytes()),
            "trajectory": trajectory,
        },
    )
    assert answer.status_code == 202, answer.text
    return answer.json()["id"]


def state(service: Served, identifier: str) -> str:
    return service.client.get(f"/api/v1/runs/{identifier}").json()["state"]


def test_it_is_watched_through_reload_and_lost_connection_and_stopped(
    visit: Visit, service: Served, tmp_path: Path
) -> None:
    page, identifier = visit.page, begin(service)
    visit.go(f"/runs/{identifier}")
    joints = page.get_by_role("region", name="Joints now")
    expect(joints).to_be_visible()
    expect(page.get_by_text("cycles missed")).to_be_visible()
    expect(page.locator("#link-state")).to_have_text("An arm is in use")
    page.reload()
    expect(joints).to_be_visible()
    expect(page.locator(".canvas canvas").nth(1)).to_be_visible()
    expect(page.get_by_role("button", name="joint1", exact=True).first).to_be_visible()
    expect(page.get_by_text(re.compile(r"^([1-9]\.\d+|\d{2}.*) of 1502 s$"))).to_be_visible()
    visit.keep("page-live", tmp_path)
    visit.context.set_offline(True)
    expect(page.locator("#link-state")).to_have_text("Not connected")
    expect(page.get_by_role("alert").filter(has_text="emergency stop")).to_be_visible()
    visit.context.set_offline(False)
    expect(page.locator("#link-state")).to_have_text("An arm is in use")
    expect(joints).to_be_visible()
    assert state(service, identifier) in ("ramping", "running")
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Stop was sent, and the service has taken it.")).to_be_visible()
    expect(page.get_by_text("stopped").first).to_be_visible()
    assert state(service, identifier) == "stopped"


def test_a_stop_that_could_not_be_sent_is_sent_when_the_connection_is_back(visit: Visit, service: Served) -> None:
    page, identifier = visit.page, begin(service)
    visit.go(f"/runs/{identifier}")
    expect(page.get_by_role("region", name="Joints now")).to_be_visible()
    expect(page.locator("#link-state")).to_have_text("An arm is in use")
    visit.context.set_offline(True)
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_text("Stop could not be sent")).to_be_visible()
    assert state(service, identifier) not in ("stopping", "stopped")
    visit.context.set_offline(False)
    expect(page.get_by_text("Stop was sent, and the service has taken it.")).to_be_visible()
    expect(page.get_by_text("stopped").first).to_be_visible()
    assert state(service, identifier) == "stopped"
