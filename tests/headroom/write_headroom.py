"""What a black box still predicts on real recordings: makes docs/reference/headroom.md anew.

`python tests/headroom/write_headroom.py` takes every folder with `train-*.csv` and `held-out-*.csv` of `TAUSCOPE_DATA`,
and of the `arms` of `TAUSCOPE_CASES`.
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "reference" / "headroom.md"

TITLE = """| recordings | verdict | joint | plain | explained | black box | floor | still predicted | refuted |
|---|---|---|---|---|---|---|---|---|
"""


def main() -> None:
    """Diagnose every folder, train black boxes, and write the page."""
    from shared_data import SHARED_CASES, SHARED_DATA

    places = [each for root in (SHARED_DATA, SHARED_CASES / "arms") for each in sorted(root.iterdir())]
    rows = [row for folder in places if any(folder.glob("train-*.csv")) for row in _rows(folder)]
    head, _, _ = PAGE.read_text(encoding="utf-8").partition(TITLE[:15])
    PAGE.write_text(head + TITLE + "".join(rows), encoding="utf-8")


def _rows(folder: Path) -> Iterator[str]:
    """One row a joint."""
    from tauscope.diagnosis import diagnose
    from tauscope.errors import TauscopeError
    from tauscope.headroom import measure_headroom
    from tauscope.headroom.entries import motion_rows
    from tauscope.recording import open_recording
    from tauscope.robot import read_robot

    robot = read_robot(folder / "robot.yaml")
    train, held_out = (
        [open_recording(path, robot) for path in sorted(folder.glob(f"{kind}-*.csv"))] for kind in ("train", "held-out")
    )
    begin = time.perf_counter()
    try:
        diagnosis = diagnose(robot, train, held_out)
    except TauscopeError as error:
        yield f"| {folder.name} | none: {error} | | | | | | | |\n"
        return
    between = time.perf_counter()
    entries = measure_headroom(diagnosis)
    after = time.perf_counter()
    print(f"{folder.name}: {diagnosis.verdict}, {between - begin:.0f} s, black box {after - between:.0f} s", flush=True)
    _, held_out_rows = motion_rows(diagnosis)
    for place, each in enumerate(entries):
        torque = np.concatenate([rows.torque[place][rows.used[place]] for rows in held_out_rows])
        size = float(np.sqrt(np.mean(torque**2)))
        cells = [_rms(value, size) for value in (each.plain, each.explained, each.black_box)]
        floor = "–" if each.floor is None else f"{each.floor:.2g} ({each.floor_kind.replace('_', ' ')})"
        share = "–" if each.share is None else f"{100.0 * each.share:.0f} ± {100.0 * float(each.share_std or 0):.0f} %"
        named = (folder.name, diagnosis.verdict.value) if place == 0 else ("", "")
        row = f"| {' | '.join((*named, each.joint, *cells, floor, share, 'yes' if each.refuted else 'no'))} |\n"
        print(row, end="", flush=True)
        yield row


def _rms(value: float | None, torque: float) -> str:
    """A residual, and its share of the torque."""
    return "–" if value is None else f"{value:.3g} ({100.0 * value / torque:.1f} %)"


if __name__ == "__main__":
    sys.path[:0] = [str(TESTS)]
    main()
