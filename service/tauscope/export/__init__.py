"""The identified model in the formats of simulators: the user's URDF patched in place, and MJCF."""

from tauscope.export.joint_model import JointModel, joint_models
from tauscope.export.mjcf import MjcfModel, to_mjcf
from tauscope.export.urdf import PatchedUrdf, patch_urdf

__all__ = ["JointModel", "MjcfModel", "PatchedUrdf", "joint_models", "patch_urdf", "to_mjcf"]
