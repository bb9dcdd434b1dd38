"""Schedules over HTTP: made from something that was done, done when asked, and told."""

import shutil
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from server.conftest import IDENTIFICATIONS, RECORDINGS, connected
from server.http.motions import ROBOT
from server.http.problem_check import assert_problem
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor
from snapshots import SNAPSHOTS, unpacked
from tauscope.server.http import Settings, create_app

SCHEDULES, CAMPAIGNS, LEASES = (f"/api/v1/{name}" for name in ("schedules", "campaigns", "leases"))
WHY = {"reason": "a test"}


@pytest.fixture
def old(tmp_path: Path) -> Settings:
    return Settings(data_folder=unpacked(SNAPSHOTS[-1], tmp_path), fires_schedules=False)


def newest(client: TestClient, kind: str) -> str:
    return client.get("/api/v1/items", params={"kind": kind, "state": "succeeded"}).json()["items"][-1]["id"]


def put(client: TestClient, like: str, **definition: Any) -> dict[str, Any]:
    answer = client.put(f"{SCHEDULES}/nightly", json={"like": like, "definition": definition})
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_an_identification_is_repeated_with_the_newest_recordings(old: Settings) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        # The copies are newer than what they are copies of.
        for name in ("tuesday", "wednesday"):
            content = client.get(f"{RECORDINGS}/{name}.csv/content").content
            client.post(RECORDINGS, files={"file": (f"cell-{name}.csv", content)})
        recordings = {"pattern": "cell-*", "train": 1, "held_out": 1}
        made = put(client, newest(client, "identification"), kind="identification", every_s=3600, recordings=recordings)
        assert (made["name"], made["robot"], made["definition"]["recordings"]) == (
            "nightly",
            "snapshot-arm",
            recordings,
        )
        assert client.get(SCHEDULES).json() == {"schedules": [made]}
        firing = client.post(f"{SCHEDULES}/nightly/run", json=WHY)
        assert (firing.status_code, firing.json()["state"]) == (202, "started")
        item = client.get(firing.json()["item"]).json()
        assert item["state"] == "succeeded", item
        assert [entry["name"] for entry in item["recordings"]] == ["cell-tuesday.csv"]
        assert [entry["name"] for entry in item["held_out"]] == ["cell-wednesday.csv"]
        (told,) = client.get(f"{SCHEDULES}/nightly/firings").json()["firings"]
        assert (told["item"], told["item_state"]) == (firing.json()["item"], "succeeded")
        models = client.get("/api/v1/models", params={"robot": "snapshot-arm"}).json()["models"]
        assert (models[0]["id"], models[0]["state"]) == (item["id"], "active")
        again = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
        assert (again["state"], again["item"]) == ("skipped", None)
        assert "newer than the last time" in again["reason"]
        assert client.delete(f"{SCHEDULES}/nightly").status_code == 204
        assert client.get(SCHEDULES).json() == {"schedules": []}


def test_a_diagnosis_is_repeated(old: Settings) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        recordings = {"pattern": "*day.csv", "train": 2, "held_out": 1}
        put(client, newest(client, "diagnosis"), kind="diagnosis", cron="0 2 * * *", recordings=recordings)
        firing = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
        item = client.get(firing["item"]).json()
        assert (item["state"], len(item["recordings"]), len(item["held_out"])) == ("succeeded", 2, 1), item


def test_a_campaign_moves_the_arm_unless_somebody_has_it(old: Settings) -> None:
    controls = HandControls()
    with connected(create_app(old, InlineExecutor(), controls)) as client:
        try:
            put(client, newest(client, "campaign"), kind="campaign", cron="0 2 * * *")
            first = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
            assert (first["state"], first["reason"]) == ("started", None)
            second = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
            assert (second["state"], second["item"]) == ("skipped", None)
            assert "still goes on" in second["reason"]
            assert client.post(f"{first['item']}/stop").status_code == 202
        finally:
            controls.obey_from_now_on()


def test_a_schedule_waits_while_somebody_has_a_lease_of_its_arm(old: Settings) -> None:
    controls = HandControls()
    with connected(create_app(old, InlineExecutor(), controls)) as client:
        try:
            put(client, newest(client, "campaign"), kind="campaign", cron="0 2 * * *")
            campaigns = client.get(CAMPAIGNS).json()
            lease = client.post(LEASES, json={"robot": "snapshot-arm", "backend": "sim", "holder": "Ann"}).json()
            for way in ("as it was taken", "armed"):
                if way == "armed":
                    client.post(lease["links"]["arm"], headers={"Lease-Token": lease["token"]})
                firing = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
                assert (firing["state"], firing["item"]) == ("skipped", None)
                assert firing["reason"].startswith("snapshot-arm on sim: Ann has its lease")
            assert controls.started == []
            assert client.get(CAMPAIGNS).json() == campaigns
            client.delete(lease["links"]["self"], headers={"Lease-Token": lease["token"]})
            assert client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()["state"] == "started"
            # Now it is the other way round: nobody is given the arm that moves.
            assert_problem(client.post(LEASES, json={"robot": "snapshot-arm", "backend": "sim"}), "busy", 409)
        finally:
            controls.obey_from_now_on()


def test_a_schedule_outlives_what_it_was_made_from_and_the_service(old: Settings) -> None:
    with connected(create_app(old, InlineExecutor())) as client:
        like = newest(client, "identification")
        made = put(client, like, kind="identification", every_s=3600, recordings={"pattern": "*day.csv"})
        shutil.rmtree(old.data_folder / "identifications" / like)  # by hand: it is the active model
    with connected(create_app(old, InlineExecutor())) as client:
        assert client.get(f"{SCHEDULES}/nightly").json() == made
        firing = client.post(f"{SCHEDULES}/nightly/run", json=WHY).json()
        assert client.get(firing["item"]).json()["state"] == "succeeded"


@pytest.mark.parametrize("name", ["Nightly", "a b", "..", "a" * 64])
def test_a_name_that_is_none(name: str, client: TestClient) -> None:
    body = {"like": "x", "definition": {"kind": "campaign", "every_s": 60}}
    assert client.put(f"{SCHEDULES}/{name}", json=body).status_code in (404, 405, 422)


def test_what_is_not_there_and_what_makes_no_sense(client: TestClient) -> None:
    body = {"like": "x", "definition": {"kind": "campaign", "every_s": 60}}
    assert_problem(client.put(f"{SCHEDULES}/nightly", json=body), "not-found", 404)
    for path in ("nightly", "nightly/firings"):
        assert_problem(client.get(f"{SCHEDULES}/{path}"), "not-found", 404)
    assert_problem(client.post(f"{SCHEDULES}/nightly/run", json=WHY), "not-found", 404)
    assert_problem(client.delete(f"{SCHEDULES}/nightly"), "not-found", 404)
    body["definition"] = {"kind": "campaign", "cron": "0 25 * * *"}
    problem = assert_problem(client.put(f"{SCHEDULES}/nightly", json=body), "invalid-request", 422)
    assert "five fields" in problem["detail"]
    answer = client.post(IDENTIFICATIONS, json={"robot": ROBOT, "recordings": []})
    assert_problem(answer, "invalid-request", 422)
