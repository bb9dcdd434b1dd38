"""What is concealed is found, by laws that are written out here."""

import numpy as np
import pytest

from diagnosis.diagnosed_arm import EffectTorque, at_joint, recordings
from identification.simulated import paper_robot
from tauscope.diagnosis.search.found import Found
from tauscope.diagnosis.search.from_recordings import search
from tauscope.identification import identify

pytestmark = pytest.mark.slow

CONCEALED: dict[str, EffectTorque] = {
    "load_dependent_friction": lambda arm, rigid: at_joint(
        1, 0.05 * np.abs(rigid[:, 1]) * np.sign(arm.exact.exact.velocity[:, 1])
    ),
    "cogging": lambda arm, rigid: at_joint(2, 0.5 * np.sin(7.0 * arm.exact.exact.position[:, 2])),
}
PLACES = {"load_dependent_friction": 1, "cogging": 2}


def found_on(effect: EffectTorque | None) -> Found:
    robot, draws = paper_robot(), np.random.default_rng(11)
    train, held_out = recordings((1, 2), effect, draws), recordings((5,), effect, draws)
    return search(identify(robot, train, held_out), train, held_out).found


@pytest.mark.parametrize("effect_id", ["load_dependent_friction", pytest.param("cogging", marks=pytest.mark.proof)])
def test_the_concealed_effect_comes_first_and_alone(effect_id: str) -> None:
    found = found_on(CONCEALED[effect_id])
    confirmed = [step.place for step in found.steps if step.is_confirmed]
    assert confirmed == [(effect_id, PLACES[effect_id])]


def test_nothing_is_found_on_a_sound_arm() -> None:
    assert not any(step.is_confirmed for step in found_on(None).steps)
