"""Joint torque from commands, for servos that report none."""

from tauscope.actuation.commands import make_efforts, require_loops, shift_command
from tauscope.actuation.delay import estimate_delays
from tauscope.actuation.scale import is_open

__all__ = ["estimate_delays", "is_open", "make_efforts", "require_loops", "shift_command"]
