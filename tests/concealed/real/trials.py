"""Trials on recordings of real arms: untouched ones with what their authors found, and changed ones.

Nothing of the recordings is in the repository: where their folder is absent there are no such trials.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from concealed.real.editing import Edit, carried, cogging_of, later, scaled
from tauscope.recording import read_recording

REPOSITORY = Path(__file__).resolve().parents[3]


def data() -> Path:
    """The folder of the recordings."""
    return Path(os.environ.get("TAUSCOPE_DATA") or REPOSITORY.parent / "shared" / "data")


@dataclass(frozen=True)
class Real:
    """A trial on real recordings.

    recordings : str
        folder of the set
    words : str
        what is concealed, or what the authors found
    labels : tuple of str
        ``effect@joint`` that are right answers; none where little is missing
    edit : callable
        gives the edit, called where the recordings are; None where they stay as they are
    parameters : mapping
        concealed values, by the names of the finding's parameters
    against_model : bool
        whether the changed recordings are compared with the model of the untouched ones
    """

    recordings: str
    words: str
    labels: tuple[str, ...]
    edit: Callable[[], Edit] | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    against_model: bool = False


def _both(effect: str, *joints: str) -> tuple[str, ...]:
    return tuple(f"{effect}@{joint}" for joint in joints)


QUICK = ("emps", "odrive", "emps-later", "lwr4-gain")
"""Those of the reduced set."""

REAL: dict[str, Real] = {
    "emps": Real("emps", "asymmetric friction (its authors)", ("asymmetric_viscous@carriage",)),
    "staubli-tx40": Real(
        "staubli-tx40", "coupled wrist (its maker, its authors)", _both("friction_coupling", "joint_5", "joint_6")
    ),
    "double-pendulum": Real(
        "double-pendulum",
        "load-dependent friction (our fits, not its authors)",
        _both("load_dependent_friction", "shoulder", "elbow"),
    ),
    "odrive": Real("odrive-cogging", "cogging, most at order 7 (its author)", ("cogging@shaft",)),
    "lwr4": Real("kuka-lwr4", "little: torque is sensed behind the gears", ()),
    "panda": Real("franka-panda", "little: torque is sensed behind the gears", ()),
    "emps-later": Real(
        "emps", "all torque 4 ms later", ("time_delay", "time_delay@carriage"), lambda: later(4), {"d": 0.004}
    ),
    "lwr4-later": Real("kuka-lwr4", "all torque 15 ms later", ("time_delay",), lambda: later(3), {"d": 0.015}),
    "panda-later": Real(
        "franka-panda", "torque of joint 2 8 ms later", ("time_delay@joint2",), lambda: later(4, 1), {"d": 0.008}
    ),
    "lwr4-gain": Real(
        "kuka-lwr4",
        "torque of joint 2 times 1.15",
        ("torque_gain_error@lwr_1_joint",),
        lambda: scaled(1, 1.15),
        {"g": 0.15},
    ),
    "panda-gain": Real(
        "franka-panda",
        "torque of joint 4 times 0.9",
        ("torque_gain_error@joint4",),
        lambda: scaled(3, 0.9),
        {"g": -0.1},
    ),
    "lwr4-mass": Real(
        "kuka-lwr4",
        "1.2 kg on the last link, against the model of the untouched recordings",
        ("payload",),
        lambda: carried(1.2, (0.02, 0.0, 0.08)),
        {"m": 1.2},
        against_model=True,
    ),
    "panda-mass": Real(
        "franka-panda",
        "0.8 kg on the last link, against the model of the untouched recordings",
        ("payload",),
        lambda: carried(0.8, (0.0, 0.03, 0.15)),
        {"m": 0.8},
        against_model=True,
    ),
    "lwr4-picked-up": Real(
        "kuka-lwr4",
        "1.2 kg on the last link, from the middle of each recording on",
        ("payload_change",),
        lambda: carried(1.2, (0.02, 0.0, 0.08), 0.5),
        {"m": 1.2},
    ),
    "panda-cogging": Real(
        "franka-panda",
        "the ODrive's cogging map at joint 1, 0.6 Nm rms",
        ("cogging@joint1",),
        lambda: cogging_of(read_recording(data() / "odrive-cogging" / "train-1.csv"), 0, 0.6),
    ),
}
"""All trials, the untouched ones first."""
