"""Settings that servos had in EEPROM before a run changed them, on disk until another process may put them back."""

import contextlib
import json
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

# items in EEPROM that the driver changes, in the order in which they are put back: a mode resets others
CHANGED = ("Drive Mode", "Return Delay Time", "Operating Mode")
FOLDER = "TAUSCOPE_STATE"  # environment variable that names the folder, in place of ``~/.local/state/tauscope``


class OriginalSettings:
    """The settings of one servo on one port."""

    def __init__(self, port: str, servo: int) -> None:
        """Read what is kept; nothing is kept where the file is missing or damaged."""
        name = f"{os.path.realpath(port).strip('/').replace('/', '-')}-{servo}.json"
        self._path = _find_folder() / "servos" / name
        self.before: dict[str, int] = {}  # value of each changed item before the first change
        self._after: dict[str, int] = {}
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
            before, after = (
                {item: int(value) for item, value in content[kind].items() if item in CHANGED}
                for kind in ("before", "after")
            )
        except (OSError, ValueError, TypeError, KeyError, AttributeError):
            return
        if before.keys() == after.keys():
            self.before, self._after = before, after

    def check(self, present: Mapping[str, int]) -> None:
        """Forget everything where an item is not as it was left: it is another servo, or somebody else set it."""
        if any(present.get(name) != value for name, value in self._after.items()):
            self.forget()

    def remember(self, name: str, before: int, after: int) -> None:
        """Keep a change; a disk that does not take it loses it, and the run goes on."""
        self.before.setdefault(name, before)
        self._after[name] = after
        with contextlib.suppress(OSError):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._path.write_text(json.dumps({"before": self.before, "after": self._after}), encoding="utf-8")

    def forget(self) -> None:
        """They are put back, or nobody's."""
        self.before, self._after = {}, {}
        with contextlib.suppress(OSError):
            self._path.unlink(missing_ok=True)


def _find_folder() -> Path:
    """Where it is kept; an account without a home has the folder for temporary files."""
    # systemd names the folder of a service, which has no other
    if named := os.environ.get(FOLDER) or os.environ.get("STATE_DIRECTORY"):
        return Path(named.partition(":")[0])
    try:
        return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "tauscope"
    except RuntimeError:
        return Path(tempfile.gettempdir()) / "tauscope"
