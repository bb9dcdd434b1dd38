"""What training and held-out motion must say before an effect is named."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Place
from tauscope.diagnosis.search.found import Step
from tauscope.diagnosis.search.held_out import HeldOut
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.proposals import Proposal, Proposer
from tauscope.diagnosis.search.window import window_log_odds
from tauscope.effects import Effect, TimeLocalEffect

NAMED = 3.0  # log odds from which an effect is named, and from which training asks for it: nineteen in twenty
# Log odds of held-out motion alone, of the joints that an effect touches, from which it is shown: three to one.
SHOWN = float(np.log(3.0))
# …of held-out motion where training does not ask for it, and of a window in time, which no other motion can refute:
# three standard errors.
UNASKED = 18.0
# Log odds before the data that torque which is left out has a name: one in twenty laws is in no catalogue.
CATALOGUED = 3.0


@dataclass(frozen=True, eq=False)
class Gates:
    """Hypotheses on the same rows, judged by training and by held-out motion."""

    nominal: Hypothesis  # model without what is looked for
    laboratory: Laboratory
    proposer: Proposer
    held_out: HeldOut | None

    def find_added_terms(self, at: Hypothesis) -> list[int]:
        """Places of the terms that the nominal model has not."""
        known = find_places(self.nominal)
        return [place for place, term in enumerate(at.model.terms) if term.place not in known]

    def add(self, at: Hypothesis, proposal: Proposal) -> Hypothesis:
        """A hypothesis with a proposal as it is, under the scales that were found with it."""
        return self.laboratory.with_term(self.laboratory.paint(at, proposal.found), proposal.term, proposal.size)

    def attempt(self, at: Hypothesis, proposal: Proposal) -> tuple[Step, Hypothesis]:
        """A proposal in the model, and what held-out motion says of it."""
        touched = proposal.term.effect.touched(len(at.scales))
        found, lost = self._drop_impossible(self.settle(self.add(at, proposal), touched))
        trained = self.log_odds(proposal) - (self._weigh_lost(lost, at, found, proposal) if lost else 0.0)
        if isinstance(proposal.term.effect, TimeLocalEffect):
            trained = min(trained, window_log_odds(at, found, found.model.terms[-1], self.laboratory))
        log_odds = trained + self.weigh_held_out(at, found)
        confirmed = log_odds > self.find_threshold(proposal.term.effect, NAMED) and stands(found.model)
        asked = trained > NAMED
        if self.held_out is not None:  # what training does not ask for may cost no joint anything
            told = self.held_out.trained_change(at, found)
            confirmed &= told.harm <= 0.0 if asked else not told.losing
        confirmed = confirmed and self.agrees(at, found, [len(found.model.terms) - 1], asked=asked)
        covariance = found.posterior.covariance
        return Step(proposal.term.effect, log_odds, confirmed, at.model, found.model, covariance, trained), found

    @staticmethod
    def find_threshold(effect: Effect, usual: float) -> float:
        """Log odds from which an effect is there: the `usual` ones, and for a window in time more."""
        return UNASKED if isinstance(effect, TimeLocalEffect) else usual

    def _drop_impossible(self, at: Hypothesis) -> tuple[Hypothesis, list[Effect]]:
        """The same without what was found before its last effect and cannot be beside it, and what that is."""
        lost: list[Effect] = []
        while broken := [place for place in self.find_added_terms(at)[:-1] if not _is_possible(at.model, place)]:
            lost.append(at.model.terms[broken[0]].effect)
            at = self.settle_without(at, broken[0])
        return at, lost

    def _weigh_lost(self, lost: Sequence[Effect], at: Hypothesis, found: Hypothesis, proposal: Proposal) -> float:
        """Log odds that are lost with effects that a proposal makes impossible."""
        gained = self.laboratory.under(found, at.dependence, range(len(at.scales))).log_evidence - at.log_evidence
        return proposal.log_factor - gained + sum(self.prior_odds(effect, 0.0) for effect in lost)

    def agrees(self, without: Hypothesis, at: Hypothesis, places: Sequence[int], *, asked: bool = True) -> bool:
        """Whether held-out motion shows an effect, and training predicts its joints no worse.

        What training does not ask for has to be beyond doubt, also in the table that a user sees. That decides alone
        where the band has too few rows. No other motion shows a window of one recording.
        """
        term = at.model.terms[places[0]]
        effect = term.effect
        if self.held_out is None or (isinstance(effect, TimeLocalEffect) and not effect.is_shared(term.shape)):
            return True
        touched = effect.touched(len(at.scales))
        trained, least = self.held_out.trained_change(without, at), SHOWN if asked else UNASKED
        tells = trained.tells(touched)
        in_table = (asked and tells) or self.held_out.delivered_change(without, at).log_odds(touched) > least
        if trained.log_odds(touched) < 0.0 or not in_table:
            return False
        shown = self.held_out.change(without, at).log_odds(touched)
        if shown <= least and tells:
            shown = self.held_out.change(self._hold_friction(at, places), at).log_odds(touched)
        return shown > least or not tells

    def _hold_friction(self, at: Hypothesis, places: Sequence[int]) -> Hypothesis:
        """The hypothesis without an effect, friction's slopes as they are with it.

        Where they may move to what nobody believes, slopes and effect may predict the same.
        """
        laboratory, without = self.laboratory.with_slopes_of(at), at
        for place in reversed(places):
            without = laboratory.without_term(without, place)
        return laboratory.settle(without, at.model.terms[places[0]].effect.touched(len(at.scales)))

    def settle(self, at: Hypothesis, touched: Sequence[int]) -> Hypothesis:
        """The most probable parameters; the edges of a window, of which each has several, are looked for once more."""
        found, last = self.laboratory.settle(at, touched), len(at.model.terms) - 1
        term = found.model.terms[last]
        if not isinstance(term.effect, TimeLocalEffect):
            return found
        without = self.laboratory.without_term(found, last)
        signals = [without.model.signals(piece) for piece in self.laboratory.rows.observations]
        shape, size = self.proposer.zoom(term.effect, term.shape, found.sizes[last], without, signals)
        other = self.laboratory.with_term(without, replace(term, shape=shape), size)
        other = self.laboratory.settle(other, touched)
        compared = self.laboratory.under(other, found.dependence, touched)
        found = other if compared.log_evidence > found.log_evidence else found
        return self.find_twin(found, lambda each: self.laboratory.settle(each, touched))

    def settle_without(self, at: Hypothesis, place: int) -> Hypothesis:
        """The most probable parameters without one term."""
        touched = at.model.terms[place].effect.touched(len(at.scales))
        return self.laboratory.settle(self.laboratory.without_term(at, place), touched)

    def find_twin(self, at: Hypothesis, approach: Callable[[Hypothesis], Hypothesis]) -> Hypothesis:
        """The hypothesis, or one whose last effect is a window that training cannot tell from it, as held-out says."""
        last = len(at.model.terms) - 1
        term, best = at.model.terms[last], at
        if not isinstance(term.effect, TimeLocalEffect):
            return at
        without = self.laboratory.without_term(at, last)
        for sign, shape in term.effect.twins(term.shape, len(self.laboratory.rows.observations.names)):
            twin = replace(term, shape=shape, coefficients=sign * term.coefficients)
            other = approach(self.laboratory.with_term(without, twin, at.sizes[last]))
            best = other if self.weigh_held_out(best, other) > 0.0 else best
        return best

    def compare(self, at: Hypothesis, found: Hypothesis, touched: Collection[int]) -> float:
        """Log Bayes factor of a second hypothesis; what both predict alike of held-out motion says nothing."""
        gained = self.laboratory.under(found, at.dependence, touched).log_evidence - at.log_evidence
        return gained + self.weigh_held_out(at, found)

    def weigh_held_out(self, before: Hypothesis, after: Hypothesis) -> float:
        """Log odds that held-out motion adds to the second of two hypotheses."""
        return 0.0 if self.held_out is None else self.held_out.change(before, after).log_odds()

    def log_odds(self, proposal: Proposal) -> float:
        """Log odds of a proposal after training."""
        return proposal.log_factor + self.prior_odds(proposal.term.effect, proposal.unnamed)

    def prior_odds(self, effect: Effect, unnamed: float) -> float:
        """Log odds before the data, that one effect at one place is missing, whichever.

        Torque without a name needs odds of its own: something is missing at one of the joints, and in no catalogue.
        """
        if effect.is_expected:
            return 0.0
        sites = len({(each.id, each.joint) for each in self.proposer.effects})
        joints = self.laboratory.rows.observations.robot.joint_count
        return float(np.clip(unnamed, 0.0, CATALOGUED + np.log(joints)) - np.log(sites))


def _is_possible(model: ExtendedModel, place: int) -> bool:
    """Whether a term is still what its effect means."""
    term, joint = model.terms[place], model.terms[place].effect.joint
    return term.is_possible(None if joint is None else model.structure.terms[joint].k_v)


def stands(model: ExtendedModel) -> bool:
    """Whether the last term is what its effect means, without being held there."""
    term = model.terms[-1]
    return _is_possible(model, -1) and term.effect.is_consistent(term.coefficients, term.shape)


def find_places(at: Hypothesis) -> set[Place]:
    """Effects of a hypothesis, and where."""
    return {term.place for term in at.model.terms}
