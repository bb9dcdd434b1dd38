"""Emulated Dynamixel servos on a pseudo terminal, in a process of their own, moved by the simulated arm's physics."""

from sim_backend.dynamixel_bus.bus import EmulatedBus
from sim_backend.dynamixel_bus.emulator import Emulator
from sim_backend.dynamixel_bus.fault_kit import FaultKind, InjectedFault
from sim_backend.dynamixel_bus.order import EmulatorOrder
from sim_backend.dynamixel_bus.process import EmulatorProcess
from sim_backend.dynamixel_bus.servo import EmulatedServo
from sim_backend.dynamixel_bus.specification import ServoSpecification

__all__ = [
    "EmulatedBus",
    "EmulatedServo",
    "Emulator",
    "EmulatorOrder",
    "EmulatorProcess",
    "FaultKind",
    "InjectedFault",
    "ServoSpecification",
]
