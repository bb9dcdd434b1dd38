"""What the arm is: joints, chain, limits, and what the user's simulation believes; the robot file."""

from tauscope.robot.actuator import Actuator
from tauscope.robot.chain import Chain
from tauscope.robot.check import JointSummary, RobotReport, check_robot
from tauscope.robot.kinematics import DenavitHartenbergRow, link_placements, modified_segments, standard_segments
from tauscope.robot.messages import Severity
from tauscope.robot.physical import find_defect, nearest_body, pseudo_inertia
from tauscope.robot.recording_layout import (
    PRESETS,
    RecordingLayout,
    find_column_fault,
    find_fault,
    find_separator_fault,
)
from tauscope.robot.robot import (
    STANDARD_PARAMETERS,
    Coupling,
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
from tauscope.robot.urdf import read_urdf_chain

__all__ = [
    "PRESETS",
    "STANDARD_PARAMETERS",
    "Actuator",
    "Chain",
    "Coupling",
    "DenavitHartenbergRow",
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
    "link_placements",
    "modified_segments",
    "nearest_body",
    "pseudo_inertia",
    "read_layout",
    "read_robot",
    "read_urdf_chain",
    "robot_from_dict",
    "robot_to_dict",
    "standard_segments",
]
