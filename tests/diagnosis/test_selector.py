"""The order in which effects are asked: what was refused beside a model may belong to a better one."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tauscope.diagnosis.screening.screen import Candidate
from tauscope.diagnosis.selection import selector
from tauscope.diagnosis.selection.choice import Choice, Option, Place, place_of
from tauscope.diagnosis.selection.confirmation import Confirmation
from tauscope.diagnosis.selection.selector import Selector
from tauscope.diagnosis.selection.table import Table
from tauscope.effects import Effect
from tauscope.effects.cable_force import CableForce
from tauscope.effects.joint_spring import JointSpring
from tauscope.effects.periodic_torque import Cogging
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.effects.time_delay import Shift, TimeDelay

JOINTS = tuple(SimpleNamespace(name=f"joint{number}") for number in (1, 2, 3))
FIT: Any = SimpleNamespace(model=SimpleNamespace(structure=SimpleNamespace(robot=SimpleNamespace(joints=JOINTS))))
SCREEN: Any = SimpleNamespace(effects=(), observations=SimpleNamespace(robot=SimpleNamespace(joint_count=3)))
FITTER: Any = None
PLAIN: Any = SimpleNamespace(inflation=lambda fit: 1.0)

SIGNIFICANT: Any = SimpleNamespace(
    level=1e-3,
    inflation=lambda fit: 1.0,
    p_value=lambda *_, blocks: 0.0,
    may_be_large_enough=lambda *_: True,
    large_enough=lambda *_, known: True,
)

LATER = Shift(1, np.full((1, 1), 2.0), np.zeros(1), np.ones(1))

SEEN = Confirmation(gain=100.0, gain_z=5.0, expected_z=10.0, seen_z=10.0, favour=50.0)
REFUTED = Confirmation(gain=-100.0, gain_z=-5.0, expected_z=10.0, seen_z=0.0, favour=-50.0)


def choice(effect: Any, confirmation: Confirmation) -> Choice:
    candidate = Candidate(effect, np.zeros(1), np.ones(1), 100.0, np.eye(1), True, 1.0, 1.0)
    return Choice((Option(candidate, FIT, 100.0),), confirmation, 0.0)


class AnyTable:
    """Knows only what is refused."""

    candidates = ()

    def __init__(self, refused: set[Place]) -> None:
        self.refused = set(refused)

    def refuse(self, place: Place, but: Sequence[Candidate] = ()) -> None:
        self.refused.add(place)

    def refined(self, candidates: Sequence[Candidate]) -> list[Candidate]:
        return list(candidates)

    def fitted(self, candidates: Sequence[Candidate]) -> list[Option]:
        return [Option(each, FIT, each.gain) for each in candidates]


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
    monkeypatch.setattr(Selector, "_settled", lambda self, fit, choices: (fit, choices))
    selector = Selector(SCREEN, FITTER, None, pure_error=True)
    selector.admission = PLAIN
    _, choices, rejected = selector._grown(FIT, FIT, [], lambda step: None)
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


@pytest.mark.parametrize(
    ("left", "effects_there", "ends"),
    [([1], 4, True), ([1, 2], 4, False), ([], 4, False), ([1], 3, False)],
    ids=["all is left where all was tried", "another joint is wrong too", "nothing is left", "more may be tried"],
)
def test_growing_ends_where_a_joint_that_has_everything_is_all_that_is_wrong(
    monkeypatch: pytest.MonkeyPatch, left: list[int], effects_there: int, ends: bool
) -> None:
    """A rotor's inertia is expected everywhere, and two orders of one effect are one."""
    told = SimpleNamespace(significant=[joint in left for joint in range(3)])
    monkeypatch.setattr(selector, "lack_of_fit", lambda *_, pure_error: None)
    monkeypatch.setattr(selector, "without_spilled", lambda *_, pure_error: told)
    there = (JointSpring(1), Cogging(1), TimeDelay(1), cable(1))[-effects_there:]
    choices = [choice(each, SEEN) for each in (*there, RotorInertia(1), cable(1), JointSpring(0))]
    asked = Selector(SCREEN, FITTER, None, pure_error=True)
    assert asked._is_of_no_catalogue(FIT, choices) is ends
    assert not Selector(SCREEN, FITTER, None, pure_error=False)._is_of_no_catalogue(FIT, choices)


def cable(side: int) -> CableForce:
    """At the second joint."""
    return CableForce(1, np.ones((1, 2)), np.zeros(2), np.ones(2), side=side)


def table_of(gains: Sequence[tuple[Effect, float]], monkeypatch: pytest.MonkeyPatch) -> Table:
    """Forms with what each explains."""
    table = object.__new__(Table)
    table.candidates = [
        Candidate(form, np.ones(2), np.ones(1), gain, np.eye(1), True, 1.0, 1.0) for form, gain in gains
    ]
    table.fit = FIT
    monkeypatch.setattr(Table, "refined", lambda self, candidates: list(candidates))
    monkeypatch.setattr(Table, "fitted", lambda self, candidates: [Option(each, FIT, each.gain) for each in candidates])
    return table


@pytest.mark.parametrize(("explained", "chosen"), [(95.0, ["cable_force"]), (85.0, [])])
def test_another_form_of_what_was_refused_is_asked_where_training_hardly_tells_the_two(
    monkeypatch: pytest.MonkeyPatch, explained: float, chosen: list[str]
) -> None:
    """Of a cable, the form of the other side may explain a little more and predict nothing."""
    forms = {side: cable(side) for side in (1, -1)}
    table = table_of([(forms[1], explained), (forms[-1], 100.0)], monkeypatch)

    def best(self: Selector, table: Table, choices: Sequence[Choice]) -> Choice | None:
        left = sorted(table.candidates, key=lambda each: -each.gain)
        asked = None if choices or not left else left[0]
        is_true = asked is not None and asked.effect is forms[1]
        return asked and Choice(tuple(table.fitted([asked])), SEEN if is_true else REFUTED, 0.0)

    monkeypatch.setattr(Selector, "_table", lambda self, fit, choices, refused: table)
    monkeypatch.setattr(Selector, "_best", best)
    selector = Selector(SCREEN, FITTER, None, pure_error=True)
    selector.admission = PLAIN
    _, found, rejected = selector._grown(FIT, FIT, [], lambda step: None)
    assert [each.options[0].candidate.effect.id for each in found] == chosen
    assert [each.options[0].candidate.effect for each in rejected] == [forms[-1]]


@pytest.mark.parametrize(("sibling", "stays"), [(TimeDelay(1), True), (LATER, False)])
def test_a_form_that_cannot_be_leaves_the_plain_form_of_its_effect_in(
    monkeypatch: pytest.MonkeyPatch, sibling: Effect, stays: bool
) -> None:
    """A delay, whose torque shifted by too much and weakened for it explains far more; another shift is as doubtful."""
    impossible = Shift(1, np.ones((1, 1)), np.zeros(1), np.ones(1))
    table = table_of([(sibling, 30.0), (impossible, 100.0)], monkeypatch)
    monkeypatch.setattr(
        selector, "is_physical", lambda option, fit, **_words: option.candidate.effect is not impossible
    )
    monkeypatch.setattr(selector, "outsized", lambda option, observations: False)
    monkeypatch.setattr(selector, "is_position_noise", lambda option, fit, screen: False)
    monkeypatch.setattr(selector, "where_held_out_shows", lambda option, fit, fitter, held_out: option)
    monkeypatch.setattr(selector, "equivalents", lambda *_: [])
    monkeypatch.setattr(Selector, "confirmation", lambda self, fit, option: SEEN)
    asked = Selector(SCREEN, FITTER, None, pure_error=True)
    asked.admission = SIGNIFICANT
    best = asked._best(table, [])
    assert ([] if best is None else [each.candidate.effect for each in best.options]) == [sibling] * stays


@pytest.mark.parametrize(("effect", "allowed"), [(JointSpring(3), True), (RotorInertia(0), True), (Cogging(0), False)])
def test_what_is_counted_are_kinds_and_not_joints(effect: Effect, allowed: bool) -> None:
    """Springs at three joints leave room for three other effects, and for a fourth spring beside those."""
    asked = Selector(SCREEN, FITTER, None, pure_error=True)
    chosen: list[Place] = [("joint_spring", joint) for joint in range(3)]
    assert asked.allowed(effect, chosen, set())
    chosen += [("time_delay", None), ("base_tilt", None), ("cable_force", 1)]
    assert asked.allowed(effect, chosen, set()) is allowed
    assert not asked.allowed(effect, [], {(effect.id, effect.joint)}), "what was refused is not looked at again"
