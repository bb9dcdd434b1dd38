"""A simulated recording as a CSV file: columns t, q1…qn, tau1…taun (or i1…in), period."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tauscope.errors import RecordingError
from tauscope.robot.robot import Joint
from tauscope_sim.recording import SimulatedRecording


def write_recording_csv(
    path: Path, recording: SimulatedRecording, joints: Sequence[Joint], *, as_current: bool = False
) -> None:
    """Write what a real arm's logger would have written, the joints' wiring included.

    A joint with ``sign: -1`` is recorded the other way round; with `as_current` the columns are i1…in and hold torque
    divided by the joint's torque constant. Numbers are written so that reading them gives the same float64. Raises
    RecordingError where the file exists, or cannot be written.
    """
    signs = np.array([joint.sign for joint in joints], dtype=np.float64)
    constants = np.array([joint.torque_constant for joint in joints])
    effort = recording.torque * signs / (constants if as_current else 1.0)
    table = np.column_stack([recording.time, recording.position, effort])
    try:
        with path.open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(_header(len(joints), "i" if as_current else "tau"))
            # tolist turns a row into Python floats, whose text is the shortest that reads back exactly
            writer.writerows([*row.tolist(), int(period)] for row, period in zip(table, recording.period, strict=True))
    except FileExistsError as error:
        raise RecordingError(
            f"{path}: exists already, and recordings are not overwritten; choose another name"
        ) from error
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({error.strerror}); choose another place") from error


def _header(joint_count: int, effort: str) -> list[str]:
    """Column names of the recording file."""
    numbers = range(1, joint_count + 1)
    return ["t", *(f"q{number}" for number in numbers), *(f"{effort}{number}" for number in numbers), "period"]
