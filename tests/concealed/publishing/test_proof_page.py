"""Figures, pictures and page of the proof, from outcomes that are made up and whose figures are therefore known."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from concealed.generator.case import drawn
from concealed.publishing import page as page_module
from concealed.publishing.overview import count_concealed
from concealed.publishing.page import write_page
from concealed.scoring.breakdown import confusion
from concealed.scoring.calibration import calibration_error, calibration_interval
from concealed.scoring.figures import Standing, headline, share

RIGHT: dict[str, Any] = {
    "strength": 15.0,
    "verdict": "explained",
    "detected": True,
    "claimed": True,
    "located": True,
    "placed": True,
    "named": True,
    "first": True,
    "size": 1.0,
    "extra": [],
    "probabilities": [(0.98, True)],
    "parameters": [{"name": "a", "truth": 1.0, "value": 1.1, "std": 0.1}],
    "held_out": 1.0,
    "seconds": 3.0,
    "told": ["cogging@joint1 0.98 {}"],
}
QUIET = {
    **RIGHT,
    "verdict": "consistent",
    "detected": False,
    "claimed": False,
    "probabilities": [],
    "parameters": [],
    "told": [],
    "size": float("nan"),
}
WRONG = {
    **RIGHT,
    "named": False,
    "first": False,
    "placed": False,
    "extra": ["backlash@joint2"],
    "probabilities": [(0.98, False)],
    "parameters": [],
    "told": ["backlash@joint2 0.98 {}"],
}


def trial(series: str, seed: int, score: dict[str, Any]) -> dict[str, Any]:
    case = drawn(series, seed)
    return {
        "series": series,
        "seed": seed,
        "arm": None,
        "name": case.name,
        "case": case.as_dict(),
        "commit": "0123456789",
        "began": "2026-11-22T08:00:00Z",
        "seconds": 3.0,
        "score": score,
        "truth": {"hidden": [{"labels": [f"{what}@joint{joint + 1}"]} for what, joint in case.places]},
        "diagnosis": {
            "joints": ["joint1", "joint2", "joint3"],
            "findings": [],
            "cutoff_hz": 10.0,
            "fit": {"held_out": {"rms_before": [1.0, 1.0, 1.0], "rms_after": [0.5, 1.0, 1.2]}},
        },
    }


@pytest.fixture(scope="module")
def outcomes() -> list[dict[str, Any]]:
    told = [trial("sound", seed, QUIET) for seed in range(98)] + [trial("sound", seed, WRONG) for seed in (98, 99)]
    told += [trial("moderate", seed, RIGHT) for seed in range(19)] + [trial("moderate", 19, WRONG)]
    told += [trial("form", seed, {**WRONG, "verdict": "partly_explained"} if seed < 5 else RIGHT) for seed in range(10)]
    told.append({**trial("weak", 0, {}), "error": "RuntimeError('exit 1')"})
    del told[-1]["score"], told[-1]["seconds"]
    return told


def test_figures_count_what_they_say(outcomes: list[dict[str, Any]]) -> None:
    found = {each.id: each for each in headline(outcomes)}
    assert (found["sound"].hits, found["sound"].count, found["sound"].value) == (2, 100, pytest.approx(0.02))
    assert found["sound"].standing is Standing.SHORT
    assert (found["named"].hits, found["named"].count) == (19, 20)
    assert found["named"].standing is Standing.MET
    assert (found["form"].hits, found["form-partly"].hits, found["form-partly"].count) == (5, 5, 5)
    assert (found["form-wrong"].hits, found["form-wrong"].standing) == (5, Standing.MISSED)
    assert (found["weak"].hits, found["weak"].count) == (0, 1)
    assert (found["failed"].hits, found["failed"].count) == (1, 131)
    assert found["coverage"].value == 1.0
    # 24 right and 8 wrong findings, all at p = 0.98
    assert found["calibration"].value == pytest.approx(0.98 - 24 / 32)


def row_of(table: str, name: str) -> list[str]:
    (line,) = [line for line in table.splitlines() if line.startswith(f"| {name}")]
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_the_page_begins_with_the_four_rows(outcomes: list[dict[str, Any]], tmp_path: Path) -> None:
    text = write_page(outcomes, tmp_path / "proof.md", "x")[0].read_text()
    table = text.split("# The proof\n\n")[1].split("\n\n")[0]
    good = row_of(table, "simulated arms, good")
    # 98 quiet sound arms, 19 effects and 5 forms are right; one effect, 5 forms and the failed trial are missed
    assert good[1:5] == ["131", "93% (87% to 97%)", "6% (3% to 12%)", "5% (2% to 11%)"]
    assert good[5] == "130 of 390"
    assert good[7] == "3.0 s"
    assert row_of(table, "simulated arms, poor")[1:3] == ["0", "not tried"]
    assert row_of(table, "real arms, an effect concealed")[1:3] == ["0", "not tried"]


def test_what_a_set_says_untouched_too_is_neither_right_nor_wrong() -> None:
    def real(series: str, findings: list[tuple[str, float]], **more: Any) -> dict[str, Any]:
        told = [
            {
                "effect": name.split("@")[0],
                "joint": name.split("@")[1],
                "equivalent": [],
                "probability": p,
                "confirmed": None,
                "parameters": [],
            }
            for name, p in findings
        ]
        diagnosis = {**trial("sound", 1, QUIET)["diagnosis"], "findings": told}
        hidden = [{"kind": "spring", "multiple": 1.5, "total": {"k": 1.0}, "constants": {}}]
        case = {"arm": "emps", "places": [], "held_out_s": 20.0, "effects": hidden, "held_out_rms": [0.5, 0.0, 0.0]}
        made_up = {"series": series, "arm": "emps", "case": case, "diagnosis": diagnosis}
        return {**trial("sound", 1, QUIET), **made_up, **more}

    before = real("real-untouched", [("time_delay@j", 0.99)])
    spring = {"hidden": [{"labels": ["joint_spring@j"]}]}
    right = real("real-concealed", [("time_delay@j", 0.99), ("joint_spring@j", 0.95)], truth=spring)
    wrong = real("real-concealed", [("time_delay@j", 0.99), ("cogging@j", 0.95)], truth=spring)
    late = real("real-concealed", [("time_delay@j", 0.99)], truth={"hidden": [{"labels": ["time_delay@j"]}]})
    failed = {"series": "real-concealed", "seed": 4, "arm": None, "error": "TimeoutExpired"}
    told = count_concealed([before, right, wrong, late, failed])
    assert [(each.right, each.confident, each.missed) for each in told] == [
        (True, False, False),
        (False, True, True),
        (False, False, True),
        (False, False, True),
    ]
    assert told[0].claims == [(0.95, True)]


def test_the_interval_of_a_share_is_the_binomial_one() -> None:
    none = share("x", "x", [False] * 300, 0.01, at_least=False)
    assert none.high == pytest.approx(1.0 - 0.025 ** (1 / 300))  # closed form where nothing was seen
    assert none.standing is Standing.MET
    assert share("x", "x", [False] * 400, 0.01, at_least=False).standing is Standing.SHOWN
    assert share("x", "x", [], 0.01).standing is None


def test_promises_of_good_and_of_poor_recordings_are_counted_apart() -> None:
    told = [trial("weak", 1, {**RIGHT, "promised": [True]}), trial("weak", 2, {**QUIET, "promised": [False]})]
    told += [trial("poor", 3, {**QUIET, "promised": [False]}), trial("poor", 4, RIGHT)]
    found = {each.id: (each.hits, each.count) for each in headline(told)}
    assert (found["promised"], found["promised-poor"]) == ((1, 2), (0, 1))


def test_a_failed_trial_excuses_nothing() -> None:
    failed = [{"series": series, "seed": 0, "arm": None, "error": "x"} for series in ("sound", "moderate", "form")]
    found = {each.id: each for each in headline(failed)}
    assert (found["sound"].hits, found["named"].hits, found["form-partly"].hits) == (1, 0, 0)
    assert (found["form-partly"].count, found["oracle"].count, found["oracle"].hits) == (1, 1, 0)


def test_findings_that_mean_what_they_say_are_calibrated() -> None:
    rng = np.random.default_rng(3)
    probability = rng.uniform(0.0, 1.0, 40_000)
    honest = [(float(p), bool(rng.random() < p)) for p in probability]
    assert calibration_error(honest) < 0.02
    boastful = [(float(0.5 + p / 2.0), right) for (p, right) in honest]
    assert calibration_error(boastful) == pytest.approx(0.25, abs=0.02)
    low, high = calibration_interval([[claim] for claim in honest[:400]])
    assert 0.0 < low < high < 0.25
    # Twenty that are right say no more than that fewer than one in six is wrong.
    assert calibration_interval([[(1.0, True)]] * 20)[1] == pytest.approx(1.0 - 0.025 ** (1 / 20))


def test_what_was_mistaken_stands_off_the_diagonal(outcomes: list[dict[str, Any]]) -> None:
    truths, answers, table = confusion(outcomes)
    assert table[truths.index("nothing"), answers.index("nothing")] == 98
    assert table[truths.index("nothing"), answers.index("backlash")] == 2
    assert table.sum() == 130


@pytest.mark.slow
def test_the_page_has_every_figure_every_failure_and_a_reason(
    outcomes: list[dict[str, Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    reasons = tmp_path / "reasons.yaml"
    reasons.write_text("form-wrong: The curve is another one.\nnamed: never shown, for it is met\n")
    monkeypatch.setattr(page_module, "REASONS", reasons)
    written = write_page(outcomes, tmp_path / "docs" / "proof.md", "tauscope prove")
    text = written[0].read_text()
    for each in headline(outcomes):
        assert (f"| {each.words} |" in text) == bool(each.count)
    assert "The curve is another one." in text
    assert "never shown" not in text
    assert "nobody has looked into it yet" in text  # of the false alarms
    below = text.split("## Below target")[1].split("## ")[0]
    assert "sound arms: an effect is named" in below
    for seed in (98, 99):
        assert f"| sound-{drawn('sound', seed).arm}-{seed} | nothing |" in text
    assert "weak 0 | | | error | RuntimeError" in text
    assert len(written) > 5
    for picture in written[1:]:
        assert f"]({picture.relative_to(tmp_path / 'docs')})" in text
        ET.parse(picture)


def test_a_set_that_is_not_done_says_so(outcomes: list[dict[str, Any]], tmp_path: Path) -> None:
    text = write_page(outcomes[-3:], tmp_path / "proof.md", "tauscope prove", 400)[0].read_text()
    assert "the outcomes of 3 trials, **the first of a set of 400**" in text


@pytest.mark.slow
def test_the_same_outcomes_give_the_same_bytes(outcomes: list[dict[str, Any]], tmp_path: Path) -> None:
    first, second = (write_page(outcomes[-3:], tmp_path / name / "proof.md", "x") for name in ("a", "b"))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]
