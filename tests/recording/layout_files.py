"""One recording of three joints that the tests write as other tools do, and what they read it by."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tauscope.recording import Reading, Recording, read_recording
from tauscope.robot import RecordingLayout, layout_from_dict
from tauscope.robot.yaml_text import read_yaml

RNG = np.random.default_rng(3)
TIME = 100.0 + np.arange(40) * 0.01
Q, QD, TAU = (np.round(RNG.normal(size=(40, 3)), 6) for _ in range(3))
JOINTS = ("shoulder_pan", "elbow", "wrist_1")


def write(path: Path, header: Sequence[str] | None, rows: np.ndarray, delimiter: str = ",", decimal: str = ".") -> Path:
    lines = [] if header is None else [delimiter.join(header)]
    lines += [delimiter.join(repr(value).replace(".", decimal) for value in row) for row in rows.tolist()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def read(path: Path, layout: RecordingLayout, joints: Sequence[str] | None = None) -> Recording:
    reading = Reading(columns=layout.columns, decimal=layout.decimal, delimiter=layout.delimiter, units=layout.units)
    return read_recording(path, joint_names=joints, reading=reading.for_robot(None))


def guess_of(message: str) -> RecordingLayout:
    """The mapping that a refusal prints, pasted."""
    return paste_layout(message[message.index("recording: {") :])


def paste_layout(text: str) -> RecordingLayout:
    return layout_from_dict(read_yaml(text, "pasted").data)
