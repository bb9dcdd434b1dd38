"""The servos that a robot file speaks of."""

from tauscope.robot import Robot
from tauscope_sim.dynamixel_bus.control_memory import ServoSpecification

_MODEL_NUMBERS = {"XM430-W350": 1020, "XM540-W270": 1120, "XL330-M288": 1200, "PH54-200-S500": 2020}


def servos_of(robot: Robot) -> tuple[ServoSpecification, ...]:
    """The servos of a robot file's ``drive`` blocks; an XM430-W350 where no model is named."""
    return tuple(
        ServoSpecification(
            servo=drive["id"],
            model_number=_MODEL_NUMBERS[drive.get("model", "XM430-W350")],
            baud=drive.get("baud", robot_baud(robot)),
            torque_per_milliampere=joint.sign * joint.torque_constant,
            direction=drive.get("direction", 1),
            reduction=drive.get("reduction", 1.0),
        )
        for joint in robot.joints
        for drive in [joint.drive or {}]
    )


def robot_baud(robot: Robot) -> int:
    """Baud rate of the bus, which stands on the first joint [bit/s]."""
    return (robot.joints[0].drive or {}).get("baud", 1_000_000)
