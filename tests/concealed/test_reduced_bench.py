"""A few trials of each kind, on the arm's motion under its own drives: fixed seeds of the development range.

What is not a whole proof here is the quick proof: one to three trials of each kind.
"""

from typing import Any

import numpy as np
import pytest

from concealed.generator.trial import effect_trial, null_trial, several_trial, unknown_trial
from concealed.scoring.score import Score, diagnosed, scored

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

AT_40 = {
    "asymmetric_viscous": 1,
    "nonlinear_viscous": 1,
    "load_dependent_friction": 1,
    "position_dependent_friction": 2,
    "presliding_hysteresis": 0,
    "friction_drift": 1,
    "friction_coupling": 1,
    "cogging": 0,
    "torque_ripple": 1,
    "rotor_inertia": 2,
    "torque_gain_error": 2,
    "torque_saturation": 0,
    "time_delay": 1,
    "joint_spring": 2,
    "cable_force": 0,
    "base_tilt": 0,
}


def outcome(effect: str, joint: int, wanted: float, seed: int) -> Score:
    trial = effect_trial("paper", effect, joint, wanted, motion_seed=seed % 2, seed=seed)
    return scored(trial, *diagnosed(trial))


@pytest.mark.proof
def test_nothing_is_named_where_nothing_is_concealed() -> None:
    trials = [null_trial("paper", motion, 100 * motion + seed) for motion in (0, 1) for seed in range(4)]
    trials += [null_trial("paper", 0, 50 + seed, states_periods=False) for seed in range(2)]
    verdicts = [diagnosed(trial)[0] for trial in trials]
    assert [found.findings for found in verdicts] == [[]] * len(trials)
    assert sum(found.verdict == "consistent" for found in verdicts) >= len(trials) - 1


POOR = [
    pytest.param({"position_std": 2e-4}, marks=pytest.mark.proof),
    pytest.param({"encoder_step": 5e-4}, marks=pytest.mark.proof),
    pytest.param({"encoder_step": 1e-3}, marks=pytest.mark.proof),
    {"encoder_step": 2.0 * np.pi / 4096},
]


@pytest.mark.parametrize("noise", POOR)
def test_poor_encoders_make_nothing_of_nothing(noise: dict[str, Any]) -> None:
    """Friction's step blurred or rounded at every reversal is no delay and no bristle."""
    verdicts = [diagnosed(null_trial("paper", motion, 10 + motion, **noise))[0] for motion in (0, 1, 2)]
    assert [found.findings for found in verdicts] == [[]] * 3


PAIRS = [(("joint_spring", 2), ("cogging", 2), 1), (("cogging", 1), ("torque_saturation", 0), 10)]


@pytest.mark.proof
@pytest.mark.parametrize(("first", "second", "draw"), PAIRS)
def test_two_effects_at_once_are_both_named(first: tuple[str, int], second: tuple[str, int], draw: int) -> None:
    trial = several_trial("paper", [first, second], 40.0, motion_seed=draw % 4, seed=4000 + draw)
    score = scored(trial, *diagnosed(trial))
    assert score.named, score.told
    assert score.first, score.told
    assert not score.extra


def test_motion_that_predicts_nothing_is_not_called_consistent() -> None:
    trial = effect_trial("paper", "stribeck_friction", 1, 40.0, motion_seed=0, seed=4, motion="slow")
    found, _ = diagnosed(trial)
    assert found.verdict != "consistent"


QUICK = {"cogging", "time_delay"}


@pytest.mark.parametrize(
    "effect", [each if each in QUICK else pytest.param(each, marks=pytest.mark.proof) for each in AT_40]
)
def test_a_strong_effect_is_named_at_its_joint(effect: str) -> None:
    score = outcome(effect, AT_40[effect], 40.0, list(AT_40).index(effect))
    assert score.named, score.told
    assert score.placed, score.told
    assert score.size <= 2.0
    assert score.verdict in {"explained", "partly_explained"}


@pytest.mark.proof
def test_most_effects_of_moderate_strength_are_named() -> None:
    scores = [outcome(effect, AT_40[effect], 15.0, 30 + place) for place, effect in enumerate(list(AT_40)[::2])]
    assert sum(score.named for score in scores) >= len(scores) - 1
    assert sum(bool(score.extra) for score in scores) <= 1


@pytest.mark.proof
def test_nine_of_ten_weak_effects_are_detected() -> None:
    scores = [outcome(effect, joint, 8.0, 900 + place) for place, (effect, joint) in enumerate(AT_40.items())]
    missed = [
        (effect, score.told) for effect, score in zip(AT_40, scores, strict=True) if score.verdict == "consistent"
    ]
    assert len(missed) <= 0.1 * len(scores), missed


@pytest.mark.parametrize(
    ("law", "joint"),
    [
        pytest.param("vibration", 1, marks=pytest.mark.proof),
        pytest.param("slipstream", 0, marks=pytest.mark.proof),
        ("bump", 2),
    ],
)
def test_what_no_catalogue_has_is_located_and_not_explained_away(law: str, joint: int) -> None:
    found, _ = diagnosed(unknown_trial("paper", law, joint, 40.0, motion_seed=joint % 2, seed=60 + joint))
    assert found.verdict in {"unexplained", "partly_explained"}
    assert found.mismatch[joint].significant
