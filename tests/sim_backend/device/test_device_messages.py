"""Frames and their bodies: what goes in comes out, and nothing else is ever accepted."""

import json
from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tauscope_drivers import ArmState, ControlMode, DriveLimits, DriverError, Fault, Setpoint, StopPolicy
from tauscope_drivers.errors import DriverErrorKind
from tauscope_sim.device import Disturbance, Injection
from tauscope_sim.device import messages as m
from tauscope_sim.device.messages import LARGEST_BODY, BrokenFrameError, Frame, FrameBuffer, FrameKind

FAULT = Fault("overload", 2, "détail", "remedy")
DOCUMENTS = [partial(m.decode_document, kind) for kind in (dict, Injection, StopPolicy)]
DECODERS = [*DOCUMENTS, m.decode_state, m.decode_error, m.decode_enable]


@given(st.lists(st.tuples(st.sampled_from(FrameKind), st.integers(0, 2**32 - 1), st.binary(max_size=200))), st.data())
def test_frames_survive_any_division_of_the_stream(contents: list[tuple[FrameKind, int, bytes]], data) -> None:
    frames = [Frame(*content) for content in contents]
    stream = b"".join(frame.encode() for frame in frames)
    buffer, received = FrameBuffer(), []
    while stream:
        cut = data.draw(st.integers(1, len(stream)))
        received += buffer.feed(stream[:cut])
        stream = stream[cut:]
    assert received == frames


@given(st.binary(max_size=300))
def test_any_bytes_are_frames_or_refused(data: bytes) -> None:
    try:
        frames = FrameBuffer().feed(data)
    except BrokenFrameError:
        return
    assert all(isinstance(frame.kind, FrameKind) for frame in frames)


def test_a_frame_that_is_too_long_is_refused_by_its_header() -> None:
    header = Frame(FrameKind.READ, 1).encode()[:8] + (LARGEST_BODY + 1).to_bytes(4, "little")
    with pytest.raises(BrokenFrameError, match="65537"):
        FrameBuffer().feed(header)


@pytest.mark.parametrize("faults", [(), (FAULT, Fault("watchdog", None, "silent", "acknowledge"))])
def test_states_go_both_ways(faults: tuple[Fault, ...]) -> None:
    numbers = np.array([[0.1, np.nan], [np.inf, -2.0], [3.0, 4.0], [25.0, np.nan]])
    state = ArmState(-5, numbers[0], numbers[1], numbers[2], numbers[3], np.array([True, False]), faults)
    back = m.decode_state(m.encode_state(state))
    assert (back.time_ns, back.faults, back.enabled.tolist()) == (-5, faults, [True, False])
    received = [back.position, back.velocity, back.effort, back.temperature]
    np.testing.assert_array_equal(received, numbers)


def test_setpoints_go_both_ways() -> None:
    sent = Setpoint(np.array([1.0, np.nan]), np.array([-np.inf, 0.5]))
    instant, back = m.decode_setpoint(m.encode_setpoint(7, sent), 2)
    assert instant == 7
    np.testing.assert_array_equal([back.position, back.torque], [sent.position, sent.torque])
    with pytest.raises(m.BadMessageError):
        m.decode_setpoint(m.encode_setpoint(7, sent), 3)


def test_requests_go_both_ways() -> None:
    limits = DriveLimits(
        np.array([-np.inf, -1.0]), np.array([np.inf, 1.0]), np.array([1.0, 2.0]), np.array([np.nan, 3])
    )
    mode, kept, policy, watchdog_s = m.decode_enable(
        m.encode_enable(ControlMode.TORQUE, limits, StopPolicy.DAMP, float("inf"))
    )
    assert (mode, policy, watchdog_s) == (ControlMode.TORQUE, StopPolicy.DAMP, float("inf"))
    for name in ("position_low", "position_high", "velocity", "torque"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(limits, name))
    injection = Injection(Disturbance.ENCODER_JUMP, 3, 5, None, -0.25)
    assert m.decode_document(Injection, m.encode_document(injection)) == injection
    stop = m.encode_document(StopPolicy.TORQUE_OFF)
    assert m.decode_document(StopPolicy, stop) is StopPolicy.TORQUE_OFF


def test_errors_go_both_ways() -> None:
    error = m.decode_error(m.encode_error(DriverError(DriverErrorKind.FAULT, "joint 2: hot", (FAULT,))))
    assert (error.kind, str(error), error.faults) == (DriverErrorKind.FAULT, "joint 2: hot", (FAULT,))


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
)
_KEYS = ["mode", "limits", "stop_policy", "watchdog_s", "policy", "kind", "joint", "start_ns", "duration_ns", "size"]
_DOCUMENTS = st.dictionaries(st.sampled_from(_KEYS), _JSON).map(lambda document: json.dumps(document).encode())


@given(st.binary(max_size=200) | _DOCUMENTS)
def test_any_body_is_understood_or_refused(body: bytes) -> None:
    for decode in DECODERS:
        with suppress(m.BadMessageError):
            decode(body)
