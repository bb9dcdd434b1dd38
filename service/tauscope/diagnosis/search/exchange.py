"""Each effect beside all others: a more probable one takes its place, and none stays that does not hold."""

from collections.abc import Collection

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Place
from tauscope.diagnosis.search.found import Rival, Weighed
from tauscope.diagnosis.search.gates import CATALOGUED, Gates, find_places
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.diagnosis.search.proposals import Wanted
from tauscope.diagnosis.search.scoring import unnamed_log_odds
from tauscope.effects import Effect, TimeLocalEffect
from tauscope.effects.computation import side_by_side

WEIGHED = 4  # rivals of a finding that are looked at, itself in another shape among them


class Exchange:
    """Exchanges among the effects of hypotheses.

    `gone`: effects whose place another one took; they do not come back, so that there is an end.
    """

    def __init__(self, gates: Gates) -> None:
        self.gates, self.gone = gates, set[Place]()
        self._rivals: dict[Place, set[Place]] = {}  # of each effect that was ever weighed

    def run(self, at: Hypothesis) -> tuple[Hypothesis, tuple[Weighed, ...]]:
        """Exchange and drop effects until each is the most probable in its place, and the findings among them."""
        groups = _groups(at.model)
        found = side_by_side(lambda own: self._weigh(at, groups[own], self._rivals.get(own)), groups)
        weighed, stale = dict(zip(groups, found, strict=True)), set[Place]()
        refused = set[Place]()
        while weighed:
            self._rivals |= {own: {each.place for each in found.proposals} for own, found in weighed.items()}
            weighed = {own: found.refuse(refused) for own, found in weighed.items()}
            behind = [own for own, found in weighed.items() if found.is_behind]
            own: Place | None = next(iter(stale), None)
            if behind:
                own = max(behind, key=lambda each: weighed[each].lead)
            if own is None:
                doubtful = self._find_doubtful(at, weighed)
                if doubtful is None:
                    break
                at, stale = weighed.pop(doubtful).without, set(weighed)
            elif own in stale:
                stale.remove(own)
                weighed[own] = self._weigh(at, _groups(at.model)[own], self._rivals[own])
            else:
                other, gained = self._try_rival(at, weighed[own])
                if other is None:
                    refused.add(weighed[own].rivals[0].place)
                elif gained > 0.0:
                    self.gone.add(own)
                    at, new = other, other.model.terms[-1].place
                    groups = _groups(at.model)
                    stale = set(groups) - {new}
                    weighed = {each: weighed[each] for each in stale} | {new: self._weigh(at, groups[new])}
                else:
                    weighed[own] = weighed[own].compare_best(gained)
        findings = (each.refuse({own}) for own, each in weighed.items() if each.log_odds > _find_least(at, each))
        return at, tuple(findings)

    def _find_doubtful(self, at: Hypothesis, weighed: dict[Place, Weighed]) -> Place | None:
        """The least probable effect of those that are less probable, or less visible, than an added one has to be."""
        added = {own: each for own, each in weighed.items() if own not in find_places(self.gates.nominal)}
        doubtful = [
            own
            for own, each in added.items()
            if each.log_odds <= self.gates.find_threshold(at.model.terms[each.places[0]].effect, 0.0)
            or not self.gates.agrees(each.without, at, each.places)
        ]
        return min(doubtful, key=lambda own: weighed[own].log_odds, default=None)

    def _try_rival(self, at: Hypothesis, weighed: Weighed) -> tuple[Hypothesis | None, float]:
        """The hypothesis with the best rival in an effect's place, None where it cannot be, and the log odds it gains.

        It gains none where training alone predicts their joints worse with it.
        """
        gates = self.gates
        if weighed.rivals[0].place in self.gone:
            return None, 0.0
        rival, own = weighed.rivals[0].term.effect, at.model.terms[weighed.places[0]].effect
        touched = {*rival.touched(len(at.scales)), *own.touched(len(at.scales))}
        proposal = next(each for each in weighed.proposals if each.term.effect is rival)
        step, found = gates.attempt(weighed.without, proposal)
        if not step.is_confirmed:
            return None, 0.0
        gained = gates.compare(at, found, touched)
        gained += gates.prior_odds(rival, 0.0) - gates.prior_odds(own, 0.0) - (CATALOGUED if rival is own else 0.0)
        told = 0.0 if gates.held_out is None else gates.held_out.trained_change(at, found).log_odds(sorted(touched))
        return found, gained if gained + told > 0.0 else min(gained, 0.0)

    def _weigh(self, at: Hypothesis, places: tuple[int, ...], known: Collection[Place] | None = None) -> Weighed:
        """An effect's odds against none and against others in its place: all, or those that are known to compete."""
        gates, laboratory = self.gates, self.gates.laboratory
        without, touched = at, at.model.terms[places[0]].effect.touched(len(at.scales))
        for place in reversed(places):
            without = laboratory.without_term(without, place)
        without = laboratory.settle(without, touched)
        before = laboratory.tune(laboratory.under(without, at.dependence, touched), touched)
        effect, shared = at.model.terms[places[0]].effect, set(touched)
        lasts = not isinstance(effect, TimeLocalEffect)
        trained = at.log_evidence - before.log_evidence + gates.prior_odds(effect, unnamed_log_odds(before))
        log_odds = trained + gates.weigh_held_out(without, at)
        own, may_be_added = (effect.id, effect.joint), Wanted(find_places(without), ())

        def competes(each: Effect) -> bool:
            place = each.id, each.joint
            is_new = may_be_added(each) and not (each.repeats and place == own)  # itself in another shape, too
            is_like = lasts != isinstance(each, TimeLocalEffect)
            is_known = known is None or place in known
            return is_known and is_new and is_like and not shared.isdisjoint(each.touched(len(at.scales)))

        proposals = gates.proposer.propose(without, competes, WEIGHED, own)
        rivals = []
        for proposal in (each for each in proposals if gates.log_odds(each) > 0.0):
            nearer = gates.add(without, proposal)
            if proposal.place == own:  # two shapes of one law compare only where each is at its best
                nearer = gates.settle(nearer, touched)
                odds = log_odds + gates.compare(at, nearer, touched) - CATALOGUED
            else:
                nearer = gates.find_twin(laboratory.approach(nearer), laboratory.approach)
                odds = log_odds - trained + gates.log_odds(proposal) + gates.weigh_held_out(at, nearer)
            rivals.append(Rival(nearer.model.terms[-1], nearer.model, odds))
        rivals.sort(key=lambda each: -each.log_odds)
        return Weighed(places, without, log_odds, tuple(rivals), tuple(proposals))


def _find_least(at: Hypothesis, weighed: Weighed) -> float:
    """Log odds from which an effect is a finding: one that every arm has must stand out."""
    return CATALOGUED if at.model.terms[weighed.places[0]].effect.is_expected else 0.0


def _groups(model: ExtendedModel) -> dict[Place, tuple[int, ...]]:
    """Places of the terms of each effect and joint among all."""
    groups: dict[Place, list[int]] = {}
    for number, term in enumerate(model.terms):
        groups.setdefault(term.place, []).append(number)
    return {place: tuple(each) for place, each in groups.items()}
