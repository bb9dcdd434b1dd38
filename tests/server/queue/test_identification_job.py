"""The work of an identification job: files in, files out."""

import json
from pathlib import Path

import pytest

from server.queue.paper_files import PAPER_ROBOT, write_recording
from tauscope.export.formats import EXPORT_FILES, ExportFormat
from tauscope.identification import IdentificationDocument
from tauscope.server.queue.analyses import IdentificationOrder, IdentificationWorkspace
from tauscope.server.queue.task_job import OrderedRecording, perform_job
from tauscope.server.store.files import hash_file
from tauscope.tasks import identify as task
from tauscope.tasks.identify import IdentificationOptions

OPTIONS = IdentificationOptions(cutoff_hz=None)


@pytest.fixture
def workspace(tmp_path: Path) -> IdentificationWorkspace:
    folder = tmp_path / "job"
    folder.mkdir()
    workspace = IdentificationWorkspace(folder)
    workspace.prepare()
    (workspace.robot / "arm.yaml").write_bytes(PAPER_ROBOT.read_bytes())
    return workspace


@pytest.fixture
def server(tmp_path: Path) -> Path:
    folder = tmp_path / "server"
    folder.mkdir()
    return folder


def order(
    workspace: IdentificationWorkspace, *paths: Path, held_out: tuple[Path, ...] = (), robot: str = "arm.yaml"
) -> None:
    def ordered(path: Path) -> OrderedRecording:
        origin = "uploaded" if path.is_relative_to(workspace.folder) else "server"
        return OrderedRecording(name=path.name, origin=origin, sha256=hash_file(path))

    workspace.write_order(
        IdentificationOrder(
            robot_file=robot,
            robot_name="paper-arm",
            recordings=tuple(ordered(path) for path in paths),
            held_out=tuple(ordered(path) for path in held_out),
            options=OPTIONS,
        )
    )


def test_result_exports_and_steps(workspace: IdentificationWorkspace, server: Path) -> None:
    train = write_recording(workspace.uploads("recordings") / "train.csv", seed=1)
    test = write_recording(server / "test.csv", seed=2)
    order(workspace, train, held_out=(test,))
    assert perform_job(IdentificationWorkspace, server, workspace.folder) is None
    content = workspace.read_result()
    assert content is not None
    document = IdentificationDocument.model_validate_json(content)
    assert document.joints == ["joint1", "joint2", "joint3"]
    assert [entry.recording for entry in document.conditioning] == ["train.csv"]
    assert [entry.recording for entry in document.held_out_conditioning] == ["test.csv"]
    for friction, (stiction, viscous) in zip(document.friction, [(2.0, 0.5), (1.0, 0.277), (2.0, 0.03)], strict=True):
        for found, truth, std in (
            (friction.stiction, stiction, friction.std["stiction"]),
            (friction.viscous, viscous, friction.std["viscous"]),
        ):
            assert std is not None
            assert found == pytest.approx(truth, abs=5 * std)
    assert workspace.read_step() == "write result and exports"
    assert set(workspace.refused_exports()) == {"urdf"}
    written = {entry.name for entry in workspace.exports.iterdir()} - {"refused.json"}
    assert written == {EXPORT_FILES[kind].name for kind in ExportFormat} - {"model.urdf"}
    compensation = json.loads(workspace.read_export("friction.json"))
    assert compensation["recordings"] == [{"name": "train.csv", "sha256": hash_file(train)}]
    assert compensation["joints"][0]["torque"]["stiction"] == document.friction[0].stiction


def test_a_urdf_that_came_with_the_robot_is_patched(workspace: IdentificationWorkspace, server: Path) -> None:
    (workspace.robot / "arm.yaml").write_text(
        "name: slider\nkinematics: {urdf: {file: arm.urdf, base: base, tip: tool}}\n", encoding="utf-8"
    )
    (workspace.robot / "arm.urdf").write_text(
        '<robot name="slider"><!-- kept --><link name="base"/><link name="tool"/>'
        '<joint name="x" type="prismatic"><parent link="base"/><child link="tool"/><axis xyz="1 0 0"/>'
        '<limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>',
        encoding="utf-8",
    )
    order(workspace, _slider_recording(workspace.uploads("recordings") / "a.csv"))
    assert perform_job(IdentificationWorkspace, server, workspace.folder) is None
    assert workspace.refused_exports() == {}
    urdf = workspace.read_export("model.urdf").decode()
    assert "<!-- kept -->" in urdf
    assert "<inertial>" in urdf
    assert "<dynamics damping=" in urdf


def _slider_recording(path: Path) -> Path:
    """Five seconds of a mass of 2 kg that slides back and forth with friction."""
    import numpy as np

    t = np.arange(0, 5, 0.01)
    q = 0.3 * np.sin(2 * t) + 0.1 * np.sin(7 * t)
    v = 0.6 * np.cos(2 * t) + 0.7 * np.cos(7 * t)
    a = -1.2 * np.sin(2 * t) - 4.9 * np.sin(7 * t)
    force = 2.0 * a + 3.0 * v + 1.5 * np.tanh(300 * v) + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    np.savetxt(path, np.column_stack([t, q, force]), delimiter=",", header="t,q1,tau1", comments="", fmt="%.9g")
    return path


def spoil(path: Path, row: int, text: str) -> Path:
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[row - 1] = text
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_broken_recording_is_named_with_line_and_column_and_without_the_servers_folders(
    workspace: IdentificationWorkspace, server: Path, tmp_path: Path
) -> None:
    path = write_recording(workspace.uploads("recordings") / "broken.csv", seed=1)
    row = path.read_text(encoding="utf-8").splitlines()[99].split(",")
    order(workspace, spoil(path, 100, ",".join([*row[:3], "oops", *row[4:]])))
    problem = perform_job(IdentificationWorkspace, server, workspace.folder)
    assert problem is not None
    assert problem.code == "recording"
    assert problem.detail.startswith("broken.csv: line 100, column q3: ")
    assert str(tmp_path) not in problem.detail
    assert "\n" not in problem.detail
    assert workspace.read_result() is None


def test_a_recording_of_another_robot(workspace: IdentificationWorkspace, server: Path) -> None:
    order(workspace, _slider_recording(server / "slider.csv"))
    problem = perform_job(IdentificationWorkspace, server, workspace.folder)
    assert problem is not None
    assert problem.code == "recording-mismatch"
    assert problem.detail.startswith("slider.csv: ")


@pytest.mark.parametrize("change", ["edited", "removed", "replaced by a link"])
def test_a_recording_on_the_server_that_changed_meanwhile(
    change: str, workspace: IdentificationWorkspace, server: Path
) -> None:
    path = _slider_recording(server / "a.csv")
    order(workspace, path)
    if change == "edited":
        spoil(path, 3, "0.02,0,0")
    else:
        path.rename(server / "b.csv")
    if change == "replaced by a link":
        path.symlink_to(server / "b.csv")
    problem = perform_job(IdentificationWorkspace, server, workspace.folder)
    assert problem is not None
    assert (problem.code, problem.detail.split(":")[0]) == ("recording", "a.csv")
    assert "changed or removed" in problem.detail


def test_a_damaged_order(workspace: IdentificationWorkspace, server: Path) -> None:
    problem = perform_job(IdentificationWorkspace, server, workspace.folder)
    assert problem is not None
    assert "order.json" in problem.detail


def test_cancelled_work_stops_at_its_next_step(
    workspace: IdentificationWorkspace, server: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order(workspace, write_recording(server / "a.csv", seed=1))
    steps: list[str] = []
    write = IdentificationWorkspace.write_step

    def cancel_at_the_second(self: IdentificationWorkspace, step: str) -> None:
        steps.append(step)
        write(self, step)
        if len(steps) == 2:
            self.ask_to_stop()

    monkeypatch.setattr(IdentificationWorkspace, "write_step", cancel_at_the_second)
    problem = perform_job(IdentificationWorkspace, server, workspace.folder)
    assert problem is not None
    assert problem.code == "cancelled"
    assert len(steps) == 2
    assert workspace.read_result() is None


def test_unforeseen_failures_are_not_swallowed(
    workspace: IdentificationWorkspace, server: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order(workspace, _slider_recording(server / "a.csv"))

    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(task, "read_robot", fail)
    with pytest.raises(ZeroDivisionError):
        perform_job(IdentificationWorkspace, server, workspace.folder)


@pytest.mark.parametrize("damage", [b"", b"[]", b"{}", b'{"schema": "other/1"}', b"\xff", b"[" * 100_000])
def test_a_damaged_result_is_no_result(damage: bytes, workspace: IdentificationWorkspace) -> None:
    workspace.folder.joinpath("result.json").write_bytes(damage)
    assert workspace.read_result() is None
