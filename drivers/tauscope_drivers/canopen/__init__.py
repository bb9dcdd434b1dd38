"""CANopen drives of the profile CiA 402: power states, process data, and the driver over python-can."""

from tauscope_drivers.canopen.configuration import DriveJoint
from tauscope_drivers.canopen.doctor import can_interfaces, examine
from tauscope_drivers.canopen.driver import CanopenArm
from tauscope_drivers.canopen.dry_run import plan_frames
from tauscope_drivers.canopen.scan import scan_bus

__all__ = ["CanopenArm", "DriveJoint", "can_interfaces", "examine", "plan_frames", "scan_bus"]
