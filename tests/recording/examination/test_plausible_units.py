"""Sound recordings are never refused; recordings in other units are, with the option that mends them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recording.examination.sound_arms import record_sound_arm, with_limits
from recording.recording_files import message_of
from tauscope.recording import Recording, Samples, examine_recording
from tauscope.recording.examination.plausibility import find_implausible
from tauscope.robot import JointLimits

DEGREES = 180.0 / np.pi
SPEEDS = {"t=ms": 1e3, "t=us": 1e6, "t=ns": 1e9}


def change(samples: Samples, **changes) -> Recording:
    """A recording of samples of which some channels are others."""
    channels = {"time": samples.time, "position": samples.position, "effort": samples.effort, **changes}
    velocity = changes.get("velocity", samples.velocity)
    return Recording.from_arrays("file.csv", **{**channels, "velocity": velocity})


@given(seed=st.integers(0, 2**31), limited=st.booleans())
def test_sound_recordings_are_not_refused(seed: int, limited: bool) -> None:
    sound = record_sound_arm(seed, rows=1500)
    robot = with_limits(sound.robot, sound.recording, np.random.default_rng(seed)) if limited else sound.robot
    assert find_implausible(sound.recording, robot) is None
    assert find_implausible(sound.recording) is None


@given(seed=st.integers(0, 2**31), unit=st.sampled_from(["t=us", "t=ns"]))
def test_microseconds_and_nanoseconds_are_refused(seed: int, unit: str) -> None:
    sound = record_sound_arm(seed)
    samples = sound.recording.samples()
    doubt = find_implausible(change(samples, time=samples.time * SPEEDS[unit]), sound.robot)
    assert doubt is not None
    assert doubt.startswith("column t")


def swing(rate_hz: float = 100.0, joints: int = 3) -> Samples:
    """Half a minute of waves of about a radian, the torque of a load and of friction, and velocities."""
    rng = np.random.default_rng(1)
    time = np.arange(int(30 * rate_hz)) / rate_hz
    phase = time[:, None] * np.linspace(0.9, 1.7, joints)
    position, velocity = np.sin(phase), np.cos(phase) * np.linspace(0.9, 1.7, joints)
    effort = 20 * np.sin(position) + 2 * np.sign(velocity) + 0.1 * rng.normal(size=position.shape)
    return Recording.from_arrays("swing", time, position, effort, velocity=velocity).samples()


@pytest.mark.parametrize("unit", SPEEDS)
@pytest.mark.parametrize("with_velocity", [True, False])
def test_time_names_its_unit(unit: str, with_velocity: bool) -> None:
    samples = swing()
    given_velocity = samples.velocity if with_velocity else None
    recording = change(samples, time=samples.time * SPEEDS[unit], velocity=given_velocity)
    message = message_of(lambda: examine_recording(recording))
    assert message.startswith("file.csv: column t: ")
    assert f"--units {unit}" in message
    assert message.endswith("go on with --trust-units")


def test_a_sample_index_names_its_rate() -> None:
    samples = swing()
    message = message_of(lambda: examine_recording(change(samples, time=np.arange(len(samples.time)) * 1.0)))
    assert "counts samples of about 100 Hz; read it with --units t=index --rate HZ" in message
    message = message_of(
        lambda: examine_recording(change(samples, time=np.arange(len(samples.time)) * 1.0, velocity=None))
    )
    assert "--units t=ms where it counts ms, or --units t=index" in message


@pytest.mark.parametrize(
    ("position", "velocity", "units"),
    [(DEGREES, 1.0, "q=deg,qd=rad"), (1.0, DEGREES, "qd=deg"), (1.0, 60 / (2 * np.pi), "qd=rpm")],
)
def test_velocity_tells_degrees_and_turns_a_minute(position: float, velocity: float, units: str) -> None:
    samples = swing()
    assert samples.velocity is not None
    recording = change(samples, position=samples.position * position, velocity=samples.velocity * velocity)
    assert f"--units {units}, or" in message_of(lambda: examine_recording(recording))


def test_a_velocity_of_the_motor_is_no_unit() -> None:
    samples = swing()
    assert samples.velocity is not None
    assert find_implausible(change(samples, velocity=samples.velocity * 101.0)) is None


def test_velocities_that_differ_by_joint_or_from_row_to_row_are_no_unit() -> None:
    samples = swing()
    assert samples.velocity is not None
    for factor in ([50.0, 57.0, 80.0], np.random.default_rng(2).uniform(35.0, 80.0, samples.velocity.shape)):
        assert find_implausible(change(samples, velocity=samples.velocity * factor)) is None


def test_velocities_in_the_place_of_torque_are_refused() -> None:
    samples = swing()
    assert samples.velocity is not None
    message = message_of(lambda: examine_recording(change(samples, velocity=samples.effort, effort=samples.velocity)))
    assert (
        "column tau1: tau1 to tau3 are the velocities of q1 to q3; name the columns of torque by --columns" in message
    )
    viscous = samples.velocity * [1.0, 1.0, 3.0]
    assert find_implausible(change(samples, effort=viscous)) is None


def test_degrees_of_a_single_pendulum_show_in_its_torque() -> None:
    samples = swing(joints=1)
    turned = change(samples, position=100 * samples.position, velocity=None, effort=20 * np.sin(100 * samples.position))
    assert find_implausible(turned) is None
    effort = 20 * np.sin(np.radians(100 * samples.position)) + 0.2 * np.sign(np.gradient(samples.position, axis=0))
    in_degrees = change(samples, position=100 * samples.position, velocity=None, effort=effort)
    doubt = find_implausible(in_degrees)
    assert doubt is not None
    assert "its torque swings once in 360" in doubt


def test_registers_and_magnitudes_are_refused() -> None:
    samples = swing()
    counts = np.rint(samples.effort * 20)
    for registers in (np.mod(counts, 65536), np.where(counts < 0, 1024 - counts, counts)):
        assert "register has that is read without its sign" in str(find_implausible(change(samples, effort=registers)))
    assert "this is a magnitude" in str(find_implausible(change(samples, effort=np.abs(samples.effort))))


def test_a_fast_drive_in_milliseconds_is_refused() -> None:
    samples = swing(rate_hz=4000.0)  # 4 Hz in ms: a rate that slow loggers have
    doubt = find_implausible(change(samples, time=samples.time * 1e3, velocity=None))
    assert doubt is not None
    assert "t=ms" in doubt


def test_a_slow_friction_sweep_is_not_refused() -> None:
    samples = swing(rate_hz=2000.0)
    slow = change(samples, time=samples.time * 200.0, velocity=None)  # 10 Hz, and 240 s for a sweep
    assert find_implausible(slow) is None


def test_recorded_velocity_vouches_for_a_slow_clock() -> None:
    samples = swing()
    assert samples.velocity is not None
    assert find_implausible(change(samples, time=samples.time * 100.0, velocity=samples.velocity / 100.0)) is None


def test_encoder_counts_are_no_angles() -> None:
    samples = swing()
    counts = np.rint(2048 + samples.position * 4096 / (2 * np.pi))
    assert "counts of an encoder" in str(find_implausible(change(samples, position=counts, velocity=None)))
    whole_degrees = np.rint(100.0 * samples.position)
    assert "--units q=deg" in str(find_implausible(change(samples, position=whole_degrees, velocity=None)))


def test_torque_limits_tell_milliamperes() -> None:
    sound = record_sound_arm(8)
    robot = sound.robot
    effort = sound.recording.samples().effort
    limits = np.abs(effort).max(axis=0) * np.linspace(1.0, 2.0, effort.shape[1])
    joints = tuple(replace(j, limits=JointLimits(torque=float(v))) for j, v in zip(robot.joints, limits, strict=True))
    current = change(sound.recording.samples(), effort=100.0 * effort)
    doubt = find_implausible(current, replace(robot, joints=joints))
    assert doubt is not None
    assert "tau=mA" in doubt
    assert "torque_constant" in doubt


def test_trust_goes_on_and_says_so() -> None:
    samples = swing()
    recording = examine_recording(change(samples, time=samples.time * 1e3, velocity=None), trust_units=True)
    assert recording.warnings[0].code == "doubtful-units"
    assert recording.warnings[0].remedy == "read it with --units t=ms"
