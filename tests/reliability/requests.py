"""Requests drawn at random, as a client sends them that writes down what it was answered."""

import hashlib
import random
from collections.abc import Callable
from typing import Any

from starlette.testclient import TestClient

from reliability.ledger import Ledger
from server.http.motions import ROBOT

RECORDINGS = "/api/v1/recordings"
IDENTIFICATIONS = "/api/v1/identifications"

Note = Callable[[str, str, str], None]


class BrokenPromiseError(AssertionError):
    """The service broke a promise."""


class Requests:
    """A client of one service."""

    def __init__(self, client: TestClient, ledger: Ledger, note: Note, chance: random.Random) -> None:
        self._client, self._ledger, self._chance = client, ledger, chance
        self._note = note
        self.is_faulty = False
        """Whether a fault is on: then a request may be refused, in words, with a status that says so."""

    def ask(self, method: str, path: str, *, told: bool = False, **content: Any) -> Any:
        """An answer. It is never 500, and while nothing is wrong no other failure of the service's either.

        `told`: what is answered is the truth about a job that failed, whose code may stand for such a status.
        """
        answer = self._client.request(method, path, **content)
        refusals = (503, 507) if self.is_faulty else (500, 507) if told else ()
        if answer.status_code >= 500 and answer.status_code not in refusals:
            raise BrokenPromiseError(f"{method} {path}: {answer.status_code} {answer.text}")
        return answer

    def some(self, count: int) -> None:
        """A few requests."""
        for _ in range(count):
            self._chance.choice((self.send, self.send, self.hand_in, self.hand_in, self.remove, self.end, self.look))()

    def send(self) -> None:
        """A recording, of a new name."""
        name = f"r{self._chance.getrandbits(48):012x}.csv"
        content = b"t,q1,tau1\n" + self._chance.randbytes(self._chance.randrange(1, 3000))
        self._note("send", name, hashlib.sha256(content).hexdigest())
        answer = self.ask("POST", RECORDINGS, files={"file": (name, content)})
        if answer.status_code == 201:
            self._note("kept", name, "")

    def hand_in(self) -> None:
        """A job about a recording that is there."""
        sound = [name for name, each in self._ledger.recordings.items() if each.is_sure and not each.going]
        if not sound:
            return self.send()
        self._note("begin", "", "")
        body = {"robot": ROBOT, "recordings": [self._chance.choice(sound)]}
        answer = self.ask("POST", IDENTIFICATIONS, json=body)
        if answer.status_code == 202:
            self._note("taken", answer.json()["id"], "")
        else:
            self._note("refused", "", "")

    def remove(self) -> None:
        """A recording."""
        known = [name for name, each in self._ledger.recordings.items() if each.is_sure]
        if len(known) < 3:
            return self.look()
        name = self._chance.choice(known)
        self._note("remove_recording", name, "")
        if self.ask("DELETE", f"{RECORDINGS}/{name}").status_code in (204, 404):
            self._note("forget_recording", name, "")

    def end(self) -> None:
        """A job: cancelled or removed."""
        if not self._ledger.jobs:
            return self.look()
        identifier = self._chance.choice(list(self._ledger.jobs))
        self._note("remove_job", identifier, "")
        if self.ask("DELETE", f"{IDENTIFICATIONS}/{identifier}").status_code in (204, 404):
            self._note("forget_job", identifier, "")

    def look(self) -> None:
        """At everything."""
        for path in (RECORDINGS, IDENTIFICATIONS, "/api/v1/items", "/healthz"):
            self.ask("GET", path)
