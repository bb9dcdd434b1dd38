"""CANopen drives of the profile CiA 402: power states, process data, and the driver over python-can."""

from drivers.canopen.configuration import DriveJoint
from drivers.canopen.doctor import can_interfaces, examine
from drivers.canopen.driver import CanopenArm
from drivers.canopen.dry_run import plan_frames
from drivers.canopen.scan import scan_bus

__all__ = ["CanopenArm", "DriveJoint", "can_interfaces", "examine", "plan_frames", "scan_bus"]
