"""Doctor green, and a run starts: over servos with random settings and defects."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.wired_port import WiredPort, starts, wire_drivers
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.dynamixel.doctor import examine
from tauscope_drivers.inspection import Finding, Severity
from tauscope_sim.dynamixel_bus import ServoSpecification

FEW, MANY = 200, 1000
"""Devices of the quick suite, and of the whole proof: with the drives' as many, 2,000."""

MODELS = (1020, 1020, 1020, 1020, 1120, 1060, 1200, 2020, 4030)
SETTINGS = {
    "Status Return Level": (0, 1, 2),
    "Return Delay Time": (0, 250),
    "Drive Mode": (0, 1, 4, 8, 13),
    "Operating Mode": (0, 1, 3, 4, 5, 16),
    "Current Limit": (0, 1, 5, 400),
    "Velocity Limit": (0, 1, 60, 400),
    "PWM Limit": (0, 300),
    "Min Position Limit": (0, 2000, 3000),
    "Max Position Limit": (1000, 4095),
    "Secondary(Shadow) ID": (1, 2, 255),
    "Secondary ID": (2, 255),
    "Bus Watchdog": (-1, 0, 5),
    "Torque Enable": (0, 1),
    "Hardware Error Status": (0x01, 0x20),
    "Error Code": (4, 18),
    "Electronic GearRatio Numerator": (1, 50),
}
DEFECTS_MOST = 2


@pytest.fixture(autouse=True)
def wired(monkeypatch: pytest.MonkeyPatch) -> None:
    wire_drivers(monkeypatch)


def specification(number: int, rng: np.random.Generator) -> ServoSpecification:
    names = rng.choice(list(SETTINGS), rng.integers(DEFECTS_MOST + 1), replace=False)
    registers = {str(name): int(rng.choice(SETTINGS[name])) for name in names}
    return ServoSpecification(number, model_number=int(rng.choice(MODELS)), firmware=45, registers=registers)


def joint(number: int, rng: np.random.Generator) -> DriveJoint:
    block: dict[str, object] = {"id": number, "port": "wired"}
    if rng.random() < 0.2:
        block["current_limit_ma"] = float(rng.choice([1.0] + [900.0] * 5))
    if rng.random() < 0.1:
        block["model"] = str(rng.choice(["XM430-W350", "XM540-W270"]))
    return DriveJoint(
        f"joint{number}",
        block,
        torque_per_unit=0.01 if rng.random() < 0.9 else None,
        torque_limit=float(rng.choice([0.02] + [3.0] * 10)) if rng.random() < 0.8 else None,
        velocity_limit=float(rng.choice([0.1, 2.0, 30.0])) if rng.random() < 0.8 else None,
        position_range=(float(rng.choice([-3.0] * 10 + [0.5])), 3.0) if rng.random() < 0.8 else None,
    )


def look(seed: int) -> tuple[list[DriveJoint], list[Finding]]:
    """An arm of two servos, and what doctor finds of it."""
    rng = np.random.default_rng(seed)
    count = 2
    turns = 2.0 * np.pi * rng.choice([0] * 10 + [1, -3], count)
    wired = [(specification(number, rng), float(0.2 + turns[number - 1])) for number in range(1, count + 1)]
    WiredPort.wire(wired[: count - int(rng.random() < 0.05)])
    joints = [joint(number, rng) for number in range(1, count + 1)]
    return joints, examine(joints)


def require_true(seeds: range) -> None:
    wrong: list[str] = []
    green = 0
    for seed in seeds:
        joints, findings = look(seed)
        if any(finding.severity is Severity.FAILURE for finding in findings):
            continue
        green += 1
        failure = starts(DynamixelArm(joints), joints)
        wrong += [] if failure is None else [f"device {seed}: {failure}"]
    assert wrong == []
    assert green > len(seeds) // 10, "devices are not all broken"


def test_a_green_doctor_means_that_a_run_starts() -> None:
    require_true(range(FEW))


@pytest.mark.proof
def test_a_green_doctor_means_that_a_run_starts_on_many() -> None:
    require_true(range(FEW, FEW + MANY))


def details(registers: dict[str, int], place: float = 0.2, **described: object) -> str:
    """What doctor finds wrong with an arm whose second servo has these settings."""
    WiredPort.wire([(ServoSpecification(1), 0.2), (ServoSpecification(2, registers=registers), place)])
    joints = [
        DriveJoint(f"joint{number}", {"id": number, "port": "wired"}, torque_per_unit=0.01, position_range=(-3.0, 3.0))
        for number in (1, 2)
    ]
    joints[1] = replace(joints[1], **described)
    found = [one for one in examine(joints) if one.severity is not Severity.GOOD and "joint2" in one.subject]
    return " | ".join(f"{one.severity}: {one.detail}" for one in found)


def test_findings_of_what_a_run_would_meet() -> None:
    assert "failure: its Secondary(Shadow) ID 1 is the ID of joint joint1" in details({"Secondary(Shadow) ID": 1})
    assert "warning: Status Return Level 1: it does not answer every" in details({"Status Return Level": 1})
    assert "failure: answers pings and no reads" in details({"Status Return Level": 0})
    assert "warning: Velocity Limit 20 is 0.479 rad/s, below the joint's limit of 2" in details(
        {"Velocity Limit": 20}, velocity_limit=2.0
    )
    assert "failure: its multi-turn position is off by 1 turn" in details({}, 0.2 + 2.0 * np.pi)
    assert "failure: its limits leave no current" in details({}, torque_limit=1e-3)


def test_a_servo_that_answers_pings_alone_is_let_answer() -> None:
    servos = WiredPort.wire([(ServoSpecification(1, registers={"Status Return Level": 0}), 0.2)])
    joints = [DriveJoint("joint1", {"id": 1, "port": "wired"}, torque_per_unit=0.01)]
    assert starts(DynamixelArm(joints), joints) is None
    assert servos[0].memory.get("Status Return Level") == 2


def test_speeds_beyond_the_servos_own_limit_are_not_asked_for() -> None:
    (servo,) = WiredPort.wire([(ServoSpecification(1, registers={"Velocity Limit": 20}), 0.2)])
    joint = DriveJoint("joint1", {"id": 1, "port": "wired"}, torque_per_unit=0.01, velocity_limit=30.0)
    assert starts(DynamixelArm([joint]), [joint]) is None
    assert servo.memory.get("Profile Velocity") <= 20


def test_a_second_id_makes_a_servo_follow_another_ones_goals() -> None:
    """What doctor refuses does harm: the emulated servo does what the real one would."""
    servos = WiredPort.wire(
        [(ServoSpecification(1), 0.2), (ServoSpecification(2, registers={"Secondary(Shadow) ID": 1}), 0.2)]
    )
    joints = [DriveJoint("joint1", {"id": 1, "port": "wired"}, torque_per_unit=0.01)]
    assert starts(DynamixelArm(joints), joints) is None
    assert servos[1].memory.get("Goal Position") == servos[0].memory.get("Goal Position")
