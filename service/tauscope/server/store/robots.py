"""Robots that are kept: a version is a robot file with the files that it names, called by a hash of their content."""

import hashlib
import json
import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from tauscope.errors import NotFoundError
from tauscope.files import sync_folder, write_atomically
from tauscope.robot.messages import shown
from tauscope.server.store.data_folder import utc_now

VERSION_PATTERN = "^[0-9a-f]{32}$"
_STAGED = ".staged-"
_FILES, _RECORD = "files", "robot.json"


@dataclass(frozen=True)
class RobotVersion:
    """A robot that is kept; `name` is the one in its file `robot_file`."""

    version: str
    name: str
    robot_file: str
    created: datetime


class RobotStore:
    def __init__(self, root: Path) -> None:
        """Open the store; its folder is made where it is missing, and what a crash left half made goes."""
        self._root = root
        root.mkdir(parents=True, exist_ok=True)
        for entry in root.glob(f"{_STAGED}*"):
            shutil.rmtree(entry, ignore_errors=True)

    @contextmanager
    def stage(self) -> Iterator[Path]:
        """A new folder for the files of a robot, which goes unless they are kept."""
        with tempfile.TemporaryDirectory(prefix=_STAGED, dir=self._root, ignore_cleanup_errors=True) as folder:
            staged = Path(folder) / _FILES
            staged.mkdir()
            yield staged

    def keep(self, staged: Path, robot_file: str, name: str) -> tuple[RobotVersion, bool]:
        """Keep staged files. Returns (RobotVersion,), whether it is new; else the same content was kept before."""
        robot = RobotVersion(hash_robot(staged, robot_file), name, robot_file, utc_now())
        record = {"form": "tauscope.robot/1", "name": name, "robot_file": robot_file}
        write_atomically(staged.parent / _RECORD, json.dumps({**record, "created": robot.created.isoformat()}).encode())
        with suppress(NotFoundError):  # also where what is kept has lost its record: that is replaced
            return self.find(robot.version), False
        target = self._root / robot.version
        shutil.rmtree(target, ignore_errors=True)
        staged.parent.rename(target)
        sync_folder(self._root)
        return robot, True

    def versions(self) -> list[RobotVersion]:
        found = []
        for entry in self._root.iterdir():
            with suppress(NotFoundError):
                found.append(self.find(entry.name))
        return sorted(found, key=lambda each: (each.created, each.version), reverse=True)

    def find(self, version: str) -> RobotVersion:
        """A version. Raises NotFoundError if it is not kept, or its record is damaged."""
        try:
            record = json.loads((self.files(version).parent / _RECORD).read_bytes())
            created = datetime.fromisoformat(record["created"])
            return RobotVersion(version, str(record["name"]), str(record["robot_file"]), created)
        except (OSError, ValueError, KeyError, TypeError):
            raise _unknown(version) from None

    def files(self, version: str) -> Path:
        """The folder of a version's files. Raises NotFoundError if it is not kept."""
        folder = self._root / version / _FILES
        if re.fullmatch(VERSION_PATTERN, version) is None or not folder.is_dir():
            raise _unknown(version)
        return folder

    def remove(self, version: str) -> None:
        """Remove a version. Raises NotFoundError if it is not kept."""
        with tempfile.TemporaryDirectory(prefix=_STAGED, dir=self._root, ignore_cleanup_errors=True) as going:
            self.files(version).parent.rename(Path(going) / version)
            sync_folder(self._root)


def hash_robot(folder: Path, robot_file: str) -> str:
    """What the files of a robot are called: other names or bytes are another version."""
    total = hashlib.sha256(robot_file.encode())
    for path in sorted(folder.iterdir()):
        total.update(f"\n{path.name}\n{hashlib.sha256(path.read_bytes()).hexdigest()}".encode())
    return total.hexdigest()[:32]


def _unknown(version: str) -> NotFoundError:
    return NotFoundError(f"no robot version {shown(version)} is kept here; GET /api/v1/robots lists them")
