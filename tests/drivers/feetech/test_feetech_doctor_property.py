"""Doctor green, and a run starts: over servos with random settings and defects; EEPROM stays as it was."""

import numpy as np
import pytest

from drivers.wired_port import WiredPort, starts, wire_drivers
from feetech_bus import ServoSpecification
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_drivers.feetech.doctor import examine
from tauscope_drivers.inspection import Finding, Severity

FEW, MANY = 200, 1000
"""Arms of the quick suite, and of the whole proof."""

SETTINGS = {
    "model": (777, 2825, 1029),
    "return_delay": (0, 250),
    "status_level": (0, 1),
    "min_position": (0, 1000, 3000),
    "max_position": (0, 1500, 4095),
    "max_voltage": (70, 80, 140),
    "min_voltage": (40, 90),
    "max_torque": (0, 1, 500),
    "phase": (0, 12, 28),
    "kp": (0, 16),
    "mode": (0, 1, 3),
    "torque_enable": (0, 1),
    "status": (0x01, 0x20),
    "voltage": (30, 60, 120),
    "lock": (0, 1),
    "unloading": (0, 44),
}
DEFECTS_MOST = 2


@pytest.fixture(autouse=True)
def wired(monkeypatch: pytest.MonkeyPatch) -> None:
    wire_drivers(monkeypatch)


def specification(number: int, rng: np.random.Generator) -> ServoSpecification:
    names = rng.choice(list(SETTINGS), rng.integers(DEFECTS_MOST + 1), replace=False)
    registers = {str(name): int(rng.choice(SETTINGS[name])) for name in names}
    return ServoSpecification(number, registers=registers)


def joint(number: int, rng: np.random.Generator) -> DriveJoint:
    block: dict[str, object] = {"servo_id": number, "port": "wired"}
    if rng.random() < 0.2:
        block["zero_count"] = int(rng.choice([0, 1024]))
    return DriveJoint(
        f"joint{number}",
        block,
        torque_per_unit=0.002 if rng.random() < 0.5 else None,
        torque_limit=float(rng.choice([1e-4] + [1.5] * 10)) if rng.random() < 0.8 else None,
        velocity_limit=float(rng.choice([0.1, 2.0, 30.0])) if rng.random() < 0.8 else None,
        position_range=(float(rng.choice([-1.5] * 10 + [0.5])), 3.0) if rng.random() < 0.8 else None,
    )


def look(seed: int) -> tuple[list[DriveJoint], list[Finding]]:
    """An arm of two servos, and what doctor finds of it."""
    rng = np.random.default_rng(seed)
    count = 2
    servos = WiredPort.wire(
        [(specification(number, rng), 0.2) for number in range(1, count + 1)][: count - int(rng.random() < 0.05)]
    )
    joints = [joint(number, rng) for number in range(1, count + 1)]
    before = [servo.memory.read(0, 56) for servo in servos]
    findings = examine(joints)
    assert [servo.memory.read(0, 56) for servo in servos] == before, f"seed {seed}: doctor wrote something"
    return joints, findings


def require_true(seeds: range) -> None:
    wrong: list[str] = []
    green = 0
    for seed in seeds:
        joints, findings = look(seed)
        failures = [finding for finding in findings if finding.severity is Severity.FAILURE]
        assert all(finding.detail and finding.remedy for finding in failures)
        reason = starts(FeetechArm(joints), joints)
        green += not failures
        if bool(failures) != (reason is not None):
            wrong.append(f"seed {seed}: doctor {[str(one) for one in failures]}, run {reason}")
        assert not any(servo.memory.eeprom_writes for servo in WiredPort.wired.servos.values())
    assert not wrong, "\n".join(wrong)
    assert 0.1 < green / len(seeds) < 0.9


def test_doctor_is_green_where_a_run_starts_and_only_there() -> None:
    require_true(range(FEW))


@pytest.mark.proof
def test_doctor_is_green_where_a_run_starts_and_only_there_over_many() -> None:
    require_true(range(FEW, FEW + MANY))


def details(registers: dict[str, int], severity: Severity = Severity.FAILURE, **drive: object) -> list[str]:
    """What doctor says of one servo."""
    WiredPort.wire([(ServoSpecification(1, registers=registers), 0.2)])
    joints = [DriveJoint("a", {"servo_id": 1, "port": "wired", **drive})]
    return [f"{one.detail}; {one.remedy}" for one in examine(joints) if one.severity is severity]


@pytest.mark.parametrize(
    ("registers", "words"),
    [
        ({"mode": 1}, "Operating Mode is 1 (speed)"),
        ({"min_position": 0, "max_position": 0}, "counts whole turns"),
        ({"phase": 28}, "counts whole turns"),
        ({"kp": 0}, "P Coefficient is 0"),
        ({"max_torque": 0}, "Max Torque Limit is 0"),
        ({"voltage": 30}, "supply of 3.0 V, its Voltage Limits are 4.0 to 8.0 V"),
        ({"status": 0x20}, "overload for too long"),
        ({"min_position": 3000}, "stands at count 2178"),
        ({"model": 2825}, "Feetech STS3250 (not supported)"),
    ],
)
def test_doctor_names_what_keeps_a_run_from_starting(registers: dict[str, int], words: str) -> None:
    (flaw,) = details(registers)
    assert words in flaw


@pytest.mark.parametrize(
    ("registers", "words"),
    [
        ({}, "Return Delay Time 500 µs lowers the rate"),
        ({"status_level": 0}, "answers reads alone"),
        ({"lock": 0}, "Lock is 0"),
        ({"unloading": 4}, "Unloading Condition 4: it does not protect itself"),
        ({"torque_enable": 1}, "is under torque"),
        ({}, "no torque constant"),
    ],
)
def test_doctor_names_what_a_run_can_do_with(registers: dict[str, int], words: str) -> None:
    assert any(words in doubt for doubt in details(registers, Severity.WARNING))


def test_doctor_shows_what_a_model_of_the_position_loop_needs() -> None:
    assert any("P 32, D 32, I 0, dead zone 0 counts, 7.4 V" in line for line in details({}, Severity.GOOD))
