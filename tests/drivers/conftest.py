"""The rigs of the conformance suite."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from arm_rigs import Rig, remote_rigs, virtual_rigs
from hardware_emulated.canopen_rig import canopen_rigs
from hardware_emulated.servo_rigs import PH54, STS3215, servo_rigs
from prompt_process import prompt_process
from tauscope.runtime.drivers import driver_names
from tauscope_drivers import StopPolicy

RigMaker = Callable[[Path], AbstractContextManager[Callable[[], Rig]]]

RIGS: dict[str, dict[str, RigMaker]] = {
    "sim": {"virtual": virtual_rigs, "real-time": remote_rigs},
    "dynamixel": {"dynamixel": partial(servo_rigs, servos=PH54)},
    "feetech": {"feetech": partial(servo_rigs, servos=STS3215)},
    "canopen": {"canopen": canopen_rigs, "canopen-stepped": partial(canopen_rigs, stepped=True)},
}
"""Makers of rigs by the driver's name: a new driver joins the suite here."""

if SOCKETCAN := os.environ.get("TAUSCOPE_SOCKETCAN"):
    # the name of an interface: few kernels have one, see tests/hardware_emulated/test_socketcan.py
    answers_within = int(os.environ.get("TAUSCOPE_ANSWERS_WITHIN", "1"))
    RIGS["canopen"]["socketcan"] = partial(
        canopen_rigs, interface=SOCKETCAN, stepped=True, answers_within=answers_within
    )

MARKS = {
    "real-time": [pytest.mark.realtime],
    "dynamixel": [pytest.mark.realtime],
    "feetech": [pytest.mark.realtime],
    "canopen": [pytest.mark.realtime],
    "canopen-stepped": [pytest.mark.slow],
}


@contextmanager
def no_rigs(_: Path, driver: str) -> Iterator[Callable[[], Rig]]:
    """Fails every test of the suite for a driver that nobody tests."""
    pytest.fail(f"driver {driver} has no rig: add one to RIGS in tests/drivers/conftest.py")
    yield


def rig_parameters(drivers: Sequence[str]) -> list[ParameterSet]:
    """The rigs of each driver, one parameter each; one that fails where there is none."""
    found = []
    for driver in drivers:
        makers = RIGS.get(driver) or {driver: partial(no_rigs, driver=driver)}
        found += [pytest.param(maker, id=name, marks=MARKS.get(name, [])) for name, maker in makers.items()]
    return found


@pytest.fixture(scope="module", params=rig_parameters(driver_names()))
def make_rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Rig]]:
    # for one module: an emulator that moves an arm by the clock takes half a processor, and takes it from the others
    with request.param(tmp_path_factory.mktemp("rig")) as maker:
        yield maker


@pytest.fixture
def rig(make_rig: Callable[[], Rig]) -> Iterator[Rig]:
    one = make_rig()
    with prompt_process() if one.is_real_time else nullcontext():
        yield one
        one.backend.stop(StopPolicy.TORQUE_OFF)
        one.backend.disconnect()
