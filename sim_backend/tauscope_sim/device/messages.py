"""What the bodies of frames hold: numbers of every cycle in binary, everything rare as JSON."""

import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from typing import Any, TypeVar

import numpy as np
from pydantic import TypeAdapter

from tauscope_drivers import ArmState, ControlMode, DriveLimits, DriverError, Fault, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind

PROTOCOL = 1  # version that host and device have to agree on
LARGEST_BODY = 65536  # longest body that is accepted [B]

_HEADER = struct.Struct("<BxxxII")


class FrameKind(IntEnum):
    """What a frame is."""

    HELLO = 1
    ENABLE = 2
    EXCHANGE = 3
    STOP = 4
    ACKNOWLEDGE = 5
    READ = 6
    INJECT = 7
    STATUS = 8
    GOODBYE = 9
    PUT_BACK = 11
    WELCOME = 64
    STATE = 65
    ERROR = 66
    REPORT = 67


@dataclass(frozen=True)
class Frame:
    """One message."""

    kind: FrameKind
    sequence: int
    body: bytes = b""

    def encode(self) -> bytes:
        """The frame as it goes over the wire."""
        return _HEADER.pack(self.kind, self.sequence, len(self.body)) + self.body


class BrokenFrameError(ValueError):
    """What arrived is no frame: the connection cannot be used any longer."""


class FrameBuffer:
    """Cuts a stream of bytes into frames."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, data: bytes) -> list[Frame]:
        """Take what arrived; the frames that are complete. Raises BrokenFrameError: unknown kind, or too long."""
        self._bytes += data
        frames: list[Frame] = []
        while len(self._bytes) >= _HEADER.size:
            kind, sequence, length = _HEADER.unpack_from(self._bytes)
            if length > LARGEST_BODY:
                raise BrokenFrameError(f"a frame of {length} bytes; the most is {LARGEST_BODY}")
            end = _HEADER.size + length
            if len(self._bytes) < end:
                break
            if kind not in iter(FrameKind):
                raise BrokenFrameError(f"a frame of the unknown kind {kind}")
            frames.append(Frame(FrameKind(kind), sequence, bytes(self._bytes[_HEADER.size : end])))
            del self._bytes[:end]
        return frames


_INSTANT = struct.Struct("<q")
_STATE_HEAD = struct.Struct("<qH")


class BadMessageError(ValueError):
    """A body that does not hold what its kind of frame says."""


@dataclass(frozen=True)
class Enabling:
    """A request to enable."""

    mode: ControlMode
    stop_policy: StopPolicy
    watchdog_s: float
    limits: Mapping[str, Sequence[float]]  # the fields of `DriveLimits`


@dataclass(frozen=True)
class Refusal:
    """A `DriverError`."""

    kind: DriverErrorKind
    message: str
    faults: tuple[Fault, ...]


_Document = TypeVar("_Document")
_find_adapter = cache(TypeAdapter)


def encode_document(document: Any) -> bytes:
    """Plain data or a dataclass as JSON, with Python's words for infinity and not-a-number."""
    return json.dumps(document, default=vars).encode()


def decode_document(kind: type[_Document], body: bytes) -> _Document:
    """What `encode_document` wrote. Raises BadMessageError where it is not of this type."""
    with _expecting(kind.__name__):
        return _find_adapter(kind).validate_python(json.loads(body))


def encode_setpoint(sent_ns: int, setpoint: Setpoint) -> bytes:
    """Instant, then position and torque, 2 n numbers. `sent_ns`: now, by the machine's monotonic clock [ns]."""
    return _INSTANT.pack(sent_ns) + np.concatenate([setpoint.position, setpoint.torque]).astype("<f8").tobytes()


def decode_setpoint(body: bytes, joint_count: int) -> tuple[int, Setpoint]:
    """Instant and setpoint of an exchange, finite or not. Raises BadMessageError for another number of values."""
    if len(body) != _INSTANT.size + 16 * joint_count:
        raise BadMessageError(f"a setpoint of {len(body)} bytes for {joint_count} joints")
    numbers = np.frombuffer(body, dtype="<f8", offset=_INSTANT.size).astype(np.float64)
    return _INSTANT.unpack_from(body)[0], Setpoint(numbers[:joint_count], numbers[joint_count:])


def encode_state(state: ArmState) -> bytes:
    """Time, position, velocity, effort, temperature, enabled, and the faults as JSON where there are any."""
    numbers = np.concatenate([state.position, state.velocity, state.effort, state.temperature]).astype("<f8")
    faults = encode_document(state.faults) if state.faults else b""
    head = _STATE_HEAD.pack(state.time_ns, len(state.position))
    return b"".join((head, numbers.tobytes(), state.enabled.tobytes(), faults))


def decode_state(body: bytes) -> ArmState:
    """The reading that `encode_state` wrote. Raises BadMessageError where it does not hold a reading."""
    with _expecting("reading of the arm"):
        time_ns, count = _STATE_HEAD.unpack_from(body)
        numbers = np.frombuffer(body, "<f8", 4 * count, _STATE_HEAD.size).astype(np.float64).reshape(4, count)
        end = _STATE_HEAD.size + 33 * count
        enabled = np.frombuffer(body, np.uint8, count, end - count).astype(np.bool_)
        faults = decode_document(tuple[Fault, ...], body[end:]) if len(body) > end else ()
    position, velocity, effort, temperature = numbers
    return ArmState(time_ns, position, velocity, effort, temperature, enabled, faults)


def encode_error(error: DriverError) -> bytes:
    """A refusal."""
    return encode_document(Refusal(error.kind, str(error), error.faults))


def decode_error(body: bytes) -> DriverError:
    """The error that `encode_error` wrote. Raises BadMessageError where it does not hold one."""
    refusal = decode_document(Refusal, body)
    return DriverError(refusal.kind, refusal.message, refusal.faults)


def encode_enable(mode: ControlMode, limits: DriveLimits, stop_policy: StopPolicy, watchdog_s: float) -> bytes:
    """A request to enable; `watchdog_s`: time of the watchdog [s]."""
    plain = {name: np.ravel(values).tolist() for name, values in vars(limits).items()}
    return encode_document(Enabling(mode, stop_policy, watchdog_s, plain))


def decode_enable(body: bytes) -> tuple[ControlMode, DriveLimits, StopPolicy, float]:
    """The arguments of `encode_enable`. Raises BadMessageError where a field is missing or of the wrong kind."""
    asked = decode_document(Enabling, body)
    with _expecting("DriveLimits"):
        limits = DriveLimits(**{name: np.array(values, dtype=np.float64) for name, values in asked.limits.items()})
    return asked.mode, limits, asked.stop_policy, asked.watchdog_s


@contextmanager
def _expecting(what: str) -> Iterator[None]:
    """Whatever else is found is a bad message."""
    try:
        yield
    except (struct.error, ValueError, TypeError, KeyError, OverflowError, RecursionError) as error:
        raise BadMessageError(f"the body is no {what}") from error
