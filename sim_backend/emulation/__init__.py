"""What emulated buses have in common: a process of its own, a pseudo terminal, a clock, a trace, a kit of faults."""

from sim_backend.emulation.fault_kit import FaultKind, InjectedFault
from sim_backend.emulation.process import EmulatorProcess

__all__ = ["EmulatorProcess", "FaultKind", "InjectedFault"]
