"""SDOs on a bus that loses, delays and doubles frames; the node's side is written here, byte by byte."""

from collections import deque

import pytest

from tauscope_drivers.canopen import objects
from tauscope_drivers.canopen.sdo import ATTEMPTS, TRANSFERS, NodeDictionary, PumpedSdoClient
from tauscope_drivers.errors import DriverError, DriverErrorKind

STATUSWORD_ANSWER = bytes.fromhex("4B41600037020000")
POSITION_ANSWER = bytes.fromhex("43646000D0070000")


class ScriptedNode:
    """A node whose answers to each request are given; stands in for the network and for the bus."""

    def __init__(self, *answers: list[bytes]) -> None:
        self.requests: list[bytes] = []
        self._answers, self._arriving = list(answers), deque[bytes]()
        client = PumpedSdoClient(self, 5)
        client.network = self  # pyright: ignore[reportAttributeAccessIssue]
        self._client = client
        self.dictionary = NodeDictionary(client, 5)

    def send_message(self, identifier: int, data: bytes) -> None:
        assert identifier == 0x605
        self.requests.append(bytes(data))
        self._arriving.extend(self._answers.pop(0) if self._answers else [])

    def receive(self, deadline_ns: int) -> bool:
        del deadline_ns
        if not self._arriving:
            return False
        self._client.on_response(0x585, self._arriving.popleft(), 0.0)
        return True


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope_drivers.canopen.sdo.SDO_TIMEOUT_S", 0.001)


def test_a_lost_answer_is_asked_for_again() -> None:
    node = ScriptedNode([], [STATUSWORD_ANSWER])
    assert node.dictionary.read(objects.STATUSWORD) == 0x0237
    assert node.requests == [bytes.fromhex("4041600000000000")] * 2


def test_a_late_answer_is_not_taken_for_the_next_question() -> None:
    node = ScriptedNode([], [STATUSWORD_ANSWER, STATUSWORD_ANSWER], [POSITION_ANSWER])
    assert node.dictionary.read(objects.STATUSWORD) == 0x0237
    assert node.dictionary.read(objects.POSITION_ACTUAL) == 2000


def test_a_written_value_is_written_again_where_another_one_is_kept() -> None:
    done, kept, zero = (bytes.fromhex(text) for text in ("6040600000000000", "4B40600006000000", "4B40600000000000"))
    node = ScriptedNode([done], [zero], [done], [kept])
    node.dictionary.write(objects.CONTROLWORD, 6)
    stubborn = ScriptedNode(*[[done], [zero]] * 2)
    with pytest.raises(DriverError, match="written as 6 and reads 0") as refusal:
        stubborn.dictionary.write(objects.CONTROLWORD, 6)
    assert refusal.value.kind is DriverErrorKind.REFUSED


def test_a_silent_node_is_given_up_after_some_attempts() -> None:
    node = ScriptedNode()
    with pytest.raises(DriverError, match="check node number"):
        node.dictionary.read(objects.STATUSWORD)
    assert sum(request[0] == 0x40 for request in node.requests) == ATTEMPTS * TRANSFERS


@pytest.mark.parametrize("altered", ["8041600001000405", "0041600000000000"])
def test_a_question_that_was_altered_on_its_way_is_asked_again(altered: str) -> None:
    """The node knows no such command, or answers another one."""
    node = ScriptedNode([bytes.fromhex(altered)], [STATUSWORD_ANSWER])
    assert node.dictionary.read(objects.STATUSWORD) == 0x0237


def test_a_node_that_declines_twice_is_believed() -> None:
    missing = bytes.fromhex("8041600000000206")
    node = ScriptedNode([missing], [missing])
    assert node.dictionary.read_optional(objects.STATUSWORD) is None
    assert len(node.requests) == 2


def test_what_everything_hangs_on_is_read_until_two_readings_agree() -> None:
    altered, rated = bytes.fromhex("4376600090810000"), bytes.fromhex("4376600090010000")
    assert ScriptedNode([rated], [rated]).dictionary.read_surely(objects.RATED_TORQUE) == 400
    assert ScriptedNode([altered], [rated], [rated]).dictionary.read_surely(objects.RATED_TORQUE) == 400
    fickle = ScriptedNode(*[[one] for one in (altered, rated)] * 2)
    with pytest.raises(DriverError, match="reads 33168, 400, 33168, 400; check the wiring"):
        fickle.dictionary.read_surely(objects.RATED_TORQUE)
