"""Outcomes kept line by line, so that an interrupted set goes on where it stopped."""

import json
import os
from pathlib import Path
from typing import Any

Outcome = dict[str, Any]
Key = tuple[str, int, str | None]
"""Series, seed, and the arm that was asked for, None where it was drawn."""


class Kept:
    """A file of outcomes, one a line; the last line may be torn by a crash and is then tried again.

    Parameters
    ----------
    path : Path
        the file; made where there is none

    Raises
    ------
    ValueError
        where a line that a crash cannot have torn does not read
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self.outcomes: list[Outcome] = []
        whole = 0
        for number, line in enumerate(path.read_bytes().splitlines(keepends=True) if path.exists() else (), 1):
            if not line.endswith(b"\n"):
                break  # what follows the last line end was being written when the machine stopped
            self.outcomes.append(_read(line, path, number))
            whole += len(line)
        self.torn = path.exists() and path.stat().st_size > whole
        if self.torn:
            os.truncate(path, whole)

    def add(self, outcome: Outcome) -> None:
        """Keep one outcome more, on the disk before this returns."""
        line = (json.dumps(outcome) + "\n").encode()
        with self.path.open("ab") as file:
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        self.outcomes.append(outcome)

    def of(self, wanted: set[Key]) -> list[Outcome]:
        """Those of some trials, in the order of series and seeds; the last where one was tried twice."""
        found = {key_of(each): each for each in self.outcomes}
        return [found[key] for key in sorted(found, key=str) if key in wanted]


def key_of(outcome: Outcome) -> Key:
    """What tells a trial from all others."""
    return outcome["series"], outcome["seed"], outcome["arm"]


def _read(line: bytes, path: Path, number: int) -> Outcome:
    try:
        outcome = json.loads(line)
        key_of(outcome)
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path}, line {number}: no outcome of a trial; delete the line or name another file"
        ) from error
    return outcome
