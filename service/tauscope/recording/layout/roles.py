"""The quantity that a family of columns holds, by the words of its name."""

import re
from collections.abc import Mapping, Sequence

_CORES: Mapping[str, str] = {
    **dict.fromkeys(("q", "qpos", "position", "positions", "pos", "angle", "angles", "theta", "state"), "q"),
    **dict.fromkeys(("qd", "dq", "qdot", "qvel", "velocity", "velocities", "vel", "speed", "speeds", "omega"), "qd"),
    **dict.fromkeys(("qdd", "ddq", "qacc", "acceleration", "accelerations", "acc"), "qdd"),
    **dict.fromkeys(("tau", "torque", "torques", "effort", "efforts", "moment", "moments", "trq", "force"), "tau"),
    **dict.fromkeys(("i", "current", "currents", "cur", "load"), "i"),
    **dict.fromkeys(("qref", "action"), "qref"),
    **dict.fromkeys(("taucmd", "ctrl"), "taucmd"),
    **dict.fromkeys(("temp", "temperature", "temperatures"), "temp"),
    **dict.fromkeys(("volt", "volts", "voltage", "voltages"), "volt"),
    "qlink": "qlink",
}
_COMMANDED = frozenset(
    ("target", "desired", "des", "d", "cmd", "command", "commanded", "ref", "reference", "goal", "setpoint", "ipo")
)
# Words of quantities that belong to no joint, or are not its measurement.
_FOREIGN = frozenset(
    ("tcp", "ee", "eef", "cartesian", "base", "tool", "ext", "external", "wrench", "object", "pose", "contact")
) | frozenset(("qfrc", "gravity", "error", "bias", "limit", "limits", "max", "min", "accelerometer", "imu"))

_QUALIFIERS = frozenset(
    ("present", "actual", "measured", "meas", "act", "raw", "filtered", "msr", "computed", "applied")
)
# Words that make a family second choice.
_LEVELS: Mapping[str, int] = {"computed": 1, "force": 2, "theta": 2, "load": 2, "state": 3}
_TIMES = ("t", "time", "timestamp", "stamp", "sim_time", "time_s", "seconds", "sec", "clock", "elapsed", "duration")
_UNIT = re.compile(r"(?<![A-Za-z])(deg(?:rees?)?|mA)(?![A-Za-z])|(°)")


def is_joint_name(words: Sequence[str]) -> bool:
    """Whether words may name a joint: none of them names a quantity, or says how it came about."""
    return not any(word in _CORES or word in _COMMANDED or word in _QUALIFIERS for word in words)


def role_of(words: Sequence[str]) -> tuple[str, int] | None:
    """The group of CONTRACT.md that words name, and how far they are from the first choice; None where none.

    The last word that names a quantity decides: ``actual_current_as_torque`` is a torque.
    """
    if tuple(words[-2:]) == ("qfrc", "actuator"):  # the joint torque of MuJoCo's actuators
        return "tau", 0
    if _FOREIGN.intersection(words):
        return None
    cores = [word for word in words if word in _CORES]
    if not cores:
        return None
    role = _CORES[cores[-1]]
    if "dot" in words:
        role = {"q": "qd", "qd": "qdd"}.get(role, role)
    if "link" in words and role == "q":
        role = "qlink"
    if _COMMANDED.intersection(words):
        role = {"q": "qref", "tau": "taucmd", "qref": "qref", "taucmd": "taucmd"}.get(role, "")
    return (role, sum(_LEVELS.get(word, 0) for word in words)) if role else None


def time_rank(words: Sequence[str]) -> int | None:
    """How likely a column is the time; the least is the likeliest, None where it is none."""
    name = "_".join(word for word in words if word not in ("ms", "us", "ns", "s"))
    for rank, time in enumerate(_TIMES):
        if name == time:
            return rank
    return next((len(_TIMES) + rank for rank, time in enumerate(_TIMES) if name.endswith(f"_{time}")), None)


def time_unit(words: Sequence[str]) -> str | None:
    """The unit that a name of a time states, None where it states none or seconds."""
    return next((word for word in words if word in ("ms", "us", "ns")), None)


def unit_of(name: str) -> str | None:
    """The unit that the name of a joint's column states, None where it states none or SI."""
    match = _UNIT.search(name)
    return None if match is None else "mA" if match[1] == "mA" else "deg"
