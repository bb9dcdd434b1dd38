"""Trials on real recordings judged beside the untouched set: made-up diagnoses."""

from typing import Any

import pytest

from concealed.real.concealed_outcome import CONCEALED, UNTOUCHED
from concealed.real.judging.concealed_table import concealed_table
from concealed.real.judging.found_size import found_size
from concealed.real.judging.judge import judge
from concealed.running.kept import Outcome
from concealed.scoring.harm import worse_joints
from concealed.scoring.test_score import finding

COGGING = {
    "kind": "cogging",
    "joint": "joint1",
    "multiple": 1.5,
    "constants": {"resolution": 2.0},
    "total": {"amplitude": 2.0, "order": 12.0},
}
SPRING = {"kind": "spring", "joint": "joint2", "multiple": 0.7, "constants": {}, "total": {"k": -4.0}}
LABELS = {"cogging": "cogging@joint1", "spring": "joint_spring@joint2"}


def wave(order: float, amplitude: float = 2.0, suffix: str = "") -> list[dict[str, Any]]:
    values = {f"amplitude{suffix}": amplitude, f"order{suffix}": order}
    return [{"name": name, "value": value, "std": 0.1, "unit": ""} for name, value in values.items()]


def outcome(
    *findings: dict[str, Any],
    concealed: tuple[dict[str, Any], ...] = (),
    before: tuple[float, float] = (2.0, 1.0),
    after: tuple[float, float] = (2.0, 1.0),
    rms: tuple[float, float] = (0.0, 0.0),
) -> Outcome:
    return {
        "series": CONCEALED if concealed else UNTOUCHED,
        "seed": 0,
        "arm": None if concealed else "set",
        "case": {"arm": "set", "effects": list(concealed), "held_out_s": 10.0, "held_out_rms": list(rms)},
        "truth": {"hidden": [{"labels": [LABELS[one["kind"]]]} for one in concealed]},
        "seconds": 3.0,
        "diagnosis": {
            "joints": ["joint1", "joint2"],
            "cutoff_hz": 8.0,
            "findings": list(findings),
            "fit": {"held_out": {"rms_before": list(before), "rms_after": list(after)}},
        },
    }


def cogging(order: float = 12.1, **more: Any) -> dict[str, Any]:
    return finding("cogging", "joint1", parameters=wave(order), confirmed=True, **more)


def test_a_wave_is_named_by_its_order() -> None:
    (right,) = judge(outcome(cogging(), concealed=(COGGING,)), outcome()).effects
    assert (right.named, right.first, right.before, right.inside) == (True, True, False, True)
    wrong = judge(outcome(cogging(20.0), concealed=(COGGING,)), outcome())
    assert not wrong.effects[0].named
    assert wrong.confident == ["cogging@joint1"]


def test_the_second_wave_of_a_finding_counts() -> None:
    parameters = [*wave(30.0, 5.0), *wave(12.0, 2.1, "_2")]
    found = finding("cogging", "joint1", parameters=parameters, confirmed=True)
    assert found_size(found, COGGING) == (2.1, 0.1, 2.0)


def test_an_equivalent_names_it_but_is_not_first() -> None:
    said = finding("cable_force", "joint2", equivalent=["joint_spring@joint2"], confirmed=None)
    told = judge(outcome(said, concealed=(SPRING,)), outcome())
    assert (told.effects[0].named, told.effects[0].first, told.effects[0].inside) == (True, False, None)
    assert told.wrong == []


def test_what_held_out_motion_refutes_names_nothing() -> None:
    told = judge(outcome({**cogging(), "confirmed": False}, concealed=(COGGING,)), outcome())
    assert not told.effects[0].named
    assert told.wrong == []


@pytest.mark.parametrize(("value", "named"), [(-4.1, True), (-2.0, False)])
def test_what_was_there_before_has_to_have_the_new_size(value: float, named: bool) -> None:
    def spring(k: float) -> dict[str, Any]:
        stiffness = {"name": "k", "value": k, "std": 0.1, "unit": ""}
        return finding("joint_spring", "joint2", parameters=[stiffness], confirmed=True)

    (told,) = judge(outcome(spring(value), concealed=(SPRING,)), outcome(spring(-2.0))).effects
    assert told.before
    assert told.named is named


def test_wrong_names_are_those_that_the_untouched_set_has_not() -> None:
    said = [finding("backlash", "joint2"), finding("time_delay", None, 0.5), finding("rotor_inertia", "joint1")]
    there = outcome(finding("rotor_inertia", "joint1"))
    told = judge(outcome(cogging(), *said, concealed=(COGGING,)), there)
    assert told.wrong == [("backlash@joint2", 0.95), ("time_delay", 0.5)]
    assert told.claims == [(0.95, True), (0.95, False), (0.5, False)]
    assert told.confident == ["backlash@joint2"]


@pytest.mark.parametrize(("after", "removed"), [((2.0, 1.5), 0.0), ((2.0, 1.0), 1.25), ((2.0, 1.25), 0.6875)])
def test_energy_is_removed_as_far_as_the_residual_comes_back(after: tuple[float, float], removed: float) -> None:
    trial = outcome(concealed=(SPRING,), before=(2.0, 1.5), after=after, rms=(0.0, 1.1))
    told = judge(trial, outcome())
    assert told.concealed == pytest.approx(1.25)  # 1.5² - 1² by which the residual grew, more than the 1.1² known
    assert told.removed == pytest.approx(removed)
    assert told.share == pytest.approx(removed / 1.25)


def test_what_the_untouched_set_loses_to_its_own_findings_is_not_counted() -> None:
    there = outcome(before=(2.0, 1.0), after=(1.0, 1.0))
    trial = outcome(concealed=(SPRING,), before=(2.0, 1.5), after=(1.0, 1.5), rms=(0.0, 1.1))
    assert judge(trial, there).removed == pytest.approx(0.0)


def test_no_share_is_told_of_what_held_out_motion_does_not_show() -> None:
    assert judge(outcome(concealed=(SPRING,)), outcome()).share is None


def test_a_wrong_sign_conceals_what_the_residual_grew_by() -> None:
    sign = {**SPRING, "kind": "sign_joint", "total": {"g": -2.0}}
    trial = outcome(before=(4.0, 1.0), after=(2.0, 1.0))
    trial["series"], trial["case"]["effects"] = CONCEALED, [sign]
    trial["truth"]["hidden"] = [{"labels": ["torque_gain_error@joint1"]}]
    told = judge(trial, outcome())
    assert told.concealed == told.removed == pytest.approx(3.0)


def test_a_joint_is_worse_from_two_standard_errors_of_the_difference_on() -> None:
    # 2 · 8 Hz · 10 s = 160 residuals: the mean square may rise by a tenth.
    assert worse_joints(outcome(after=(2.09, 1.0))) == []
    assert worse_joints(outcome(after=(2.11, 1.0))) == ["joint1"]


def test_the_bound_of_harm_is_two_standard_errors() -> None:
    """The mean square of N residuals to which a wrong torque is added rises by δ² with a deviation of 2 r δ / √N."""
    import numpy as np

    rng, count = np.random.default_rng(1), 400
    wrong = np.sqrt(16.0 / count)
    rises = []
    for _ in range(4000):
        residual = rng.standard_normal(count)
        rises.append(np.mean((residual + wrong * rng.choice([-1.0, 1.0], count)) ** 2 - residual**2))
    assert np.mean(rises) / np.std(rises) == pytest.approx(2.0, rel=0.05)


def test_the_table_counts_effects_and_trials() -> None:
    done = [outcome(), outcome(cogging(), concealed=(COGGING, SPRING)), {"series": CONCEALED, "error": "no"}]
    rows = concealed_table(done).splitlines()
    assert rows[0] == "2 trials, 1 of them failed; in 1 untouched sets 0 joints are made worse"
    assert any(row.startswith("| 1.5 × | 1 | 1 | 1/1 (100%) |") for row in rows)
    assert any(row.startswith("| 0.7 × | 1 | 1 | 0/1 (0%) |") for row in rows)
    assert rows[-1].startswith("| all | 1 | 2 | 1/2 (50%) |")
    assert concealed_table([]) == ""
