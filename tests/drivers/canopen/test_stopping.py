"""Drives that are told one by one to stop: what each is told, and what is said of those that do not hold."""

import pytest

from tauscope_drivers.backend import ControlMode
from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.configuration import NodeConfiguration
from tauscope_drivers.canopen.emergency import HEARTBEAT_LOST
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.objects import DriveObject
from tauscope_drivers.canopen.power import PROMPT_CYCLES, dropped_faults, has_stopped, stop_one_by_one, stop_promptly
from tauscope_drivers.canopen.process_data import MEASURED, MEASURED_WHERE_THERE
from tauscope_drivers.canopen.session import Session, arm_faults
from tauscope_drivers.canopen.state_machine import Goal
from tauscope_drivers.errors import DriverError, DriverErrorKind, Fault
from tauscope_drivers.state import ArmState

# statuswords of CiA 402-2; voltage is there in all of them
SWITCH_ON_DISABLED, READY, SWITCHED_ON, OPERATION_ENABLED = 0x0250, 0x0231, 0x0233, 0x0237
QUICK_STOP_ACTIVE, FAULT = 0x0217, 0x0218


class Dictionary:
    """A drive's object dictionary, or the lack of one."""

    def __init__(self, statusword: int, failure: DriverErrorKind | None = None) -> None:
        self.values = dict.fromkeys((*MEASURED, *MEASURED_WHERE_THERE), 0) | {objects.STATUSWORD: statusword}
        self.written: list[tuple[DriveObject, int]] = []
        self._failure = failure

    def read(self, entry: DriveObject) -> int:
        if self._failure is not None:
            raise DriverError(self._failure, "no answer; check it")
        return self.values[entry]

    def write(self, entry: DriveObject, value: int) -> None:
        self.written.append((entry, value))


def drive(joint: int, statusword: int, failure: DriverErrorKind | None = None) -> tuple[DriveNode, Dictionary]:
    dictionary = Dictionary(statusword, failure)
    return DriveNode(NodeConfiguration(joint, 65536.0, 1.0), joint, dictionary, bus=dictionary), dictionary  # pyright: ignore[reportArgumentType]


FORGET_MASTER = (objects.CONSUMER_HEARTBEAT, 0)
LET_GO, QUICK_STOP = (objects.CONTROLWORD, 0x0000), (objects.CONTROLWORD, 0x0002)


@pytest.mark.parametrize(
    ("statusword", "goal", "is_stopped", "told"),
    [
        (OPERATION_ENABLED, Goal.QUICK_STOP, False, [QUICK_STOP, FORGET_MASTER]),
        (OPERATION_ENABLED, Goal.SWITCH_ON_DISABLED, False, [LET_GO, FORGET_MASTER]),
        (QUICK_STOP_ACTIVE, Goal.QUICK_STOP, False, [FORGET_MASTER]),
        (QUICK_STOP_ACTIVE, Goal.SWITCH_ON_DISABLED, False, [LET_GO, FORGET_MASTER]),
        (OPERATION_ENABLED, Goal.QUICK_STOP, True, [FORGET_MASTER]),
    ],
)
def test_a_drive_is_told_what_takes_it_there_and_one_that_holds_is_left_alone(
    statusword: int, goal: Goal, is_stopped: bool, told: list[tuple[DriveObject, int]]
) -> None:
    node, dictionary = drive(1, statusword)
    assert stop_one_by_one([node], goal, is_stopped=is_stopped) == []
    assert dictionary.written == told


def test_one_that_does_not_answer_is_named_and_the_next_is_stopped_all_the_same() -> None:
    silent, _ = drive(1, OPERATION_ENABLED, DriverErrorKind.CANNOT_CONNECT)
    silent.values = {objects.STATUSWORD: OPERATION_ENABLED}
    sound, dictionary = drive(2, OPERATION_ENABLED)
    faults = stop_one_by_one([silent, sound], Goal.QUICK_STOP, is_stopped=False)
    assert [(fault.code, fault.joint) for fault in faults] == [("silent", 1)]
    assert silent.state is None, "what it sent before is not what it is now"
    assert dictionary.written == [QUICK_STOP, FORGET_MASTER]


def test_a_bus_that_is_gone_is_no_silent_drive() -> None:
    node, _ = drive(1, OPERATION_ENABLED, DriverErrorKind.LOST)
    with pytest.raises(DriverError) as failure:
        stop_one_by_one([node], Goal.QUICK_STOP, is_stopped=False)
    assert failure.value.kind is DriverErrorKind.LOST


class Unanswered(Session):
    """Drives that answer no SYNC: what they told in the last cycle that they answered is all there is."""

    cycles = 0

    def cycle(self, *_: object) -> ArmState:
        self.cycles += 1
        for node in self.nodes:
            node.values = {}
        return self.observe(0)


class Clock:
    """Stands still."""

    def now_ns(self) -> int:
        return 0

    def wait_until_ns(self, deadline_ns: int) -> int:
        return deadline_ns


@pytest.mark.parametrize(("is_deaf", "cycles", "is_enabled"), [(True, 1, False), (False, PROMPT_CYCLES, True)])
def test_drives_that_missed_the_master_are_asked_what_they_have_done(
    is_deaf: bool, cycles: int, is_enabled: bool
) -> None:
    node, dictionary = drive(1, OPERATION_ENABLED)
    session = Unanswered(None, (node,), Clock(), 0)  # pyright: ignore[reportArgumentType]
    session.read_by_sdo()
    node.is_deaf, dictionary.values[objects.STATUSWORD] = is_deaf, SWITCH_ON_DISABLED
    state = stop_promptly(session, ControlMode.POSITION, Goal.SWITCH_ON_DISABLED)
    assert session.cycles == cycles
    assert state.enabled.tolist() == [is_enabled], "one that may hear the next cycle is as it last told"


def test_what_has_stopped_depends_on_where_the_stop_goes() -> None:
    words = (SWITCH_ON_DISABLED, READY, SWITCHED_ON, OPERATION_ENABLED, QUICK_STOP_ACTIVE, FAULT, None)
    found: dict[Goal, list[int | None]] = {Goal.QUICK_STOP: [], Goal.SWITCH_ON_DISABLED: []}
    for goal, stopped in found.items():
        for word in words:
            node, _ = drive(1, 0)
            node.values = {} if word is None else {objects.STATUSWORD: word}
            if has_stopped(node, goal):
                stopped.append(word)
    assert found[Goal.QUICK_STOP] == [QUICK_STOP_ACTIVE, FAULT]
    assert found[Goal.SWITCH_ON_DISABLED] == [SWITCH_ON_DISABLED, READY, SWITCHED_ON, FAULT]


def test_drives_without_power_where_the_arm_shall_be_held_are_named() -> None:
    words = (QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED, FAULT, READY, SWITCHED_ON)
    nodes = [drive(joint, word)[0] for joint, word in enumerate(words, 1)]
    for node in nodes:
        node.read_now()
    found = [(fault.code, fault.joint) for fault in dropped_faults(nodes)]
    assert found == [("not-held", 2), ("not-held", 4), ("not-held", 5)]


def test_a_host_that_fell_silent_is_one_fault_and_what_the_driver_caught_comes_first() -> None:
    nodes = [drive(joint, FAULT)[0] for joint in (1, 2, 3)]
    for node, code in zip(nodes, (HEARTBEAT_LOST, 0x4310, HEARTBEAT_LOST), strict=True):
        node.error_code = code
    caught = Fault("over-speed", 3, "moves at 9", "stop it")
    found = [(fault.code, fault.joint) for fault in arm_faults(nodes, caught)]
    assert found == [("over-speed", 3), ("watchdog", None), ("over-temperature", 2)]
