"""A campaign on the simulated arm, handed in without the page: short, with a spring concealed."""

import json
from typing import Any

from server.http.serving import Served
from server.queue.paper_files import PAPER_ROBOT

ROBOT = "paper-arm"
SHORT = {
    "excitation": {"starts": 1, "periods": 2, "slow_postures": 1, "closing_period": False},
    "held_out": {"periods": 1},
    "run": {"feed_forward": False, "rate_hz": 100},
    "diagnosis": {"next_trajectory": False},
    "backend": {
        "name": "sim",
        "time": "virtual",
        "scenario": {"torque_noise_std": 0.1, "effects": [{"effect": "joint_spring", "joint": 1, "stiffness": 2.0}]},
    },
}


def make_campaign(service: Served) -> dict[str, Any]:
    """Run it to its end; returns what the service says of it."""
    files = {
        "request": (None, json.dumps(SHORT), "application/json"),
        "robot": ("arm.yaml", PAPER_ROBOT.read_bytes()),
    }
    answer = service.client.post("/api/v1/campaigns", files=files)
    assert answer.status_code == 202, answer.text
    here = answer.headers["location"]
    service.client.get(f"{here}/events", timeout=600)  # answered to its end when the campaign has ended
    ended = service.client.get(here).json()
    assert ended["state"] == "succeeded", ended
    return ended


def views_of(campaign: dict[str, Any]) -> dict[str, str]:
    """Every view of the page that there is, by name."""
    made = {
        name: f"/{link.removeprefix('/api/v1/')}" for name, link in campaign["links"].items() if isinstance(link, str)
    }
    return {
        "home": "/",
        "campaigns": "/campaigns",
        "campaign": f"/campaigns/{campaign['id']}",
        "new campaign": f"/new?robot=campaigns/{campaign['id']}",
        "robots": "/robots",
        "robot": f"/robots/{ROBOT}",
        "runs": "/runs",
        "run": next(f"/{step['link'].removeprefix('/api/v1/')}" for step in campaign["steps"] if step["name"] == "run"),
        "recordings": "/recordings",
        "recording": f"/{campaign['links']['recordings'][0].removeprefix('/api/v1/')}",
        "identifications": "/identifications",
        "identification": made["identification"],
        "diagnoses": "/diagnoses",
        "diagnosis": made["diagnosis"],
        "over time": "/history",
    }
