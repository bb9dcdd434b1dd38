"""Emulated Dynamixel servos on a pseudo terminal, in a process of their own, moved by the simulated arm's physics."""

from tauscope_sim.dynamixel_bus.bus import EmulatedBus
from tauscope_sim.dynamixel_bus.control_memory import ServoSpecification
from tauscope_sim.dynamixel_bus.emulator import DynamixelEmulator, DynamixelOrder
from tauscope_sim.dynamixel_bus.servo import EmulatedServo

__all__ = ["DynamixelEmulator", "DynamixelOrder", "EmulatedBus", "EmulatedServo", "ServoSpecification"]
