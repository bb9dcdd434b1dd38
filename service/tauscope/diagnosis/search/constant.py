"""What may be taken for a constant torque at a joint: friction that is larger one way, a spring far from its rest."""

from collections.abc import Sequence
from dataclasses import replace

from tauscope.diagnosis.search.found import Rival
from tauscope.diagnosis.search.from_recordings import Searched
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.proposals import Proposal, Proposer

CERTAIN = 1e12  # factor by which a constant that is not there is believed more precisely


def weigh_constant(searched: Searched, joint: int) -> tuple[float, tuple[Rival, ...]]:
    """Log odds of a joint's constant, and its rivals, against a model with neither."""
    final, laboratory = searched.found.hypothesis, searched.laboratory
    place = final.model.structure.coefficient(joint, "offset")
    if place is None:
        return 0.0, ()
    laboratory = _hold(laboratory, place - len(laboratory.prior.bodies.base))
    parameters = final.model.parameters.copy()
    parameters[place] = 0.0
    without = laboratory.at(replace(final.model, parameters=parameters), final.sizes, final.scales, final.dependence)
    without = laboratory.settle(without, [joint])
    beside = laboratory.tune(laboratory.under(without, final.dependence, [joint]), [joint])
    effects = [each for each in searched.effects if each.joint == joint]
    proposals = Proposer(laboratory, effects).propose(without, lambda effect: not effect.is_expected)
    return final.log_evidence - beside.log_evidence, _rivals(laboratory, without, proposals, place)


def _hold(laboratory: Laboratory, place: int) -> Laboratory:
    """The same where a friction coefficient is believed to be zero."""
    friction = laboratory.prior.friction.copy()
    friction[place, place] *= CERTAIN
    return replace(laboratory, prior=replace(laboratory.prior, friction=friction))


def _rivals(
    laboratory: Laboratory, without: Hypothesis, proposals: Sequence[Proposal], absent: int
) -> tuple[Rival, ...]:
    found = []
    for proposal in proposals:
        painted = laboratory.paint(without, proposal.found)
        model = laboratory.approach(laboratory.with_term(painted, proposal.term, proposal.size)).model
        found.append(Rival(model.terms[-1], model, proposal.log_factor, absent))
    return tuple(sorted(found, key=lambda each: -each.log_odds))
