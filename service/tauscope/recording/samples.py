"""What a stretch of a recording is made of, and the table that its rows come from."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class EffortKind(StrEnum):
    """What the recording holds in place of joint torque."""

    TORQUE = "tau"
    CURRENT = "i"
    COMMAND = "qref"


@dataclass(frozen=True, eq=False)
class Samples:
    """A stretch of a recording as it was measured; NaN marks a sample that was missed.

    `time`: (N,), strictly increasing [s].
    `position`: (N, n), q [rad or m].
    `effort`: (N, n), τ [Nm or N], or drive units (current), or commanded positions, as `Recording.effort_kind` says,
        sign and constant not yet applied.
    `velocity`, `acceleration`, `reference`, `effort_command`, `temperature`, `link_position`, `voltage`, `gain`: (N,
        n) or None, the optional columns qd, qdd, qref, taucmd, temp, qlink, volt, kp; a joint without such a column is
        NaN.
    `period`: (N,), index of the repeated excitation period, NaN outside the repeated part.
    """

    time: Array
    position: Array
    effort: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    reference: Array | None = None
    effort_command: Array | None = None
    temperature: Array | None = None
    link_position: Array | None = None
    voltage: Array | None = None
    gain: Array | None = None
    period: Array | None = None

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Rows in which the position of every joint is known, (N,)."""
        known = np.isfinite(self.position, order="F")  # column by column: a tenth of the time
        return np.asarray(known.all(axis=1))


class Table(Protocol):
    """Rows of float64 columns, in memory or spooled to a temporary file when they are many."""

    @property
    def names(self) -> tuple[str, ...]:
        """Column names of CONTRACT.md: t, q1…, tau1… or i1…, qd1…, period."""
        ...

    def __len__(self) -> int: ...

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop as one (stop-start, columns) float64 array."""
        ...
