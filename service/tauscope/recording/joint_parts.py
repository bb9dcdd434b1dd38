"""Joint states of which no message holds all joints, or both position and effort: merged by name and time."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope.recording.columns import table_columns
from tauscope.recording.intake import Choice, RowIntake
from tauscope.recording.joint_state import JointStates
from tauscope.recording.recording import EffortKind, Recording
from tauscope.recording.samples import Array
from tauscope.result_warning import ResultWarning
from tauscope.robot.messages import listed

GAP_INTERVALS = 5.0  # of a joint's median interval, beyond which nothing is interpolated
_POSITION, _EFFORT, _VELOCITY = range(3)


class JointParts:
    """The wanted joints of one topic's messages, each with a clock of its own."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.messages = 0
        self._clocks: dict[str, list[NDArray[np.int64]]] = {}
        self._values: dict[str, list[Array]] = {}

    def add(self, states: JointStates, log_time: NDArray[np.int64], wanted: Sequence[str]) -> None:
        """Take messages of one layout. `log_time`: (N,), the clock where there are no stamps [ns]."""
        arrays = (states.position, states.effort, states.velocity)
        known = [array if array.shape[1] == len(states.names) else None for array in arrays]
        own = [(place, name) for place, name in enumerate(states.names) if name in wanted]
        self.messages += len(states.stamp) if own else 0
        for place, name in own:
            missing = np.full(len(states.stamp), np.nan)
            columns = [missing if array is None else array[:, place] for array in known]
            self._clocks.setdefault(name, []).append(states.stamp if states.stamp.any() else log_time)
            self._values.setdefault(name, []).append(np.column_stack(columns))

    def is_whole(self, joint: str) -> bool:
        """Whether both positions and efforts of a joint are known."""
        return all(len(self.series(joint, quantity)[0]) > 1 for quantity in (_POSITION, _EFFORT))

    def series(self, joint: str, quantity: int) -> tuple[NDArray[np.int64], Array]:
        """Instants at which a quantity of a joint is known, rising [ns], and its values there, both (M,)."""
        if joint not in self._clocks:
            return np.empty(0, np.int64), np.empty(0)
        clock, values = np.concatenate(self._clocks[joint]), np.concatenate(self._values[joint])[:, quantity]
        known = np.isfinite(values)
        instants, first = np.unique(clock[known], return_index=True)
        return instants, values[known][first]


def merge_parts(topics: Sequence[JointParts], wanted: Sequence[str], choice: Choice) -> Recording | None:
    """The recording at the instants of the slowest joint, NaN in gaps; None where a joint lacks position or effort."""
    of_joint = [next((topic for topic in topics if topic.is_whole(joint)), None) for joint in wanted]
    used = [topic for topic in topics if topic in of_joint]
    sources = [(topic, joint) for topic, joint in zip(of_joint, wanted, strict=True) if topic is not None]
    if len(sources) < len(wanted):
        return None
    groups = [[topic.series(joint, group) for topic, joint in sources] for group in (_POSITION, _EFFORT, _VELOCITY)]
    has_velocity = all(len(instants) > 1 for instants, _ in groups[_VELOCITY])
    known = [each for group in groups[: 3 if has_velocity else 2] for each in group]
    slowest = min(range(len(wanted)), key=lambda joint: len(known[joint][0]))
    start, stop = max(each[0][0] for each in known), min(each[0][-1] for each in known)
    clock = known[slowest][0]
    clock = clock[(clock >= start) & (clock <= stop)]
    time = (clock - start).astype(np.float64) * 1e-9
    columns = [_interpolate(time, (instants - start).astype(np.float64) * 1e-9, values) for instants, values in known]
    names = table_columns(len(wanted), EffortKind.TORQUE, ("qd",) if has_velocity else ())
    intake = RowIntake(choice, names, EffortKind.TORQUE)
    intake.add(np.column_stack([time, *columns]), lambda row: f"merged message {row + 1}")
    count, names_of = sum(topic.messages for topic in used), listed([topic.topic for topic in used])
    text = (
        f"topic {names_of}: {count} messages hold part of the joint states each; merged by name, at the {len(time)}"
        f" instants of {wanted[slowest]}"
    )
    note = ResultWarning(code="held-samples", text=text, remedy="record all joints at the same instants")
    return intake.finish(len(wanted), notes=(note,))


def _interpolate(time: Array, instants: Array, values: Array) -> Array:
    """Values at other instants, NaN within gaps. All (N,) or (M,), time [s]."""
    after = np.clip(np.searchsorted(instants, time), 1, len(instants) - 1)
    step = np.diff(instants)
    is_lost = (step[after - 1] > GAP_INTERVALS * np.median(step)) & ~np.isin(time, instants)
    return np.where(is_lost, np.nan, np.interp(time, instants, values))
