"""Units as people read them."""

from collections.abc import Iterable

from tauscope.robot import JointType


def torque_unit(joint_type: JointType) -> str:
    """Unit of what drives a joint."""
    return "N" if joint_type is JointType.PRISMATIC else "Nm"


def velocity_unit(joint_type: JointType) -> str:
    """Unit of a joint's velocity."""
    return "m/s" if joint_type is JointType.PRISMATIC else "rad/s"


def state_unit(variable: str, joint_type: JointType) -> str:
    """Unit of a variable that a residual may depend on."""
    position = "m" if joint_type is JointType.PRISMATIC else "rad"
    units = {"velocity": f"{position}/s", "position": position, "acceleration": f"{position}/s²", "time": "s"}
    return {**units, "load": torque_unit(joint_type), "temperature": "°C", "motor_position": "rad"}.get(variable, "")


def base_parameter_unit(terms: Iterable[str]) -> str:
    """Unit of a combination of standard parameters: that of its first, whose coefficient is one."""
    first = next(iter(terms))
    if first.startswith("I"):
        return "kg m²"
    return "kg m" if first.startswith("ms") else "kg"
