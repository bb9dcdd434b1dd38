"""Emulated servos that a module's tests use one after the other, each of them as delivered; and the program itself.

No emulator outlives its module: one that moves an arm by the clock takes half a processor, and takes it from others.
"""

from collections.abc import Iterator

import pytest

from hardware_emulated.commands import Tauscope, called_with
from hardware_emulated.servo_bench import Bench, bench
from prompt_process import prompt_process


@pytest.fixture(scope="module")
def three_servos(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("servos")) as one:
        yield one


@pytest.fixture(scope="module")
def weightless_servos(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    with bench(tmp_path_factory.mktemp("servos"), weight=0.0) as one:
        yield one


@pytest.fixture
def three(three_servos: Bench) -> Iterator[Bench]:
    with prompt_process():
        yield three_servos.anew()
        three_servos.clear()


@pytest.fixture
def weightless(weightless_servos: Bench) -> Iterator[Bench]:
    with prompt_process():
        yield weightless_servos.anew()
        weightless_servos.clear()


@pytest.fixture
def tauscope(capfd: pytest.CaptureFixture[str]) -> Tauscope:
    return called_with(capfd)
