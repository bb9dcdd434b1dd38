"""The chain of an MJCF, compiled by MuJoCo: includes, defaults and classes count as in the simulator.

MuJoCo is in the ``sim`` extra, and the judge shares no code with the judged: the compiler is found by its entry point.
"""

from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol, cast

from tauscope.errors import RobotFileError
from tauscope.extras import require_extra
from tauscope.robot.chain import Chain

ENTRY_POINT_GROUP = "tauscope.mjcf"


class MjcfReader(Protocol):
    """Compiles an MJCF and reads the chain between two of its bodies."""

    def __call__(
        self,
        data: bytes,
        label: str,
        path: Path | None,
        base: str | None,
        tip: str | None,
        locked: Mapping[str, float],
    ) -> Chain:
        """The chain from body `base` to body `tip`.

        Raises RobotFileError if MuJoCo refuses the file, or no chain of hinges and slides runs from base to tip.
        """
        ...


def read_mjcf_chain(
    data: bytes,
    label: str,
    path: Path | None = None,
    base: str | None = None,
    tip: str | None = None,
    locked: Mapping[str, float] | None = None,
) -> Chain:
    """The chain from body `base` to body `tip` of an MJCF; by default from the root to the deepest body.

    Raises RobotFileError if MuJoCo refuses the file, or no chain of hinges and slides runs from base to tip. Raises
    MissingExtraError where MuJoCo is not installed.

    Parameters
    ----------
    path : Path or None
        where the file lies, for the files that it names; None for text without files beside it
    locked : mapping of str to float, or None
        position of joints that do not move [rad or m]
    """
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        with require_extra(f"{label}: reading an MJCF"):
            reader = cast("MjcfReader", entry.load())
        return reader(data, label, path, base, tip, locked or {})
    raise RobotFileError(f"{label}: no reader of MJCF is registered; install tauscope again")
