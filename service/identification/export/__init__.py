"""The identified model in the formats of simulators: the user's URDF patched in place, and MJCF."""

from service.identification.export.joint_model import JointModel, joint_models
from service.identification.export.mjcf import MjcfModel, to_mjcf
from service.identification.export.urdf import PatchedUrdf, patch_urdf

__all__ = ["JointModel", "MjcfModel", "PatchedUrdf", "joint_models", "patch_urdf", "to_mjcf"]
