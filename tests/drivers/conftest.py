"""The rigs of the conformance suite."""

import os
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial

import pytest

from arm_rigs import RIGS, Rig
from hardware_emulated.canopen_rig import canopen_rigs
from hardware_emulated.dynamixel_rig import dynamixel_rigs
from prompt_process import prompt_process
from tauscope_drivers import StopPolicy

ALL_RIGS = {
    **RIGS,
    "dynamixel": dynamixel_rigs,
    "canopen": canopen_rigs,
    "canopen-stepped": partial(canopen_rigs, stepped=True),
}
"""Makers of rigs by name; the emulated buses join here."""

if SOCKETCAN := os.environ.get("TAUSCOPE_SOCKETCAN"):
    # the name of an interface: few kernels have one, see tests/hardware_emulated/test_socketcan.py
    answers_within = int(os.environ.get("TAUSCOPE_ANSWERS_WITHIN", "1"))
    ALL_RIGS["socketcan"] = partial(canopen_rigs, interface=SOCKETCAN, stepped=True, answers_within=answers_within)

MARKS = {
    "real-time": [pytest.mark.realtime],
    "dynamixel": [pytest.mark.realtime],
    "canopen": [pytest.mark.realtime],
    "canopen-stepped": [pytest.mark.slow],
}
MAKERS = [pytest.param(name, marks=MARKS.get(name, [])) for name in ALL_RIGS]


@pytest.fixture(scope="module", params=MAKERS)
def make_rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Rig]]:
    # for one module: an emulator that moves an arm by the clock takes half a processor, and takes it from the others
    with ALL_RIGS[request.param](tmp_path_factory.mktemp("rig")) as maker:
        yield maker


@pytest.fixture
def rig(make_rig: Callable[[], Rig]) -> Iterator[Rig]:
    one = make_rig()
    with prompt_process() if one.is_real_time else nullcontext():
        yield one
        one.backend.stop(StopPolicy.TORQUE_OFF)
        one.backend.disconnect()
