"""The robot file's drive blocks, right and wrong."""

import re
from typing import Any

import pytest

from tauscope_drivers.canopen.configuration import read_configuration
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.errors import DriverError


def joints(first: dict[str, Any] | None = None, second: dict[str, Any] | None = None) -> list[DriveJoint]:
    bus = {"interface": "socketcan", "channel": "can0", "node_id": 1, "counts_per_turn": 65536}
    return [
        DriveJoint("shoulder", bus | (first or {}), gear_ratio=50.0),
        DriveJoint("elbow", {"node_id": 2, "counts_per_turn": 65536} | (second or {}), gear_ratio=50.0),
    ]


def test_the_bus_stands_on_the_first_joint() -> None:
    configuration = read_configuration(joints({"bit_rate": 500_000}, {"direction": -1}))
    assert (configuration.interface, configuration.channel, configuration.bit_rate) == ("socketcan", "can0", 500_000)
    assert [node.node_id for node in configuration.nodes] == [1, 2]
    assert [node.direction for node in configuration.nodes] == [1, -1]


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ({}, {"node_id": 1}, "joint shoulder: drive.node_id = 1 is there twice"),
        ({}, {"node_id": 128}, "joint elbow: drive.node_id = 128; give a whole number from 1 to 127"),
        ({}, {"channel": "can1"}, "joint elbow: drive.channel differs from that of shoulder"),
        ({"counts_per_turn": 0}, {}, "joint shoulder: drive.counts_per_turn = 0; give a positive number"),
        ({"counts_per_turn": float("nan")}, {}, "joint shoulder: drive.counts_per_turn = nan"),
        ({"interface": ""}, {}, "joint shoulder: drive.interface is missing"),
        ({}, {"direction": 0}, "joint elbow: drive.direction = 0"),
        ({}, {"gear": 3}, "joint elbow: drive.gear is not known; known keys: "),
        ({"options": 3}, {}, "joint shoulder: drive.options = 3; give what python-can takes"),
        ({"options": {"host": ["a"]}}, {}, "joint shoulder: drive.options = {'host': ['a']}; give what python-can"),
        ({"options": {"bitrate": 1}}, {}, "joint shoulder: drive.options.bitrate has a key of its own"),
        ({}, {"options": {"host": "a"}}, "joint elbow: drive.options differs from that of shoulder"),
        ({}, {"rated_torque_nm": True}, "joint elbow: drive.rated_torque_nm = True; give a positive number"),
    ],
)
def test_what_is_wrong_is_named(first: dict[str, Any], second: dict[str, Any], message: str) -> None:
    with pytest.raises(DriverError, match=re.escape(message)):
        read_configuration(joints(first, second))
