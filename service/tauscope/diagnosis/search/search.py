"""From the nominal model to the most probable set of effects: one more, one less, until nothing helps."""

from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.search.held_out import Change, HeldOut
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.proposals import Proposal, Proposer
from tauscope.diagnosis.selection.choice import Place
from tauscope.effects import Effect
from tauscope.effects.computation import side_by_side

MOST_EFFECTS = 12
"""Effects that are added at most."""

WORSE = 2.7
"""Standard errors by which no joint may be predicted worse: of seven joints one is so by chance in thirty findings…"""

SPILLED = 0.25
"""…unless what it loses is less than this part of what all joints gain [log rms]."""

BETTER = 1.64
"""…and by which a joint on which an effect acts is predicted better, at least: one in twenty is so by chance."""

CATALOGUED = 3.0
"""Log odds before the data that torque which is left out has a name: one in twenty laws is in no catalogue."""


@dataclass(frozen=True, eq=False)
class Step:
    """An effect that was added or refused.

    log_odds : float
        posterior, that it is there
    rivals : tuple of Proposal
        other effects that were as good as looked at in its place
    change : Change or None
        on held-out motion; None where there is none
    """

    proposal: Proposal
    log_odds: float
    rivals: tuple[Proposal, ...]
    change: Change | None
    is_confirmed: bool


@dataclass(frozen=True, eq=False)
class Found:
    """What the search found."""

    nominal: Hypothesis
    hypothesis: Hypothesis
    steps: tuple[Step, ...]


@dataclass(frozen=True, eq=False)
class Search:
    """A search among effects on the same rows."""

    laboratory: Laboratory
    proposer: Proposer
    held_out: HeldOut | None

    def run(self, nominal: Hypothesis) -> Found:
        """Add what makes the data most probable and held-out motion no worse."""
        at, steps, refused = nominal, list[Step](), set[Place]()
        while len(at.model.terms) - len(nominal.model.terms) < MOST_EFFECTS:
            proposals = self.proposer.propose(at, _Wanted(_places(at), refused))
            tried, found = self._best(at, proposals)
            refused.update(step.proposal.place for step in tried if not step.is_confirmed)
            steps += tried
            if found is None:
                break
            at = self._without_superfluous(found, len(nominal.model.terms))
            refused |= _places(found) - _places(at)
        return Found(nominal, at, tuple(steps))

    def _best(self, at: Hypothesis, proposals: list[Proposal]) -> tuple[list[Step], Hypothesis | None]:
        """The most probable proposal that held-out motion does not contradict, after those that it does.

        Where none is more probable than torque without a name, one that is as probable, and with which held-out motion
        is predicted clearly better, is preferred to it.
        """
        refusals: list[Step] = []
        likely = [each for each in proposals if self._log_odds(each) > 0.0]
        for proposal in likely:
            step, found = self._try(at, proposal, proposals)
            if step.is_confirmed:
                return [*refusals, step], found
            refusals.append(step)
        others = [each for each in proposals if each not in likely and self._names(each)]
        for proposal in sorted(others, key=lambda each: -each.log_factor_alone):
            step, found = self._try(at, proposal, proposals)
            if step.is_confirmed and step.change is not None and bool((step.change.standard < -WORSE).any()):
                return [*refusals, step], found
        return refusals, None

    def _try(self, at: Hypothesis, proposal: Proposal, proposals: list[Proposal]) -> tuple[Step, Hypothesis]:
        """A proposal in the model, and what held-out motion says of it."""
        touched = proposal.term.effect.touched(len(at.scales))
        added = self.laboratory.with_term(at, proposal.term, proposal.size)
        found = self.laboratory.settle(replace(added, scales=proposal.scales), touched)
        change = None if self.held_out is None else self.held_out.change(at, found)
        rivals = tuple(each for each in proposals if each is not proposal)
        confirmed = change is None or _is_better(change, touched)
        return Step(proposal, self._log_odds(proposal), rivals, change, confirmed), found

    def _log_odds(self, proposal: Proposal) -> float:
        return proposal.log_factor + self._prior_odds(proposal.term.effect)

    def _names(self, proposal: Proposal) -> bool:
        """Whether an effect is as probable as torque without a name, and far more than none."""
        alone = proposal.log_factor_alone + self._prior_odds(proposal.term.effect)
        return proposal.log_factor > -CATALOGUED and alone > CATALOGUED

    def _prior_odds(self, effect: Effect) -> float:
        """Log odds before the data: one effect at one place is missing, whichever."""
        if effect.is_expected:
            return 0.0
        return -float(np.log(len({(each.id, each.joint) for each in self.proposer.effects})))

    def _without_superfluous(self, at: Hypothesis, first: int) -> Hypothesis:
        """The same without effects that the later ones made superfluous.

        Parameters
        ----------
        first : int
            number of terms that the nominal model has
        """
        while True:
            places = range(first, len(at.model.terms) - 1)
            gains = side_by_side(lambda place, at=at: self._gain_without(at, place), places)
            if not gains or max(gains) <= CATALOGUED:
                return at
            place = places[int(np.argmax(gains))]
            touched = at.model.terms[place].effect.touched(len(at.scales))
            at = self.laboratory.settle(self.laboratory.without_term(at, place), touched)

    def _gain_without(self, at: Hypothesis, place: int) -> float:
        """Log posterior odds that an effect is not there."""
        term, own = at.model.terms[place], at.model.term_places()[place]
        effect, steps = term.effect, np.zeros(term.size)
        steps[: len(term.coefficients)] = -term.coefficients
        reduced = at.linear.without(np.arange(own.start, own.stop), steps)
        scales = reduced.most_probable(at.scales, effect.touched(len(at.scales)))
        return reduced.evidence(scales) - at.log_evidence - self._prior_odds(effect)


@dataclass(frozen=True)
class _Wanted:
    """Whether an effect may be added: none a second time, but what repeats, and none that was refused."""

    present: set[Place]
    refused: set[Place]

    def __call__(self, effect: Effect) -> bool:
        place = effect.id, effect.joint
        return place not in self.refused and (effect.repeats or place not in self.present)


def _places(at: Hypothesis) -> set[Place]:
    """Effects of a hypothesis, and where."""
    return {(term.effect.id, term.effect.joint) for term in at.model.terms}


def _is_better(change: Change, touched: tuple[int, ...]) -> bool:
    """Whether held-out motion is predicted better where an effect acts, and hardly worse anywhere.

    All joints share the links. What is believed of these moves with an effect, and other joints with it.
    """
    gain = np.log1p(change.relative)
    lost = float(gain[change.standard > WORSE].sum())
    gained = -float(np.minimum(gain, 0.0).sum())
    return bool(change.standard[list(touched)].min() < -BETTER) and lost < SPILLED * gained and gain.sum() < 0.0
