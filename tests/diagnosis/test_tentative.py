"""What training shows and held-out motion refutes: told apart, once a place, as it was tried last."""

import numpy as np

from diagnosis.diagnosed_arm import sound_arm
from tauscope.diagnosis.findings.conclude import _tentative
from tauscope.diagnosis.findings.finding import Finding
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.search.found import Step
from tauscope.effects.joint_spring import JointSpring


def step(
    joint: int, stiffness: float, *, trained: float = 9.0, is_confirmed: bool = False, log_odds: float = -1.0
) -> Step:
    """A spring that was tried beside the sound arm's model."""
    nominal = sound_arm().selection.fit.model
    term = Term(JointSpring(joint), np.zeros(0), np.array([stiffness]))
    after = with_terms(nominal, [*nominal.terms, term])
    return Step(term.effect, log_odds, is_confirmed, nominal, after, np.eye(after.size), trained)


def tentative(*steps: Step, found: frozenset[Place] = frozenset()) -> list[Finding]:
    sound = sound_arm()
    return list(_tentative(steps, set(found), sound.fitter, sound.held_out))


def test_what_was_refuted_is_told_with_even_odds_at_most() -> None:
    (found,) = tentative(step(0, 0.5))
    assert found.place == ("joint_spring", 0)
    assert found.confirmed is False
    assert found.probability < 0.5
    assert found.before.held_out is not None
    assert found.before.train.tolist() == sound_arm().after.train.tolist()


def test_of_one_place_the_last_trial_counts() -> None:
    (found,) = tentative(step(0, 0.5), step(0, 0.2))
    assert found.terms[0].coefficients.tolist() == [0.2]


def test_what_training_does_not_show_or_motion_confirms_or_is_found_is_not_tentative() -> None:
    assert not tentative(step(0, 0.5, trained=-1.0))
    assert not tentative(step(0, 0.5, is_confirmed=True))
    assert not tentative(step(0, 0.5), found=frozenset({("joint_spring", 0)}))


def test_what_is_refuted_at_twenty_to_one_is_not_told() -> None:
    assert tentative(step(0, 0.5, log_odds=-2.9))
    assert not tentative(step(0, 0.5, log_odds=-3.1))


def test_each_place_has_its_own() -> None:
    assert {each.place for each in tentative(step(0, 0.5), step(2, 0.5))} == {("joint_spring", 0), ("joint_spring", 2)}
