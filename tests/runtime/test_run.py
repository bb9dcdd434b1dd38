"""A run in virtual time, from the first call to the last file."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from runtime.doubles import PointArm, connection, point_robot, short_motion, with_fault
from tauscope.errors import AcquisitionError
from tauscope.recording import EffortKind, read_recording
from tauscope.recording.journal_reading import read_journal
from tauscope.recording.journal_rows import Phase
from tauscope.robot import Robot
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord, read_record
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import ManualStop, RunState, StopSource
from tauscope_drivers import ArmState, ControlMode, DriverError, StopPolicy
from tauscope_drivers.errors import DriverErrorKind

START = np.array([0.4, -0.3])


def run(folder: Path, arm: PointArm | None = None, **options: object) -> tuple[RunRecord, PointArm, list[dict]]:
    """A run of the point masses, its arm and its events."""
    robot, events = point_robot(), []
    arm = arm or PointArm(position=START)
    record = run_trajectory(
        robot,
        short_motion(robot),
        connection(arm),
        folder,
        RunOptions.model_validate(options),
        report=lambda event: events.append(dict(event)),
    )
    assert read_record(folder) == record
    return record, arm, events


def states(record: RunRecord) -> list[str]:
    return [transition.state.value for transition in record.history]


def test_a_sound_run(tmp_path: Path) -> None:
    record, arm, events = run(tmp_path / "run")
    assert record.problem is None
    assert states(record) == ["created", "connecting", "enabling", "ramping", "running", "stopping", "finished"]
    assert [event["state"] for event in events if event["event"] == "state"] == states(record)[1:]
    assert events[-1]["event"] == "end"
    assert arm.calls == ["connect", "enable", "exchange", "stop", "disconnect"]
    assert arm.stops == [StopPolicy.HOLD]
    assert record.played == 1.0
    assert record.timing is not None
    assert record.timing.missed_periods == 0
    assert record.timing.lateness_us["max"] == 0.0
    assert record.recording is not None
    assert not record.recording.partial
    assert record.recording.samples == round(4 * 0.5 * 500) + 1


def test_the_recording_is_what_the_arm_did(tmp_path: Path) -> None:
    """The ramp is in the journal only; time starts with the motion; every number is the arm's own."""
    record, arm, _ = run(tmp_path / "run")
    motion = short_motion(point_robot()).samples(500.0)
    assert record.recording is not None
    for name in record.recording.files:
        samples = read_recording(tmp_path / "run" / name).samples()
        np.testing.assert_allclose(samples.time, motion.time, atol=1e-12)
        np.testing.assert_array_equal(samples.position, motion.position)
        assert samples.reference is not None
        np.testing.assert_array_equal(samples.reference, motion.position)
        np.testing.assert_array_equal(samples.period, motion.period)
        assert samples.effort_command is None, "in position mode no effort is commanded"
    journal = read_journal(tmp_path / "run" / "journal.mcap")
    ramp = journal.rows[journal.rows["phase"] == Phase.RAMP]
    np.testing.assert_allclose(ramp["position"][0], START, atol=1e-12)
    np.testing.assert_array_equal(journal.rows["position"], [sent.position for sent in arm.sent])
    assert np.abs(np.diff(ramp["position"], axis=0)).max() * 500 <= 0.5 * 2.0 + 1e-9, "half the speed limit"
    assert record.ramp_s == pytest.approx(len(ramp) / 500)
    assert [event["state"] for event in journal.events] == ["enabling", "ramping", "running", "stopping"]


def test_torque_mode_tracks_with_gains_from_the_inertia(tmp_path: Path) -> None:
    record, arm, _ = run(tmp_path / "run", mode="torque", stop_policy="damp")
    assert record.problem is None
    assert arm.stops == [StopPolicy.DAMP]
    assert max(record.worst_following) < 0.005
    samples = read_recording(tmp_path / "run" / "recording.csv").samples()
    assert samples.effort_command is not None
    np.testing.assert_array_equal(samples.effort_command, [sent.torque for sent in arm.sent][-len(samples.time) :])


def test_torque_mode_without_reported_velocity(tmp_path: Path) -> None:
    record, _, _ = run(tmp_path / "run", PointArm(position=START, velocity_is_reported=False), mode="torque")
    assert record.problem is None
    assert max(record.worst_following) < 0.02
    assert read_recording(tmp_path / "run" / "recording.csv").samples().velocity is None


def test_torque_mode_needs_a_model(tmp_path: Path) -> None:
    robot = replace(point_robot(), model=replace(point_robot().model, links=None))
    arm = PointArm(position=START)
    options = RunOptions(mode=ControlMode.TORQUE)
    record = run_trajectory(robot, short_motion(robot), connection(arm), tmp_path / "run", options)
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert "model" in record.problem.detail
    assert "enable" not in arm.calls


def test_currents_are_recorded_as_currents(tmp_path: Path) -> None:
    run(tmp_path / "run", PointArm(position=START, effort_unit="mA"))
    assert read_recording(tmp_path / "run" / "recording.csv").effort_kind is EffortKind.CURRENT


def silence(joint: int, from_cycle: int, until: int = 10**9) -> Callable[[PointArm, ArmState], ArmState]:
    def tamper(arm: PointArm, state: ArmState) -> ArmState:
        if from_cycle <= len(arm.sent) < until:
            state.position[joint] = np.nan
        return state

    return tamper


def after(cycle: int, change: Callable[[ArmState], ArmState]) -> Callable[[PointArm, ArmState], ArmState]:
    return lambda arm, state: change(state) if len(arm.sent) >= cycle else state


@pytest.mark.parametrize(
    ("tamper", "rule", "joint"),
    [
        (silence(1, 300), "stale-state", "joint2"),
        (after(300, with_fault), "fault", "joint2"),
        (after(300, lambda s: replace(s, position=s.position + np.array([0.25, 0.0]))), "following-error", "joint1"),
        (after(300, lambda s: replace(s, enabled=np.array([True, False]))), "not-enabled", "joint2"),
        (after(300, lambda s: replace(s, time_ns=1)), "time", None),
        (after(300, lambda s: replace(s, temperature=np.array([20.0, 99.0]))), "temperature", "joint2"),
    ],
    ids=["silent joint", "drive fault", "collision", "drop-out", "clock", "heat"],
)
def test_a_violation_stops_the_arm_by_its_policy(
    tmp_path: Path, tamper: Callable[[PointArm, ArmState], ArmState], rule: str, joint: str | None
) -> None:
    record, arm, _ = run(tmp_path / "run", PointArm(position=START, tamper=tamper), stop_policy="torque_off")
    assert states(record)[-2:] == ["stopping", "failed"]
    assert record.problem is not None
    assert (record.problem.rule, record.problem.joint) == (rule, joint)
    assert arm.stops == [StopPolicy.TORQUE_OFF]
    assert arm.calls[-2:] == ["stop", "disconnect"]
    assert len(arm.sent) <= 303
    journal = read_journal(tmp_path / "run" / "journal.mcap")
    unusable = 1 if rule == "time" else 0
    assert len(journal.rows) == len(arm.sent) - unusable, "every cycle up to the stop is in the journal"
    assert journal.events[-1]["reason"] == record.problem.detail


def test_a_joint_that_misses_now_and_then_is_counted_and_recorded_as_missing(tmp_path: Path) -> None:
    record, _, _ = run(tmp_path / "run", PointArm(position=START, tamper=silence(0, 900, 902)))
    assert record.state is RunState.FINISHED
    assert record.timing is not None
    assert record.timing.stale_samples == (2, 0)
    assert np.isnan(read_recording(tmp_path / "run" / "recording.csv").samples().position).sum() == 2


@pytest.mark.parametrize(("late_ms", "lost"), [(0.9, 0), (1.1, 2)])
def test_an_answer_of_which_nobody_knows_the_instant_is_no_sample(tmp_path: Path, late_ms: float, lost: int) -> None:
    def tamper(arm: PointArm, state: ArmState) -> ArmState:
        return replace(state, late_ns=round(late_ms * 1e6)) if 900 <= len(arm.sent) < 902 else state

    arm = PointArm(position=START, tamper=tamper)
    record, _, _ = run(tmp_path / "run", arm)
    assert record.state is RunState.FINISHED, "the arm is seen all the same, and goes on"
    assert record.timing is not None
    assert record.timing.stale_samples == (lost, lost)
    assert len(read_journal(tmp_path / "run" / "journal.mcap").rows) == len(arm.sent) - lost


def late_answers(share: int) -> PointArm:
    """An arm of whose answers one of so many is 2 ms late."""

    def tamper(arm: PointArm, state: ArmState) -> ArmState:
        return replace(state, late_ns=2_000_000) if len(arm.sent) % share == 0 else state

    return PointArm(position=START, tamper=tamper)


def test_a_run_that_keeps_too_few_samples_is_degraded_and_says_first_why(tmp_path: Path) -> None:
    record, _, events = run(tmp_path / "run", late_answers(4))
    assert record.state is RunState.DEGRADED
    assert record.kept == pytest.approx(0.75, abs=0.01)
    assert record.problem is not None
    assert re.match(
        r"\d+ answers came more than 1 ms later than usual: 75\.\d % of the motion's samples were kept, 98 %",
        record.problem.detail,
    )
    assert "--least-kept" in record.problem.detail
    assert record.recording is not None
    assert record.recording.files
    assert events[-1]["event"] == "end"


@pytest.mark.parametrize(("share", "options"), [(100, {}), (4, {"least_kept": 0.7}), (4, {"stale_ms": 3.0})])
def test_what_may_be_lost_is_an_option(tmp_path: Path, share: int, options: dict[str, float]) -> None:
    record, _, _ = run(tmp_path / "run", late_answers(share), **options)
    assert record.state is RunState.FINISHED


def test_a_loop_that_is_late_skips_and_says_so(tmp_path: Path) -> None:
    arm = PointArm(position=START)
    arm.clock.delay = lambda deadline: 7_500_000 if len(arm.sent) in (600, 800) else 0
    record, _, _ = run(tmp_path / "run", arm)
    assert record.state is RunState.FINISHED
    assert record.timing is not None
    assert record.timing.missed_periods == 6
    assert record.timing.lateness_us["max"] == 7500.0
    samples = read_recording(tmp_path / "run" / "recording.csv").samples()
    assert np.isclose(np.diff(samples.time), 0.002).sum() < len(samples.time) - 1


def test_a_loop_later_than_the_watchdog_stops(tmp_path: Path) -> None:
    arm = PointArm(position=START)
    arm.clock.delay = lambda deadline: 150_000_000 if len(arm.sent) == 600 else 0
    record, arm, _ = run(tmp_path / "run", arm)
    assert record.problem is not None
    assert record.problem.rule == "late"
    assert len(arm.sent) == 600


@pytest.mark.parametrize("call", ["connect", "enable", "exchange", "stop", "disconnect"])
@pytest.mark.parametrize(
    "error", [DriverError(DriverErrorKind.LOST, "the bus is gone"), ZeroDivisionError("a bug"), MemoryError()]
)
def test_whatever_breaks_the_arm_is_stopped_and_the_state_told(tmp_path: Path, call: str, error: Exception) -> None:
    def fail() -> None:
        raise error

    record, arm, events = run(tmp_path / "run", PointArm(position=START, fail={call: fail}))
    assert states(record)[-2:] == ["stopping", "failed"]
    assert record.problem is not None
    assert record.problem.detail
    assert arm.calls[-2:] == ["stop", "disconnect"]
    assert events[-1]["state"] == "failed"
    if call == "stop":
        assert "look at the arm" in record.problem.detail
    if call in ("stop", "disconnect"):
        assert record.recording is not None
        assert record.recording.files, "what was recorded is kept"


@pytest.mark.parametrize("state", ["connecting", "enabling", "ramping", "running"])
def test_a_stop_in_every_state(tmp_path: Path, state: str) -> None:
    stops, robot, arm = ManualStop(), point_robot(), PointArm(position=START)
    record = run_trajectory(
        robot,
        short_motion(robot),
        connection(arm),
        tmp_path / "run",
        stops=stops,
        report=lambda event: stops.request("the operator") if event.get("state") == state else None,
    )
    assert states(record)[-3:] == [state, "stopping", "stopped"]
    assert record.stop == "the operator"
    assert stops.acknowledged
    assert arm.calls[-1] == "disconnect"
    assert "stop" in arm.calls
    assert ("exchange" in arm.calls) == (state == "running")


def test_a_stop_before_the_start(tmp_path: Path) -> None:
    stops, robot, arm = ManualStop(), point_robot(), PointArm(position=START)
    stops.request("at once", StopSource.OWNER_GONE)
    record = run_trajectory(robot, short_motion(robot), connection(arm), tmp_path / "run", stops=stops)
    assert states(record) == ["created", "stopping", "interrupted"]
    assert arm.calls == []


def test_an_owner_that_cannot_listen_does_not_matter(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def deaf(event: object) -> None:
        raise BrokenPipeError("nobody there")

    robot, arm = point_robot(), PointArm(position=START)
    record = run_trajectory(robot, short_motion(robot), connection(arm), tmp_path / "run", report=deaf)
    assert record.state is RunState.FINISHED
    assert "nobody there" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arm", "options", "words"),
    [
        (PointArm(position=np.array([2.2, 0.0])), {}, "joint1: its limits are -2 to 2 rad, and the arm stands at 2.2"),
        (PointArm(position=np.array([np.nan, 0.0])), {}, "joint1: does not say where it stands"),
        (PointArm(position=START, modes=frozenset({ControlMode.POSITION})), {"mode": "torque"}, "choose position"),
        (PointArm(position=START, largest_rate_hz=100.0), {"rate_hz": 200}, "ask for at most 100"),
        (PointArm(position=START), {"watchdog_s": 5.0}, "take 0.01 to 1 s"),
        (PointArm(position=START), {"rate_hz": 10, "watchdog_s": 0.1}, "take 0.2 s or more"),
        (PointArm(joint_count=3, position=np.zeros(3)), {}, "the backend has 3"),
        (PointArm(position=START, tamper=lambda arm, state: with_fault(state)), {}, "then acknowledge the fault"),
    ],
    ids=["outside", "silent", "mode", "rate", "watchdog", "slow", "joints", "fault"],
)
def test_what_cannot_be_run_is_refused_without_torque(tmp_path: Path, arm: PointArm, options: dict, words: str) -> None:
    record, arm, _ = run(tmp_path / "run", arm, **options)
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert words in record.problem.detail
    assert "enable" not in arm.calls
    assert record.recording is None


def test_a_motion_beyond_the_limits_is_refused(tmp_path: Path) -> None:
    robot = point_robot(position=(-0.2, 0.35), velocity=2.0)
    arm = PointArm(position=np.zeros(2))
    record = run_trajectory(robot, short_motion(robot), connection(arm), tmp_path / "run")
    assert record.problem is not None
    assert "joint2: its limits are -0.2 to 0.35 rad, and the motion goes to" in record.problem.detail


def test_a_slow_bus_sets_the_rate(tmp_path: Path) -> None:
    record, _, _ = run(tmp_path / "run", PointArm(position=START, largest_rate_hz=100.0))
    assert record.state is RunState.FINISHED
    assert record.timing is not None
    assert record.timing.rate_hz == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("stated", "asked", "policy"),
    [([None, None], None, "hold"), (["damp", None], None, "damp"), (["damp", "damp"], "torque_off", "torque_off")],
)
def test_where_the_stop_policy_comes_from(
    tmp_path: Path, stated: list[str | None], asked: str | None, policy: str
) -> None:
    robot, arm = point_robot(), PointArm(position=START)
    drives = [{"stop_policy": value} if value else None for value in stated]
    joints = tuple(replace(joint, drive=drive) for joint, drive in zip(robot.joints, drives, strict=True))
    options = RunOptions.model_validate({"stop_policy": asked})
    robot = replace(robot, joints=joints)
    record = run_trajectory(robot, short_motion(robot), connection(arm), tmp_path / "run", options)
    assert record.stop_policy == policy
    assert arm.stops == [StopPolicy(policy)]


def test_stop_policies_that_disagree_or_do_not_exist(tmp_path: Path) -> None:
    robot = point_robot()
    for values, words in ((["damp", "hold"], r"damp \(joint1\) and hold \(joint2\)"), (["brake", None], "'brake'")):
        drives = [{"stop_policy": value} for value in values]
        joints = tuple(replace(joint, drive=drive) for joint, drive in zip(robot.joints, drives, strict=True))
        with pytest.raises(AcquisitionError, match=words):
            run_trajectory(
                replace(robot, joints=joints), short_motion(robot), connection(PointArm()), tmp_path / values[0]
            )
        assert not (tmp_path / values[0] / "run.json").exists(), "there is no run"


def test_an_endless_motion_is_refused(tmp_path: Path) -> None:
    robot, arm = point_robot(), PointArm(position=START)
    record = run_trajectory(robot, short_motion(robot, repeats=20_000), connection(arm), tmp_path / "run")
    assert record.problem is not None
    assert "the motion lasts 1e+04 s; at 500 cycles a second at most 8000 s can be run" in record.problem.detail


def test_a_folder_is_used_once(tmp_path: Path) -> None:
    run(tmp_path / "run")
    with pytest.raises(AcquisitionError, match="holds a run already"):
        run(tmp_path / "run")


def test_a_run_ended_in_its_ramp_leaves_a_journal_and_no_recording(tmp_path: Path) -> None:
    record, _, _ = run(tmp_path / "run", PointArm(position=START, tamper=silence(0, 50)))
    assert record.recording is not None
    assert record.recording.partial
    assert record.recording.files == ()
    assert any("before its motion began" in remark for remark in record.recording.remarks)


RELEASED = {"stop_policy": "release"}


def released_robot() -> Robot:
    robot = point_robot()
    return replace(robot, joints=tuple(replace(joint, drive=dict(RELEASED)) for joint in robot.joints))


def released_run(folder: Path, arm: PointArm, **options: object) -> RunRecord:
    robot = released_robot()
    return run_trajectory(robot, short_motion(robot), connection(arm), folder, RunOptions.model_validate(options))


def test_an_arm_that_is_safe_without_torque_is_let_go_once_it_stands_still(tmp_path: Path) -> None:
    record = released_run(tmp_path / "run", arm := PointArm(position=START))
    assert (record.state, record.stop_policy) == (RunState.FINISHED, "release")
    assert (arm.stops[0], arm.stops[-1]) == (StopPolicy.HOLD, StopPolicy.TORQUE_OFF)
    assert arm.stops.count(StopPolicy.TORQUE_OFF) == 1


@pytest.mark.parametrize("trouble", ["moves", "unseen"])
def test_one_that_does_not_come_to_rest_or_is_not_seen_stays_held(tmp_path: Path, trouble: str) -> None:
    def tamper(arm: PointArm, state: ArmState) -> ArmState:
        if not arm.stops:
            return state
        drift = np.full(2, np.nan) if trouble == "unseen" else 0.1 * len(arm.stops)
        return replace(state, position=state.position + drift)

    arm = PointArm(position=START, tamper=tamper)
    released_run(tmp_path / "run", arm)
    assert set(arm.stops) == {StopPolicy.HOLD}


def test_a_run_that_was_broken_off_is_held(tmp_path: Path) -> None:
    record = released_run(tmp_path / "run", arm := PointArm(position=START, tamper=silence(1, 300)))
    assert record.state is RunState.FAILED
    assert set(arm.stops) == {StopPolicy.HOLD}


def test_only_the_robot_file_states_that_an_arm_is_safe_without_torque(tmp_path: Path) -> None:
    with pytest.raises(AcquisitionError, match=r"state drive\.stop_policy: release for its joints"):
        run(tmp_path / "run", stop_policy="release")
