"""Source code of a friction compensation: its tables, as C and as Python."""

import re
import textwrap
import unicodedata
from dataclasses import dataclass

from tauscope.export.compensation.model import EQUATION, CompensationModel, JointCompensation

# Characters that end no comment and no string, and start no trigraph, in C, C++ or Python.
_PLAIN = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 ._,:;()+=@#%/-")


def identifier(name: str) -> str:
    """A name as a lower-case identifier that C, C++ and Python accept as the beginning of a longer one."""
    ascii_name = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii").lower()
    words = re.sub(r"[^a-z0-9]+", "_", ascii_name).strip("_")[:60].strip("_")
    if not words:
        return "robot"
    return words if words[0].isalpha() else f"robot_{words}"


def comment_text(text: str) -> str:
    """Text as it may stand in a comment of any of the languages: one line of plain ASCII."""
    return "".join(c if c in _PLAIN else f"<U+{ord(c):04X}>" for c in text)


def c_string(text: str) -> str:
    """Text as a C string literal in UTF-8, all but letters, digits and a few signs as three-digit octal escapes."""
    data = text.replace("\0", "\ufffd").encode("utf-8", "replace")
    return '"' + "".join(chr(b) if chr(b) in _PLAIN else f"\\{b:03o}" for b in data) + '"'


COEFFICIENTS = ("stiction", "stribeck", "viscous", "offset", "k_v", "delta")


@dataclass(frozen=True)
class UnitFunction:
    """A function that gives the friction in one unit."""

    suffix: str
    meaning: str
    torque_per_unit: tuple[float, ...]  # what one unit means at each joint [Nm or N]


def unit_functions(model: CompensationModel) -> tuple[tuple[UnitFunction, ...], tuple[str, ...]]:
    """The functions of a model in drive units, and the units that are left out because a joint does not know them."""
    candidates = (
        ("friction_current_ma", "motor current in mA", [j.units.torque_per_milliampere for j in model.joints]),
        ("friction_permille", "torque in 1/1000 of rated torque", [j.units.torque_per_permille for j in model.joints]),
    )
    functions, missing = [], []
    for suffix, meaning, per_unit in candidates:
        known = tuple(value for value in per_unit if value is not None)
        if len(known) == len(per_unit):
            functions.append(UnitFunction(suffix, meaning, known))
        else:
            unknown = ", ".join(j.name for j, value in zip(model.joints, per_unit, strict=True) if value is None)
            missing.append(f"{meaning}: not known for {unknown}; the function {suffix} is not written.")
    return tuple(functions), tuple(missing)


def heading(model: CompensationModel) -> tuple[str, ...]:
    """Lines of the comment at the top: what this is, in which units, and where it came from; safe in any language."""
    lines = [
        f"Friction compensation of {model.robot}, written by Tauscope {model.version} on {model.created.isoformat()}.",
        "",
        f"{EQUATION.replace('*', ' ')}, with the offset included.",
        "Joint numbers start at 1. v in rad/s, torque in Nm; of a prismatic joint v in m/s, force in N.",
        "",
        *(
            " ".join([f"Joint {number}: {joint.name} ({joint.type}).", *(f"{each}." for each in joint.units.remarks)])
            for number, joint in enumerate(model.joints, start=1)
        ),
        "",
        *(f"Recording {source.name}, sha256 {source.sha256}." for source in model.recordings),
        *unit_functions(model)[1],
    ]
    return tuple(part for line in lines for part in textwrap.wrap(comment_text(line), 100) or [""])


def row(joint: JointCompensation) -> tuple[float, ...]:
    """A joint's numbers in the order of `COEFFICIENTS`; δ is 0 where the joint has no Stribeck term."""
    values = {name: getattr(joint.friction, name) for name in COEFFICIENTS}
    return tuple(0.0 if values[name] is None else float(values[name]) for name in COEFFICIENTS)


_TWO_OVER_PI = "0.6366197723675814"  # the shortest decimal that reads back as 2/π rounded to float64


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
        _c_torque_function(name, model),
        *(_c_unit_function(name, function) for function in functions),
        f"#endif /* {guard} */",
    ]
    return "\n\n".join(parts) + "\n"


def _joint_name_function(name: str, model: CompensationModel) -> str:
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


def _c_torque_function(name: str, model: CompensationModel) -> str:
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


def _c_unit_function(name: str, function: UnitFunction) -> str:
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
        _python_torque_function(name),
        *(_python_unit_function(name, function) for function in functions),
    ]
    return "\n\n".join(parts) + "\n"


def _table(model: CompensationModel) -> str:
    names = "".join(f"    {joint.name!a},\n" for joint in model.joints)
    rows = "".join(f"    {row(joint)!r},\n" for joint in model.joints)
    return f"JOINT_NAMES = (\n{names})\n\n# {', '.join(COEFFICIENTS)}\nCOEFFICIENTS = (\n{rows})"


def _python_torque_function(name: str) -> str:
    return f'''
def {name}_friction_torque(joint, velocity):
    """Torque in Nm (force in N) that compensates the friction of a joint moving at the given velocity."""
    if not 1 <= joint <= len(COEFFICIENTS):
        raise IndexError(f"joint {{joint}} does not exist; joints are numbered 1 to {{len(COEFFICIENTS)}}")
    stiction, stribeck, viscous, offset, k_v, delta = COEFFICIENTS[joint - 1]
    two_over_pi = 2.0 / math.pi
    step = math.atan(k_v * velocity) * two_over_pi
    return stiction * step + stribeck * (math.atan(delta * velocity) * two_over_pi) + viscous * velocity + offset'''


def _python_unit_function(name: str, function: UnitFunction) -> str:
    return f'''
def {name}_{function.suffix}(joint, velocity):
    """The same as {function.meaning}."""
    torque = {name}_friction_torque(joint, velocity)
    return torque / {function.torque_per_unit!r}[joint - 1]'''
