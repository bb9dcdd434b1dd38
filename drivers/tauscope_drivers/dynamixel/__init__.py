"""Arms of Dynamixel servos: Protocol 2.0 over a serial port, position under a cap of current, or current."""

from tauscope_drivers.dynamixel.adapters import serial_adapters
from tauscope_drivers.dynamixel.bus_budget import BusTiming, CycleTraffic, largest_rate_hz, require_rate
from tauscope_drivers.dynamixel.configuration import (
    BusConfiguration,
    DynamixelJoint,
    ServoConfiguration,
    read_configuration,
)
from tauscope_drivers.dynamixel.doctor import examine
from tauscope_drivers.dynamixel.driver import DynamixelArm
from tauscope_drivers.dynamixel.dry_run import plan_frames
from tauscope_drivers.dynamixel.scan import USUAL_BAUDS, scan_bus

__all__ = [
    "USUAL_BAUDS",
    "BusConfiguration",
    "BusTiming",
    "CycleTraffic",
    "DynamixelArm",
    "DynamixelJoint",
    "ServoConfiguration",
    "examine",
    "largest_rate_hz",
    "plan_frames",
    "read_configuration",
    "require_rate",
    "scan_bus",
    "serial_adapters",
]
