"""What the arm is: joints, chain, limits, and what the user's simulation believes; the robot file."""

from tauscope.robot.actuator import Actuator
from tauscope.robot.check import JointSummary, RobotReport, check_robot
from tauscope.robot.messages import Severity
from tauscope.robot.physical import find_defect, nearest_body, pseudo_inertia
from tauscope.robot.recording_layout import RecordingLayout, find_column_fault, find_fault, find_separator_fault
from tauscope.robot.robot import (
    STANDARD_PARAMETERS,
    FrictionCoefficients,
    FrictionShape,
    Joint,
    JointLimits,
    JointType,
    LinkInertia,
    Model,
    Placement,
    Robot,
    Segment,
)
from tauscope.robot.robot_data import robot_from_dict, robot_to_dict
from tauscope.robot.robot_file import layout_from_dict, read_layout, read_robot

__all__ = [
    "STANDARD_PARAMETERS",
    "Actuator",
    "FrictionCoefficients",
    "FrictionShape",
    "Joint",
    "JointLimits",
    "JointSummary",
    "JointType",
    "LinkInertia",
    "Model",
    "Placement",
    "RecordingLayout",
    "Robot",
    "RobotReport",
    "Segment",
    "Severity",
    "check_robot",
    "find_column_fault",
    "find_defect",
    "find_fault",
    "find_separator_fault",
    "layout_from_dict",
    "nearest_body",
    "pseudo_inertia",
    "read_layout",
    "read_robot",
    "robot_from_dict",
    "robot_to_dict",
]
