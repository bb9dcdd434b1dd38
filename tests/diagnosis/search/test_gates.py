"""What training and held-out motion must say before an effect is named, each gate by a trial on either side of it."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tauscope.diagnosis.model.held_out_change import HeldOutChange
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.search.gates import Gates
from tauscope.diagnosis.search.search import Search
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.time_delay import Shift

NOTHING: Any = None
JOINTS = 2


@dataclass(frozen=True)
class Trial:
    """What is said of a spring at the first of two joints, in log odds."""

    training: float
    held_out: float
    beside_friction: float = 0.0
    predicted: float = 10.0
    delivered: float = 20.0
    tells: bool = True
    harm: float = 0.0
    lost: float | None = None


def change(log_odds: float, harm: float = 0.0) -> HeldOutChange:
    """Of the first joint by log odds, of the second a loss in its rms."""
    size = np.sqrt(abs(log_odds) / 2.0)
    return HeldOutChange(
        np.array([-np.sign(log_odds) * 0.01 * size, harm]),
        np.array([0.01, 0.1 * harm]),
        np.array([size, 0.0]),
    )


@dataclass(frozen=True, eq=False)
class Asking(Gates):
    """Gates whose odds are given, among them those that are lost with a lag where the spring leaves none."""

    lost: float | None = None

    def add(self, at: Any, proposal: Any) -> Any:
        found = holding("found")
        if self.lost is not None:
            found.model.terms.insert(0, Term(Shift(0), np.array([0.01]), np.array([0.4])))
        return found

    def settle_without(self, at: Any, place: int) -> Any:
        assert place == 0
        return holding("found")

    def _weigh_lost(self, lost: Any, *_: Any) -> float:
        assert [each.id for each in lost] == ["time_delay"]
        assert self.lost is not None
        return self.lost

    def settle(self, at: Any, touched: Any) -> Any:
        return at

    def _hold_friction(self, at: Any, places: Any) -> Any:
        return holding("friction")

    def log_odds(self, proposal: Any) -> float:
        return float(proposal.log_factor)


def holding(name: str) -> Any:
    spring = JointSpring(0)
    term = Term(spring, np.zeros(len(spring.shapes)), np.ones(len(spring.coefficients)))
    structure = SimpleNamespace(terms=[SimpleNamespace(k_v=100.0)] * JOINTS)
    model = SimpleNamespace(terms=[term], structure=structure)
    return SimpleNamespace(
        name=name, model=model, scales=(NOTHING,) * JOINTS, posterior=SimpleNamespace(covariance=np.eye(1))
    )


def is_named(trial: Trial) -> bool:
    said = {"at": change(trial.held_out), "friction": change(trial.beside_friction)}
    if not trial.tells:
        said = {name: replace(each, error=np.full(JOINTS, np.inf)) for name, each in said.items()}
    held_out: Any = SimpleNamespace(
        change=lambda before, after: said[before.name],
        trained_change=lambda before, after: change(trial.predicted, trial.harm) if trial.tells else said["at"],
        delivered_change=lambda before, after: change(trial.delivered),
    )
    proposal: Any = SimpleNamespace(term=holding("found").model.terms[0], log_factor=trial.training)
    nominal: Any = SimpleNamespace(model=SimpleNamespace(terms=[]))
    gates = Asking(nominal, NOTHING, NOTHING, held_out, lost=trial.lost)
    step, found = gates.attempt(holding("at"), proposal)
    assert len(found.model.terms) == 1
    return step.is_confirmed


ASKED = Trial(training=4.0, held_out=1.5)
UNASKED = Trial(training=2.0, held_out=20.0)


@pytest.mark.parametrize(
    ("trial", "named"),
    [
        (ASKED, True),
        (replace(ASKED, training=2.0), False),  # nineteen in twenty after training
        (replace(ASKED, held_out=0.5), False),  # three to one of held-out motion
        (replace(ASKED, held_out=0.5, beside_friction=1.5), True),  # where friction's slopes take its place
        (replace(ASKED, predicted=-1.0), False),  # by training alone no worse
        (replace(ASKED, delivered=0.0), True),  # whatever single samples say
        (replace(ASKED, tells=False), True),  # which decide where the band has too few rows
        (replace(ASKED, tells=False, delivered=0.5), False),
        (replace(ASKED, harm=0.5), False),  # at no other joint's cost
        (replace(ASKED, lost=0.5), True),  # without what it makes impossible
        (replace(ASKED, lost=5.0), False),  # but what is lost with that counts
        (UNASKED, True),
        (replace(UNASKED, held_out=16.0), False),  # three standard errors
        (replace(UNASKED, delivered=16.0), False),  # which the table shows, too
        (replace(ASKED, held_out=20.0, harm=0.006), True),  # at a small cost beside its gain
        (replace(UNASKED, harm=0.006), False),  # which nothing is worth that training does not ask for
        (replace(UNASKED, training=-20.0), False),  # what training is sure is not there
    ],
)
def test_an_effect_is_named_where_training_asks_and_held_out_motion_shows_it(trial: Trial, named: bool) -> None:
    assert is_named(trial) is named


@pytest.mark.parametrize(
    ("training", "held_out", "tried"), [(0.5, 0.0, True), (-1.0, 20.0, True), (-1.0, 16.0, False), (-1.0, 0.0, False)]
)
def test_an_effect_is_tried_where_training_asks_for_it_or_held_out_motion_alone(
    training: float, held_out: float, tried: bool
) -> None:
    laboratory: Any = SimpleNamespace(approach=lambda found, *_: found)
    judge: Any = SimpleNamespace(change=lambda before, after: change(held_out))
    proposal: Any = SimpleNamespace(term=NOTHING, log_factor=training)
    assert Search(Asking(NOTHING, laboratory, NOTHING, judge))._rank(holding("at"), [proposal]) == [proposal] * tried
