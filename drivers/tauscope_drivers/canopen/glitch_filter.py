"""Readings that a joint cannot give: what an encoder's glitch or an altered frame looks like.

On the wire every frame has a checksum, and one that is disturbed is sent again. An adapter or a driver behind it that
alters a frame is not noticed by anybody unless its content cannot be true.
"""

import math

FASTEST = 3.0
"""A joint is believed to be so many times as fast as its limit, no faster."""

SLACK_S = 0.002
"""How much later than the host thinks a drive may have sampled [s]."""


class GlitchFilter:
    """Doubts a reading that is farther from the one before than its joint can have gone, or faster than it can go.

    One reading is doubted at a time: a joint that truly runs away, or whose encoder jumped, gives the next one too.

    `limit`: speed limit of the joint; infinite as long as nothing is doubted [rad/s or m/s].
    """

    def __init__(self) -> None:
        """Doubt nothing yet."""
        self.limit = math.inf
        self._believed: tuple[float, int] | None = None
        self._doubts_place = self._doubts_speed = False

    def believes_place(self, position: float, time_ns: int) -> bool:
        """Whether a position may be true.

        `position`: NaN where there is none, which is no lie [rad or m]; `time_ns`: instant of the reading, never before
        that of the last [ns].
        """
        if math.isnan(position):
            return True
        self._doubts_place = not self._doubts_place and self._is_out_of_reach(position, time_ns)
        if not self._doubts_place:
            self._believed = position, time_ns
        return not self._doubts_place

    def believes_speed(self, velocity: float) -> bool:
        """Whether a velocity may be true. `velocity`: NaN where there is none, which is no lie [rad/s or m/s]."""
        self._doubts_speed = not self._doubts_speed and abs(velocity) > FASTEST * self.limit
        return not self._doubts_speed

    def _is_out_of_reach(self, position: float, time_ns: int) -> bool:
        """Whether the joint cannot have gone there since it was believed last."""
        if self._believed is None:
            return False
        before, before_ns = self._believed
        return abs(position - before) > FASTEST * self.limit * ((time_ns - before_ns) * 1e-9 + SLACK_S)
