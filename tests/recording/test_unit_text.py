"""Units that names of columns and rows of units state: known ones are converted, others are told."""

from pathlib import Path

import numpy as np
import pytest

from recording.recording_files import message_of, rows_of
from tauscope.recording import Reading, read_recording
from tauscope.recording.unit_text import collect_units, find_unit, stated_unit
from tauscope.recording.units import CURRENTS, METRES, RADIANS, SECONDS, TORQUES
from tauscope.robot.recording_layout import UNITS

RNG = np.random.default_rng(5)
ROWS = np.column_stack([np.arange(40) * 0.004, RNG.normal(size=(40, 4))])


def header(time: str = "", angle: str = "", torque: str = "") -> list[str]:
    return [f"Time{time}", f"Position J1{angle}", f"Position J2{angle}", f"Torque J1{torque}", f"Torque J2{torque}"]


def read(folder: Path, names: list[str], rows: np.ndarray, *above: str, **stated: str) -> np.ndarray:
    """Rows of a file with such names, by a mapping written by hand."""
    lines = [",".join(names), *above, *(",".join(map(repr, row)) for row in rows.tolist())]
    (folder / "file.csv").write_text("\n".join(lines))
    columns = {"t": names[0], "q": names[1:3], "tau": names[3:]}
    reading = Reading(columns=columns, units=stated, trust_units=True).for_robot(None)
    return rows_of(read_recording(folder / "file.csv", reading=reading))


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        *[("lbf.ft", 1.3558179483), ("in-lb", 0.1129848290), ("oz-in", 0.00706155181), ("N.mm", 1e-3), ("N·m", 1.0)],
        *[("kNm", 1e3), ("Ncm", 1e-2), ("mNm", 1e-3), ("Nm", 1.0), ("A", 1.0), ("mA", 1e-3), ("‰", 1.0), ("%", 1.0)],
    ],
)
@pytest.mark.parametrize("brackets", [" [{}]", " ({})"])
def test_torque_is_in_the_unit_of_its_name(tmp_path: Path, unit: str, factor: float, brackets: str) -> None:
    rows = read(tmp_path, header(torque=brackets.format(unit)), ROWS)
    np.testing.assert_allclose(rows[:, 3:], factor * ROWS[:, 3:], rtol=1e-9)
    np.testing.assert_array_equal(rows[:, 1:3], ROWS[:, 1:3])


@pytest.mark.parametrize(
    ("unit", "factor"), [("rev", 2 * np.pi), ("turns", 2 * np.pi), ("°", np.pi / 180), ("mrad", 1e-3), ("rad", 1.0)]
)
def test_angles_are_in_the_unit_of_their_name_or_of_a_row_of_units(tmp_path: Path, unit: str, factor: float) -> None:
    expected = ROWS * [1.0, factor, factor, 1.0, 1.0]
    np.testing.assert_allclose(read(tmp_path, header(angle=f" [{unit}]"), ROWS), expected, rtol=1e-12)
    np.testing.assert_allclose(read(tmp_path, header(), ROWS, f"s,{unit},{unit},Nm,Nm"), expected, rtol=1e-12)


def test_time_is_in_the_unit_of_its_name(tmp_path: Path) -> None:
    for name, unit_s in ((" [min]", 60.0), ("_ms", 1e-3), (" (µs)", 1e-6)):
        scaled = ROWS / [unit_s, 1.0, 1.0, 1.0, 1.0]
        np.testing.assert_allclose(read(tmp_path, header(time=name), scaled), ROWS, rtol=1e-9, atol=1e-12)


def test_an_unknown_unit_is_told_and_a_stated_one_goes_before_it(tmp_path: Path) -> None:
    names = header(angle=" [inc]")
    message = message_of(lambda: read(tmp_path, names, ROWS))
    assert "column Position J1 [inc]: inc is no unit that is known; state it by --units q=UNIT, of rad, mrad" in message
    np.testing.assert_allclose(read(tmp_path, names, ROWS, q="deg")[:, 1:3], np.deg2rad(ROWS[:, 1:3]))


def test_torques_in_two_units_are_refused(tmp_path: Path) -> None:
    names = [*header()[:3], "Torque J1 (Nm)", "Torque J2 (mA)"]
    assert "Nm and mA is no unit that is known" in message_of(lambda: read(tmp_path, names, ROWS))


@pytest.mark.parametrize("name", ["effort[0]", "q_m", "torque_a", "pos_rev_b", "tau_min"])
def test_words_that_may_mean_anything_are_no_units(name: str) -> None:
    assert stated_unit("q", name) is stated_unit("tau", name) is None


def test_texts_that_differ_from_joint_to_joint_name_these() -> None:
    assert collect_units({"tau1": "elbow", "tau2": "wrist", "q1": "deg", "q2": "mm"}) == {"q1": "deg", "q2": "mm"}


def test_every_unit_that_may_be_stated_has_a_factor_and_is_read_as_written() -> None:
    known = {"t": {*SECONDS, "index"}, "q": {*RADIANS, *METRES} - {"rpm"}, "tau": {*TORQUES, *CURRENTS}}
    for group, units in known.items():
        assert set(UNITS[group]) == units
        for unit in units - {"index", "drive"}:
            assert find_unit(group, unit) == unit
    assert find_unit("qd", "rpm") == "rpm"
    assert find_unit("qd", "deg/s") == find_unit("qd", "dps") == "deg"
