"""The clock of emulated servos whose time passes only when it is told to: no busy machine disturbs a run by it."""

from emulator_process import EmulatorProcess


class SteppedClock:
    """Implements `drivers.Clock`: waiting lets the device's time pass."""

    def __init__(self, emulator: EmulatorProcess) -> None:
        self._emulator = emulator
        self._now_ns = 0

    def now_ns(self) -> int:
        return self._now_ns

    def wait_until_ns(self, deadline_ns: int) -> int:
        if deadline_ns > self._now_ns:
            self._now_ns = deadline_ns
            self._emulator.advance_to(deadline_ns * 1e-9)
        return self._now_ns
