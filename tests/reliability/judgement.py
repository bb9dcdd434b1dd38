"""What has to be true of a service in which nothing is wrong any more, whatever was wrong before."""

from concurrent.futures import wait
from typing import Any

from reliability.ledger import HandedInJob, KeptRecording, Ledger
from reliability.requests import IDENTIFICATIONS, RECORDINGS, BrokenPromiseError, Note, Requests
from tauscope.server.http.services import Services
from tauscope.server.queue.job_folder import Workspace
from tauscope.server.queue.queue import MOST_ATTEMPTS
from tauscope.server.store.files import hash_file

PATIENCE_S = 100.0
GOES_ON = ("queued", "running")
LIVING = ("state.json", "events.jsonl", "progress", "progress.part", "cancel")
"""Files of a job that say nothing of its result, so that no hash of them is kept."""


class Judge:
    """Looks at everything that the service shows, and at the files that it speaks of."""

    def __init__(self, requests: Requests, services: Services, ledger: Ledger, note: Note) -> None:
        self._requests, self._services, self._ledger, self._note = requests, services, ledger, note

    def check(self) -> None:
        """Nothing is lost, nothing is stuck, every state is true; what was damaged is shown so, and then removed."""
        self._wait_for_jobs()
        changed = {item.identifier for item in self._services.index.check()} if self._may_be_damage() else set()
        self._check_recordings()
        self._check_jobs(changed)
        self._check_index()
        self._note("over", "", "")

    def _may_be_damage(self) -> bool:
        recordings, jobs = self._ledger.recordings.values(), self._ledger.jobs.values()
        return any(each.may_be_damaged for each in recordings) or any(each.damage for each in jobs)

    def _jobs(self) -> dict[str, dict[str, Any]]:
        answer = self._requests.ask("GET", IDENTIFICATIONS, params={"limit": 1000})
        _require(answer.status_code == 200, f"the list of jobs: {answer.text}")
        return {each["id"]: each for each in answer.json()["identifications"]}

    def _wait_for_jobs(self) -> None:
        """Until nothing is worked on any more; what waits then, waits for ever.

        A look may begin what was interrupted, and another one may still write down what has ended: two find nothing.
        """
        queue, quiet = self._services.jobs, 0
        while quiet < 2:
            queue.settle()
            running = list(queue._running.values())
            quiet = 0 if running else quiet + 1
            _require(not wait(running, PATIENCE_S).not_done, "work does not come to an end")
        stuck = [f"{each['id']} is {each['state']}" for each in self._jobs().values() if each["state"] in GOES_ON]
        _require(not stuck and queue.waiting() == 0, f"stuck: {stuck}, {queue.waiting()} wait")

    def _check_recordings(self) -> None:
        listed = {each["name"]: each for each in self._requests.ask("GET", RECORDINGS).json()["recordings"]}
        unknown = listed.keys() - self._ledger.recordings.keys()
        _require(not unknown, f"recordings that nobody sent: {unknown}")
        for name, recording in list(self._ledger.recordings.items()):
            if name in listed:
                self._check_recording(name, recording, listed[name])
            else:
                _require(not recording.is_sure or recording.going, f"recording {name} is lost")
                self._note("forget_recording", name, "")

    def _check_recording(self, name: str, recording: KeptRecording, shown: dict[str, Any]) -> None:
        if shown["sha256"] is None:
            shown = self._requests.ask("GET", f"{RECORDINGS}/{name}").json()
        is_sound = hash_file(self._services.settings.recordings_folder / name) == recording.sha256
        _require(is_sound or recording.may_be_damaged, f"recording {name} has other bytes")
        _require(shown["is_damaged"] is not is_sound, f"recording {name}, sound: {is_sound}, is shown as {shown}")
        if is_sound:
            _require(shown["sha256"] == recording.sha256, f"recording {name}: another hash is shown")
            if not recording.is_sure or recording.going or recording.may_be_damaged:
                self._note("kept", name, "")
            return
        self._note("remove_recording", name, "")
        _require(self._requests.ask("DELETE", f"{RECORDINGS}/{name}").status_code == 204, f"{name} cannot be removed")
        self._note("forget_recording", name, "")

    def _check_jobs(self, changed: set[str]) -> None:
        shown = self._jobs()
        unknown = shown.keys() - self._ledger.jobs.keys()
        _require(len(unknown) <= self._ledger.begun, f"jobs that nobody handed in: {unknown}")
        for identifier in unknown:
            self._note("found", identifier, "")
        for identifier, job in list(self._ledger.jobs.items()):
            if identifier not in shown:
                _require(job.going, f"job {identifier} is lost")
                self._note("forget_job", identifier, "")
            elif job.damage is not None:
                self._check_damaged(identifier, job, shown[identifier]["state"], changed)
            else:
                self._check_job(identifier, job, shown[identifier])

    def _check_job(self, identifier: str, job: HandedInJob, shown: dict[str, Any]) -> None:
        state, code = shown["state"], (shown["problem"] or {}).get("code")
        what = f"job {identifier}: {state} {code}"
        _require(job.ended in (None, state), f"{what}, but it had ended: {job.ended}")
        if job.ended is not None:
            return
        result = self._requests.ask("GET", f"{IDENTIFICATIONS}/{identifier}/result", told=code in job.may_be)
        if state == "succeeded":
            _require(result.status_code == 200, f"{what}, without result: {result.text}")
            made_from = [each["sha256"] for each in shown["recordings"]]
            _require(result.json()["made_from"] == made_from, f"{what}, with the result of another")
            return
        is_true = {
            "failed": code in job.may_be,
            "cancelled": job.going,
            "interrupted": job.kills >= MOST_ATTEMPTS or "interrupted" in job.may_be,
        }.get(state, False)
        _require(is_true, f"{what}; true could be {job}")
        _require(result.status_code >= 400, f"{what}, with a result")

    def _check_damaged(self, identifier: str, job: HandedInJob, state: str, changed: set[str]) -> None:
        """It is shown as damaged, or as what it was: then a file was changed that says nothing of it."""
        assert job.damage is not None
        before, _, name = job.damage.partition(" ")
        path = self._services.items["identification"].folder(identifier) / name
        is_seen = job.ended is None or name in LIVING or hash_file(path) == before or identifier in changed
        _require(is_seen, f"job {identifier}: nobody sees that {name} was changed")
        _require(job.ended is None or state in (job.ended, "damaged"), f"job {identifier}: {job.ended}, now {state}")
        self._note("remove_job", identifier, "")
        for _ in range(3):
            if self._requests.ask("DELETE", f"{IDENTIFICATIONS}/{identifier}").status_code == 404:
                break
        _require(identifier not in self._jobs(), f"job {identifier} is damaged and cannot be removed")
        self._note("forget_job", identifier, "")

    def _check_index(self) -> None:
        """The index says what the folders say, and whoever follows a job hears of its end."""
        query = {"kind": "identification", "limit": 1000}
        indexed = {
            each["id"]: each["state"]
            for each in self._requests.ask("GET", "/api/v1/items", params=query).json()["items"]
        }
        states = {identifier: each["state"] for identifier, each in self._jobs().items()}
        _require(
            indexed == states,
            f"the index says {indexed.items() - states.items()}, the folders {states.items() - indexed.items()}",
        )
        for identifier, state in states.items():
            if self._ledger.jobs[identifier].ended is None:
                self._note("ended", identifier, state)

    def check_ends_told(self) -> None:
        """After a start, the events of every job that has ended say so."""
        for identifier, job in self._ledger.jobs.items():
            if job.damage is None and job.ended is not None:
                workspace = Workspace(self._services.items["identification"].folder(identifier))
                _require(workspace.has_told_end(), f"job {identifier}: its end was never told")


def _require(is_so: bool, otherwise: str) -> None:
    if not is_so:
        raise BrokenPromiseError(otherwise)
