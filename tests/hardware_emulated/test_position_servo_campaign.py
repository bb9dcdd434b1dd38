"""Campaigns with position servos that droop under load and lose torque to back-EMF: design, run, identify.

The emulated servos have the loop of the robot file: register gain, duty limit, supply. Time passes in step with the
host's cycles.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

import feetech_bus
from emulator_process import EmulatorProcess
from hardware_emulated.campaign_arms import assert_within, deviations, three_joints, write_robot, write_servos
from hardware_emulated.servo_kinds import DYNAMIXEL, FEETECH, ServoKind, servos_of
from hardware_emulated.stepped_clock import SteppedClock
from tauscope.actuation import make_efforts
from tauscope.excitation import ExcitationOptions, design_excitation
from tauscope.identification import document, identify
from tauscope.recording import Recording, read_recording
from tauscope.recording.recording import take_commands
from tauscope.robot import Robot, read_robot
from tauscope.runtime.drivers import Connection, find_driver, to_drive_joints
from tauscope.runtime.options import RunOptions
from tauscope.runtime.record import RunRecord
from tauscope.runtime.run import run_trajectory
from tauscope.runtime.states import RunState
from tauscope.trajectory import Trajectory

VOLTS, STS3215_NM_PER_VOLT = 7.4, 1.91 / 7.4
STS3215 = {
    "kind": "position",
    "servo": "feetech-sts3215",
    "supply_voltage": VOLTS,
    "torque_per_volt": STS3215_NM_PER_VOLT,
    "back_emf": 1.5,  # 4.8 rad/s without load
    "delay": 0.02,  # two cycles of pace at 100 Hz
}
PH54 = {
    "kind": "position",
    "servo": "dynamixel-x",
    "kp": 1600,
    "supply_voltage": 24.0,
    "torque_per_volt": 4.0,
    "back_emf": 6.9,  # 3.5 rad/s without load
    "delay": 0.01,  # two cycles of pace at 200 Hz
}
NOISE_MA = 100.0
SHAPE = {"k_v": 500, "delta": 10}
DESIGN = ExcitationOptions(period_s=8.0, periods=2, starts=2, slow_postures=0)
FOLLOWING_RAD = 0.2


def desk_arm(kp: float, velocity: float = 2.0) -> dict[str, Any]:
    """Three joints in the manner of an SO-101, of 0.6 kg."""
    limits = {"position": [-1.6, 1.6], "velocity": velocity, "acceleration": 8.0, "torque": 1.9}
    rows = ((0.0, 0.06, 0.03, 1.5707963), (1.5707963, 0.0, 0.116, 0.0), (-1.5707963, 0.0, 0.135, 0.0))
    links = [
        {
            "mass": mass,
            "first_moment": [-mass * reach, 0.0, 0.002],
            "inertia": {"xx": 6e-4, "yy": about, "zz": about, "xy": 0.0, "xz": 0.0, "yz": 0.0},
        }
        for mass, reach in ((0.15, 0.02), (0.2, 0.06), (0.22, 0.08))
        for about in [1.3 * mass * reach**2 + 1e-4]
    ]
    return {
        "name": "desk-arm",
        "kinematics": {"dh": [dict(zip(("theta", "d", "a", "alpha"), row, strict=True)) for row in rows]},
        "joints": [
            {
                "name": name,
                "limits": limits,
                "friction_shape": {"k_v": 500, "delta": 10},
                "actuator": STS3215 | {"kp": kp},
            }
            for name in ("pan", "lift", "elbow")
        ],
        "model": {"links": links, "friction": [{"stiction": 0.06, "stribeck": -0.01, "viscous": 0.02}] * 3},
    }


def heavy_arm() -> dict[str, Any]:
    arm = three_joints()
    return arm | {"joints": [joint | {"actuator": PH54} for joint in arm["joints"]]}


@dataclass(frozen=True)
class Site:
    """`told`: what the host knows, `true`: what the servos are; both robot files."""

    kind: ServoKind
    folder: Path
    told: Robot
    true: Robot
    rate_hz: float
    volts: float = VOLTS

    def design(self) -> Trajectory:
        return design_excitation(self.told, DESIGN).trajectory

    def run(self, motion: Trajectory) -> RunRecord:
        joints = to_drive_joints(find_driver(self.kind.name), self.told)
        start = tuple((motion.start + 0.05).tolist())
        files = {
            "port": str(self.folder / "port"),
            "control": str(self.folder / "control"),
            "robot": str(self.folder / "true.json"),
        }
        order = self.kind.make_order(servos=self._servos(), start=start, stepped=True, **files)
        with EmulatorProcess(order) as emulator:
            backend = self.kind.make_arm(joints, slack_s=0.5, clock=SteppedClock(emulator))
            return run_trajectory(
                self.told,
                motion,
                lambda: Connection(backend, is_real_time=False),
                self.folder / "run",
                RunOptions(rate_hz=self.rate_hz),
                backend_name=self.kind.name,
            )

    def recording(self) -> Recording:
        return read_recording(self.folder / "run" / "recording.csv")

    def _servos(self) -> tuple[Any, ...]:
        if self.kind is DYNAMIXEL:
            return tuple(replace(servo, current_noise_ma=NOISE_MA) for servo in servos_of(self.true))
        registers = {"return_delay": 0, "voltage": round(10 * self.volts)}
        return tuple(
            feetech_bus.ServoSpecification(
                number, torque_per_permille=joint.torque_constant, back_emf=loop.damping, registers=registers
            )
            for number, joint in enumerate(self.true.joints, 1)
            if (loop := joint.actuator) is not None
        )


def write_feetech(arm: dict[str, Any], path: Path, port: str) -> Path:
    return write_servos(arm, path, port, id_key="servo_id", constant=STS3215_NM_PER_VOLT * VOLTS / 1000)


def desk_site(folder: Path, kp: float = 32, *, true_kp: float | None = None, fast: bool = False) -> Site:
    """Its servos have P `true_kp`; joints that are `fast` need the stated supply."""
    port, velocity = str(folder / "port"), 3.0 if fast else 2.0
    told = read_robot(write_feetech(desk_arm(kp, velocity), folder / "told.json", port))
    true = read_robot(write_feetech(desk_arm(true_kp or kp, velocity), folder / "true.json", port))
    return Site(FEETECH, folder, told, true, 100.0)


def heavy_site(folder: Path) -> Site:
    robot = read_robot(write_robot(heavy_arm(), folder / "true.json", str(folder / "port")))
    return Site(DYNAMIXEL, folder, robot, robot, 200.0)


def assert_followed(record: RunRecord) -> None:
    """The arm lagged, as servos without an integral do, and no further than was planned for."""
    assert record.state is RunState.FINISHED, record.problem
    assert record.worst_following is not None
    assert 0.05 < max(record.worst_following) < 0.9 * FOLLOWING_RAD


def without_back_emf(far: dict[str, float]) -> dict[str, float]:
    return {name: value for name, value in far.items() if not name.startswith("viscous")}


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_feetech_arm_is_found_from_load_and_from_commands(tmp_path: Path) -> None:
    site = desk_site(tmp_path)
    assert_followed(site.run(site.design()))
    recording = site.recording()
    # Load is the bridge's duty: back-EMF is part of it, as viscous friction.
    far = deviations(document(identify(site.told, [recording])), site.true)
    assert_within(4.5, without_back_emf(far))
    commands = take_commands(recording)
    assert commands is not None
    driven, made, _ = make_efforts(site.told, [commands])
    far = deviations(document(identify(driven, made)), site.true)
    assert_within(4.5, far)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_dynamixel_arm_in_position_mode_is_found_from_current(tmp_path: Path) -> None:
    site = heavy_site(tmp_path)
    record = site.run(site.design())
    assert_followed(record)
    far = deviations(document(identify(site.told, [site.recording()])), site.true)
    assert_within(4.0, far)


def refuse_unfollowed(site: Site, motion: Trajectory) -> str:
    """Why a run was refused before the arm had torque."""
    record = site.run(motion)
    assert record.state is RunState.FAILED
    assert not record.worst_following, "nothing has moved"
    assert record.problem is not None
    return record.problem.detail


def unaware(site: Site) -> Trajectory:
    """A motion that was designed without knowing the servos."""
    joints = tuple(replace(joint, actuator=None) for joint in site.told.joints)
    return design_excitation(replace(site.told, joints=joints), DESIGN).trajectory


def test_a_motion_that_soft_servos_cannot_follow_is_refused_before_it_moves(tmp_path: Path) -> None:
    site = desk_site(tmp_path, 16)
    detail = refuse_unfollowed(site, unaware(site))
    assert "its following error leaves" in detail
    assert detail.split(":")[0] in ("pan", "lift", "elbow")


def test_a_supply_that_sags_below_what_is_stated_is_refused_before_it_moves(tmp_path: Path) -> None:
    site = replace(desk_site(tmp_path, 64, fast=True), volts=4.2)
    assert "its voltage leaves" in refuse_unfollowed(site, unaware(site))


@pytest.mark.slow
def test_servos_that_are_softer_than_stated_are_stopped_by_the_guard(tmp_path: Path) -> None:
    site = desk_site(tmp_path, 32, true_kp=12)
    record = site.run(site.design())
    assert record.state is RunState.FAILED
    assert record.problem is not None
    assert record.problem.rule == "following-error"
    assert record.holds
