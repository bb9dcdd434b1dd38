"""One small protocol for anything that moves an arm; the simulated backend and the buses stand behind it.

Nothing of service is known in here. `backend` is the protocol, `state` and `setpoint` what passes through it each
cycle, `errors` what a backend raises.
"""

from tauscope_drivers.backend import Backend, Capabilities, ControlMode, DriveLimits, StopPolicy
from tauscope_drivers.clock import Clock, MonotonicClock
from tauscope_drivers.errors import DriverError, Fault
from tauscope_drivers.state import ArmState, Setpoint

__all__ = [
    "ArmState",
    "Backend",
    "Capabilities",
    "Clock",
    "ControlMode",
    "DriveLimits",
    "DriverError",
    "Fault",
    "MonotonicClock",
    "Setpoint",
    "StopPolicy",
]
