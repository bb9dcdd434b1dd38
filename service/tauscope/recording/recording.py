"""What was measured: one continuous motion, its positions and its torques."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tauscope.errors import RecordingError, RecordingMismatchError
from tauscope.recording.columns import OPTIONAL_GROUPS, table_columns
from tauscope.recording.samples import Array, EffortKind, RowCheck, Samples, Table, require_rising, require_rows
from tauscope.recording.table import MemoryTable
from tauscope.result_warning import ResultWarning
from tauscope.robot.robot import Robot

__all__ = ["Array", "EffortKind", "Recording", "Samples", "Table", "take_commands"]


@dataclass(frozen=True, eq=False)
class Recording:
    """One continuous motion as it was measured."""

    name: str
    joint_count: int
    effort_kind: EffortKind
    table: Table
    ignored_columns: tuple[str, ...] = ()
    notes: tuple[ResultWarning, ...] = ()  # warnings without its name
    # relative standard error of each joint's effort as a whole; empty where measured
    effort_std: tuple[float, ...] = ()
    is_examined: bool = False  # whether units and samples were looked at, so that they need not be again

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.table)

    @property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """Warnings about its units and samples, each beginning with its name."""
        return tuple(note.model_copy(update={"text": f"{self.name}: {note.text}"}) for note in self.notes)

    def has(self, group: str) -> bool:
        """Whether any joint has a column of a group, such as ``qlink`` or ``temp``; no row is read."""
        return any(name.rstrip("0123456789") == group for name in self.table.names)

    def samples(self, start: int = 0, stop: int | None = None) -> Samples:
        """Samples start:stop, as read-only views of the table where its columns allow; None for columns it lacks."""
        first, last, _ = slice(start, stop).indices(len(self.table))
        block = self.table.rows(first, max(first, last))
        where = {name: index for index, name in enumerate(self.table.names)}
        groups = {_ARGUMENTS[group]: self._group(block, group, where) for group in OPTIONAL_GROUPS}
        n = self.joint_count
        return Samples(
            time=block[:, 0],
            position=block[:, 1 : 1 + n],
            effort=block[:, 1 + n : 1 + 2 * n],
            **groups,
            period=block[:, where["period"]] if "period" in where else None,
        )

    def joint_torque(self, effort: Array, robot: Robot) -> Array:
        """τ = sign · k · effort, k = 1 of recorded torque; `effort` and τ (N, n). Raises a RecordingMismatchError."""
        if self.effort_kind is EffortKind.COMMAND:
            raise RecordingError(
                f"{self.name}: column tau1 is missing, and joint 1 ({robot.joints[0].name}) has no position loop that"
                " makes torque of qref1; record torques, or state joints[].actuator in the robot file"
            )
        if effort.ndim != 2 or effort.shape[1] != robot.joint_count:
            raise RecordingMismatchError(
                f"{self.name}: efforts of shape {effort.shape} do not fit the robot's {robot.joint_count} joints"
            )
        gain = np.array([float(joint.sign) for joint in robot.joints])
        if self.effort_kind is EffortKind.CURRENT:
            gain *= [joint.torque_constant for joint in robot.joints]
        return effort * gain

    @staticmethod
    def from_arrays(
        name: str,
        time: Array,
        position: Array,
        effort: Array,
        *,
        effort_kind: EffortKind = EffortKind.TORQUE,
        period: Array | None = None,
        **optional: Array | None,
    ) -> "Recording":
        """Make a recording of arrays, held to the same rules as a file: `time`, (N,), strictly increasing [s].

        `position`, `effort`: (N, n), q and τ or drive units; `period`: (N,), NaN outside the repeated part; `optional`:
        (N, n), as `Samples` names them. Raises RecordingError: argument, row from 0, joint; TypeError for others.
        """
        unknown = optional.keys() - {_ARGUMENTS[group] for group in OPTIONAL_GROUPS}
        if unknown:
            raise TypeError(f"no column of a recording is called {', '.join(sorted(unknown))}")
        time = _check("time", time, name, None)
        position = _check("position", position, name, (len(time), None))
        shape = (len(time), position.shape[1])
        columns, present = [time[:, None], position, _check("effort", effort, name, shape)], []
        for group in OPTIONAL_GROUPS:
            array = optional.get(_ARGUMENTS[group])
            if array is not None and group != effort_kind:
                columns.append(_check(_ARGUMENTS[group], array, name, shape))
                present.append(group)
        if period is not None:
            columns.append(_check("period", period, name, (len(time),))[:, None])
            present.append("period")
        require_rows(len(time), name)
        names = table_columns(shape[1], effort_kind, present)
        data = np.hstack(columns)
        RowCheck(name, names)(data, lambda row: f"row {row}")
        require_rising(data[:, 0], -np.inf, name, lambda row: f"row {row}")
        return Recording(name, shape[1], effort_kind, MemoryTable(names, data))

    def _group(self, block: Array, group: str, where: Mapping[str, int]) -> Array | None:
        """One column a joint; a view where the file has all of them, NaN where it lacks one."""
        joints = range(self.joint_count)
        places = {joint: where[name] for joint in joints if (name := f"{group}{joint + 1}") in where}
        if len(places) == self.joint_count:
            return block[:, places[0] : places[0] + self.joint_count]
        columns = np.full((len(block), self.joint_count), np.nan)
        for joint, place in places.items():
            columns[:, joint] = block[:, place]
        return columns if places else None


_NAMES = ("velocity", "acceleration", "reference", "effort_command", "temperature", "link_position", "voltage", "gain")
_ARGUMENTS = dict(zip(OPTIONAL_GROUPS, _NAMES, strict=True))


def _check(argument: str, array: Array, name: str, shape: tuple[int | None, ...] | None) -> Array:
    """An argument as float64 of the expected shape, without infinite numbers; `shape` None is any vector."""
    try:
        checked = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{name}: argument {argument} is not an array of numbers") from error
    expected = (None,) if shape is None else shape
    fits = checked.ndim == len(expected) and all(
        want is None or want == have for want, have in zip(expected, checked.shape, strict=True)
    )
    if not fits or 0 in checked.shape[1:]:
        words = ", ".join("n" if want is None else str(want) for want in expected) if shape else "N"
        raise RecordingError(f"{name}: argument {argument} has shape {checked.shape}; expected ({words})")
    if np.isinf(checked).any():
        row, *column = (int(index) for index in np.argwhere(np.isinf(checked))[0])
        joint = f", joint {column[0] + 1}" if column else ""
        raise RecordingError(f"{name}: argument {argument}, row {row}{joint}: the value is infinite")
    return checked


def take_commands(recording: Recording) -> Recording | None:
    """The recording with its commands in place of effort; None where a joint has none."""
    if recording.effort_kind is EffortKind.COMMAND:
        return recording
    names, first = recording.table.names, table_columns(recording.joint_count, EffortKind.COMMAND)
    if not set(first) <= set(names):
        return None
    lost = recording.effort_kind.value
    kept = (*first, *(name for name in names if name not in first and name.rstrip("0123456789") != lost))
    rows = recording.table.rows(0, len(recording))[:, [names.index(name) for name in kept]]
    return replace(recording, effort_kind=EffortKind.COMMAND, table=MemoryTable(kept, rows))
