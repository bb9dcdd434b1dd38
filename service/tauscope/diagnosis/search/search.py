"""From the nominal model to the most probable set of effects: one more, one less, until nothing helps."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cmp_to_key, partial

import numpy as np

from tauscope.diagnosis.model.term import Place
from tauscope.diagnosis.search.exchange import Exchange
from tauscope.diagnosis.search.found import Found, Step, Weighed
from tauscope.diagnosis.search.gates import CATALOGUED, UNASKED, Gates, find_places, stands
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.diagnosis.search.proposals import Looks, Proposal, Proposer, Wanted
from tauscope.effects import Effect
from tauscope.effects.computation import side_by_side

MOST_EFFECTS = 12  # effects that are added at most
FIRST = 3  # proposals, first after one step to their parameters, that are compared after more


@dataclass(frozen=True, eq=False)
class Search:
    """A search among effects on the same rows."""

    gates: Gates
    farther: Sequence[Effect] = ()  # forms that say more than what they refine

    def run(self, before: Found | None = None) -> Found:
        """Add what makes the data most probable and held-out motion no worse, to what was found before."""
        at, steps, refused = self.gates.nominal, list[Step](), dict[Place, frozenset[int]]()
        if before is not None:
            at, steps = before.hypothesis, list(before.steps)
        exchange, exchanged, weighed = Exchange(self.gates), None, tuple[Weighed, ...]()
        while True:
            at, tried = self._grow(at, refused)
            steps += tried
            at = self._refine(self._drop_harmful(at))
            if at is exchanged:
                break
            grown, gone = at, len(exchange.gone)
            exchanged, weighed = exchange.run(grown)
            if len(exchange.gone) == gone:
                at = exchanged
                break
            at = self._drop_superfluous(exchanged)
            _forgive(refused, _find_changed_joints(grown, at))
            refused |= dict.fromkeys(exchange.gone - find_places(at), frozenset())
        return Found(self.gates.nominal, at, tuple(steps), weighed)

    def _grow(self, at: Hypothesis, refused: dict[Place, frozenset[int]]) -> tuple[Hypothesis, list[Step]]:
        """One more effect, and without those that it makes superfluous, until nothing helps.

        What was refused is tried again after something changed at its joints; all others are looked at anew where
        nothing helps any more.
        """
        steps, looks, is_anew = list[Step](), Looks(), True
        while len(self.gates.find_added_terms(at)) < MOST_EFFECTS:
            proposals = self.gates.proposer.propose(at, Wanted(find_places(at), refused), looks=looks)
            tried, found = self._best(at, proposals, looks)
            steps += tried
            refused |= {step.place: _find_joints(step) for step in tried if not step.is_confirmed}
            if found is None and is_anew:
                break
            if found is None:
                looks, is_anew = Looks(), True
                continue
            before, at, is_anew = at, self._drop_superfluous(found), False
            changed = _find_changed_joints(before, at)
            looks.forget(changed, len(at.scales))
            _forgive(refused, changed)
            refused |= dict.fromkeys(find_places(found) - find_places(at), frozenset())
        return at, steps

    def _refine(self, at: Hypothesis) -> Hypothesis:
        """Farther forms in the place of effects that they refine, where they are more probable."""
        for effect in self.farther:
            terms = at.model.terms
            own = (place for place in self.gates.find_added_terms(at) if terms[place].effect.joint == effect.joint)
            refined = next((place for place in own if terms[place].effect.id in effect.refines), None)
            if refined is not None:
                at = self._refine_by(effect, refined, at)
        return at

    def _refine_by(self, effect: Effect, place: int, at: Hypothesis) -> Hypothesis:
        """One of them in the place of a term, and of all others that it makes superfluous."""
        touched, without = effect.touched(len(at.scales)), self.gates.settle_without(at, place)
        for proposal in Proposer(self.gates.laboratory, [effect]).propose(without, lambda _: True):
            found = self.gates.settle(self.gates.add(without, proposal), touched)
            found = self._drop_superfluous(found)
            if self.gates.compare(at, found, touched) > 0.0 and stands(found.model):
                return found
        return at

    def _drop_harmful(self, at: Hypothesis) -> Hypothesis:
        """The same without the effects at whose cost joints are predicted worse than by the nominal model."""
        while self.gates.held_out is not None and (added := self.gates.find_added_terms(at)):
            if self.gates.held_out.trained_change(self.gates.nominal, at).harm <= 0.0:
                break
            others = [self.gates.settle_without(at, place) for place in added]
            harms = [self.gates.held_out.trained_change(self.gates.nominal, each).harm for each in others]
            at = others[int(np.argmin(harms))]
        return at

    def _best(
        self, at: Hypothesis, proposals: Sequence[Proposal], looks: Looks
    ) -> tuple[list[Step], Hypothesis | None]:
        """The most probable proposal that held-out motion does not contradict, after those that it does."""
        refusals, untried = list[Step](), list(self.farther)
        renewed = (self.gates.proposer.renew(each, at, looks) for each in self._rank(at, proposals))
        for proposal in (each for each in renewed if each is not None):
            step, found = self.gates.attempt(at, proposal)
            name, joint = proposal.place
            forms = [each for each in untried if name in each.refines and each.joint == joint]
            if forms and not step.is_confirmed and not stands(found.model):  # its own law cannot be
                untried = [each for each in untried if each not in forms]
                for form in Proposer(self.gates.laboratory, forms).propose(at, lambda _: True):
                    step, found = self.gates.attempt(at, form)
                    if step.is_confirmed:
                        break
            if step.is_confirmed:
                return [*refusals, step], found
            refusals.append(step)
        return refusals, None

    def _rank(self, at: Hypothesis, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Proposals that training asks for, or held-out motion alone, the most probable after all motion first."""
        asked = [each for each in proposals if self.gates.log_odds(each) > 0.0]
        if self.gates.held_out is None or len(asked) == len(proposals) < 2:
            return asked
        held_out = self.gates.held_out
        approach = self.gates.laboratory.approach

        def begin(proposal: Proposal) -> Hypothesis:
            """The hypothesis with it after one step."""
            return self.gates.find_twin(approach(self.gates.add(at, proposal), 1), partial(approach, steps=1))

        approached = side_by_side(begin, proposals)
        nearer = {id(each): found for each, found in zip(proposals, approached, strict=True)}
        for each in proposals:
            if each not in asked and held_out.change(at, nearer[id(each)]).log_odds() > UNASKED:
                asked.append(each)

        def compare(one: Proposal, other: Proposal) -> int:
            """Which is more probable. What both predict alike says nothing: they are compared with each other."""
            found = held_out.change(nearer[id(one)], nearer[id(other)]).log_odds()
            return int(np.sign(found + self.gates.log_odds(other) - self.gates.log_odds(one)))

        asked.sort(key=cmp_to_key(compare))
        first = asked[:FIRST]
        nearest = side_by_side(lambda each: approach(nearer[id(each)]), first)
        nearer |= {id(each): found for each, found in zip(first, nearest, strict=True)}
        return [*sorted(first, key=cmp_to_key(compare)), *asked[FIRST:]]

    def _drop_superfluous(self, at: Hypothesis) -> Hypothesis:
        """The same without effects that the later ones made superfluous."""
        while True:
            places = [place for place in self.gates.find_added_terms(at) if place < len(at.model.terms) - 1]
            gains = side_by_side(lambda place, at=at: self._weigh_absence(at, place), places)
            pairs = sorted(zip(gains, places, strict=True), reverse=True)
            others = (self._leave_out(at, place, gain) for gain, place in pairs if gain > CATALOGUED)
            other = next((each for each in others if each is not None), None)
            if other is None:
                return at
            at = other

    def _leave_out(self, at: Hypothesis, place: int, gain: float) -> Hypothesis | None:
        """The hypothesis without an effect; None where held-out motion asks for it."""
        without = self.gates.settle_without(at, place)
        return without if gain + self.gates.weigh_held_out(at, without) > CATALOGUED else None

    def _weigh_absence(self, at: Hypothesis, place: int) -> float:
        """Log posterior odds that an effect is not there."""
        term, own = at.model.terms[place], at.model.term_places()[place]
        effect, steps = term.effect, np.zeros(term.size)
        steps[: len(term.coefficients)] = -term.coefficients
        reduced = at.linear.without(np.arange(own.start, own.stop), steps)
        scales = reduced.most_probable(at.scales, effect.touched(len(at.scales)))
        gained = replace(at, linear=reduced, scales=scales).log_evidence - at.log_evidence
        return gained - self.gates.prior_odds(effect, 0.0)


def _find_joints(step: Step) -> frozenset[int]:
    """Joints at which a step's effect acts."""
    return frozenset(step.effect.touched(step.after.structure.robot.joint_count))


def _find_changed_joints(before: Hypothesis, after: Hypothesis) -> set[int]:
    """Joints at which two hypotheses have other effects."""
    one, other = (
        Counter((term.place, term.effect.touched(len(each.scales))) for term in each.model.terms)
        for each in (before, after)
    )
    return {joint for _, joints in (one - other) + (other - one) for joint in joints}


def _forgive(refused: dict[Place, frozenset[int]], joints: set[int]) -> None:
    """Nothing that acts at some joints is refused any more."""
    for place in [each for each, own in refused.items() if own & joints]:
        del refused[place]
