"""Joints of a URDF that do not move by themselves: locked, beside the chain, or following another joint.

A joint beside the chain is rigid at the value that ``locked`` states, else at 0, and the bodies that it carries count.
A mimic joint is at multiplier · master + offset (URDF's own definition), wherever its master is.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from tauscope.errors import RobotFileError
from tauscope.robot.messages import Finding, Severity, nearest, one_line, shown
from tauscope.robot.placement import rotation_about_z, rotation_of_z_to
from tauscope.robot.robot import Coupling, Placement
from tauscope.robot.urdf_element import number, only_child, urdf_error, vector, where
from tauscope.robot.urdf_xml import UrdfJoint, UrdfTree

MOVING = frozenset({"revolute", "continuous", "prismatic"})


@dataclass(frozen=True)
class Master:
    """The joint that another one follows in the end, with multiplier and offset."""

    joint: UrdfJoint
    multiplier: float
    offset: float


class JointMotions:
    """How the joints of a URDF move, where some of them are locked.

    `locked`: position by the name of a joint [rad or m].
    """

    def __init__(self, tree: UrdfTree, locked: Mapping[str, float], path: Iterable[UrdfJoint]) -> None:
        self._tree, self._locked = tree, locked
        self._joints = {joint.name: joint for joint in tree.parent_joint.values()}
        for name in locked:
            if name not in self._joints:
                hint = nearest(name, self._joints)
                raise RobotFileError(one_line(f"{tree.label}: locked: joint {shown(name)} is not in the file; {hint}"))
        free = [joint for joint in path if joint.type in MOVING and joint.name not in locked]
        masters = {joint.name: self.master(joint) for joint in free}
        own = {name for name, master in masters.items() if master is None}
        moving = [joint for joint in free if (masters[joint.name] or Master(joint, 1.0, 0.0)).joint.name in own]
        self.moving = tuple(joint.name for joint in moving)
        """Joints of the path that move, base first: their own masters, and those that follow one of them."""
        names = list(dict.fromkeys((master.joint.name if (master := masters[name]) else name) for name in self.moving))
        self.independent = tuple(self._joints[name] for name in names)
        """Joints that the others follow, in the order in which they first move the chain."""
        self._couplings: dict[str, Coupling | None] = {}
        met: set[str] = set()
        for name in self.moving:
            master = masters[name] or Master(self._joints[name], 1.0, 0.0)
            is_next = master.joint.name not in met and (master.multiplier, master.offset) == (1.0, 0.0)
            place = names.index(master.joint.name)
            self._couplings[name] = None if is_next else Coupling(place, master.multiplier, master.offset)
            met.add(master.joint.name)

    def coupling(self, joint: UrdfJoint) -> Coupling | None:
        """The joint that a joint of the chain follows; None where it is the next one itself."""
        return self._couplings[joint.name]

    def master(self, joint: UrdfJoint) -> Master | None:
        """The joint that a mimic joint follows; None where it follows none."""
        multiplier, offset, met = 1.0, 0.0, [joint.name]
        while (mimic := only_child(self._tree.label, joint.element, "mimic", [])) is not None:
            name = mimic.get("joint") or ""
            if name not in self._joints:
                return None  # `remark_on_masters` warns
            if name in met:
                raise urdf_error(self._tree.label, joint.element, "mimics itself; name another joint in <mimic>")
            met.append(name)
            offset += multiplier * number(self._tree.label, mimic, "offset", 0.0)
            multiplier *= number(self._tree.label, mimic, "multiplier", 1.0)
            joint = self._joints[name]
            if joint.name in self._locked:
                break
        return None if len(met) == 1 else Master(joint, multiplier, offset)

    def remark_on_masters(self, findings: list[Finding]) -> None:
        """Say which mimic joints follow a joint that is not in the file; as in ROS, they move by themselves."""
        for joint in self._joints.values():
            mimic = only_child(self._tree.label, joint.element, "mimic", findings)
            if mimic is not None and (name := mimic.get("joint") or "") not in self._joints:
                text = f"mimics joint {shown(name)}, which is not in the file, and counts as free; "
                place = one_line(where(self._tree.label, joint.element))
                findings.append(Finding(Severity.WARNING, place, text + nearest(name, self._joints)))

    def rigid_position(self, joint: UrdfJoint) -> float:
        """Position of a joint that does not move with the chain [rad or m]."""
        if joint.name in self._locked:
            return self._locked[joint.name]
        master = self.master(joint)
        return 0.0 if master is None else master.multiplier * self._locked.get(master.joint.name, 0.0) + master.offset

    def is_locked(self, joint: UrdfJoint) -> bool:
        """Whether the robot file states where a joint stands, or where the one stands that it follows."""
        master = self.master(joint)
        return joint.name in self._locked or (master is not None and master.joint.name in self._locked)

    def follows_chain(self, joint: UrdfJoint) -> str | None:
        """Name of the chain's joint that a joint beside the chain follows."""
        master = None if joint.name in self._locked else self.master(joint)
        return master.joint.name if master and master.joint in self.independent and master.multiplier else None

    def rigid_motion(self, joint: UrdfJoint, findings: list[Finding]) -> Placement:
        """Displacement along or about a joint's axis that does not move with the chain."""
        position = self.rigid_position(joint) if joint.type in MOVING else 0.0
        if position == 0.0:
            return Placement()
        axis = joint_axis(self._tree, joint, findings)
        if joint.type == "prismatic":
            return Placement(np.eye(3), position * axis)
        align = rotation_of_z_to(axis)
        return Placement(align @ rotation_about_z(position) @ align.T)


def joint_axis(tree: UrdfTree, joint: UrdfJoint, findings: list[Finding]) -> np.ndarray:
    """Unit vector of a joint's axis, (3,); x where none is given, as URDF defines."""
    element = only_child(tree.label, joint.element, "axis", findings)
    axis = vector(tree.label, element, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if length < 1e-9:
        raise urdf_error(tree.label, joint.element, "its axis is zero; give the direction, as xyz='0 0 1'")
    if abs(length - 1.0) > 1e-3:
        text = f"its axis has length {length:g}; its direction is used"
        findings.append(Finding(Severity.INFO, one_line(where(tree.label, joint.element)), text))
    return axis / length
