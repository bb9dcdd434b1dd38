"""Verdicts on the shared recordings: `python tests/diagnosis/write_verdicts.py` makes docs/reference/verdicts.md anew.

The recordings are those of `TAUSCOPE_DATA`; training and held-out files, and the robot file, by their names.
"""

import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tauscope.diagnosis import Diagnosis, DiagnosisDocument
    from tauscope.recording import Recording

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

IN_THE_CURATORS_BANDS = """
## In the bands of the data's curators

They made two fits of their own: the plain model, and for three of the sets that model with the effect that they found
missing, in a band that they chose. The same in their bands (`tauscope diagnose … --cutoff HZ`): held-out relative error
of the plain model that `identify` delivers, and of the model with all findings.

| recordings | band | theirs, plain | theirs, with the effect | ours, plain | ours, with the findings | findings |
|---|---|---|---|---|---|---|
"""

CURATORS = {
    "emps": (100.0, "4.78 %", "3.93 %"),
    "double-pendulum": (8.0, "10.1 %", "9.4 %"),
    "staubli-tx40": (30.0, "21.1 %", "13.9 %"),
}
"""Cut-off [Hz] and held-out relative errors of the data's README."""


def main() -> None:
    """Diagnose every folder, and write the page."""
    data = Path(os.environ.get("TAUSCOPE_DATA", str(ROOT.parent / "shared" / "data")))
    folders = [each for each in sorted(data.iterdir()) if any(each.glob("train-*.csv"))]
    rows = [_row(folder) for folder in folders]
    in_their_bands = [_row_in_band(data / name, *figures) for name, figures in CURATORS.items()]
    PAGE.write_text(HEAD + "".join(rows) + IN_THE_CURATORS_BANDS + "".join(in_their_bands), encoding="utf-8")


def _row(folder: Path) -> str:
    """What is said of one folder, everything at its default."""
    from tauscope.diagnosis import document
    from tauscope.errors import TauscopeError

    try:
        diagnosis, held_out = _diagnosed(folder)
    except TauscopeError as error:
        return f"| {folder.name} | none: {error} | | | | |\n"
    found = document(diagnosis)
    change, in_band = "", ("", "")
    if found.fit.held_out is not None:
        torques = [r.joint_torque(s.effort, diagnosis.robot) for r in held_out for s in [r.samples()]]
        size = _rms([value for torque in torques for value in torque.ravel()])
        before, after = (_rms(rms) for rms in (found.fit.held_out.rms_before, found.fit.held_out.rms_after))
        change = f"{100.0 * before / size:.2f} → {100.0 * after / size:.2f} %"
        in_band = _in_band(diagnosis)
    return f"| {' | '.join((folder.name, found.verdict, _findings(found), change, *in_band))} |\n"


def _row_in_band(folder: Path, cutoff_hz: float, plain: str, with_effect: str) -> str:
    """What is said of one folder in a band given, beside what its curators reached there."""
    from diagnosis.held_out_residual import relative_error
    from tauscope.diagnosis import document

    diagnosis, held_out = _diagnosed(folder, cutoff_hz)
    identified = diagnosis.identification.held_out
    assert identified is not None
    ours = (identified.relative_error, relative_error(diagnosis, held_out, cutoff_hz))
    cells = (plain, with_effect, *(f"{100.0 * error:.2f} %" for error in ours), _findings(document(diagnosis)))
    return f"| {' | '.join((folder.name, f'{cutoff_hz:.0f} Hz', *cells))} |\n"


def _diagnosed(folder: Path, cutoff_hz: float | None = None) -> "tuple[Diagnosis, Sequence[Recording]]":
    """The diagnosis of a folder, in the band that it chooses where none is given, and the held-out recordings."""
    from tauscope.diagnosis import diagnose
    from tauscope.identification import Options
    from tauscope.recording import read_recording
    from tauscope.robot import read_robot

    train, held_out = (
        [read_recording(path) for path in sorted(folder.glob(f"{kind}-*.csv"))] for kind in ("train", "held-out")
    )
    begin = time.process_time()
    options = Options() if cutoff_hz is None else Options(cutoff_hz=cutoff_hz)
    diagnosis = diagnose(read_robot(folder / "robot.yaml"), train, held_out, options)
    print(f"{folder.name}: {diagnosis.verdict}, {time.process_time() - begin:.0f} s", flush=True)
    return diagnosis, held_out


def _findings(found: "DiagnosisDocument") -> str:
    """Effects with joint, probability, and what they are not told apart from."""
    told = []
    for each in found.findings:
        text = f"`{each.effect}` ({each.joint or 'arm'}, {each.probability:.2f}"
        told.append(text + (f"; {', '.join(f'`{other}`' for other in each.equivalent)})" if each.equivalent else ")"))
    return "; ".join(told) or "none"


def _in_band(diagnosis: "Diagnosis") -> tuple[str, str]:
    """Change of the held-out residual in the common band: of all joints together, and of the one that gains most."""
    from diagnosis.held_out_residual import squares

    assert diagnosis.held_out is not None
    observations = diagnosis.held_out.observations
    (before, torque), (after, _) = (
        squares(each.model, observations) for each in (diagnosis.selection.nominal, diagnosis.selection.fit)
    )
    whole = 100.0 * np.sqrt([before.sum() / torque.sum(), after.sum() / torque.sum()])
    joint = int(np.argmin(after / before))
    most = 100.0 * np.sqrt([before[joint] / torque[joint], after[joint] / torque[joint]])
    change = f"{most[0]:.1f} → {most[1]:.1f} %" if after[joint] < before[joint] else ""
    name = diagnosis.robot.joints[joint].name
    return f"{whole[0]:.2f} → {whole[1]:.2f} % ({diagnosis.cutoff_hz:.0f} Hz)", f"{name} {change}" if change else ""


def _rms(values: list[float]) -> float:
    known = [value for value in values if value == value]  # NaN marks what was missed
    return (sum(value**2 for value in known) / max(len(known), 1)) ** 0.5


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT / "tests")]
    main()
