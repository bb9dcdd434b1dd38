"""Robot files and URDFs as text, for the tests of their readers."""

from pathlib import Path

ROBOT_YAML = """\
name: two-joint-arm
kinematics:
  dh:
    - {theta: 0.1, d: 0.3, a: 0.2, alpha: 1.5707963}
    - {theta: 0.0, d: 0.1, a: 0.5, alpha: 0.0, type: prismatic}
gravity: [0, 0, -9.81]
joints:
  - name: shoulder
    limits: {position: [-2.9, 2.9], velocity: 2.0, acceleration: 5.0, torque: 40}
    gear_ratio: 100
    torque_constant: 0.5
    sign: -1
    friction_shape: {k_v: 500, delta: 10}
    drive: {bus: can0, node: 3}
  - name: slide
    limits: {position: [0.0, 0.4]}
model:
  links:
    - {mass: 0, first_moment: [0, 0, 0], inertia: {xx: 0, yy: 0, zz: 0, xy: 0, xz: 0, yz: 0}}
    - {mass: 1.4, first_moment: [0.1, 0, 0], inertia: {xx: 0.02, yy: 0.03, zz: 0.03, xy: 0, xz: 0, yz: 0}}
  friction:
    - {stiction: 2.0, stribeck: -0.3, viscous: 0.5}
    - {stiction: 1.0, stribeck: -0.2, viscous: 0.25}
"""

URDF = """\
<?xml version="1.0"?>
<robot name="two-joint-arm">
  <link name="base"/>
  <link name="upper">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 0.3"/>
      <mass value="2.0"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/>
    </inertial>
  </link>
  <link name="lower">
    <inertial>
      <mass value="1.0"/>
      <inertia ixx="0.01" ixy="0.001" ixz="0" iyy="0.01" iyz="0" izz="0.012"/>
    </inertial>
  </link>
  <link name="tool"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.3" rpy="0 0.5 0"/>
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="1.5" effort="30"/>
    <dynamics damping="0.5" friction="0.2"/>
  </joint>
  <joint name="elbow" type="continuous">
    <origin xyz="0.4 0 0"/>
    <parent link="upper"/>
    <child link="lower"/>
    <axis xyz="0 0 -1"/>
    <limit velocity="2.5" effort="10"/>
  </joint>
  <joint name="flange" type="fixed">
    <origin xyz="0 0 0.2"/>
    <parent link="lower"/>
    <child link="tool"/>
  </joint>
</robot>
"""

URDF_ROBOT_YAML = """\
name: urdf-arm
kinematics:
  urdf: {file: arm.urdf, base: base, tip: tool}
"""


def write_robot(folder: Path, text: str | bytes, urdf: str | bytes | None = None) -> Path:
    """A robot file in a folder, with the URDF beside it."""
    path = folder / "arm.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    if urdf is not None:
        (folder / "arm.urdf").write_bytes(urdf if isinstance(urdf, bytes) else urdf.encode())
    return path


def replaced(text: str, old: str, new: str) -> str:
    """The text with one part exchanged, which must stand in it."""
    assert old in text, old
    return text.replace(old, new, 1)
