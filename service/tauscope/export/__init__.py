"""An identified model in the formats of controllers and simulators, findings included as far as each can hold them."""

from tauscope.export.joint_model import JointModel, joint_models
from tauscope.export.urdf import PatchedUrdf, patch_urdf

__all__ = ["JointModel", "PatchedUrdf", "joint_models", "patch_urdf"]
