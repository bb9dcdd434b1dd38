"""Whatever frames come, the driver neither crashes nor takes one of another length for an answer."""

from collections.abc import Iterator
from uuid import uuid4

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tauscope_drivers.canopen.bus import CanBus
from tauscope_drivers.canopen.configuration import BusConfiguration, NodeConfiguration
from tauscope_drivers.canopen.node import DriveNode
from tauscope_drivers.canopen.state_machine import Goal, next_controlword

NODE = 5
OURS = [base + NODE for base in (0x080, 0x180, 0x280, 0x580, 0x700)]
"""Identifiers that the node listens to."""


@pytest.fixture(scope="module")
def buses() -> Iterator[tuple[can.BusABC, CanBus]]:
    channel = str(uuid4())
    with can.Bus(interface="virtual", channel=channel) as peer:
        bus = CanBus(BusConfiguration((), "virtual", channel, 1_000_000))
        yield peer, bus
        bus.close()


def messages() -> st.SearchStrategy[can.Message]:
    """Of any kind, most of them to the node."""
    identifiers = st.sampled_from(OURS) | st.integers(0, 0x7FF)
    kinds = st.sampled_from([{}, {}, {}, {"is_remote_frame": True}, {"is_error_frame": True}, {"is_extended_id": True}])

    def message(identifier: int, data: bytes, kind: dict[str, bool]) -> can.Message:
        payload = {} if kind.get("is_remote_frame") else {"data": data}
        return can.Message(arbitration_id=identifier, **{"is_extended_id": False, **payload, **kind})

    return st.builds(message, identifiers, st.binary(max_size=8), kinds)


@given(noise=st.lists(messages(), max_size=20))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_frame_crashes_the_driver(buses: tuple[can.BusABC, CanBus], noise: list[can.Message]) -> None:
    peer, bus = buses
    node = DriveNode.on_bus(bus, NodeConfiguration(NODE, 65_536.0, 1.0), 1)
    for message in noise:
        peer.send(message)
    bus.drain()
    node.remember(0)
    plain = [one for one in noise if not (one.is_remote_frame or one.is_error_frame or one.is_extended_id)]
    told = {(one.arbitration_id, len(one.data)) for one in plain}
    assert node.has_answered == ({(0x180 + NODE, 8), (0x280 + NODE, 6)} <= told), "both frames, each of its length"
    assert next_controlword(node.last_state, Goal.OPERATION_ENABLED) in (0x0, 0x6, 0x7, 0xF), "never a fault reset"
    assert all("\n" not in str(fault) and fault.remedy for fault in node.faults())
