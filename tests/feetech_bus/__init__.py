"""Emulated STS3215 servos on a pseudo terminal, in a process of their own; nothing is shared with the driver."""

from feetech_bus.order import FeetechOrder, ServoSpecification

__all__ = ["FeetechOrder", "ServoSpecification"]
