"""Emulated Dynamixel servos on a pseudo terminal, in a process of their own, moved by the simulated arm's physics."""

from sim_backend.dynamixel_bus.bus import EmulatedBus
from sim_backend.dynamixel_bus.emulator import DynamixelEmulator
from sim_backend.dynamixel_bus.order import DynamixelOrder
from sim_backend.dynamixel_bus.servo import EmulatedServo
from sim_backend.dynamixel_bus.specification import ServoSpecification

__all__ = ["DynamixelEmulator", "DynamixelOrder", "EmulatedBus", "EmulatedServo", "ServoSpecification"]
