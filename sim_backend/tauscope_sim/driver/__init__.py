"""The simulated arm behind the protocol of `drivers`: in virtual time, and in real time in a process of its own."""

from tauscope_sim.driver.remote_arm import DeviceProcess, RemoteSimulatedArm, start_device
from tauscope_sim.driver.simulated_arm import SimulatedArm

__all__ = ["DeviceProcess", "RemoteSimulatedArm", "SimulatedArm", "start_device"]
