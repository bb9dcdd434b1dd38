"""Doctor green, and a run starts: over drives with random defects, with a true EDS file and without one."""

from pathlib import Path

import numpy as np
import pytest

from emulated_can_bus import RATED_TORQUE_MNM, EmulatedBus
from emulated_data_sheet import sections, write_file
from tauscope_drivers import ControlMode, DriverError, Setpoint, StopPolicy
from tauscope_drivers.canopen.arm import CanopenArm
from tauscope_drivers.canopen.doctor import examine
from tauscope_drivers.drive_block import DriveJoint
from tauscope_drivers.inspection import Severity
from tauscope_drivers.limits import stated_limits
from tauscope_sim.canopen_bus.drive import EmulatedDrive

FEW, MANY = 40, 1000
"""Devices of the quick suite, and of the whole proof: with the servos' as many, 2,000."""

HIDDEN = (
    *(0x100C, 0x1016, 0x1017, 0x6007, 0x603F, 0x605A, 0x605E, 0x6061, 0x606C, 0x6071, 0x6072, 0x6075, 0x6076, 0x6077),
    *(0x607D, 0x60C2, 0x6502),
)
READ_ONLY = (0x100D, 0x1016, 0x1017, 0x6007, 0x605A, 0x605E, 0x6060, 0x6072, 0x607D, *range(0x1600, 0x1604))
FIXED = ((0x60400010, 0x607A0020), (0x60410010, 0x60770010, 0x60640020), (0x606C0020, 0x603F0010), (0x60410010,))
DEFECTS_MOST = 3


def damage(drive: EmulatedDrive, rng: np.random.Generator) -> None:
    """One defect of a drive."""
    entries = drive.dictionary.entries
    match rng.integers(7):
        case 0 | 1:
            index = rng.choice(HIDDEN)
            for place, entry in entries.items():
                entry.is_visible &= place[0] != index
        case 2:
            index = rng.choice(READ_ONLY)
            for place, entry in entries.items():
                entry.writable &= place[0] != index
        case 3:
            mapping = int(rng.choice([0x1600, 0x1601, 0x1A00, 0x1A01, 0x1A02]))
            content = FIXED[rng.integers(len(FIXED))]
            for subindex, value in enumerate((len(content), *content)):
                entries[mapping, subindex].value = value
            for place, entry in entries.items():
                entry.writable &= place[0] != mapping
        case 4:
            values = {0x6072: (0, 1), 0x6076: (0, 1, RATED_TORQUE_MNM * 1000), 0x6007: (0,), 0x1000: (0x191,)}
            index = int(rng.choice(list(values)))
            entries[index, 0].value = int(rng.choice(values[index]))
        case 5:
            entries[0x6502, 0].value = int(rng.integers(0x400))
        case _:
            drive.fail(0x4310)


def starts(joint: DriveJoint) -> str | None:
    """Why a run does not start; None where it does."""
    arm = CanopenArm([joint], patience_s=0.1)
    try:
        place = arm.connect().position
        arm.enable(ControlMode.POSITION, stated_limits([joint]), StopPolicy.HOLD, 2.0, 0.01)
        faults = arm.exchange(Setpoint(place, np.zeros(1))).faults
    except DriverError as error:
        return str(error)
    finally:
        arm.disconnect()
    return str(faults[0]) if faults else None


def is_green_and_fails(folder: Path, seed: int) -> str | None:
    """What a green doctor did not find; None where it is right, or not green."""
    rng = np.random.default_rng(seed)
    with EmulatedBus([None]) as bus:
        for _ in range(rng.integers(DEFECTS_MOST + 1)):
            damage(bus.drives[0], rng)
        (joint,) = bus.joints()
        block = dict(joint.drive)
        if rng.random() < 0.8:
            block["eds"] = write_file(folder, sections(bus.drives[0]))
        if rng.random() < 0.5:
            block["rated_torque_nm"] = RATED_TORQUE_MNM * 1e-3
        low = float(rng.choice([-3.0, -3.0, 0.5]))
        joint = DriveJoint(
            joint.name,
            block,
            gear_ratio=joint.gear_ratio,
            torque_limit=20.0,
            velocity_limit=2.0,
            position_range=(low, 3.0),
        )
        try:
            findings = examine([joint])
        except DriverError:
            return None
        worst = {finding.severity for finding in findings}
        if Severity.FAILURE in worst or "eds" not in block:
            assert "eds" in block or worst != {Severity.GOOD}, "without its file a drive is never green"
            return None
        failure = starts(joint)
        return None if failure is None else f"device {seed}: {failure}"


def require_true(folder: Path, seeds: range, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tauscope_drivers.canopen.sdo.SDO_TIMEOUT_S", 0.05)
    wrong = [found for seed in seeds if (found := is_green_and_fails(folder, seed))]
    assert wrong == []


def test_a_green_doctor_means_that_a_run_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    require_true(tmp_path, range(FEW), monkeypatch)


@pytest.mark.proof
def test_a_green_doctor_means_that_a_run_starts_on_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    require_true(tmp_path, range(FEW, FEW + MANY), monkeypatch)
