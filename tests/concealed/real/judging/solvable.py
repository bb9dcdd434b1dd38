"""Whether a trial can be solved: the oracle's size beside the concealed one.

A real set may hold some of the same effect before anything is concealed. So what a trial holds is the concealed size
and the oracle's estimate from the untouched set, together.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from concealed.real.concealing.draw import RealCase, total_size
from concealed.real.concealing.ground import ground_of
from concealed.real.concealing.oracle import estimate_sizes

ENOUGH = 2.0
"""Standard errors within which the oracle's size is right."""


@dataclass(frozen=True)
class Solved:
    """One effect as the oracle finds it.

    concealed : float
        size that was added
    before : float
        of the same effect, in the untouched set
    total : float
        of both
    found, std : float
        in the trial
    """

    kind: str
    multiple: float | None
    concealed: float
    before: float
    total: float
    found: float
    std: float

    @property
    def is_right(self) -> bool:
        """Whether it is within two standard errors of what the trial holds."""
        return abs(self.found - self.total) <= ENOUGH * self.std

    @property
    def is_right_alone(self) -> bool:
        """The same, of the concealed size alone."""
        return abs(self.found - self.concealed) <= ENOUGH * self.std

    @property
    def strength(self) -> float:
        """Concealed size in standard errors."""
        return abs(self.concealed) / self.std

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {**asdict(self), "right": self.is_right, "right_alone": self.is_right_alone, "s": self.strength}


def solve_case(case: RealCase, folder: Path) -> list[Solved] | None:
    """The oracle on a trial's files; None where it does not take its effects."""
    laws = [each.concealment for each in case.effects]
    before = [case.effects[0].before] if len(laws) == 1 else estimate_sizes(case.ground, laws)
    if before is None:
        return None
    files = ground_of(folder, case.ground.band_hz)
    found = estimate_sizes(files, laws) or []
    return [
        Solved(
            each.concealment.kind,
            each.multiple,
            each.size,
            earlier.size,
            total_size(each.concealment, each.size, earlier.size),
            now.size,
            now.std,
        )
        for each, earlier, now in zip(case.effects, before, found, strict=True)
    ]
