"""Joint torque from commands, for servos that report none."""

from tauscope.actuation.commands import make_efforts, shift_command
from tauscope.actuation.delay import Delay, estimate_delays

__all__ = ["Delay", "estimate_delays", "make_efforts", "shift_command"]
