"""What the C header and the Python module have in common: the functions to write, and the comment above them."""

import re
import textwrap
import unicodedata
from dataclasses import dataclass

from tauscope.export.compensation.model import EQUATION, CompensationModel, JointCompensation
from tauscope.robot import JointType

_PLAIN = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 ._,:;()+=@#%/-")
"""Characters that end no comment and no string, and start no trigraph, in C, C++ or Python."""


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
    """A function that gives the friction in one unit.

    `torque_per_unit`: what one unit means at each joint [Nm or N].
    """

    suffix: str
    meaning: str
    torque_per_unit: tuple[float, ...]


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
        *(_joint_line(number, joint) for number, joint in enumerate(model.joints, start=1)),
        "",
        *(f"Recording {source.name}, sha256 {source.sha256}." for source in model.recordings),
        *unit_functions(model)[1],
    ]
    return tuple(part for line in lines for part in textwrap.wrap(comment_text(line), 100) or [""])


def row(joint: JointCompensation) -> tuple[float, ...]:
    """A joint's numbers in the order of `COEFFICIENTS`; δ is 0 where the joint has no Stribeck term."""
    values = {name: getattr(joint.friction, name) for name in COEFFICIENTS}
    return tuple(0.0 if values[name] is None else float(values[name]) for name in COEFFICIENTS)


def _joint_line(number: int, joint: JointCompensation) -> str:
    """A joint's number, name and units in one line."""
    kind = "prismatic" if joint.type is JointType.PRISMATIC else "revolute"
    return f"Joint {number}: {joint.name} ({kind}). " + " ".join(f"{remark}." for remark in joint.units.remarks)
