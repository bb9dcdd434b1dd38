"""A trajectory as CSV for other controllers, and from them: ``t,q1…qn[,qd1…qdn][,qdd1…qddn][,period]``."""

import csv
import io
import math
import re

import numpy as np

from tauscope.errors import ExcitationError
from tauscope.robot.messages import nearest, shown
from tauscope.robot.robot import Array
from tauscope.trajectory.fourier_series import MotionSamples
from tauscope.trajectory.segments import SampledSegment
from tauscope.trajectory.trajectory import Trajectory

GROUPS = ("q", "qd", "qdd")  # prefixes of the columns that hold position, velocity and acceleration

# Positions alone become a quintic spline that rests at both ends: four times continuously differentiable.
SPLINE_DEGREE = 5
SPEED_MISFIT = 0.05  # part of the largest speed by which the velocities may miss the slope of the positions
POSITION_ROUNDING = 1e-4  # rounding of the positions that is not held against the velocities [rad or m]
_COLUMN = re.compile(r"^(qdd|qd|q)([1-9][0-9]{0,2})$")


PIECE_ROWS = 10_000  # rows of a piece of text: some megabytes, made in a fraction of a second


def trajectory_csv(trajectory: Trajectory, rate_hz: float) -> str:
    """CSV text: t, q1…, qd1…, qdd1…, period; shortest digits that read back as they were."""
    starts = range(0, trajectory.count_samples(rate_hz), PIECE_ROWS)
    return "".join(write_trajectory_rows(trajectory, rate_hz, start) for start in starts)


def write_trajectory_rows(trajectory: Trajectory, rate_hz: float, start: int) -> str:
    """`PIECE_ROWS` rows of the text from row `start` on; the header goes before the first ones."""
    stop = min(start + PIECE_ROWS, trajectory.count_samples(rate_hz))
    samples = trajectory.evaluate(np.arange(start, stop) / rate_hz)
    joints = range(1, trajectory.joint_count + 1)
    header = ["t", *(f"{group}{joint}" for group in GROUPS for joint in joints), "period"]
    columns = [samples.time[:, None], samples.position, samples.velocity, samples.acceleration]
    lines = [f"# trajectory of {trajectory.robot!r}", ",".join(header)] if start == 0 else []
    for row, period in zip(np.hstack(columns).tolist(), samples.period.tolist(), strict=True):
        label = "nan" if math.isnan(period) else str(int(period))
        lines.append(",".join([*map(repr, row), label]))
    return "".join(f"{line}\n" for line in lines)


def parse_trajectory_csv(text: str, name: str, robot: str, joints: tuple[str, ...]) -> Trajectory:
    """The trajectory of a CSV file.

    Velocity and acceleration that the file lacks come from a quintic spline through the positions that rests at both
    ends. Raises ExcitationError naming the file, the line and the column.
    """
    numbers, columns, lines = _read_numbers(text, name)
    count = len(joints)
    groups = {group: _group(columns, group, count, name) for group in GROUPS}
    time = numbers[:, columns.index("t")]
    if len(time) < 2:
        raise ExcitationError(f"{name}: has {len(time)} rows; a motion needs two or more")
    step = np.flatnonzero(~(np.diff(time) > 0.0))
    if len(step):
        line = lines[int(step[0]) + 1]
        raise ExcitationError(f"{name}: line {line}, column t: time does not increase; sort or repair the rows")
    time = time - time[0]
    position = numbers[:, groups["q"]]
    velocity, acceleration = (numbers[:, groups[group]] if groups[group] else None for group in GROUPS[1:])
    if velocity is not None:
        _require_fitting(time, position, velocity, name, lines)
    if velocity is None or acceleration is None:
        motion = _spline(time, position, name)
    else:
        motion = MotionSamples(position, velocity, acceleration)
    label = numbers[:, columns.index("period")] if "period" in columns else None
    try:
        return Trajectory(robot, joints, (SampledSegment(time, motion, label),))
    except ExcitationError as error:
        raise ExcitationError(f"{name}: {str(error).replace('segments[0]', 'the motion', 1)}") from None


def _read_numbers(text: str, name: str) -> tuple[Array, list[str], list[int]]:
    """All numbers, the names of their columns, and the line of every row."""
    rows: list[list[float]] = []
    lines: list[int] = []
    columns: list[str] | None = None
    reader = csv.reader(io.StringIO(text))
    try:
        for fields in reader:
            if not fields or fields[0].lstrip().startswith("#") or not any(field.strip() for field in fields):
                continue
            if columns is None:
                columns = _header([field.strip() for field in fields], name, reader.line_num)
                continue
            if len(fields) != len(columns):
                raise ExcitationError(
                    f"{name}: line {reader.line_num} has {len(fields)} fields where the header has {len(columns)}; "
                    "complete or delete the line"
                )
            rows.append([_number(f, name, reader.line_num, c) for f, c in zip(fields, columns, strict=True)])
            lines.append(reader.line_num)
    except csv.Error as error:
        raise ExcitationError(f"{name}: line {reader.line_num} is no CSV ({error}); is it the right file?") from None
    if columns is None:
        raise ExcitationError(f"{name}: holds no header line; begin with t,q1,q2,…")
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(columns)), columns, lines


def _header(fields: list[str], name: str, line: int) -> list[str]:
    """Column names, each known and there once."""
    for place, field in enumerate(fields):
        if field not in ("t", "period") and not _COLUMN.match(field):
            known = ["t", "q1", "qd1", "qdd1", "period"]
            raise ExcitationError(f"{name}: line {line}: unknown column {shown(field)}; {nearest(field, known)}")
        if field in fields[:place]:
            raise ExcitationError(f"{name}: line {line}: column {field} is there twice; keep one")
    if "t" not in fields:
        raise ExcitationError(f"{name}: line {line}: column t is missing; begin with t,q1,q2,…")
    return fields


def _number(field: str, name: str, line: int, column: str) -> float:
    """A finite number; the period index may be absent."""
    text = field.strip()
    if column == "period" and text.lower() in ("", "nan"):
        return math.nan
    try:
        value = float(text) if "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ExcitationError(f"{name}: line {line}, column {column}: {shown(text)} is no finite number")
    return value


def _group(columns: list[str], group: str, count: int, name: str) -> list[int]:
    """Places of one column a joint; none where the file lacks all of an optional group."""
    found = {int(match[2]) for column in columns if (match := _COLUMN.match(column)) and match[1] == group}
    if not found and group != "q":
        return []
    for joint in range(1, count + 1):
        if joint not in found:
            raise ExcitationError(f"{name}: column {group}{joint} is missing; give one column for each joint")
    if max(found) > count:
        raise ExcitationError(f"{name}: column {group}{max(found)} belongs to no joint: the robot has {count} joints")
    return [columns.index(f"{group}{joint}") for joint in range(1, count + 1)]


def _spline(time: Array, position: Array, name: str) -> MotionSamples:
    """Samples of the quintic spline through the positions, at rest at both ends."""
    # Not above: the process that plays a run needs SciPy for nothing else, and begins without it in half the time.
    from scipy.interpolate import make_interp_spline

    if len(time) <= SPLINE_DEGREE:
        raise ExcitationError(f"{name}: has {len(time)} rows; velocities from positions need {SPLINE_DEGREE + 1}")
    zero = np.zeros(position.shape[1])
    rest = [(1, zero), (2, zero)]
    # The stubs know one condition an end; SciPy takes as many as the degree needs.
    spline = make_interp_spline(time, position, k=SPLINE_DEGREE, bc_type=(rest, rest))  # pyright: ignore
    motion = MotionSamples(position, spline(time, 1), spline(time, 2))
    # At its ends the spline is at rest but for rounding.
    for values in (motion.velocity, motion.acceleration):
        values[[0, -1]] = 0.0
    return motion


def _require_fitting(time: Array, position: Array, velocity: Array, name: str, lines: list[int]) -> None:
    """Refuse velocities that are not the slope of the positions: other units, another order of joints, shifted rows."""
    slope = np.diff(position, axis=0) / np.diff(time)[:, None]
    middle = 0.5 * (velocity[1:] + velocity[:-1])
    speed = np.maximum(np.abs(slope).max(axis=0), np.abs(velocity).max(axis=0))
    allowed = SPEED_MISFIT * speed + POSITION_ROUNDING / np.diff(time)[:, None]
    wrong = np.argwhere(np.abs(slope - middle) > allowed)
    if len(wrong):
        row, joint = (int(index) for index in wrong[0])
        raise ExcitationError(
            f"{name}: line {lines[row + 1]}, column qd{joint + 1}: {velocity[row + 1, joint]:.6g} does not fit the "
            f"positions, whose slope is {slope[row, joint]:.6g}; check units and order, or leave the column out"
        )
