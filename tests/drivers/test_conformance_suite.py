"""The conformance suite itself: it asks every registered driver, and it finds a driver that does nothing."""

import inspect
from collections.abc import Iterator
from itertools import product
from types import ModuleType
from typing import Any

import pytest

from arm_rigs import ExactRig, bench_robot
from drivers import test_conformance_calls, test_conformance_motion, test_conformance_watchdog
from drivers.conftest import RIGS, rig_parameters
from tauscope.cli.run_command import DEFAULT_BACKEND as DEFAULT_OF_COMMANDS
from tauscope.runtime.drivers import DEFAULT_BACKEND, driver_names, find_driver

MODULES = (test_conformance_calls, test_conformance_motion, test_conformance_watchdog)


class EmptyBackend:
    """Every member of it raises."""

    def __getattr__(self, name: str) -> Any:
        raise NotImplementedError(name)


class EmptyRig(ExactRig):
    """An onlooker of a driver that does nothing."""

    is_real_time = False

    def __init__(self) -> None:
        self.robot = bench_robot()
        self.backend = EmptyBackend()

    def __getattr__(self, name: str) -> Any:
        raise NotImplementedError(name)


def checks(module: ModuleType) -> Iterator[Any]:
    """Every test of a module with every set of its parameters."""
    for name, test in inspect.getmembers(module, inspect.isfunction):
        if not name.startswith("test_"):
            continue
        sets = []
        for mark in (one for one in getattr(test, "pytestmark", []) if one.name == "parametrize"):
            names = (
                [part.strip() for part in mark.args[0].split(",")] if isinstance(mark.args[0], str) else mark.args[0]
            )
            sets.append(
                [dict(zip(names, values if len(names) > 1 else (values,), strict=True)) for values in mark.args[1]]
            )
        for number, chosen in enumerate(product(*sets)):
            arguments = {name: value for one in chosen for name, value in one.items()}
            yield pytest.param(test, arguments, id=f"{name}-{number}")


@pytest.mark.parametrize(("check", "arguments"), [one for module in MODULES for one in checks(module)])
def test_an_empty_driver_fails_every_check(check: Any, arguments: dict[str, Any]) -> None:
    with pytest.raises((NotImplementedError, AssertionError, pytest.fail.Exception)):
        check(EmptyRig(), **arguments)


def test_every_registered_driver_has_a_rig_and_every_rig_a_driver() -> None:
    assert set(RIGS) == set(driver_names())


def test_a_driver_without_a_rig_fails(tmp_path: Any) -> None:
    (parameter,) = rig_parameters(["nullbus"])
    assert not parameter.marks, "it is run wherever the suite is"
    maker: Any = parameter.values[0]
    with pytest.raises(pytest.fail.Exception, match="driver nullbus has no rig"), maker(tmp_path):
        pass


@pytest.mark.parametrize("name", driver_names())
def test_a_driver_has_words_for_page_and_help(name: str) -> None:
    driver = find_driver(name)
    assert driver.title
    assert all(option.name and option.help for option in driver.options)
    assert len(set(driver.option_names)) == len(driver.options)


def test_commands_have_the_registrys_default() -> None:
    assert DEFAULT_OF_COMMANDS == DEFAULT_BACKEND
