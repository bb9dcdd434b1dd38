"""Containers without a daemon: Podman with a store of its own, and services of the compose file as it runs them."""

import os
import resource
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PROGRAMS = ("mmdebstrap", "podman", "runc")
"""Debian packages of the same names."""

READ_ELSEWHERE = {"image", "build", "command", "profiles", "depends_on", "networks", "restart"}
"""What a service of the compose file says of its place among the others: the test puts it there."""


def absent() -> str:
    """What keeps this machine from building and running containers; nothing where it can."""
    if os.geteuid() != 0:
        return "containers need root"
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    return f"not installed: {', '.join(missing)}" if missing else ""


ENOUGH = {"nofile": 4096, "nproc": 16384}
"""Limits of a container; by itself Podman asks for more, to which not every root has the right."""


def limits() -> list[str]:
    """`ENOUGH`, as far as this process has it itself."""
    own = {name: resource.getrlimit(getattr(resource, f"RLIMIT_{name.upper()}"))[1] for name in ENOUGH}
    lower = {name: min(ENOUGH[name], limit) if limit >= 0 else ENOUGH[name] for name, limit in own.items()}
    return [f"{name}={limit}:{limit}" for name, limit in lower.items()]


class Podman:
    """Images and containers below one folder; nothing of them is seen by other users of Podman."""

    def __init__(self, folder: Path) -> None:
        """The folder's path has to be short: sockets lie in it."""
        settings, storage = folder / "containers.conf", folder / "storage.conf"
        settings.write_text(
            f'[containers]\nnetns = "none"\ndefault_ulimits = {limits()}\n[engine]\nruntime = "runc"\n'
            f'cgroup_manager = "cgroupfs"\nevents_logger = "file"\nlock_type = "file"\ntmp_dir = "{folder}/tmp"\n'
        )
        storage.write_text(f'[storage]\ndriver = "overlay"\ngraphroot = "{folder}/store"\nrunroot = "{folder}/run"\n')
        self._environment = {
            **os.environ,
            "CONTAINERS_CONF": str(settings),
            "CONTAINERS_STORAGE_CONF": str(storage),
            "TMPDIR": str(folder),  # a build's intermediate files; as large as the image
        }

    def start(
        self, *words: str, given: str | None = None, within_s: float = 400, environment: Mapping[str, str] | None = None
    ) -> "subprocess.CompletedProcess[str]":
        """Call it, whatever comes of it; `environment` is what a compose file passes on by name."""
        return subprocess.run(
            ["podman", *words], check=False, capture_output=True, text=True, input=given, timeout=within_s,
            env=self._environment | dict(environment or {}),
        )  # fmt: skip

    def call(
        self, *words: str, given: str | None = None, within_s: float = 400, environment: Mapping[str, str] | None = None
    ) -> str:
        """What it prints; it has to succeed."""
        done = self.start(*words, given=given, within_s=within_s, environment=environment)
        assert done.returncode == 0, f"podman {' '.join(words)}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
        return done.stdout

    def log(self, name: str) -> str:
        """All that a container has said."""
        done = self.start("logs", name)
        return done.stdout + done.stderr

    def healthy(self, name: str, within_s: float = 300) -> bool:
        """Whether the command by which the image says that it is well does so in time."""
        deadline = time.monotonic() + within_s
        while (done := self.start("healthcheck", "run", name)).returncode != 0 and time.monotonic() < deadline:
            time.sleep(0.5)
        return done.returncode == 0

    def clear(self) -> None:
        """End and remove every container with what it kept; images stay."""
        for _ in range(2):  # one whose network others share goes after them
            self.start("rm", "--all", "--force", "--time=0")
        self.start("volume", "rm", "--all", "--force")


@contextmanager
def podman() -> Iterator[Podman]:
    """Podman with an empty store; on leaving everything in it is gone."""
    folder = Path(tempfile.mkdtemp(prefix="tauscope-podman-", dir="/tmp"))
    engine = Podman(folder)
    try:
        yield engine
    finally:
        engine.clear()
        subprocess.run(["umount", str(folder / "store" / "overlay")], check=False, capture_output=True)
        shutil.rmtree(folder, ignore_errors=True)


def as_composed(service: Mapping[str, Any]) -> list[str]:
    """A service of the compose file as options of `podman run`; a key that is not known here fails."""
    known = {
        "read_only": lambda on: ["--read-only", "--read-only-tmpfs=false"] if on else [],
        "tmpfs": lambda folders: [f"--tmpfs={folder}" for folder in folders],
        "cap_drop": lambda names: [f"--cap-drop={name}" for name in names],
        "security_opt": lambda options: [f"--security-opt={option.partition(':')[0]}" for option in options],
        "pids_limit": lambda number: [f"--pids-limit={number}"],
        "environment": lambda variables: [f"--env={variable}" for variable in variables],
        "volumes": lambda volumes: [f"--volume={volume}" for volume in volumes],
        "stop_grace_period": lambda period: [f"--stop-timeout={period.removesuffix('s')}"],
        "healthcheck": lambda check: ["--no-healthcheck"] if check == {"disable": True} else [],
    }
    return [word for key in service.keys() - READ_ELSEWHERE for word in known[key](service[key])]
