"""Layouts that other tools write, by the words of their columns; the first that a file has is taken."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Preset:
    """One tool's ends of column names without the joint, words joined by ``_``, by group of CONTRACT.md; its units."""

    columns: Mapping[str, tuple[str, ...]]
    units: Mapping[str, str]  # as in a robot file
    mark: str  # a word of its columns that no other tool writes, as a pattern: its units follow


def _preset(ends: str, units: Mapping[str, str] | None = None, mark: str = "") -> Preset:
    """A tool's layout; `ends`: each group and its ends, the likeliest first."""
    groups = (part.split() for part in ends.split(","))
    return Preset({group: tuple(names) for group, *names in groups}, units or {}, mark)


# By the names of `tauscope.robot.recording_layout.PRESETS`.
PRESET_OF: Mapping[str, Preset] = {
    "rtde": _preset(
        "t timestamp, q actual_q, qd actual_qd, qref target_q, tau actual_current_as_torque, i actual_current,"
        "taucmd target_moment, temp joint_temperatures"
    ),
    "libfranka": _preset("t time timestamp t, q q, qd dq, qref q_d, tau tau_j, taucmd tau_j_d"),
    "plotjuggler": _preset("t time timestamp, q position, qd velocity, tau effort torque, i current"),
    "lerobot": _preset(
        "t timestamp, q observation_state, qref action, tau observation_effort observation_torque,"
        "i observation_current observation_load",
        {"q": "deg"},
        r"observation\.state",
    ),
    "mujoco": _preset("t time t, q qpos, qd qvel, qdd qacc, tau qfrc_actuator actuator_force, taucmd ctrl"),
    "isaac": _preset(
        "t time sim_time timestamp t, q joint_pos joint_position joint_positions dof_pos,"
        "qd joint_vel joint_velocity joint_velocities dof_vel,"
        "qref joint_pos_target joint_position_target joint_position_targets,"
        "tau applied_torque applied_torques joint_effort joint_efforts measured_joint_efforts"
        " joint_torque joint_torques dof_force computed_torque"
    ),
    "odrive": _preset(
        "t time timestamp t, q pos_estimate, qd vel_estimate, tau torque_estimate, i iq_measured",
        {"q": "rev"},
        "pos_estimate",
    ),
    "moteus": _preset("t time timestamp t, q position, qd velocity, tau torque, i q_a q_current", {"q": "rev"}, "q_A"),
}
