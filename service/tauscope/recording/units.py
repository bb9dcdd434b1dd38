"""From the units that a file is written in to SI: factors of its columns, and the clock of its rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.errors import RecordingError
from tauscope.recording.layout.presets import PRESET_OF
from tauscope.recording.samples import Array, EffortKind
from tauscope.robot.recording_layout import DELIMITERS, RecordingLayout, find_fault
from tauscope.robot.robot import JointType, Robot

SECONDS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}  # units of time [s]
# Units of angle [rad], and of speed a minute [rad/s].
RADIANS: Mapping[str, float] = {
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": np.pi / 180.0,
    "rev": 2.0 * np.pi,
    "rpm": 2.0 * np.pi / 60.0,
}
METRES: Mapping[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}  # units of length [m]
_POUND, _FOOT = 4.4482216152605, 0.3048  # force [N] and length [m]
# Units of torque and force [Nm or N].
TORQUES: Mapping[str, float] = {
    **{"Nm": 1.0, "N": 1.0, "mNm": 1e-3, "Ncm": 1e-2, "Nmm": 1e-3, "kNm": 1e3, "kN": 1e3},
    **{"lbft": _POUND * _FOOT, "lbin": _POUND * _FOOT / 12.0, "ozin": _POUND * _FOOT / 192.0},
}
# Units that a joint's torque constant turns into torque [A, or the drive's own unit].
CURRENTS: Mapping[str, float] = {"A": 1.0, "mA": 1e-3, "drive": 1.0}
_FOLLOWERS: Mapping[str, tuple[str, ...]] = {"q": ("q", "qref", "qlink"), "qd": ("qd", "qdd"), "tau": ("tau", "taucmd")}


@dataclass(frozen=True)
class Reading(RecordingLayout):
    """How a file is to be read: its layout, SI where it states no unit, and what is known of the robot."""

    trust_units: bool = False
    joint_types: tuple[JointType, ...] | None = None  # degrees are of revolute joints only, mm of prismatic ones
    joint_names: tuple[str, ...] | None = None
    prefers_torque: bool = False  # whether currents are of no use, because no torque constant is known
    # whether the columns are those of the robot file: recordings that Tauscope made have their own
    is_usual: bool = False

    def for_robot(self, robot: Robot | None) -> "Reading":
        """Fill in what the robot file states. Raises RecordingError for an unknown unit, or a missing rate."""
        layout = RecordingLayout() if robot is None else robot.recording
        columns = layout.columns if self.columns is None else self.columns
        preset = PRESET_OF[columns].units if isinstance(columns, str) else {}
        units = {**preset, **layout.units, **self.units}
        rate_hz = self.rate_hz if self.rate_hz is not None or units.get("t") != "index" else layout.rate_hz
        fault = find_fault(units, rate_hz)
        if fault is not None:
            raise RecordingError(f"units: {fault[1]}")
        joints = None if robot is None else robot.joints
        return replace(
            self,
            units=units,
            rate_hz=rate_hz,
            columns=columns,
            is_usual=self.columns is None and columns is not None,
            decimal=self.decimal or layout.decimal,
            delimiter=self.delimiter or layout.delimiter,
            topic=self.topic or layout.topic,
            joint_types=None if joints is None else tuple(joint.type for joint in joints),
            joint_names=None if joints is None else tuple(joint.name for joint in joints),
            prefers_torque=joints is not None and not all(joint.has_torque_constant for joint in joints),
        )

    @property
    def delimiter_sign(self) -> str | None:
        """The sign between fields, None where the file shows it."""
        return None if self.delimiter is None else DELIMITERS[self.delimiter]


SI = Reading()  # a file in SI units


@dataclass(frozen=True, eq=False)
class Conversion:
    """Turns rows of a file into SI."""

    names: tuple[str, ...]  # columns after the conversion: torque that is current becomes i1…
    effort_kind: EffortKind
    factor: Array  # (columns,), multiplies each column
    from_first: bool  # whether time counts from the first row: a large count has no room for small parts of a second

    @staticmethod
    def design(names: Sequence[str], effort_kind: EffortKind, reading: Reading) -> "Conversion":
        """The conversion of a table's columns."""
        time = reading.units.get("t", "s")
        seconds = 1.0 / (reading.rate_hz or 1.0) if time == "index" else SECONDS[time]
        torque = reading.units.get("tau")
        kind = effort_kind
        if torque is not None and effort_kind is not EffortKind.COMMAND:
            kind = EffortKind.CURRENT if torque in CURRENTS else EffortKind.TORQUE
        columns, factors = [], []
        for name in names:
            group = name.rstrip("0123456789")
            number = name[len(group) :]
            factors.append(seconds if group == "t" else _factor("tau" if group == "i" else group, number, reading))
            columns.append(kind.value + number if group == effort_kind.value else name)
        return Conversion(tuple(columns), kind, np.array(factors), time != "s")

    @property
    def is_needed(self) -> bool:
        """Whether anything changes."""
        return self.from_first or bool((self.factor != 1.0).any())


def parse_units(text: str) -> dict[str, str]:
    """Units as a command line writes them: ``q=deg,t=ms``. Raises ValueError naming the part that is no assignment."""
    units: dict[str, str] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        column, sign, unit = (piece.strip() for piece in part.partition("="))
        if not (column and sign and unit):
            raise ValueError(f"{part!r} is no unit; write it as q=deg,t=ms,tau=mA")
        if column in units:
            raise ValueError(f"{column} has two units; give one")
        units[column] = unit
    return units


def _factor(group: str, number: str, reading: Reading) -> float:
    root = next((root for root, followers in _FOLLOWERS.items() if group in followers), None)
    if root is None:
        return 1.0
    units = reading.units
    unit = units.get(f"{root}{number}", units.get(root, ""))
    if not unit and root == "qd":  # a file in degrees holds degrees a second
        unit = units.get(f"q{number}", units.get("q", ""))
    joint = None if reading.joint_types is None or not number else reading.joint_types[int(number) - 1]
    if unit in RADIANS:
        return RADIANS[unit] if joint is not JointType.PRISMATIC else 1.0
    if unit in METRES:
        return METRES[unit] if joint is not JointType.REVOLUTE else 1.0
    return CURRENTS.get(unit, TORQUES.get(unit, 1.0))
