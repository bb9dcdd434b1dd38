"""The compensation model as a C99 header that needs nothing but atan() of math.h; also compiles as C++."""

from tauscope.export.compensation.model import CompensationModel
from tauscope.export.compensation.source_table import (
    COEFFICIENTS,
    UnitFunction,
    c_string,
    heading,
    identifier,
    row,
    unit_functions,
)

_TWO_OVER_PI = "0.6366197723675814"
"""The shortest decimal that reads back as 2/π rounded to float64."""


def to_c_header(model: CompensationModel) -> str:
    """The model as a C header with ``static inline`` functions.

    ``double NAME_friction_torque(int joint, double velocity)`` returns the torque of equations (7), (8) plus offset;
    ``NAME_friction_current_ma`` and ``NAME_friction_permille`` return it in drive units and exist only where every
    joint's unit is known, so that a missing unit is a compiler's error and not a wrong torque. Joints count from 1; for
    any other number the functions return 0. ``NAME_joint_name(int joint)`` gives the joint's name in UTF-8. NAME is the
    robot's name as an identifier.
    """
    name = identifier(model.robot)
    guard = f"TAUSCOPE_{name.upper()}_FRICTION_H"
    functions, _ = unit_functions(model)
    parts = [
        "/*\n" + "\n".join(f" * {line}".rstrip() for line in heading(model)) + "\n */",
        f"#ifndef {guard}\n#define {guard}\n\n#include <math.h>",
        f"#define {name.upper()}_JOINT_COUNT {len(model.joints)}",
        _joint_name_function(name, model),
        _torque_function(name, model),
        *(_unit_function(name, function) for function in functions),
        f"#endif /* {guard} */",
    ]
    return "\n\n".join(parts) + "\n"


def _joint_name_function(name: str, model: CompensationModel) -> str:
    """The function that names a joint."""
    names = ",\n        ".join(c_string(joint.name) for joint in model.joints)
    return f"""static inline const char *{name}_joint_name(int joint)
{{
    static const char *const names[{name.upper()}_JOINT_COUNT] = {{
        {names}
    }};
    if (joint < 1 || joint > {name.upper()}_JOINT_COUNT) {{
        return "";
    }}
    return names[joint - 1];
}}"""


def _torque_function(name: str, model: CompensationModel) -> str:
    """The function that gives the joint torque."""
    rows = ",\n        ".join("{" + ", ".join(map(repr, row(joint))) + "}" for joint in model.joints)
    return f"""/* Torque in Nm (force in N) that compensates the friction of a joint moving at the given velocity. */
static inline double {name}_friction_torque(int joint, double velocity)
{{
    /* {", ".join(COEFFICIENTS)} */
    static const double table[{name.upper()}_JOINT_COUNT][{len(COEFFICIENTS)}] = {{
        {rows}
    }};
    const double two_over_pi = {_TWO_OVER_PI};
    const double *c;
    if (joint < 1 || joint > {name.upper()}_JOINT_COUNT) {{
        return 0.0;
    }}
    c = table[joint - 1];
    return c[0] * (atan(c[4] * velocity) * two_over_pi) + c[1] * (atan(c[5] * velocity) * two_over_pi)
        + c[2] * velocity + c[3];
}}"""


def _unit_function(name: str, function: UnitFunction) -> str:
    """A function that gives the friction in a drive unit."""
    values = ", ".join(map(repr, function.torque_per_unit))
    return f"""/* The same as {function.meaning}. */
static inline double {name}_{function.suffix}(int joint, double velocity)
{{
    static const double torque_per_unit[{name.upper()}_JOINT_COUNT] = {{{values}}};
    if (joint < 1 || joint > {name.upper()}_JOINT_COUNT) {{
        return 0.0;
    }}
    return {name}_friction_torque(joint, velocity) / torque_per_unit[joint - 1];
}}"""
