"""The simulated drives and their arm, on the far side of the bus: as a pure object, and as a process of its own."""

from tauscope_sim.device.device import HOTTEST, SimulatedDevice
from tauscope_sim.device.drives import Activity
from tauscope_sim.device.faults import Disturbance, FaultCode, Injection

__all__ = ["HOTTEST", "Activity", "Disturbance", "FaultCode", "Injection", "SimulatedDevice"]
