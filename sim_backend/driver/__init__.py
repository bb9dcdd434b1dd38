"""The simulated arm behind the protocol of `drivers`: in virtual time, and in real time in a process of its own."""

from sim_backend.driver.device_process import DeviceProcess, start_device
from sim_backend.driver.remote_arm import RemoteSimulatedArm
from sim_backend.driver.simulated_arm import SimulatedArm
from sim_backend.driver.virtual_clock import VirtualClock

__all__ = ["DeviceProcess", "RemoteSimulatedArm", "SimulatedArm", "VirtualClock", "start_device"]
