"""The verbs of the service, one method each; answers are the models that the service itself makes them from."""

import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar
from urllib.parse import quote

from pydantic import TypeAdapter

from tauscope.client.transport import Answer, ApiError, Content, Transport, form_content, json_content
from tauscope.robot import RobotReport
from tauscope.server.http.analyses import DiagnosisAnswer, IdentificationAnswer, RolloutAnswer
from tauscope.server.http.campaigns import CampaignAnswer
from tauscope.server.http.excitations import ExcitationAnswer
from tauscope.server.http.leases import LeaseAnswer, StopAllAnswer
from tauscope.server.http.recordings import RecordingAnswer
from tauscope.server.http.runs import RunAnswer, StopAnswer

BEATS_A_TTL = 3.0
"""Heartbeats in the time that the lease lasts without one."""


class HeldLease:
    """A lease kept by heartbeats; use it as a context. When the program hangs or dies, the arm stops by itself."""

    def __init__(self, lease: LeaseAnswer, beat: Callable[[], object], release: Callable[[], object]) -> None:
        self.lease = lease
        self.lost: str | None = None
        self._beat, self._release = beat, release
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._keep, name=lease.id, daemon=True)

    @property
    def token(self) -> str:
        """What to send as header ``Lease-Token``."""
        return self.lease.token or ""

    def require(self) -> None:
        """Refuse to go on with a lease that was lost. Raises ApiError if it was."""
        if self.lost is not None:
            raise ApiError("lease-lost", 409, self.lost)

    def __enter__(self) -> "HeldLease":
        """Keep the lease from now on."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the lease back; what still moves by it stops."""
        self._is_over.set()
        self._thread.join()
        if self.lost is None:
            try:
                self._release()
            except ApiError:
                # It ends by itself; what happened inside the context is more important.
                return

    def _keep(self) -> None:
        """Renew the lease until it is over or lost; a beat that got lost on the way is made up for by the next."""
        while not self._is_over.wait(self.lease.ttl_s / BEATS_A_TTL):
            try:
                self._beat()
            except ApiError as error:
                if error.problem_code == "lease-lost":
                    self.lost = error.detail
                    return


PREFIX = "/api/v1"
ENDS = frozenset(
    {"finished", "degraded", "stopped", "failed", "interrupted", "succeeded", "cancelled", "damaged"},
)
"""States after which nothing happens any more."""

POLL_S = 0.2
"""How often the service is asked again [s]."""

SETTLING_S = 10.0
"""How long what has ended may take until its files can be fetched [s]."""

Model = TypeVar("Model")
Followed = TypeVar(
    "Followed", RunAnswer, CampaignAnswer, IdentificationAnswer, DiagnosisAnswer, RolloutAnswer, ExcitationAnswer
)  # what has a state


class Client:
    """One service. Methods may be called from several threads at once; each raises `ApiError` where it is refused."""

    def __init__(
        self, url: str = "http://127.0.0.1:8000", key: str | None = None, *, timeout_s: float = 30.0,
        ca_file: Path | None = None,
    ) -> None:  # fmt: skip
        """Name the service; nothing is sent yet. `timeout_s`: how long each step of a request may take [s]."""
        self._transport = Transport(url, key, timeout_s, ca_file)

    def is_ready(self) -> bool:
        """Whether the service is there and can work."""
        try:
            self._transport.send("GET", "/readyz")
        except ApiError:
            return False
        return True

    def check_robot(self, robot: Path, urdf: Path | None = None) -> RobotReport:
        """Have a robot file checked."""
        files = [("robot", robot), *([("urdf", urdf)] if urdf else [])]
        return self._post("robots/check", RobotReport, form_content(None, files))

    def keep_recording(self, recording: Path) -> RecordingAnswer:
        """Send a recording, to be named by later requests."""
        return self._create("recordings", RecordingAnswer, form_content(None, [("file", recording)]))

    def identify(self, robot: Path, recordings: Sequence[Path], **request: Any) -> IdentificationAnswer:
        """Hand in an identification."""
        files = [("robot", robot), *(("recordings", path) for path in recordings)]
        return self._create("identifications", IdentificationAnswer, form_content(request, files))

    def diagnose(self, robot: Path, recordings: Sequence[Path], **request: Any) -> DiagnosisAnswer:
        """Hand in a diagnosis."""
        files = [("robot", robot), *(("recordings", path) for path in recordings)]
        return self._create("diagnoses", DiagnosisAnswer, form_content(request, files))

    def rollout(
        self, robot: Path, recordings: Sequence[Path], model: Path | None = None, **request: Any
    ) -> RolloutAnswer:
        """Hand in a rollout."""
        files = [("robot", robot), *(("recordings", path) for path in recordings)]
        files += [("model", model)] if model else []
        return self._create("rollouts", RolloutAnswer, form_content(request, files))

    def excite(self, robot: Path, **request: Any) -> ExcitationAnswer:
        """Have a motion designed."""
        return self._create("excitations", ExcitationAnswer, form_content(request, [("robot", robot)]))

    def run(
        self, robot: Path, lease: HeldLease | None = None, trajectory: Path | None = None, **request: Any
    ) -> RunAnswer:
        """Begin a run: the arm moves."""
        files = [("robot", robot), *([("trajectory", trajectory)] if trajectory else [])]
        return self._create("runs", RunAnswer, form_content(request, files), _lease_header(lease))

    def campaign(self, robot: Path, lease: HeldLease | None = None, **request: Any) -> CampaignAnswer:
        """Begin a campaign: the arm moves."""
        content = form_content(request, [("robot", robot)])
        return self._create("campaigns", CampaignAnswer, content, _lease_header(lease))

    def wait(self, item: Followed, timeout_s: float | None = None, lease: HeldLease | None = None) -> Followed:
        """Wait until a job, run or campaign has ended, or raise TimeoutError. `timeout_s`: for good where None [s]."""
        last = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            item = _parse(self._transport.send("GET", item.links.self_), type(item))
            if str(item.state) in ENDS:
                return item
            if lease is not None:
                lease.require()
            if last is not None and time.monotonic() > last:
                raise TimeoutError(f"{item.id} is {item.state} after {timeout_s:g} s")
            time.sleep(POLL_S)

    def fetch(self, link: str, to: Path) -> Path:
        """Fetch a file, as links in answers name it; waits a moment where the service still puts it in its place."""
        last = time.monotonic() + SETTLING_S
        while True:
            try:
                to.write_bytes(self._transport.send("GET", link).body)
                return to
            except ApiError as error:
                if error.problem_code != "not-finished" or time.monotonic() > last:
                    raise
            time.sleep(POLL_S)

    def lease(self, robot: str, *, backend: str | None = None, ttl_s: float = 10.0, take: bool = False) -> HeldLease:
        """Take an arm; the lease is kept within the context. `ttl_s`: until it stops when this program is gone [s]."""
        wanted = {"robot": robot, "backend": backend, "ttl_s": ttl_s, "take": take}
        taken = self._create("leases", LeaseAnswer, json_content(wanted))
        headers = {"Lease-Token": taken.token or ""}
        return HeldLease(
            taken,
            lambda: self._transport.send("POST", taken.links.heartbeat, headers=headers),
            lambda: self._transport.send("DELETE", taken.links.self_, headers=headers),
        )

    def arm(self, lease: HeldLease) -> None:
        """Let the arm move."""
        self._transport.send("POST", lease.lease.links.arm, headers=_lease_header(lease))

    def stop(self, run: RunAnswer) -> StopAnswer:
        """Stop a run."""
        return _parse(self._transport.send("POST", run.links.stop), StopAnswer)

    def stop_everything(self) -> StopAllAnswer:
        """Stop every arm; needs no lease."""
        return self._post("stop", StopAllAnswer, Content("", (), 0))

    def _create(
        self, path: str, kind: type[Model], content: Content, headers: Mapping[str, str] | None = None
    ) -> Model:
        """A POST that is done once, also where its answer gets lost and it is sent again."""
        once = {"Idempotency-Key": uuid.uuid4().hex, **(headers or {})}
        send: Callable[[], Answer] = lambda: self._transport.send(  # noqa: E731
            "POST", f"{PREFIX}/{path}", headers=once, content=content
        )
        try:
            return _parse(send(), kind)
        except ApiError as error:
            if error.problem_code != "unreachable":
                raise
        return _parse(send(), kind)

    def _post(self, path: str, kind: type[Model], content: Content) -> Model:
        """A POST that is sent once."""
        return _parse(self._transport.send("POST", f"{PREFIX}/{quote(path)}", content=content), kind)


def _parse(answer: Answer, kind: type[Model]) -> Model:
    """An answer as its model; one of a newer service may hold more than we know."""
    try:
        return TypeAdapter(kind).validate_json(answer.body, extra="ignore")
    except ValueError:
        raise ApiError("unknown", answer.status, "the answer is not as documented; are both of one version?") from None


def _lease_header(lease: HeldLease | None) -> dict[str, str]:
    """The header by which an arm moves."""
    return {} if lease is None else {"Lease-Token": lease.token}
