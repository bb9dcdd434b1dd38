"""Verdicts on the shared recordings: `python tests/diagnosis/write_verdicts.py` makes docs/reference/verdicts.md anew.

The recordings are those of `TAUSCOPE_DATA`; training and held-out files, and the robot file, by their names.
"""

import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "verdicts.md"

HEAD = """# Verdicts on recordings of real machines

Written by `tests/diagnosis/write_verdicts.py` from the shared recordings (not in this repository), everything at its
default: train on `train-*.csv`, confirm on `held-out-*.csv`. Residuals: rms at the recorded rate, unfiltered, relative
to the rms of the torque, all joints together.

| recordings | verdict | findings (joint, probability; not told apart from) | held out before → after |
|---|---|---|---|
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
            found = document(diagnose(robot, train, held_out))
        except TauscopeError as error:
            rows.append(f"| {folder.name} | none: {error} | | |\n")
            continue
        print(f"{folder.name}: {found.verdict}, {time.process_time() - begin:.0f} s", flush=True)
        findings = []
        for each in found.findings:
            text = f"`{each.effect}` ({each.joint or 'arm'}, {each.probability:.2f}"
            text += f"; {', '.join(f'`{other}`' for other in each.equivalent)})" if each.equivalent else ")"
            findings.append(text)
        change = ""
        if found.fit.held_out is not None:
            torques = [r.joint_torque(s.effort, robot) for r in held_out for s in [r.samples()]]
            size = _rms([value for torque in torques for value in torque.ravel()])
            before, after = (_rms(rms) for rms in (found.fit.held_out.rms_before, found.fit.held_out.rms_after))
            change = f"{100.0 * before / size:.2f} → {100.0 * after / size:.2f} %"
        rows.append(f"| {folder.name} | {found.verdict} | {'; '.join(findings) or 'none'} | {change} |\n")
    PAGE.write_text(HEAD + "".join(rows), encoding="utf-8")


def _rms(values: list[float]) -> float:
    known = [value for value in values if value == value]  # NaN marks what was missed
    return (sum(value**2 for value in known) / max(len(known), 1)) ** 0.5


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    main()
