"""An identified model in the formats of controllers and simulators, findings included as far as each can hold them."""

from tauscope.export.joint_model import JointModel
from tauscope.export.urdf import patch_urdf

__all__ = ["JointModel", "patch_urdf"]
