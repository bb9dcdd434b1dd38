"""The order in which effects are asked: what was refused beside a model may belong to a better one."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.diagnosis.catalogue.elastic_forces import JointSpring
from service.diagnosis.catalogue.periodic_torque import Cogging
from service.diagnosis.screening.screen import Candidate
from service.diagnosis.selection.choice import Choice, Option, Place, place_of
from service.diagnosis.selection.confirmation import Confirmation
from service.diagnosis.selection.selector import Selector

JOINTS = tuple(SimpleNamespace(name=f"joint{number}") for number in (1, 2, 3))
FIT: Any = SimpleNamespace(model=SimpleNamespace(structure=SimpleNamespace(robot=SimpleNamespace(joints=JOINTS))))
SCREEN: Any = SimpleNamespace(effects=(), observations=SimpleNamespace(robot=SimpleNamespace(joint_count=3)))
FITTER: Any = None

SEEN = Confirmation(gain=100.0, gain_z=5.0, expected_z=10.0, seen_z=10.0, favour=50.0)
REFUTED = Confirmation(gain=-100.0, gain_z=-5.0, expected_z=10.0, seen_z=0.0, favour=-50.0)


def choice(effect: Any, confirmation: Confirmation) -> Choice:
    candidate = Candidate(effect, np.zeros(1), np.ones(1), 100.0, np.eye(1), True, 1.0, 1.0)
    return Choice((Option(candidate, FIT, 100.0),), confirmation, 0.0)


class AnyTable:
    """Knows only what is refused."""

    def __init__(self, refused: set[Place]) -> None:
        self.refused = set(refused)

    def refuse(self, place: Place) -> None:
        self.refused.add(place)


def grown(monkeypatch: pytest.MonkeyPatch, waves_at: int) -> tuple[list[Place], list[Place]]:
    """Waves at a joint that only a model with the spring of joint 1 predicts; what is chosen, what was refused."""
    waves, spring = Cogging(waves_at), JointSpring(0)

    def best(self: Selector, table: Any, choices: Sequence[Choice]) -> Choice | None:
        chosen = [place_of(each.options[0].candidate) for each in choices]
        left = [each for each in (waves, spring) if (each.id, each.joint) not in {*table.refused, *chosen}]
        if not left:
            return None
        return choice(left[0], SEEN if left[0] is spring or chosen else REFUTED)

    monkeypatch.setattr(Selector, "_table", lambda self, fit, choices, refused: AnyTable(refused))
    monkeypatch.setattr(Selector, "_best", best)
    selector = Selector(SCREEN, FITTER, None, pure_error=True)
    _, choices, rejected = selector._grown(FIT, [], lambda step: None)
    return tuple([place_of(each.options[0].candidate) for each in found] for found in (choices, rejected))  # type: ignore[return-value]


def test_what_was_refused_is_asked_again_beside_an_effect_found_since_at_its_joint(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    chosen, refused = grown(monkeypatch, waves_at=0)
    assert chosen == [("joint_spring", 0), ("cogging", 0)]
    assert refused == [("cogging", 0)]


def test_what_was_refused_elsewhere_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen, refused = grown(monkeypatch, waves_at=2)
    assert chosen == [("joint_spring", 0)]
    assert refused == [("cogging", 2)]
