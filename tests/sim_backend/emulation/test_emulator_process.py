"""An emulator in a process of its own, of either bus: stepped time, the trace, what a test may ask."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import tauscope_sim.examples
from emulator_process import EmulatorProcess
from hardware_emulated.canopen_robot import RATED_TORQUE_MNM, write_canopen_robot
from tauscope_sim.canopen_bus.emulator import CanOrder
from tauscope_sim.dynamixel_bus import DynamixelOrder, ServoSpecification
from tauscope_sim.emulation import FaultKind, InjectedFault

START = (0.1, 0.2, 0.3)


def servo_order(folder: Path) -> DynamixelOrder:
    servos = tuple(ServoSpecification(number) for number in (1, 2, 3))
    port, control, trace = (str(folder / name) for name in ("port", "control", "trace"))
    return DynamixelOrder(servos=servos, start=START, port=port, control=control, stepped=True, trace=trace)


def drive_order(folder: Path) -> CanOrder:
    robot = write_canopen_robot(Path(tauscope_sim.examples.__file__).with_name("paper_arm.yaml"), folder)
    port, control, trace = (str(folder / name) for name in ("port", "control", "trace"))
    return CanOrder(
        robot=str(robot),
        start=START,
        port=port,
        control=control,
        rated_torque_mnm=(RATED_TORQUE_MNM,) * 3,
        stepped=True,
        trace=trace,
    )


@pytest.fixture(scope="module", params=[servo_order, drive_order], ids=["dynamixel", "canopen"])
def process(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmulatorProcess]:
    with EmulatorProcess(request.param(tmp_path_factory.mktemp("emulator"))) as emulator:
        yield emulator


@pytest.fixture
def emulator(process: EmulatorProcess) -> EmulatorProcess:
    process.reset()
    return process


def test_stepped_time_passes_only_when_told_to(emulator: EmulatorProcess) -> None:
    assert [emulator.state["time"] for _ in range(20)] == [0.0] * 20
    emulator.advance_to(0.037)
    assert emulator.state["time"] == pytest.approx(0.037, abs=1e-9)
    emulator.advance_to(0.02)
    assert emulator.state["time"] == pytest.approx(0.037, abs=1e-9), "time does not go back"
    # longer than a process may sleep by the machine's clock: nothing of it is lost
    emulator.advance_to(1.5)
    assert emulator.state["time"] == pytest.approx(1.5, abs=1e-9)
    assert emulator.state["lost"] == 0.0


def test_the_trace_is_of_every_two_milliseconds(emulator: EmulatorProcess) -> None:
    emulator.advance_to(0.1)
    times = [entry["time"] for entry in emulator.trace()]
    np.testing.assert_allclose(times, np.arange(0.0, 0.1005, 0.002), atol=1e-3)
    assert len(times) == 51


def test_a_reset_begins_a_new_trace(emulator: EmulatorProcess) -> None:
    emulator.advance_to(0.1)
    emulator.reset()
    (first,) = emulator.trace()
    assert first["time"] == 0.0
    np.testing.assert_allclose(first["position"], START, atol=1e-12)
    emulator.advance_to(0.01)
    assert [entry["time"] for entry in emulator.trace()] == pytest.approx([0.0, 0.002, 0.004, 0.006, 0.008, 0.01])


def test_what_a_device_holds_is_read_and_set_behind_the_masters_back(emulator: EmulatorProcess) -> None:
    place, value = ("Goal Position", 1234) if isinstance(emulator.order, DynamixelOrder) else ((0x6072, 0), 321)
    others = [emulator.get(device, place) for device in (1, 3)]
    emulator.put(2, place, value)
    assert emulator.get(2, place) == value
    assert [emulator.get(device, place) for device in (1, 3)] == others
    emulator.reset()
    assert emulator.get(2, place) != value, "as delivered"


def test_an_injected_faults_instant_counts_from_now(emulator: EmulatorProcess) -> None:
    def has_failed() -> bool:
        state = emulator.state
        return bool(state["error"][1]) if "error" in state else state["state"][1] == "FAULT"

    emulator.advance_to(0.2)
    emulator.inject(InjectedFault(FaultKind.OVERLOAD, 2, at_s=0.1, seconds=10.0))
    emulator.advance_to(0.29)
    assert not has_failed()
    emulator.advance_to(0.31)
    assert has_failed()
