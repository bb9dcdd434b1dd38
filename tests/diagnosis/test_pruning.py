"""What is superfluous is dropped, the weakest first, whatever is asked anew on the way."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from tauscope.diagnosis.screening.screen import Candidate
from tauscope.diagnosis.selection import pruning
from tauscope.diagnosis.selection.choice import Choice, Option
from tauscope.diagnosis.selection.proxies import TELLING, endless, hopeless
from tauscope.diagnosis.selection.pruning import without_superfluous
from tauscope.effects import Effect
from tauscope.effects.periodic_torque import Cogging, TorqueRipple
from tauscope.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope.effects.rotor_inertia import RotorInertia

ADMISSION: Any = SimpleNamespace(level=1e-3, inflation=lambda fit: 1.0)


COGGING = Cogging(0)


def wave(gain: float = 0.0, effect: Effect = COGGING) -> Choice:
    fit: Any = None
    candidate = Candidate(effect, np.zeros(1), np.ones(2), gain, np.eye(2), True, 1.0, 1.0)
    return Choice((Option(candidate, fit, gain),), None, 0.0)


class Explained:
    """What sets of terms explain: each a part of the same things, which count once."""

    def __init__(self, worth: list[float], parts: list[set[int]]) -> None:
        self.worth, self.parts = worth, parts
        self.fits = 0

    def fit(self, terms: tuple[int, ...]) -> Any:
        covered = set().union(*(self.parts[term] for term in terms))
        return SimpleNamespace(terms=terms, energy=-sum(self.worth[thing] for thing in covered))

    def each_without(self, groups: list[list[int]], fit: Any, fitter: Any) -> list[Any]:
        self.fits += len(groups)
        return [self.fit(tuple(t for at, t in enumerate(fit.terms) if at not in group)) for group in groups]


def plainly(explained: Explained, terms: tuple[int, ...]) -> tuple[int, ...]:
    """The same with all terms asked anew after each that is dropped."""
    while terms:
        fit = explained.fit(terms)
        losses = [
            each.energy - fit.energy for each in explained.each_without([[at] for at in range(len(terms))], fit, None)
        ]
        weakest = int(np.argmin(losses))
        candidate = Candidate(Cogging(0), np.zeros(1), np.ones(2), losses[weakest], np.eye(2), True, 1.0, 1.0)
        if candidate.p_value(1.0, refined=True) < ADMISSION.level:
            break
        terms = terms[:weakest] + terms[weakest + 1 :]
    return terms


@example(parts=[{0}, set(), {0, 1, 3, 8}, {0, 1, 3, 8}], seed=0)
@given(st.lists(st.sets(st.integers(0, 11), max_size=4), min_size=1, max_size=10), st.integers(0, 2**32 - 1))
def test_it_ends_as_if_all_were_asked_anew(parts: list[set[int]], seed: int) -> None:
    """Where what a term adds never grows with others beside it."""
    # Dyadic fractions: every sum is exact, so that terms that explain the same are equally strong.
    worth = (np.random.default_rng(seed).integers(0, 30 * 2**20, 12) / 2**20).tolist()
    terms = tuple(range(len(parts)))
    expected = plainly(Explained(worth, parts), terms)
    explained, fitter = Explained(worth, parts), None
    choices = [wave() for _ in terms]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(pruning, "_each_without", explained.each_without)
        fit, kept = without_superfluous(explained.fit(terms), choices, fitter, ADMISSION)  # type: ignore[arg-type]
    assert fit.terms == expected  # type: ignore[attr-defined]
    assert [choices.index(each) for each in kept] == list(expected)


def test_what_is_plainly_needed_is_asked_once(monkeypatch: pytest.MonkeyPatch) -> None:
    worth = [1.0, 2.0, *(100.0 + np.arange(10))]
    explained, fitter = Explained(worth, [{thing} for thing in range(12)]), None
    monkeypatch.setattr(pruning, "_each_without", explained.each_without)
    _, kept = without_superfluous(explained.fit(tuple(range(12))), [wave() for _ in worth], fitter, ADMISSION)  # type: ignore[arg-type]
    assert len(kept) == 10
    assert explained.fits <= 12 + 2 + 2


@pytest.mark.parametrize(("last", "ended"), [(20.0, True), (80.0, False)])
def test_orders_end_where_all_that_may_come_would_leave_most(last: float, ended: bool) -> None:
    """Three of twelve orders have explained 250 of 1000: nine of the last one's size make 430 or 970."""
    choices = [wave(130.0), wave(100.0), wave(last)]
    observations: Any = SimpleNamespace(noise=[SimpleNamespace(share=1.0)])
    rows = SimpleNamespace(residual=[np.zeros(500)])
    nominal: Any = SimpleNamespace(joint_energies=np.array([1500.0]))
    fit: Any = SimpleNamespace(joint_energies=np.array([1250.0]), projection=rows)
    assert hopeless(nominal, fit, choices, observations, 12) == ({("cogging", 0)} if ended else set())
    assert hopeless(nominal, fit, choices[:2], observations, 12) == set()


def test_orders_end_beside_two_other_effects_of_the_joint() -> None:
    """A series beside other things fits anything; what every geared joint may have is no such thing."""
    orders = [wave() for _ in range(TELLING)]
    beside = [wave(effect=each) for each in (TorqueRipple(0), RotorInertia(0), PreslidingHysteresis(1))]
    third = wave(effect=PreslidingHysteresis(0))
    assert endless([*orders, *beside]) == set()
    assert endless([*orders, *beside, third]) == {("cogging", 0)}
    assert endless([*orders[1:], *beside, third]) == set()
