"""What emulated buses have in common: a process of its own, a pseudo terminal, a clock, a trace, a kit of faults."""

from tauscope_sim.emulation.fault_kit import FaultKind, InjectedFault

__all__ = ["FaultKind", "InjectedFault"]
