"""The client against the service behind a real socket: every verb, problems, a lease kept and lost."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from server.auth.keyed import make_keys
from server.conftest import inline_readers
from server.http.contract.running import running
from server.http.motions import ROBOT, ROBOT_FILE, move_document
from server.queue.controls import HandControls
from server.queue.executors import InlineExecutor
from server.queue.waiting import wait_until
from tauscope.client import ApiError, Client, HeldLease
from tauscope.client.client import ENDS
from tauscope.client.transport import Transport, form_content
from tauscope.runtime.states import RunState
from tauscope.server.auth.keys import Scope
from tauscope.server.http import Settings, create_app
from tauscope.server.queue.job_folder import JobState

__all__ = ["inline_readers"]


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_folder=tmp_path / "data", max_upload_bytes=4 * 2**20)


@pytest.fixture
def controls() -> HandControls:
    return HandControls()


@pytest.fixture
def address(settings: Settings, controls: HandControls) -> Iterator[str]:
    """A service that asks for keys."""
    make = create_app(settings, InlineExecutor(), controls)
    with running(make) as address:
        try:
            yield address
        finally:
            controls.obey_from_now_on()


@pytest.fixture
def keys(settings: Settings) -> dict[Scope, str]:
    return make_keys(settings.data_folder)


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "arm.yaml"
    path.write_bytes(ROBOT_FILE)
    return path


@pytest.fixture
def motion(tmp_path: Path) -> Path:
    path = tmp_path / "motion.json"
    path.write_text(json.dumps(move_document()))
    return path


@pytest.fixture
def mover(keys: dict[Scope, str], address: str) -> Client:
    return Client(address, keys[Scope.MOVE])


def test_an_arm_is_taken_moved_and_given_back(
    mover: Client, controls: HandControls, robot: Path, motion: Path, tmp_path: Path
) -> None:
    assert mover.is_ready()
    assert mover.check_robot(robot).name == ROBOT["name"]
    with pytest.raises(ApiError) as refused:
        mover.run(robot, trajectory=motion)
    assert (refused.value.problem_code, refused.value.status) == ("lease-needed", 428)
    with mover.lease(ROBOT["name"], ttl_s=30.0) as lease:
        with pytest.raises(ApiError) as refused:
            mover.run(robot, lease, motion)
        assert refused.value.problem_code == "not-armed"
        mover.arm(lease)
        run = mover.run(robot, lease, motion, rate_hz=250.0)
        assert run.options is not None
        assert run.options.rate_hz == 250.0
        controls.next().finish()
        run = mover.wait(run, timeout_s=20.0, lease=lease)
        assert run.state == "finished"
        file = mover.fetch(run.links.recordings["csv"], tmp_path / "run.csv")
        assert file.read_text().startswith("t,q1")
        assert mover.keep_recording(file).name == "run.csv"
    with mover.lease(ROBOT["name"]) as again:
        assert again.lease.number == lease.lease.number + 1


def test_stops(mover: Client, keys: dict[Scope, str], address: str, controls: HandControls, robot: Path,
               motion: Path) -> None:  # fmt: skip
    reader = Client(address, keys[Scope.READ])
    with mover.lease(ROBOT["name"]) as lease:
        mover.arm(lease)
        run = mover.run(robot, lease, motion)
        control = controls.next()
        assert reader.stop(run).id == run.id
        assert reader.stop_everything().runs == [run.id]
        assert control.stops == 2
        control.finish(RunState.STOPPED)
        assert mover.wait(run, timeout_s=20.0).state == "stopped"


def test_a_lease_that_somebody_took_is_known_to_be_lost(mover: Client, keys: dict[Scope, str], address: str) -> None:
    admin = Client(address, keys[Scope.ADMIN])
    with mover.lease(ROBOT["name"], ttl_s=1.0) as lease, admin.lease(ROBOT["name"], take=True) as taken:
        wait_until(lambda: lease.lost is not None)
        with pytest.raises(ApiError) as lost:
            lease.require()
        assert lost.value.problem_code == "lease-lost"
        taken.require()


def test_a_lease_is_kept_by_its_heartbeats(mover: Client) -> None:
    beats: list[int] = []
    taken = mover.lease(ROBOT["name"], ttl_s=1.0)

    def beat() -> None:
        beats.append(1)
        if len(beats) == 2:
            raise ApiError("unreachable", 0, "lost on the way")

    with HeldLease(taken.lease, beat, lambda: beats.append(-1)) as held:
        wait_until(lambda: len(beats) >= 4)
        assert held.lost is None
    assert beats[-1] == -1


def test_a_request_whose_answer_was_lost_is_done_once(
    settings: Settings, robot: Path, motion: Path, controls: HandControls, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, tries = Transport.send, []

    def lossy(self: Transport, method: str, path: str, **arguments: object) -> object:
        answer = send(self, method, path, **arguments)  # type: ignore[arg-type]
        tries.append(path)
        if len(tries) == 1:
            raise ApiError("unreachable", 0, "the answer was lost")
        return answer

    monkeypatch.setattr(Transport, "send", lossy)
    controls.obey = True
    with running(create_app(settings, InlineExecutor(), controls)) as address:
        run = Client(address).run(robot, trajectory=motion)
        controls.next()
        assert tries == ["/api/v1/runs"] * 2
        assert len(controls.started) == 1
        assert run.robot == ROBOT["name"]


@pytest.mark.parametrize("url", ["", "127.0.0.1:8000", "ftp://x", "http://x/path", "http://x?q=1"])
def test_addresses_that_are_none(url: str) -> None:
    with pytest.raises(ValueError, match="no address"):
        Client(url)


def test_a_key_never_goes_over_the_network_in_clear() -> None:
    with pytest.raises(ValueError, match="in clear"):
        Client("http://arm3.example:8000", "tsk_1_x")


def test_nobody_there() -> None:
    client = Client("http://127.0.0.1:9", timeout_s=5.0)
    assert not client.is_ready()
    with pytest.raises(ApiError, match="is the service up") as error:
        client.stop_everything()
    assert error.value.problem_code == "unreachable"


def test_forms_state_their_length(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_bytes(b"x" * 700_000)
    content = form_content({"a": 1}, [("file", file)])
    assert content.length == len(b"".join(content.pieces()))


def test_every_end_is_known() -> None:
    ends = {state.value for kind in (RunState, JobState) for state in kind if state.is_end}
    assert ends <= ENDS
