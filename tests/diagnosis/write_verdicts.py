"""Verdicts on the shared recordings: `python tests/diagnosis/write_verdicts.py` makes docs/reference/verdicts.md anew.

The recordings are those of `TAUSCOPE_DATA`; training and held-out files, and the robot file, by their names.
"""

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from service.diagnosis import Diagnosis
    from service.diagnosis.model.extended import ExtendedModel
    from service.recording.recording import Array

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "verdicts.md"

HEAD = """# Verdicts on recordings of real machines

Written by `tests/diagnosis/write_verdicts.py` from the shared recordings (not in this repository), everything at its
default: train on `train-*.csv`, confirm on `held-out-*.csv`. Residuals of the held-out recordings, before → after: rms
relative to that of the torque, all joints together, at the recorded rate without a filter, and in the band that model
and recordings are compared in; then the joint whose residual in that band shrinks most.

| recordings | verdict | findings (joint, probability; not told apart from) | unfiltered | in the band | most |
|---|---|---|---|---|---|
"""


def main() -> None:
    """Diagnose every folder, and write the page."""
    from service.diagnosis import diagnose, document
    from service.errors import TauscopeError
    from service.recording import read_recording
    from service.robot import read_robot

    data = Path(os.environ.get("TAUSCOPE_DATA", str(ROOT.parent / "shared" / "data")))
    rows = []
    for folder in sorted(each for each in data.iterdir() if (each / "robot.yaml").is_file()):
        robot = read_robot(folder / "robot.yaml")
        train, held_out = (
            [read_recording(path) for path in sorted(folder.glob(f"{kind}-*.csv"))] for kind in ("train", "held-out")
        )
        begin = time.process_time()
        if not train:
            continue
        try:
            diagnosis = diagnose(robot, train, held_out)
        except TauscopeError as error:
            rows.append(f"| {folder.name} | none: {error} | | | | |\n")
            continue
        found = document(diagnosis)
        print(f"{folder.name}: {found.verdict}, {time.process_time() - begin:.0f} s", flush=True)
        findings = []
        for each in found.findings:
            text = f"`{each.effect}` ({each.joint or 'arm'}, {each.probability:.2f}"
            text += f"; {', '.join(f'`{other}`' for other in each.equivalent)})" if each.equivalent else ")"
            findings.append(text)
        change, in_band = "", ("", "")
        if found.fit.held_out is not None:
            torques = [r.joint_torque(s.effort, robot) for r in held_out for s in [r.samples()]]
            size = _rms([value for torque in torques for value in torque.ravel()])
            before, after = (_rms(rms) for rms in (found.fit.held_out.rms_before, found.fit.held_out.rms_after))
            change = f"{100.0 * before / size:.2f} → {100.0 * after / size:.2f} %"
            in_band = _in_band(diagnosis)
        cells = (folder.name, found.verdict, "; ".join(findings) or "none", change, *in_band)
        rows.append(f"| {' | '.join(cells)} |\n")
    PAGE.write_text(HEAD + "".join(rows), encoding="utf-8")


def _in_band(diagnosis: "Diagnosis") -> tuple[str, str]:
    """Change of the held-out residual in the common band: of all joints together, and of the one that gains most."""
    (before, torque), (after, _) = (
        _left(diagnosis, each.model) for each in (diagnosis.selection.nominal, diagnosis.selection.fit)
    )
    whole = 100.0 * np.sqrt([before.sum() / torque.sum(), after.sum() / torque.sum()])
    joint = int(np.argmin(after / before))
    most = 100.0 * np.sqrt([before[joint] / torque[joint], after[joint] / torque[joint]])
    change = f"{most[0]:.1f} → {most[1]:.1f} %" if after[joint] < before[joint] else ""
    name = diagnosis.robot.joints[joint].name
    return f"{whole[0]:.2f} → {whole[1]:.2f} % ({diagnosis.cutoff_hz:.0f} Hz)", f"{name} {change}" if change else ""


def _left(diagnosis: "Diagnosis", model: "ExtendedModel") -> "tuple[Array, Array]":
    """Sums of squares of every joint's residual and torque on held-out motion in the common band, (n,) each."""
    from service.diagnosis.model.residual import residual_rows

    assert diagnosis.held_out is not None
    observations = diagnosis.held_out.observations
    left, whole = np.zeros(observations.robot.joint_count), np.zeros(observations.robot.joint_count)
    for joint, rows in enumerate(residual_rows(model, observations)):
        for row, torque, piece in zip(rows, observations.torque(joint), observations, strict=True):
            used = piece.used[joint].ravel()
            left[joint] += float(np.sum(row[0, used] ** 2))
            whole[joint] += float(np.sum(torque[0, used] ** 2))
    return left, whole


def _rms(values: list[float]) -> float:
    known = [value for value in values if value == value]  # NaN marks what was missed
    return (sum(value**2 for value in known) / max(len(known), 1)) ** 0.5


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    main()
