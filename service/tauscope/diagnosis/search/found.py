"""What a search comes to: the effects it tried, and how probable each is beside its rivals."""

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.diagnosis.search.proposals import Proposal
from tauscope.effects import Effect
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class Step:
    """An effect that was added or refused."""

    effect: Effect
    log_odds: float  # posterior, that it is there
    is_confirmed: bool
    before: ExtendedModel
    after: ExtendedModel
    covariance: Array  # (p, p), of the parameters with it
    trained_log_odds: float  # the same after training alone

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.effect.id, self.effect.joint

    @property
    def probability(self) -> float:
        """Of the effect, against none: no more than even where held-out motion contradicts it."""
        log_odds = self.log_odds if self.is_confirmed else min(self.log_odds, 0.0)
        return float(1.0 / (1.0 + np.exp(-np.clip(log_odds, -700.0, 700.0))))


@dataclass(frozen=True, eq=False)
class Rival:
    """What may be in the place of a finding."""

    term: Term
    model: ExtendedModel
    log_odds: float  # posterior, against neither
    absent: int | None = None  # parameter of the nominal model in whose place it is

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.term.place


@dataclass(frozen=True, eq=False)
class Weighed:
    """Effects of one kind at one place beside all others."""

    places: tuple[int, ...]  # of their terms in the model
    without: Hypothesis  # all others, at their most probable parameters
    log_odds: float  # posterior, that it is there
    rivals: tuple[Rival, ...]  # the most probable first
    proposals: tuple[Proposal, ...]

    @property
    def lead(self) -> float:
        """Log odds of the best rival against it."""
        return self.rivals[0].log_odds - self.log_odds if self.rivals else -np.inf

    @property
    def is_behind(self) -> bool:
        """Whether a rival may take its place: it alone has one, and is less probable."""
        return self.lead > 0.0 and len(self.places) == 1

    def compare_best(self, gained: float) -> "Weighed":
        """The same where the best rival turned out to gain so many log odds, at most none."""
        best = replace(self.rivals[0], log_odds=self.log_odds + gained)
        rivals = sorted((best, *self.rivals[1:]), key=lambda each: -each.log_odds)
        return replace(self, rivals=tuple(rivals))

    def refuse(self, rivals: Collection[Place]) -> "Weighed":
        """The same without some rivals."""
        return replace(self, rivals=tuple(each for each in self.rivals if each.place not in rivals))

    @property
    def probability(self) -> float:
        """Share of all visited models that contain it (Madigan & Raftery 1994)."""
        ahead = np.array([-self.log_odds, *(each.log_odds - self.log_odds for each in self.rivals)])
        return float(1.0 / (1.0 + np.exp(np.clip(ahead, -700.0, 700.0)).sum()))


@dataclass(frozen=True, eq=False)
class Found:
    """Result of a search."""

    nominal: Hypothesis
    hypothesis: Hypothesis
    steps: tuple[Step, ...]  # every effect that was tried, in the order of trial
    weighed: tuple[Weighed, ...]  # every effect of the hypothesis
