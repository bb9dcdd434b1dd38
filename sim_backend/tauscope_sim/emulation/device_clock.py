"""The time of emulated devices: whole steps, taken behind a clock that does not wait for them."""

from collections.abc import Callable
from math import ceil

STEP_S = 1e-3
"""Period of the devices' own loops and of the physics [s]."""

MOST_STEPS = 10
"""Steps that are taken in a row while nothing is asked."""

LONGEST_CATCH_UP_S = 0.25
"""Where the machine stood still for longer than this, the device's clock has lost the rest [s]."""

ALL_STEPS = ceil(LONGEST_CATCH_UP_S / STEP_S)
"""As many as can be due."""


class DeviceClock:
    """How far devices have come; what a machine that stood still made them miss is lost, and told.

    `lost_s`: time that was never stepped through [s].
    """

    def __init__(self, now_s: float) -> None:
        """Begin. `now_s`: present instant [s]."""
        self.tick = round(now_s / STEP_S)
        self.lost_s = 0.0

    @property
    def now_s(self) -> float:
        """Instant up to which the devices have come [s]."""
        return self.tick * STEP_S + self.lost_s

    def catch_up(self, now_s: float, step: Callable[[], None], most_steps: int = MOST_STEPS) -> None:
        """Take the steps that are due: not all at once where there are many, so that a master is heard in between.

        `now_s`: present instant [s].
        """
        if now_s - self.now_s > LONGEST_CATCH_UP_S:
            self.lost_s += now_s - self.now_s - LONGEST_CATCH_UP_S
        for _ in range(most_steps):
            if self.now_s + STEP_S > now_s:
                return
            self.tick += 1
            step()
