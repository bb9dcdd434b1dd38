"""The ROS 2 message sensor_msgs/msg/JointState as CDR bytes, for a publisher that keeps to one layout."""

import struct
from collections.abc import Sequence

import numpy as np

from tauscope.recording.samples import Array

JOINT_STATE_DEFINITION = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""

_ENCAPSULATION = b"\x00\x01\x00\x00"
_STAMP = struct.Struct("<iI")
_NANOSECONDS = 1_000_000_000


class JointStateEncoder:
    """Writes joint states of the same joints, message after message, into one template."""

    def __init__(self, names: Sequence[str], *, has_velocity: bool = True, has_effort: bool = True) -> None:
        message = bytearray(_ENCAPSULATION + bytes(_STAMP.size))
        _append_string(message, "")
        _append_length(message, len(names))
        for name in names:
            _append_string(message, name)
        counts = (len(names), len(names) if has_velocity else 0, len(names) if has_effort else 0)
        places = [_append_numbers(message, count) for count in counts]
        self._message = message
        self._numbers = [np.frombuffer(message, "<f8", count, at) for count, at in zip(counts, places, strict=True)]

    def encode(self, stamp_ns: int, position: Array, velocity: Array | None, effort: Array | None) -> bytes:
        """One message.

        `stamp_ns`: time of measurement since 1970 [ns].
        `position`: (n,) [rad or m].
        `velocity`: (n,) [rad/s or m/s]; None where the layout has none.
        `effort`: (n,) [Nm or N]; None where the layout has none.
        """
        _STAMP.pack_into(self._message, len(_ENCAPSULATION), stamp_ns // _NANOSECONDS, stamp_ns % _NANOSECONDS)
        for target, values in zip(self._numbers, (position, velocity, effort), strict=True):
            if values is not None:
                target[:] = values
        return bytes(self._message)


def _append_length(message: bytearray, length: int) -> None:
    """A uint32, aligned to its own size behind the encapsulation header."""
    message.extend(bytes(-(len(message) - len(_ENCAPSULATION)) % 4))
    message.extend(struct.pack("<I", length))


def _append_string(message: bytearray, text: str) -> None:
    """Length with the closing NUL, text, NUL."""
    content = text.encode() + b"\0"
    _append_length(message, len(content))
    message.extend(content)


def _append_numbers(message: bytearray, count: int) -> int:
    """Room for a float64 sequence; where its numbers begin."""
    _append_length(message, count)
    if count:
        message.extend(bytes(-(len(message) - len(_ENCAPSULATION)) % 8))
    place = len(message)
    message.extend(bytes(8 * count))
    return place
