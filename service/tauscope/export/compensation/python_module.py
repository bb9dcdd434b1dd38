"""The compensation model as a Python module that needs nothing but `math`."""

from tauscope.export.compensation.model import CompensationModel
from tauscope.export.compensation.source_table import (
    COEFFICIENTS,
    UnitFunction,
    heading,
    identifier,
    row,
    unit_functions,
)


def to_python(model: CompensationModel) -> str:
    """The model as Python source with plain functions.

    ``NAME_friction_torque(joint, velocity)`` returns the torque of equations (7), (8) plus offset;
    ``NAME_friction_current_ma`` and ``NAME_friction_permille`` return it in drive units and exist only where every
    joint's unit is known. Joints count from 1; another number raises IndexError. NAME is the robot's name as an
    identifier.
    """
    name = identifier(model.robot)
    functions, _ = unit_functions(model)
    parts = [
        "\n".join(f"# {line}".rstrip() for line in heading(model)),
        "import math",
        _table(model),
        _torque_function(name),
        *(_unit_function(name, function) for function in functions),
    ]
    return "\n\n".join(parts) + "\n"


def _table(model: CompensationModel) -> str:
    """Names and coefficients of the joints."""
    names = "".join(f"    {joint.name!a},\n" for joint in model.joints)
    rows = "".join(f"    {row(joint)!r},\n" for joint in model.joints)
    return f"JOINT_NAMES = (\n{names})\n\n# {', '.join(COEFFICIENTS)}\nCOEFFICIENTS = (\n{rows})"


def _torque_function(name: str) -> str:
    """The function that gives the joint torque."""
    return f'''
def {name}_friction_torque(joint, velocity):
    """Torque in Nm (force in N) that compensates the friction of a joint moving at the given velocity."""
    if not 1 <= joint <= len(COEFFICIENTS):
        raise IndexError(f"joint {{joint}} does not exist; joints are numbered 1 to {{len(COEFFICIENTS)}}")
    stiction, stribeck, viscous, offset, k_v, delta = COEFFICIENTS[joint - 1]
    two_over_pi = 2.0 / math.pi
    step = math.atan(k_v * velocity) * two_over_pi
    return stiction * step + stribeck * (math.atan(delta * velocity) * two_over_pi) + viscous * velocity + offset'''


def _unit_function(name: str, function: UnitFunction) -> str:
    """A function that gives the friction in a drive unit."""
    return f'''
def {name}_{function.suffix}(joint, velocity):
    """The same as {function.meaning}."""
    torque = {name}_friction_torque(joint, velocity)
    return torque / {function.torque_per_unit!r}[joint - 1]'''
