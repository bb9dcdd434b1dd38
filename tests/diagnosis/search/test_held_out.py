"""What held-out motion says of a hypothesis, in closed form and of a torque that is left out."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis.nominal_arm import nominal_rows
from tauscope.diagnosis.evidence.scales import Scales
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.noise.floor import white_noise
from tauscope.diagnosis.search.held_out import SPILLED, WORSE, Change, HeldOut

RELATIVE = st.floats(-0.5, 0.5)
JOINT = 2


def change(relative: list[float], error: float = 0.01) -> Change:
    return Change(np.array(relative), np.full(len(relative), error), np.zeros(len(relative)))


@given(st.lists(RELATIVE, min_size=1, max_size=7), st.floats(1e-3, 0.1))
def test_log_odds_are_twice_the_square_of_every_joint_with_its_sign(relative: list[float], error: float) -> None:
    z = np.array(relative) / error
    assert change(relative, error).log_odds == pytest.approx(float(np.sum(-2.0 * np.sign(z) * z**2)))


def test_a_change_without_an_error_says_nothing() -> None:
    assert change([-0.2, 0.0], 0.0).log_odds == 0.0


@pytest.mark.parametrize(
    ("relative", "harm"),
    [
        ([-0.2, 0.0], 0.0),
        ([-0.2, 0.9 * WORSE * 0.01], 0.0),  # worse by chance
        ([0.0, 0.1], np.log(1.1)),
        ([-0.3, 0.1], np.log(1.1) + SPILLED * np.log(0.7)),  # others gain far more
        ([-0.1, 0.1], np.log(1.1) + SPILLED * np.log(0.9)),
    ],
)
def test_harm_is_what_joints_lose_beyond_a_part_of_what_others_gain(relative: list[float], harm: float) -> None:
    assert change(relative).harm == pytest.approx(harm)


def test_a_small_loss_beside_a_large_gain_is_no_harm() -> None:
    assert change([-0.3, 0.05]).harm <= 0.0 < change([-0.1, 0.1]).harm


@given(st.lists(RELATIVE, min_size=1, max_size=7))
def test_only_a_joint_that_is_clearly_worse_is_harmed(relative: list[float]) -> None:
    found = change(relative)
    assert found.harm <= 0.0 or bool((found.standard > WORSE).any())


def at(model: ExtendedModel) -> Any:
    """A hypothesis of which held-out motion asks."""
    return SimpleNamespace(model=model, scales=(Scales.start(1.0),) * 3)


def with_offset(model: ExtendedModel, offset: float) -> ExtendedModel:
    place = model.structure.coefficient(JOINT, "offset")
    assert place is not None
    parameters = model.parameters.copy()
    parameters[place] += offset
    return replace(model, parameters=parameters)


@settings(max_examples=10, deadline=None)
@given(st.floats(0.5, 5.0))
def test_a_torque_that_is_not_there_is_refuted_at_its_joint_alone(offset: float) -> None:
    observations, model = nominal_rows()
    held_out = HeldOut(observations.with_noise(white_noise(observations, model)))
    worse = held_out.change(at(model), at(with_offset(model, offset)))
    assert worse.relative[JOINT] > 0.0
    assert worse.log_odds < 0.0 < worse.harm
    others = [joint for joint in range(3) if joint != JOINT]
    np.testing.assert_array_equal(worse.relative[others], 0.0)
    better = held_out.change(at(with_offset(model, offset)), at(model))
    assert better.log_odds > 0.0
    assert better.harm == 0.0
    assert better.gain[JOINT] > 0.0
    assert 1.0 + better.relative[JOINT] == pytest.approx(1.0 / (1.0 + worse.relative[JOINT]))


def test_the_same_model_changes_nothing() -> None:
    observations, model = nominal_rows()
    found = HeldOut(observations.with_noise(white_noise(observations, model))).change(at(model), at(model))
    assert found.log_odds == 0.0
    assert found.harm == 0.0
