"""Log Bayes factors of a screen against the evidence of the model with and without the effect."""

import numpy as np
import pytest
from scipy.special import logsumexp

from diagnosis.diagnosed_arm import recordings
from identification.simulated import paper_robot
from tauscope.diagnosis.evidence.rows import EvidenceRows
from tauscope.diagnosis.model.nominal import delivered_model, setting_of
from tauscope.diagnosis.noise.floor import with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory, Prior
from tauscope.diagnosis.search.proposals import Proposer
from tauscope.diagnosis.search.scoring import SIZES, Scored, Scorer
from tauscope.effects import Effect, possible_effects
from tauscope.identification import identify
from tauscope.recording.conditioning import Conditioner

pytestmark = pytest.mark.slow

CUTOFF_HZ = 8.0


@pytest.fixture(scope="module")
def beside() -> tuple[Proposer, Hypothesis]:
    """All effects, and the nominal model of a sound arm."""
    robot, made = paper_robot(), recordings((1, 2), None, np.random.default_rng(3))
    identification = identify(robot, made)
    model = delivered_model(identification)
    surveyed = [Conditioner.survey(each, robot) for each in made]
    bare = Observations.prepare(surveyed, robot, identification.structure.base, CUTOFF_HZ, model.steepness)
    known = with_pure_error(bare, model)
    assert known is not None
    rows = EvidenceRows.prepare(known, model)
    effects = possible_effects(setting_of(model, bare, surveyed, CUTOFF_HZ))
    laboratory = Laboratory(rows, Prior.of(identification, model))
    return Proposer(laboratory, effects), laboratory.start(model)


@pytest.mark.parametrize("effect_id", ["joint_spring", "load_dependent_friction", "cogging", "base_tilt"])
def test_a_factor_is_the_ratio_of_two_evidences(beside: tuple[Proposer, Hypothesis], effect_id: str) -> None:
    proposer, at = beside
    effect = next(each for each in proposer.effects if each.id == effect_id)
    shapes = effect.grid[:2]
    signals = [at.model.signals(piece) for piece in proposer.rows.observations]
    columns = proposer.columns(effect, shapes, signals, at.dependence)
    found, _ = Scorer(proposer.rows, at).score(effect, shapes, columns)
    before = at.posterior.log_evidence
    for place in range(len(shapes)):
        own = {joint: rows[place] for joint, rows in columns.items()}
        shares = np.max(
            [
                np.sqrt(np.mean(rows**2, axis=-1)) / proposer.rows.measured_rms(joint, at.dependence[joint])
                for joint, rows in own.items()
            ],
            axis=0,
        )
        width = len(effect.coefficients)
        gains = [
            at.linear.extend(own, np.zeros(width), size / shares).posterior(at.scales).log_evidence - before
            for size in SIZES
        ]
        one_sided = sum(each.positive for each in effect.coefficients)
        expected = float(logsumexp(gains)) - np.log(len(SIZES)) + np.log(2.0) * one_sided
        if np.isfinite(found.log_factors[place]):
            assert found.log_factors[place] == pytest.approx(expected, abs=1e-5)


def test_an_arm_that_lacks_nothing_has_no_likely_effect(beside: tuple[Proposer, Hypothesis]) -> None:
    proposer, at = beside
    places = len({(each.id, each.joint) for each in proposer.effects})
    assert all(each.log_factor < np.log(places) for each in proposer.propose(at, lambda effect: True))


@pytest.mark.parametrize(("explained", "looked_at"), [(60.0, True), (40.0, False)])
def test_a_rival_explains_at_least_half_as_much(
    beside: tuple[Proposer, Hypothesis], monkeypatch: pytest.MonkeyPatch, explained: float, looked_at: bool
) -> None:
    proposer, at = beside
    own, rival = (next(each for each in proposer.effects if each.id == name) for name in ("cogging", "joint_spring"))
    looked: list[Effect] = []

    def score(effect: Effect, *_: object) -> tuple[Scored, Scored]:
        factor = np.array([100.0 if effect is own else explained if effect is rival else 0.0])
        found = Scored(effect, effect.grid[:1], factor, np.zeros((1, 1)), np.ones((1, 1)))
        return found, found

    monkeypatch.setattr(proposer, "_on_grid", score)
    monkeypatch.setattr(proposer, "_look_at", lambda scored, *_: looked.append(scored[0].effect))
    proposer.propose(at, lambda _: True, instead=(own.id, own.joint))
    assert own in looked
    assert (rival in looked) is looked_at
    looked.clear()
    proposer.propose(at, lambda _: True)
    assert rival in looked
