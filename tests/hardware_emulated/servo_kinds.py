"""The two makers' servos that emulated arms have: their robot files, drivers and orders."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import feetech_bus
from hardware_emulated.campaign_arms import write_robot, write_servos
from tauscope.robot import Robot
from tauscope_drivers.dynamixel.arm import DynamixelArm
from tauscope_drivers.dynamixel.packets import DynamixelParser
from tauscope_drivers.feetech.arm import FeetechArm
from tauscope_drivers.feetech.packets import FeetechParser
from tauscope_sim.dynamixel_bus import DynamixelOrder, ServoSpecification
from tauscope_sim.dynamixel_bus.emulator import ServoOrder

_MODEL_NUMBERS = {"XM430-W350": 1020, "XM540-W270": 1120, "XL330-M288": 1200, "PH54-200-S500": 2020}
TORQUE_PER_PERMILLE = 0.15


@dataclass(frozen=True)
class ServoKind:
    """`write_robot`: of an arm, a path and a port; `servos_of`: those of a robot file; `quick`: registers that differ
    from a delivered servo's where it shall answer at once, and its driver does not see to that.
    """

    name: str
    make_arm: Any
    make_parser: Any
    write_robot: Callable[..., Path]
    servos_of: Callable[..., tuple[Any, ...]]
    make_order: Callable[..., ServoOrder[Any]]
    quick: dict[str, int] = field(default_factory=dict)

    def order(self, arm: Robot, start: Any, folder: Path, *, quick: bool = False, **options: Any) -> ServoOrder[Any]:
        """Emulated servos whose port and control are in a folder."""
        port, control = str(folder / "port"), str(folder / "control")
        servos = self.servos_of(arm, **(self.quick if quick else {}))
        return self.make_order(servos=servos, start=tuple(start), port=port, control=control, **options)


def servos_of(robot: Robot, **registers: int) -> tuple[ServoSpecification, ...]:
    """The servos of a robot file's ``drive`` blocks; an XM430-W350 where no model is named."""
    return tuple(
        ServoSpecification(
            servo=drive["id"],
            model_number=_MODEL_NUMBERS[drive.get("model", "XM430-W350")],
            torque_per_milliampere=joint.sign * joint.torque_constant,
            registers=registers,
        )
        for joint in robot.joints
        for drive in [joint.drive or {}]
    )


def feetech_servos(robot: Robot, **registers: int) -> tuple[feetech_bus.ServoSpecification, ...]:
    """The servos of a robot file, one a joint."""
    return tuple(
        feetech_bus.ServoSpecification(number, torque_per_permille=joint.torque_constant, registers=registers)
        for number, joint in enumerate(robot.joints, 1)
    )


DYNAMIXEL = ServoKind("dynamixel", DynamixelArm, DynamixelParser, write_robot, servos_of, DynamixelOrder)
FEETECH = ServoKind(
    "feetech",
    FeetechArm,
    FeetechParser,
    partial(write_servos, id_key="servo_id", constant=TORQUE_PER_PERMILLE),
    feetech_servos,
    feetech_bus.FeetechOrder,
    {"return_delay": 0},
)
KINDS = pytest.mark.parametrize("kind", [DYNAMIXEL, FEETECH], ids=lambda kind: kind.name)
