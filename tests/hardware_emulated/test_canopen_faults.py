"""Every fault of the kit on a CAN bus, in every phase: a definite state, a decoded message, a still arm."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from arm_rigs import START, drive, setpoint, wide_limits
from hardware_emulated.canopen_rig import CanopenRig, canopen_rigs
from tauscope_drivers import ControlMode, DriverError, StopPolicy
from tauscope_sim.emulation.fault_kit import FaultKind, InjectedFault

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(1200)]

WATCHDOG_S = 0.4
FAULTS: dict[FaultKind, dict[str, Any]] = {
    FaultKind.LOSE: {"device": 2, "count": 6},
    FaultKind.CORRUPT: {"device": 2, "count": 6},
    FaultKind.LATE: {"device": 2, "count": 6, "seconds": 0.06},
    FaultKind.DUPLICATE: {"device": 2, "count": 10},
    FaultKind.SILENT: {"device": 2, "seconds": 3.0},
    FaultKind.OVER_TEMPERATURE: {"device": 2, "seconds": 1.0},
    FaultKind.OVERLOAD: {"device": 2, "seconds": 1.0},
    FaultKind.ENCODER_JUMP: {"device": 2, "counts": 3000},
    FaultKind.RESET: {"device": 2, "seconds": 0.3},
    FaultKind.POWER_DIP: {"seconds": 0.3},
}
HARDWARE = {FaultKind.OVERLOAD: "overload", FaultKind.OVER_TEMPERATURE: "over-temperature"}
PHASES = ["run", *(pytest.param(phase, marks=pytest.mark.proof) for phase in ("connect", "enable", "stop"))]
"""All of them in the drives' own time: test_canopen_fault_table.py."""


@dataclass(frozen=True)
class Outcome:
    """What a fault came to in a phase."""

    ended_in: str
    message: str


@pytest.fixture(scope="module")
def make_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder: Path = tmp_path_factory.mktemp("faults")
    with canopen_rigs(folder) as maker:
        yield maker


def outcome(rig: CanopenRig, kind: FaultKind, phase: str) -> Outcome:
    """Let a fault happen in a phase, go on as a careful host would, and say how it ended."""
    arm = rig.backend

    def happen(at: str) -> None:
        if at == phase:
            rig.disturb(InjectedFault(kind, **FAULTS[kind]))

    try:
        happen("connect")
        arm.connect()
        happen("enable")
        arm.enable(ControlMode.POSITION, wide_limits(rig.robot), StopPolicy.HOLD, WATCHDOG_S)
        happen("run")
        missed = 0
        for state in drive(rig, lambda _: setpoint(START), 0.6):
            missed = 0 if state.fresh.all() else missed + 1
            if state.faults:
                return Outcome("fault", str(state.faults[0]))
            if missed > 3:
                return Outcome("stale", f"no answer for {missed} cycles")
        happen("stop")
        stopped = arm.stop(StopPolicy.HOLD)
        return Outcome("stopped", str(stopped.faults[0]) if stopped.faults else "")
    except DriverError as error:
        return Outcome("refused", str(error))


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("kind", list(FAULTS))
def test_every_fault_in_every_phase_ends_in_a_definite_state(make_rig, kind: FaultKind, phase: str) -> None:
    rig = make_rig()
    ended = outcome(rig, kind, phase)
    assert "\n" not in ended.message
    if ended.ended_in in ("fault", "refused"):
        assert ";" in ended.message, "it names the next step"
    if kind in HARDWARE and phase in ("connect", "enable", "run"):
        assert HARDWARE[kind] in ended.message
    if kind is FaultKind.DUPLICATE:
        assert ended == Outcome("stopped", "")
    # whatever happened: without a host nothing under power moves
    seen = rig.watch(WATCHDOG_S + 0.8)
    assert not seen.commanded[-50:].any()
    under_power = np.array([state == "QUICK_STOP_ACTIVE" for state in rig.drive_states()])
    assert np.abs(seen.velocity[-1][under_power]).max(initial=0.0) < 0.05
