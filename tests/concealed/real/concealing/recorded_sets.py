"""The open recordings of real arms in which effects are concealed. Nothing of them is in the repository."""

import os
from dataclasses import dataclass
from pathlib import Path

from tauscope.robot import Robot, read_robot

REPOSITORY = Path(__file__).resolve().parents[4]


@dataclass(frozen=True)
class RecordedSet:
    """Recordings of one arm.

    band_hz : float
        band in which the plain residual is taken, from the README of the data [Hz]
    shares : int
        trials on this set in a cycle of `CYCLE`
    """

    name: str
    band_hz: float
    shares: int

    @property
    def folder(self) -> Path:
        """Its files: among the data, or among the cases."""
        data = Path(os.environ.get("TAUSCOPE_DATA") or REPOSITORY.parent / "shared" / "data")
        cases = Path(os.environ.get("TAUSCOPE_CASES") or REPOSITORY.parent / "shared" / "cases")
        inside = data / self.name
        return inside if inside.is_dir() else cases / "arms" / self.name

    @property
    def is_there(self) -> bool:
        """Whether this machine has the recordings."""
        return (self.folder / "robot.yaml").is_file()

    def robot(self) -> Robot:
        """The arm as its robot file has it."""
        return read_robot(self.folder / "robot.yaml")

    def recordings(self) -> list[Path]:
        """Training recordings, then held-out ones."""
        return recordings_in(self.folder)


def recordings_in(folder: Path) -> list[Path]:
    """Training recordings of a folder, then held-out ones."""
    return [*sorted(folder.glob("train-*.csv")), *sorted(folder.glob("held-out-*.csv"))]


SETS: dict[str, RecordedSet] = {
    each.name: each
    for each in (
        RecordedSet("staubli-tx40", 30.0, 2),
        RecordedSet("kuka-lwr4", 8.0, 2),
        RecordedSet("franka-panda", 10.0, 2),
        RecordedSet("double-pendulum", 8.0, 2),
        RecordedSet("ur10-bag", 5.0, 2),
        RecordedSet("bam-xl330", 12.0, 2),
        RecordedSet("emps", 100.0, 2),
        RecordedSet("panda-bag30", 5.0, 1),
        RecordedSet("odrive-cogging", 20.0, 1),
    )
}
"""All sets. Half the weight goes to those on which fewest effects can be told: one slow turn, 30 Hz."""

CYCLE = [name for turn in range(2) for name, each in SETS.items() if each.shares > turn]
"""Sets of consecutive seeds: so many trials on end have each set as often as its share."""


def set_of_seed(seed: int) -> str:
    """The set on which the trial of a seed is made."""
    return CYCLE[seed % len(CYCLE)]
