"""The image built from its Dockerfile and run as compose runs it; and the README's commands on an empty machine.

No registry is asked: the Python image is a bare Debian of the same release with its Python 3.11, and wheels are fetched
before by this environment's own pip, so that nothing of this machine's way to them gets into an image.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ruamel.yaml import YAML

from deploy.containers import Podman, absent, as_composed, podman
from patience import eventually
from server.queue.paper_files import PAPER_ROBOT, write_recording
from shared_data import REPOSITORY
from tauscope.trajectory import Trajectory, trajectory_json
from tauscope.trajectory.segments import MoveSegment

DEPLOY = REPOSITORY / "deploy"
CONTAINER = DEPLOY / "container"
ERRAND = (REPOSITORY / "tests" / "deploy" / "errand.py").read_text(encoding="utf-8")

PYTHON_IMAGE = "docker.io/library/python:3.11-slim-bookworm"
MACHINE = "localhost/machine"
IMAGE = "localhost/tauscope"
PACKAGES = "ca-certificates,python3-venv,python-is-python3"

pytestmark = [
    pytest.mark.proof,  # test_container_files.py is the quick guard
    pytest.mark.system,
    pytest.mark.timeout(2400),  # the first of them builds everything for the others
    pytest.mark.skipif(bool(absent()), reason=absent()),
]


@pytest.fixture(scope="module")
def engine() -> Iterator[Podman]:
    with podman() as engine:
        yield engine


@pytest.fixture(scope="module")
def bare(engine: Podman, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Debian with Python only, under the name of the Python image; and a machine, which has systemd too."""
    folder = tmp_path_factory.mktemp("debian")
    python, machine = folder / "python.tar", folder / "machine.tar"
    left_out = "--exclude=./var/cache/apt/archives/* --exclude=./var/lib/apt/lists/*"
    hooks = [
        f'tar --one-file-system {left_out} -C "$1" -cf {python} .',
        'chroot "$1" apt-get install --yes --no-install-recommends systemd',
    ]
    command = ["mmdebstrap", "--quiet", "--variant=minbase", f"--include={PACKAGES}"]
    command += ["--aptopt=Acquire::Retries 3"]
    command += [*(f"--customize-hook={hook}" for hook in hooks), "bookworm", str(machine)]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    for file, name in ((python, PYTHON_IMAGE), (machine, MACHINE)):
        engine.call("import", "--quiet", str(file), name)
        file.unlink()


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Options that give pip the locked wheels, as long as a container is there and no longer."""
    folder = tmp_path_factory.mktemp("index")
    wheels, settings = folder / "wheels", folder / "pip.conf"
    fetch = [sys.executable, "-m", "pip", "download", "-q", "--only-binary=:all:", "--python-version=3.11"]
    fetch += ["--require-hashes", "-r", str(REPOSITORY / "constraints.txt"), "-d", str(wheels)]
    done = subprocess.run(fetch, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    settings.write_text("[global]\nno-index = true\nfind-links = /wheels\n")
    return [f"--volume={wheels}:/wheels:ro", f"--volume={settings}:/etc/pip.conf:ro"]


@pytest.fixture(scope="module")
def errand(tmp_path_factory: pytest.TempPathFactory) -> str:
    """An option that gives a container what it works with."""
    folder = tmp_path_factory.mktemp("errand")
    folder.chmod(0o755)  # it is read by nobody
    (folder / "arm.yaml").write_bytes(PAPER_ROBOT.read_bytes())
    write_recording(folder / "recording.csv", seed=1)
    move = MoveSegment(np.array([0.0, 0.6, 0.6]), np.array([0.5, 1.0, 0.0]), 2.0)
    motion = Trajectory("paper-arm", ("joint1", "joint2", "joint3"), (move,))
    (folder / "motion.json").write_text(trajectory_json(motion))
    return f"--volume={folder}:/errand:ro"


@pytest.fixture(scope="module")
def image(engine: Podman, bare: None, index: list[str]) -> str:
    """Built as deploy/README.md says; its health check is kept in Docker's own format only."""
    options = ["--pull=never", "--isolation=chroot", "--format=docker", "--layers=false", *index]
    file = ["--file", str(CONTAINER / "Dockerfile"), "--ignorefile", str(CONTAINER / "Dockerfile.dockerignore")]
    engine.call("build", *options, *file, "--tag", IMAGE, str(REPOSITORY), within_s=1100)
    return IMAGE


@pytest.fixture(scope="module")
def services() -> dict[str, dict[str, Any]]:
    return YAML(typ="safe", pure=True).load((CONTAINER / "compose.yaml").read_text(encoding="utf-8"))["services"]


@pytest.fixture(autouse=True)
def nothing_runs(engine: Podman) -> Iterator[None]:
    yield
    engine.clear()


def words(service: dict[str, Any]) -> list[str]:
    """The command of a service, as compose understands it where no variable is set."""
    return re.sub(r"\$\{\w+:-(\w+)\}", r"\1", service["command"]).split()


def documented(pattern: str) -> str:
    """What deploy/README.md says."""
    found = re.search(pattern, (DEPLOY / "README.md").read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert found is not None, pattern
    return found[1]


def add_key(engine: Podman, options: list[str]) -> str:
    """The first key, as deploy/README.md has it made."""
    command = documented(r"run --rm tauscope (tauscope key add [^\n]+)")
    return engine.call("run", "--rm", *options, IMAGE, *command.split()).strip()


def test_it_runs_as_nobody_and_holds_what_every_service_needs(
    engine: Podman, image: str, services: dict[str, dict[str, Any]]
) -> None:
    composed = as_composed(services["tauscope"])

    def inside(script: str) -> str:
        return engine.call("run", "--rm", *composed, image, "sh", "-ec", script)

    assert inside("id -u; id -Gn").split() == ["10001", "tauscope", "dialout"]
    assert re.search(r"CapBnd:\s+0+\n(.*\n)*NoNewPrivs:\s+1\n", inside("cat /proc/self/status"))
    assert "Read-only file system" in inside("touch /opt/tauscope/x 2>&1 || true")
    assert inside("ls -A /var/lib/tauscope; ls -d /source 2>/dev/null || true") == ""
    assert inside("ls -A /wheels; cat /etc/pip.conf") == ""  # mount points of this test's own build
    version = re.search(r'^version = "(.+)"$', (REPOSITORY / "pyproject.toml").read_text(), flags=re.MULTILINE)
    assert version is not None
    assert inside("tauscope --version").split() == ["tauscope", version[1]]
    assert inside("pip check") == "No broken requirements found.\n"
    assert "serve" in inside("tauscope --help")
    for program in ("dask scheduler", "dask worker"):
        assert "--help" in inside(f"{program} --help")
    assert inside("python -c 'import psycopg; print(psycopg.pq.__impl__)'") == "binary\n"


def test_the_service_works_ends_when_it_is_asked_to_and_comes_back_from_a_backup(
    engine: Podman, image: str, services: dict[str, dict[str, Any]], errand: str
) -> None:
    composed = as_composed(services["tauscope"])
    refused = engine.start("run", "--rm", *composed, image)
    assert refused.returncode != 0
    assert "tauscope key add" in refused.stderr
    key = add_key(engine, composed)
    engine.call("run", "--detach", "--name=service", *composed, errand, image, *words(services["tauscope"]))
    assert engine.healthy("service"), engine.log("service")
    for what in ("pages", "identify", "move"):
        engine.call("exec", "-i", "service", "python", "-", what, key, given=ERRAND, within_s=1100)
    engine.call("stop", "service")
    assert engine.call("inspect", "--format={{.State.ExitCode}}", "service").strip() == "0"
    assert "Finished server process" in engine.log("service")
    engine.call("rm", "service")
    script = (
        "cd /var/lib/tauscope; tauscope backup monday.tar.gz --data data; mv data lost;"
        " tauscope restore monday.tar.gz --data data; tauscope key list --data data"
    )
    assert "ann" in engine.call("run", "--rm", *composed, image, "sh", "-ec", script)


def test_a_worker_of_dask_does_the_analysis(
    engine: Podman, image: str, services: dict[str, dict[str, Any]], errand: str, tmp_path: Path
) -> None:
    """All three see one network and one volume, as in compose; names come from a file, as the network has none."""
    found = re.search(r"DASK_SCHEDULER_ADDRESS=(\S+)", (CONTAINER / "compose.yaml").read_text(encoding="utf-8"))
    assert found is not None
    (tmp_path / "hosts").write_text("127.0.0.1 localhost scheduler\n")
    shared = [f"--volume={tmp_path / 'hosts'}:/etc/hosts:ro", errand]

    def begin(name: str, *options: str) -> None:
        told = [*as_composed(services[name]), *shared, *options, image, *words(services[name])]
        engine.call("run", "--detach", f"--name={name}", *told, environment={"DASK_SCHEDULER_ADDRESS": found[1]})

    key = add_key(engine, as_composed(services["tauscope"]))
    begin("scheduler")
    assert eventually(lambda: "Scheduler at" in engine.log("scheduler"), 60), engine.log("scheduler")
    begin("tauscope", "--network=container:scheduler")
    assert engine.healthy("tauscope"), engine.log("tauscope")
    job = engine.call("exec", "-i", "tauscope", "python", "-", "hand-in", key, given=ERRAND)
    begin("worker", "--network=container:scheduler")
    engine.call("exec", "-i", "tauscope", "python", "-", "follow", key, job, given=ERRAND, within_s=1100)


def test_what_the_readme_says_makes_a_service_of_an_empty_machine(
    engine: Podman, bare: None, index: list[str], errand: str
) -> None:
    """Debian boots, the commands are typed in, the unit runs hardened, is started anew when it hangs."""
    machine = [f"--volume={REPOSITORY}:/source:ro", *index, errand, MACHINE, "/lib/systemd/systemd"]
    # What systemd needs in order to shut services in; what it asks of the kernel for all machines stays out of reach.
    rights = ["--systemd=always", "--cap-add=SYS_ADMIN", "--security-opt=seccomp=unconfined"]
    engine.call("run", "--detach", "--name=machine", *rights, "--security-opt=apparmor=unconfined", *machine)

    def shell(script: str, within_s: float = 400) -> str:
        return engine.call("exec", "-i", "--workdir=/source", "machine", "bash", "-e", given=script, within_s=within_s)

    def property_of_unit(name: str) -> str:
        return engine.start("exec", "machine", "systemctl", "show", "tauscope", "--value", "-p", name).stdout.strip()

    booted = ("exec", "machine", "systemctl", "is-system-running")
    assert eventually(lambda: engine.start(*booted).stdout == "running\n", 60), engine.start(*booted)
    shell(documented(r"^On a machine, .*?```sh\n(.+?)```"), within_s=1200)
    status = shell(f"cat /proc/{property_of_unit('MainPID')}/status")
    assert re.search(r"CapBnd:\s+0+\n(.*\n)*NoNewPrivs:\s+1\nSeccomp:\s+2\n", status), status
    for what in ("pages", "identify", "move"):
        engine.call("exec", "-i", "machine", "/opt/tauscope/bin/python", "-", what, given=ERRAND, within_s=1100)
    shell(f"kill -STOP {property_of_unit('MainPID')}")
    assert eventually(lambda: property_of_unit("NRestarts") == "1", 60)
    assert eventually(lambda: property_of_unit("ActiveState") == "active", 60), shell("journalctl -u tauscope")
    shell("systemctl stop tauscope")
    assert property_of_unit("Result") == "success", shell("journalctl -u tauscope")
