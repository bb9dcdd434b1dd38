"""From the nominal model to the most probable set of effects: one more, one less, until nothing helps."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cmp_to_key

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Place
from tauscope.diagnosis.search.found import Found, Rival, Step, Weighed
from tauscope.diagnosis.search.held_out import HeldOut
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.proposals import Looks, Proposal, Proposer
from tauscope.diagnosis.search.scoring import unnamed_log_odds
from tauscope.diagnosis.search.window import window_log_odds
from tauscope.effects import Effect, TimeLocalEffect
from tauscope.effects.computation import side_by_side

WEIGHED = 4
"""Rivals of a finding that are looked at, itself in another shape among them."""

MOST_EFFECTS = 12
"""Effects that are added at most."""

MOST_EXCHANGES = 4
"""Effects whose place another one takes at most: after each, all are weighed anew."""

NAMED = 3.0
"""Log odds from which an effect is named, and from which training asks for it: nineteen in twenty."""

SHOWN = float(np.log(3.0))
"""Log odds of held-out motion alone, of the joints that an effect touches, from which it is shown: three to one."""

UNASKED = 18.0
"""…of held-out motion where training does not ask for it, and of a window in time, which no other motion can refute:
three standard errors."""

CATALOGUED = 3.0
"""Log odds before the data that torque which is left out has a name: one in twenty laws is in no catalogue."""


@dataclass(frozen=True, eq=False)
class Search:
    """A search among effects on the same rows.

    `nominal`: model without what is looked for.
    `farther`: forms that say more than what they refine.
    """

    nominal: Hypothesis
    laboratory: Laboratory
    proposer: Proposer
    held_out: HeldOut | None
    farther: Sequence[Effect] = ()

    def run(self, before: Found | None = None) -> Found:
        """Add what makes the data most probable and held-out motion no worse, to what was found before."""
        at, steps, refused, exchanges = self.nominal, list[Step](), dict[Place, frozenset[int]](), 0
        if before is not None:
            at, steps = before.hypothesis, list(before.steps)
        exchanged, weighed, made, rivals = None, tuple[Weighed, ...](), MOST_EXCHANGES, dict[Place, set[Place]]()
        while made:
            at, tried = self._grow(at, refused)
            steps += tried
            at = self._refine(self._drop_harmful(at))
            if at is exchanged:
                break
            before, (exchanged, weighed, made) = at, self._exchange(at, MOST_EXCHANGES - exchanges, rivals)
            exchanges += made
            at = self._drop_superfluous(exchanged) if made else exchanged
            _forgive(refused, _find_changed(before, at))
        return Found(self.nominal, at, tuple(steps), weighed)

    def _find_added(self, at: Hypothesis) -> list[int]:
        """Places of the terms that the nominal model has not."""
        known = _places(self.nominal)
        return [place for place, term in enumerate(at.model.terms) if term.place not in known]

    def _grow(self, at: Hypothesis, refused: dict[Place, frozenset[int]]) -> tuple[Hypothesis, list[Step]]:
        """One more effect, and without those that it makes superfluous, until nothing helps.

        What was refused is tried again after something changed at its joints; all others are looked at anew where
        nothing helps any more.
        """
        steps, looks, is_anew = list[Step](), Looks(), True
        while len(self._find_added(at)) < MOST_EFFECTS:
            proposals = self.proposer.propose(at, _Wanted(_places(at), refused), looks=looks)
            tried, found = self._best(at, proposals, looks)
            steps += tried
            refused |= {step.place: _find_joints(step) for step in tried if not step.is_confirmed}
            if found is None and is_anew:
                break
            if found is None:
                looks, is_anew = Looks(), True
                continue
            before, at, is_anew = at, self._drop_superfluous(found), False
            changed = _find_changed(before, at)
            looks.forget(changed, len(at.scales))
            _forgive(refused, changed)
            refused |= dict.fromkeys(_places(found) - _places(at), frozenset())
        return at, steps

    def _refine(self, at: Hypothesis) -> Hypothesis:
        """Farther forms in the place of effects that they refine, where they are more probable."""
        for effect in self.farther:
            terms = at.model.terms
            own = (place for place in self._find_added(at) if terms[place].effect.joint == effect.joint)
            refined = next((place for place in own if terms[place].effect.id in effect.refines), None)
            if refined is not None:
                at = self._refine_by(effect, refined, at)
        return at

    def _refine_by(self, effect: Effect, place: int, at: Hypothesis) -> Hypothesis:
        """One of them in the place of a term, and of all others that it makes superfluous."""
        touched, without = effect.touched(len(at.scales)), self._settle_without(at, place)
        for proposal in Proposer(self.laboratory, [effect]).propose(without, lambda _: True):
            found = self._settle(self._add(without, proposal), touched)
            found = self._drop_superfluous(found)
            if self._compare(at, found, touched) > 0.0 and _stands(found.model):
                return found
        return at

    def _exchange(
        self, at: Hypothesis, most: int, rivals: dict[Place, set[Place]]
    ) -> tuple[Hypothesis, tuple[Weighed, ...], int]:
        """Each effect weighed beside all others, a more probable one in its place, and none that does not hold.

        `rivals`: of each effect that was weighed before, to which this adds.
        """
        groups, exchanges, stale, refused, gone = _groups(at.model), 0, set[Place](), set[Place](), set[Place]()
        found = side_by_side(lambda own: self._weigh(at, groups[own], rivals.get(own)), groups)
        weighed = dict(zip(groups, found, strict=True))
        while weighed:
            rivals |= {own: {each.place for each in found.proposals} for own, found in weighed.items()}
            weighed = {each: found.refuse(refused) for each, found in weighed.items()}
            behind = [each for each, found in weighed.items() if found.is_behind]
            own: Place | None = next(iter(stale), None)
            if behind and exchanges < most:
                own = max(behind, key=lambda each: weighed[each].lead)
            if own is None:
                added = {each: found for each, found in weighed.items() if each not in _places(self.nominal)}
                doubtful: list[Place] = [each for each, found in added.items() if not self._holds(at, found)]
                if not doubtful:
                    break
                least = min(doubtful, key=lambda each: weighed[each].log_odds)
                at = weighed.pop(least).without
                stale = set(weighed)
                continue
            if own in stale:
                stale.remove(own)
                weighed[own] = self._weigh(at, _groups(at.model)[own], rivals[own])
                continue
            rival = weighed[own].rivals[0].place
            other = None if rival in gone else self._try_rival(at, weighed[own])
            if other is None:
                refused.add(rival)
                continue
            exchanges += 1
            gone.add(own)  # what another one took the place of does not come back
            at, new = other, other.model.terms[-1].place
            groups = _groups(at.model)
            stale = set(groups) - {new}
            weighed = {each: weighed[each] for each in stale} | {new: self._weigh(at, groups[new])}
        findings = (each.refuse({own}) for own, each in weighed.items() if each.log_odds > self._least(at, each))
        return at, tuple(findings), exchanges

    def _holds(self, at: Hypothesis, weighed: Weighed) -> bool:
        """Whether an effect is as probable beside all others, and as visible, as one that is added has to be."""
        return weighed.log_odds > 0.0 and self._agrees(weighed.without, at, weighed.places)

    def _least(self, at: Hypothesis, weighed: Weighed) -> float:
        """Log odds from which an effect is a finding: one that every arm has must stand out."""
        return CATALOGUED if at.model.terms[weighed.places[0]].effect.is_expected else 0.0

    def _try_rival(self, at: Hypothesis, weighed: Weighed) -> Hypothesis | None:
        """The hypothesis with the best rival in the place of an effect, where that is more probable.

        Training alone, too, has to predict their joints no worse with it.
        """
        rival, own = weighed.rivals[0].term.effect, at.model.terms[weighed.places[0]].effect
        touched = {*rival.touched(len(at.scales)), *own.touched(len(at.scales))}
        proposal = next(each for each in weighed.proposals if each.term.effect is rival)
        step, found = self._try(weighed.without, proposal)
        gained = self._compare(at, found, touched)
        gained += self._prior_odds(rival, 0.0) - self._prior_odds(own, 0.0) - (CATALOGUED if rival is own else 0.0)
        told = 0.0 if self.held_out is None else self.held_out.trained_change(at, found).log_odds(sorted(touched))
        return found if step.is_confirmed and gained > 0.0 and told >= 0.0 else None

    def _compare(self, at: Hypothesis, found: Hypothesis, touched: Collection[int]) -> float:
        """Log Bayes factor of a second hypothesis; what both predict alike of held-out motion says nothing."""
        gained = self.laboratory.under(found, at.dependence, touched).log_evidence - at.log_evidence
        return gained + self._told(at, found)

    def _told(self, before: Hypothesis, after: Hypothesis) -> float:
        """Log odds that held-out motion adds to the second of two hypotheses."""
        return 0.0 if self.held_out is None else self.held_out.change(before, after).log_odds()

    def _weigh(self, at: Hypothesis, places: tuple[int, ...], known: Collection[Place] | None = None) -> Weighed:
        """An effect's odds against none and against others in its place: all, or those that are known to compete."""
        without, touched = at, at.model.terms[places[0]].effect.touched(len(at.scales))
        for place in reversed(places):
            without = self.laboratory.without_term(without, place)
        without = self.laboratory.settle(without, touched)
        before = self.laboratory.tune(self.laboratory.under(without, at.dependence, touched), touched)
        effect, shared = at.model.terms[places[0]].effect, set(touched)
        lasts = not isinstance(effect, TimeLocalEffect)
        trained = at.log_evidence - before.log_evidence + self._prior_odds(effect, unnamed_log_odds(before))
        log_odds = trained + self._told(without, at)
        own, may_be_added = (effect.id, effect.joint), _Wanted(_places(without), ())

        def competes(each: Effect) -> bool:
            place = each.id, each.joint
            is_new = may_be_added(each) and not (each.repeats and place == own)  # itself in another shape, too
            is_like = lasts != isinstance(each, TimeLocalEffect)
            is_known = known is None or place in known
            return is_known and is_new and is_like and not shared.isdisjoint(each.touched(len(at.scales)))

        proposals = self.proposer.propose(without, competes, WEIGHED, own)
        rivals = []
        for proposal in (each for each in proposals if self._log_odds(each) > 0.0):
            nearer = self._add(without, proposal)
            if proposal.place == own:  # two shapes of one law compare only where each is at its best
                nearer = self._settle(nearer, touched)
                odds = log_odds + self._compare(at, nearer, touched) - CATALOGUED
            else:
                nearer = self.laboratory.approach(nearer)
                odds = log_odds - trained + self._log_odds(proposal) + self._told(at, nearer)
            rivals.append(Rival(nearer.model.terms[-1], nearer.model, odds))
        rivals.sort(key=lambda each: -each.log_odds)
        return Weighed(places, without, log_odds, tuple(rivals), tuple(proposals))

    def _drop_harmful(self, at: Hypothesis) -> Hypothesis:
        """The same without the effects at whose cost joints are predicted worse than by the nominal model."""
        while self.held_out is not None and (added := self._find_added(at)):
            if self.held_out.trained_change(self.nominal, at).harm <= 0.0:
                break
            others = [self._settle_without(at, place) for place in added]
            harms = [self.held_out.trained_change(self.nominal, each).harm for each in others]
            at = others[int(np.argmin(harms))]
        return at

    def _settle_without(self, at: Hypothesis, place: int) -> Hypothesis:
        touched = at.model.terms[place].effect.touched(len(at.scales))
        return self.laboratory.settle(self.laboratory.without_term(at, place), touched)

    def _best(
        self, at: Hypothesis, proposals: Sequence[Proposal], looks: Looks
    ) -> tuple[list[Step], Hypothesis | None]:
        """The most probable proposal that held-out motion does not contradict, after those that it does."""
        refusals, untried = list[Step](), list(self.farther)
        renewed = (self.proposer.renew(each, at, looks) for each in self._rank(at, proposals))
        for proposal in (each for each in renewed if each is not None):
            step, found = self._try(at, proposal)
            name, joint = proposal.place
            forms = [each for each in untried if name in each.refines and each.joint == joint]
            if forms and not step.is_confirmed and not _stands(found.model):  # its own law cannot be
                untried = [each for each in untried if each not in forms]
                for form in Proposer(self.laboratory, forms).propose(at, lambda _: True):
                    step, found = self._try(at, form)
                    if step.is_confirmed:
                        break
            if step.is_confirmed:
                return [*refusals, step], found
            refusals.append(step)
        return refusals, None

    def _rank(self, at: Hypothesis, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Proposals that training asks for, or held-out motion alone, the most probable after all motion first."""
        asked = [each for each in proposals if self._log_odds(each) > 0.0]
        if self.held_out is None or len(asked) == len(proposals) < 2:
            return asked
        held_out = self.held_out
        approached = side_by_side(lambda each: self.laboratory.approach(self._add(at, each)), proposals)
        nearer = {id(each): found for each, found in zip(proposals, approached, strict=True)}
        for each in proposals:
            if each not in asked and held_out.change(at, nearer[id(each)]).log_odds() > UNASKED:
                asked.append(each)

        def compare(one: Proposal, other: Proposal) -> float:
            """Log odds of the other. What both predict alike says nothing: they are compared with each other."""
            found = held_out.change(nearer[id(one)], nearer[id(other)]).log_odds()
            return found + self._log_odds(other) - self._log_odds(one)

        return sorted(asked, key=cmp_to_key(lambda one, other: int(np.sign(compare(one, other)))))

    def _add(self, at: Hypothesis, proposal: Proposal) -> Hypothesis:
        return self.laboratory.with_term(self.laboratory.paint(at, proposal.found), proposal.term, proposal.size)

    def _try(self, at: Hypothesis, proposal: Proposal) -> tuple[Step, Hypothesis]:
        """A proposal in the model, and what held-out motion says of it."""
        touched = proposal.term.effect.touched(len(at.scales))
        found, lost = self._drop_impossible(self._settle(self._add(at, proposal), touched))
        trained = self._log_odds(proposal) - (self._weigh_lost(lost, at, found, proposal) if lost else 0.0)
        passes = isinstance(proposal.term.effect, TimeLocalEffect)
        if passes:
            trained = min(trained, window_log_odds(at, found, found.model.terms[-1], self.laboratory))
        log_odds = trained + self._told(at, found)
        confirmed = log_odds > (UNASKED if passes else NAMED) and _stands(found.model)
        asked = trained > NAMED
        if self.held_out is not None:  # what training does not ask for may cost no joint anything
            told = self.held_out.trained_change(at, found)
            confirmed &= told.harm <= 0.0 if asked else not told.losing
        confirmed = confirmed and self._agrees(at, found, [len(found.model.terms) - 1], asked=asked)
        covariance = found.posterior.covariance
        return Step(proposal.term.effect, log_odds, confirmed, at.model, found.model, covariance, trained), found

    def _drop_impossible(self, at: Hypothesis) -> tuple[Hypothesis, list[Effect]]:
        """The same without what was found before its last effect and cannot be beside it, and what that is."""
        lost: list[Effect] = []
        while broken := [place for place in self._find_added(at)[:-1] if not _is_possible(at.model, place)]:
            lost.append(at.model.terms[broken[0]].effect)
            at = self._settle_without(at, broken[0])
        return at, lost

    def _weigh_lost(self, lost: Sequence[Effect], at: Hypothesis, found: Hypothesis, proposal: Proposal) -> float:
        """Log odds that are lost with effects that a proposal makes impossible."""
        gained = self.laboratory.under(found, at.dependence, range(len(at.scales))).log_evidence - at.log_evidence
        return proposal.log_factor - gained + sum(self._prior_odds(effect, 0.0) for effect in lost)

    def _agrees(self, without: Hypothesis, at: Hypothesis, places: Sequence[int], *, asked: bool = True) -> bool:
        """Whether held-out motion shows an effect, and training predicts its joints no worse.

        What training does not ask for has to be beyond doubt, also in the table that a user sees. No other motion shows
        a window in time.
        """
        effect = at.model.terms[places[0]].effect
        if self.held_out is None or isinstance(effect, TimeLocalEffect):
            return True
        touched = effect.touched(len(at.scales))
        if self.held_out.trained_change(without, at).log_odds(touched) < 0.0:
            return False
        if not asked and self.held_out.delivered_change(without, at).log_odds(touched) < UNASKED:
            return False
        least = SHOWN if asked else UNASKED
        shown = self.held_out.change(without, at).log_odds(touched)
        if shown <= least:
            shown = self.held_out.change(self._hold_friction(at, places), at).log_odds(touched)
        return shown > least

    def _hold_friction(self, at: Hypothesis, places: Sequence[int]) -> Hypothesis:
        """The hypothesis without an effect, friction's slopes as they are with it.

        Where they may move to what nobody believes, slopes and effect may predict the same.
        """
        laboratory, without = self.laboratory.with_slopes_of(at), at
        for place in reversed(places):
            without = laboratory.without_term(without, place)
        return laboratory.settle(without, at.model.terms[places[0]].effect.touched(len(at.scales)))

    def _settle(self, at: Hypothesis, touched: Sequence[int]) -> Hypothesis:
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
        return self._turn(found, touched)

    def _turn(self, at: Hypothesis, touched: Sequence[int]) -> Hypothesis:
        """The same effect outside its window where held-out motion says so: training cannot tell which of the two."""
        last = len(at.model.terms) - 1
        term = at.model.terms[last]
        outside = term.effect.outside(term.shape) if isinstance(term.effect, TimeLocalEffect) else None
        if outside is None:
            return at
        turned = replace(term, shape=outside, coefficients=-term.coefficients)
        other = self.laboratory.with_term(self.laboratory.without_term(at, last), turned, at.sizes[last])
        other = self.laboratory.settle(other, touched)
        return other if self._told(at, other) > 0.0 else at

    def _log_odds(self, proposal: Proposal) -> float:
        return proposal.log_factor + self._prior_odds(proposal.term.effect, proposal.unnamed)

    def _prior_odds(self, effect: Effect, unnamed: float) -> float:
        """Log odds before the data, that one effect at one place is missing, whichever.

        Torque without a name needs odds of its own: something is missing at one of the joints, and in no catalogue.
        """
        if effect.is_expected:
            return 0.0
        sites = len({(each.id, each.joint) for each in self.proposer.effects})
        joints = self.laboratory.rows.observations.robot.joint_count
        return float(np.clip(unnamed, 0.0, CATALOGUED + np.log(joints)) - np.log(sites))

    def _drop_superfluous(self, at: Hypothesis) -> Hypothesis:
        """The same without effects that the later ones made superfluous."""
        while True:
            places = [place for place in self._find_added(at) if place < len(at.model.terms) - 1]
            gains = side_by_side(lambda place, at=at: self._weigh_absence(at, place), places)
            pairs = sorted(zip(gains, places, strict=True), reverse=True)
            others = (self._leave_out(at, place, gain) for gain, place in pairs if gain > CATALOGUED)
            other = next((each for each in others if each is not None), None)
            if other is None:
                return at
            at = other

    def _leave_out(self, at: Hypothesis, place: int, gain: float) -> Hypothesis | None:
        """The hypothesis without an effect; None where held-out motion asks for it."""
        without = self._settle_without(at, place)
        return without if gain + self._told(at, without) > CATALOGUED else None

    def _weigh_absence(self, at: Hypothesis, place: int) -> float:
        """Log posterior odds that an effect is not there."""
        term, own = at.model.terms[place], at.model.term_places()[place]
        effect, steps = term.effect, np.zeros(term.size)
        steps[: len(term.coefficients)] = -term.coefficients
        reduced = at.linear.without(np.arange(own.start, own.stop), steps)
        scales = reduced.most_probable(at.scales, effect.touched(len(at.scales)))
        return replace(at, linear=reduced, scales=scales).log_evidence - at.log_evidence - self._prior_odds(effect, 0.0)


def _is_possible(model: ExtendedModel, place: int) -> bool:
    """Whether a term is still what its effect means."""
    term, joint = model.terms[place], model.terms[place].effect.joint
    return term.is_possible(None if joint is None else model.structure.terms[joint].k_v)


def _stands(model: ExtendedModel) -> bool:
    """Whether the last term is what its effect means, without being held there."""
    term = model.terms[-1]
    return _is_possible(model, -1) and term.effect.is_consistent(term.coefficients, term.shape)


@dataclass(frozen=True)
class _Wanted:
    """Whether an effect may be added: none a second time, but what repeats, and none that was refused."""

    present: set[Place]
    refused: Collection[Place]

    def __call__(self, effect: Effect) -> bool:
        place = effect.id, effect.joint
        return place not in self.refused and (effect.repeats or not self._is_present(effect))

    def _is_present(self, effect: Effect) -> bool:
        """Whether it is there at its joint, or at the whole arm: an effect of all joints and one of each are alike."""
        joints = {joint for name, joint in self.present if name == effect.id}
        return bool(joints) if effect.joint is None else bool(joints & {None, effect.joint})


def _find_joints(step: Step) -> frozenset[int]:
    """Joints at which a step's effect acts."""
    return frozenset(step.effect.touched(step.after.structure.robot.joint_count))


def _find_changed(before: Hypothesis, after: Hypothesis) -> set[int]:
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


def _groups(model: ExtendedModel) -> dict[Place, tuple[int, ...]]:
    """Places of the terms of each effect and joint among all."""
    groups: dict[Place, list[int]] = {}
    for number, term in enumerate(model.terms):
        groups.setdefault(term.place, []).append(number)
    return {place: tuple(each) for place, each in groups.items()}


def _places(at: Hypothesis) -> set[Place]:
    """Effects of a hypothesis, and where."""
    return {term.place for term in at.model.terms}
