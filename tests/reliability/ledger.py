"""What the service has said that it did: against this, everything that it shows later is judged."""

from dataclasses import dataclass, field


@dataclass
class KeptRecording:
    """A recording that was sent. `is_sure` from the answer on; `going` from the request to remove it on.

    `is_vouched_for` until that was damaged which the service had written down of it: damage to both is not promised.
    """

    sha256: str
    is_sure: bool = False
    going: bool = False
    may_be_damaged: bool = False
    is_vouched_for: bool = True


@dataclass
class HandedInJob:
    """A job that was taken. `may_be` are reasons for which it may fail; `ended` is the end that was shown.

    `damage` is the file that may have been damaged, behind the hash that it had before.
    """

    may_be: set[str] = field(default_factory=set)
    kills: int = 0
    ended: str | None = None
    going: bool = False
    damage: str | None = None


@dataclass
class Ledger:
    """Kept by who sends the requests, and once more by who kills it: `note` does the same to both."""

    recordings: dict[str, KeptRecording] = field(default_factory=dict)
    jobs: dict[str, HandedInJob] = field(default_factory=dict)
    begun: int = 0
    """Requests for a job that were not answered: each may have left one that nobody knows."""
    excuses: set[str] = field(default_factory=set)
    """Reasons for which any job may fail as long as the present fault lasts."""
    events: list[tuple[str, str, str]] = field(default_factory=list)
    """All that was noted, in its order: for who looks for what broke a promise."""

    def note(self, what: str, key: str, value: str = "") -> None:
        """Take an event down, by its name."""
        self.events.append((what, key, value))
        getattr(self, f"_{what}")(key, value)

    def unfinished(self) -> list[HandedInJob]:
        return [job for job in self.jobs.values() if job.ended is None]

    def _send(self, name: str, sha256: str) -> None:
        self.recordings[name] = KeptRecording(sha256)

    def _kept(self, name: str, _: str) -> None:
        known = self.recordings[name]
        known.is_sure, known.going, known.may_be_damaged = True, False, False

    def _forget_recording(self, name: str, _: str) -> None:
        self.recordings.pop(name, None)

    def _remove_recording(self, name: str, _: str) -> None:
        self.recordings[name].going = True
        self._excuse("recording", "")

    def _damage_recording(self, name: str, _: str) -> None:
        self.recordings[name].may_be_damaged = True
        self._excuse("recording", "")

    def _begin(self, _: str, __: str) -> None:
        self.begun += 1

    def _refused(self, _: str, __: str) -> None:
        self.begun -= 1

    def _taken(self, identifier: str, _: str) -> None:
        self.begun -= 1
        self.jobs[identifier] = HandedInJob(may_be=set(self.excuses))

    def _found(self, identifier: str, _: str) -> None:
        """One of those whose request was not answered; what it was made from may be gone by now."""
        self.begun -= 1
        self.jobs[identifier] = HandedInJob(may_be={"storage-full", "worker-lost", "recording", "interrupted"})

    def _remove_job(self, identifier: str, _: str) -> None:
        self.jobs[identifier].going = True

    def _forget_job(self, identifier: str, _: str) -> None:
        self.jobs.pop(identifier, None)

    def _damage_memory(self, name: str, _: str) -> None:
        self.recordings[name].is_vouched_for = False

    def _damage_job(self, identifier: str, what: str) -> None:
        self.jobs[identifier].damage = what

    def _ended(self, identifier: str, state: str) -> None:
        self.jobs[identifier].ended = state

    def _excuse(self, code: str, _: str) -> None:
        """Whatever has not ended may fail for this reason, and whatever is handed in before the fault is over."""
        self.excuses.add(code)
        for job in self.unfinished():
            job.may_be.add(code)

    def _over(self, _: str, __: str) -> None:
        self.excuses.clear()

    def _killed(self, _: str, __: str) -> None:
        for job in self.unfinished():
            job.kills += 1
