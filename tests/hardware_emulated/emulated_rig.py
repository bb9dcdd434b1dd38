"""What the rigs of emulated buses have in common: an onlooker who reads the emulator's trace."""

import time
from typing import Any

import numpy as np

from arm_rigs import PATIENCE_S, Watched
from emulator_process import EmulatorProcess
from tauscope_drivers import Backend
from tauscope_sim.device import Disturbance
from tauscope_sim.emulation import FaultKind

GLANCE_NS = 2_000_000
"""Between two looks at the trace: the emulator has its own work to do."""

FAULTS = {
    Disturbance.LOST_SAMPLE: FaultKind.SILENT,
    Disturbance.OVER_TEMPERATURE: FaultKind.OVER_TEMPERATURE,
    Disturbance.OVERLOAD: FaultKind.OVERLOAD,
}
"""Disturbances of the conformance suite as faults of the kit."""


class EmulatedRig:
    """An arm of emulated drives in a process of its own; the backend is the subclass's matter."""

    is_real_time = True
    answers_within = 1
    has_watchdog = True
    backend: Backend

    def __init__(self, emulator: EmulatorProcess) -> None:
        self._emulator = emulator

    def watch(self, duration_s: float) -> Watched:
        clock = self.backend.clock
        begin = clock.now_ns()
        end = begin + round(duration_s * 1e9)
        clock.wait_until_ns(end)
        rows = [entry for entry in self._trace_until(end) if begin <= entry["monotonic_ns"] <= end]
        return Watched(
            np.array([entry["monotonic_ns"] for entry in rows]),
            np.array([entry["position"] for entry in rows]),
            np.array([entry["velocity"] for entry in rows]),
            np.array([any(entry["commanded"]) for entry in rows]),
        )

    def look(self) -> np.ndarray:
        return np.array(self._trace_until(self.backend.clock.now_ns())[-1]["position"])

    def _trace_until(self, instant_ns: int) -> list[dict[str, Any]]:
        deadline = time.monotonic() + PATIENCE_S
        while (trace := self._emulator.trace())[-1]["monotonic_ns"] < instant_ns:
            assert time.monotonic() < deadline, "the emulator's trace does not go on"
            self.backend.clock.wait_until_ns(self.backend.clock.now_ns() + GLANCE_NS)
        return trace
