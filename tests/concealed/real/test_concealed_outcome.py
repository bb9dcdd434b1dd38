"""Trials on the open recordings: drawn alike, as many as asked for, and sealed before anything is diagnosed."""

import csv
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from concealed.real import concealed_outcome as module
from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED, concealed_outcome, truth_of_case
from concealed.real.concealed_sets import FULL, concealed_tasks
from concealed.real.concealing.draw import MULTIPLES, OWN_SHARE, draw_case
from concealed.real.concealing.kinds import KINDS
from concealed.real.concealing.recorded_sets import CYCLE, SETS, set_of_seed
from concealed.real.judging.solvable import solve_case
from concealed.scoring.test_score import diagnosis
from tauscope.diagnosis import diagnose, document
from tauscope.diagnosis.documents.document import DiagnosisDocument
from tauscope.effects import catalogue
from tauscope.recording import read_recording
from tauscope.robot import read_robot

absent = [each.name for each in SETS.values() if not each.is_there]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(absent), reason=f"no recordings of {absent}; TAUSCOPE_DATA and TAUSCOPE_CASES"),
]

QUICK = (7, 23)
"""Seeds of the set that is read fastest: 30 Hz."""


def test_consecutive_seeds_have_every_set_as_often_as_its_share() -> None:
    for first in (0, 1_000_000):
        counts = Counter(set_of_seed(first + number) for number in range(len(CYCLE)))
        assert counts == {name: each.shares for name, each in SETS.items()}


@pytest.mark.parametrize("seed", QUICK)
def test_a_seed_draws_the_same_trial_again(seed: int) -> None:
    first = truth_of_case(draw_case(seed))
    draw_case.cache_clear()
    assert truth_of_case(draw_case(seed)) == first


def test_trials_differ_and_hold_what_the_rules_allow() -> None:
    cases = [draw_case(seed, name) for name in ("emps", "panda-bag30") for seed in range(3)]
    assert len({str(truth_of_case(case).case) for case in cases}) == len(cases)
    effects = {each.id for each in catalogue()}
    for case in cases:
        for each in case.effects:
            assert {label.partition("@")[0] for label in each.concealment.labels} <= effects
            if each.multiple is not None:
                assert each.multiple in MULTIPLES
                assert each.reached == pytest.approx(each.multiple, rel=0.15)
                assert OWN_SHARE[0] <= each.total / each.size - 1.0 <= OWN_SHARE[1]


def test_the_full_set_is_three_hundred_trials_beside_nine_untouched_sets() -> None:
    tasks = concealed_tasks(FULL, 1_000_000, "")
    assert FULL >= 300
    assert [task.series for task in tasks] == [UNTOUCHED] * len(SETS) + [CONCEALED] * FULL
    assert len({task.key for task in tasks}) == len(tasks)
    few = concealed_tasks(3, 0, "", set_name="emps")
    assert [(task.series, task.seed, task.arm) for task in few] == [
        (UNTOUCHED, 0, "emps"),
        *((CONCEALED, seed, "emps") for seed in range(3)),
    ]


def test_every_kind_has_its_turn() -> None:
    assert len(KINDS) == 22
    assert {name.partition("_")[0] for name in KINDS} >= {"spring", "cable", "cogging", "gravity", "contact", "link"}


def test_the_files_hold_what_was_added_and_nothing_else(tmp_path: Path) -> None:
    cases = (draw_case(seed, "emps") for seed in range(20))
    case = next(each for each in cases if len(each.effects) == 1 and each.effects[0].concealment.torque is not None)
    (effect,) = case.effects
    case.write(tmp_path)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["held-out-1.csv", "robot.yaml", "train-1.csv"]
    with (tmp_path / "train-1.csv").open() as file:
        rows = np.array([[float(each) for each in row] for row in list(csv.reader(file))[1:]])
    passage = case.ground.passages[0]
    told = passage.recording.samples()
    np.testing.assert_allclose(rows[:, :2], np.column_stack([told.time, told.position]), rtol=1e-9)
    expected = passage.torque[:, 0] + effect.concealment.added(case.ground, effect.size)[0][:, 0]
    np.testing.assert_allclose(rows[:, 2] * passage.gain[0], expected, rtol=1e-6, atol=1e-9)


def test_the_truth_is_sealed_before_the_diagnosis_and_is_not_among_what_it_sees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = tmp_path / "seen"

    def look(folder: Path) -> tuple[DiagnosisDocument, float]:
        assert list(folder.parent.iterdir()) == [folder]
        shutil.copytree(folder, seen)
        return diagnosis(verdict="consistent"), 1.0

    monkeypatch.setattr(module, "diagnosis_apart", look)
    told = concealed_outcome(0, "double-pendulum")
    assert len(told["seal"]) == 64
    assert not told["score"]["claimed"]
    for path in seen.iterdir():
        text = path.read_text(encoding="utf-8")
        for word in (told["case"]["effects"][0]["kind"], "concealed", "vault", told["seal"]):
            assert word not in text or word in (SETS["double-pendulum"].folder / path.name).read_text(encoding="utf-8")


@pytest.mark.parametrize(("name", "seed"), [("emps", 2), ("panda-bag30", 3)])
def test_the_oracle_solves_the_trial_from_its_files(name: str, seed: int, tmp_path: Path) -> None:
    case = draw_case(seed, name)
    case.write(tmp_path)
    for each in solve_case(case, tmp_path) or []:
        assert each.is_right


def test_a_push_on_one_servo_is_a_force_whose_part_along_the_axis_nobody_knows(tmp_path: Path) -> None:
    case = draw_case(40_000_101)
    case.write(tmp_path)
    train, held_out = (
        [read_recording(path) for path in sorted(tmp_path.glob(f"{kind}-*.csv"))] for kind in ("train", "held-out")
    )
    told = document(diagnose(read_robot(tmp_path / "robot.yaml"), train, held_out))
    push, own = told.findings
    assert (push.effect, push.joint, own.effect) == ("external_contact", None, "load_dependent_friction")
    assert all(each.visible for each in told.detectable if each.effect == push.effect)
    assert "F_z" not in push.statement
    found = {each.name: each.value for each in push.parameters}
    assert "F_z" not in found
    (hidden,) = case.effects
    constants = hidden.concealment.constants
    pushed = hidden.total * (constants["F_x"] + 1j * constants["F_y"])
    ratio = (found["F_x"] + 1j * found["F_y"]) / pushed
    assert 0.67 < abs(ratio) < 1.5
    assert abs(np.angle(ratio, deg=True)) < 10.0
