"""The robot file of the page about STS3215 servos is one that Tauscope and the driver take."""

import re
from pathlib import Path

from shared_data import REPOSITORY
from tauscope.robot import read_robot
from tauscope.runtime.drivers import select_bus, to_drive_joints

URDF = """<robot name="so101"><link name="base_link"/>{links}</robot>"""
LINK = """
<link name="{child}"><inertial><origin xyz="0.03 0 0"/><mass value="0.1"/>
<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="0.1 0 0"/>
<axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="10"/></joint>"""


def test_the_robot_file_of_the_page_is_taken(tmp_path: Path) -> None:
    page = (REPOSITORY / "docs" / "reference" / "feetech.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    names = ["shoulder_pan", "shoulder_lift", "gripper"]
    links = ["base_link", "shoulder", "gripper_frame_link", "jaw"]
    parents = ["base_link", "shoulder", "gripper_frame_link"]
    text = "".join(
        LINK.format(name=name, parent=parent, child=child)
        for name, parent, child in zip(names, parents, links[1:], strict=True)
    )
    (tmp_path / "so101_new_calib.urdf").write_text(URDF.format(links=text), encoding="utf-8")
    (tmp_path / "arm.yaml").write_text(example, encoding="utf-8")
    robot = read_robot(tmp_path / "arm.yaml")
    assert [joint.name for joint in robot.joints] == names[:2]
    bus = select_bus(robot)
    assert bus.name == "feetech"
    assert not bus.check_blocks(to_drive_joints(bus, robot))
    assert all(joint.actuator is not None and joint.actuator.servo == "feetech-sts3215" for joint in robot.joints)
