"""Findings that only stand in for something that the catalogue does not have.

Several weak likenesses of an unknown effect each take a part of it and pass every test but one: together they leave
most of it, where a finding that is what it says leaves nothing but noise; how much is left can only be told where the
noise is known from repetitions. A window in time can stand in for anything that is strong for a while: what happens
once explains its joints wholly, or more than all that it leaves, noise included; else it is something else.
"""

from collections import Counter
from collections.abc import Iterable, Sequence

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.selection.choice import Choice, Place, place_of
from tauscope.effects import TimeLocalEffect, effect_class
from tauscope.recording.recording import Array

EXPLAINED = 0.6
"""Share of a joint's excess residual that findings have to explain between them where they leave more than noise."""

SPARED = 0.2
"""Share of what is explained at all joints of a finding, up to which it is not there for what one of them leaves."""

TELLING = 3
"""Orders of one periodic effect from which it shows whether more of them can ever explain as much."""

CROWDED = 3
"""Different effects at one joint beside which more orders than those are no physics: such a series fits anything."""

FULL = 4
"""Different effects at one joint beyond which nothing is looked for there."""


def weak_likenesses(nominal: Fit, fit: Fit, choices: Sequence[Choice], observations: Observations) -> list[int]:
    """Places of the choices at joints where all of them together leave most of what there is to explain.

    With fewer of them they leave more: no other choice has to be dropped before that is known.
    """
    before, after = (lack_of_fit(each, observations, pure_error=True) for each in (nominal, fit))
    return _weak(choices, before, after, nominal.joint_energies - fit.joint_energies)


def proxies(
    nominal: Fit, fit: Fit, choices: Sequence[Choice], observations: Observations, *, pure_error: bool
) -> list[int]:
    """Places of the choices that only stand in for something else."""
    if not choices:
        return []
    after = lack_of_fit(fit, observations, pure_error=pure_error)
    if not any(after.significant):
        return []
    before = lack_of_fit(nominal, observations, pure_error=pure_error)
    unexplained = {joint for joint, left in enumerate(after.significant) if left}
    explained = nominal.joint_energies - fit.joint_energies
    found = set(_weak(choices, before, after, explained)) if pure_error else set()
    for place, choice in enumerate(choices):
        option, joints = choice.options[0], _joints(choice, before)
        doubtful = isinstance(option.candidate.effect, TimeLocalEffect) and joints & unexplained
        if doubtful and option.gain < _left(fit, joints):
            found.add(place)
    return sorted(found)


def _weak(choices: Sequence[Choice], before: LackOfFit, after: LackOfFit, explained: Array) -> list[int]:
    """Places of the choices at joints where most of what was missing `before` is left `after` them.

    One of several joints at which nearly all is explained elsewhere is there for that, whatever else one of them has.
    """
    weak = {
        joint
        for joint, left in enumerate(after.significant)
        if left and after.excess[joint] > (1.0 - EXPLAINED) * before.excess[joint]
    }

    def is_weak(choice: Choice) -> bool:
        touched = choice.options[0].candidate.effect.touched(len(before.significant))
        there = float(sum(explained[joint] for joint in weak.intersection(touched)))
        return _joints(choice, before) <= weak and there >= SPARED * float(explained[list(touched)].sum())

    return [place for place, choice in enumerate(choices) if is_weak(choice)]


def _joints(choice: Choice, before: LackOfFit) -> set[int]:
    """Joints that a choice touches; of several, those where anything was wrong: a likeness may spare the others."""
    joints = set(choice.options[0].candidate.effect.touched(len(before.significant)))
    if len(joints) > 1:
        joints = {joint for joint in joints if before.significant[joint]} or joints
    return joints


def hopeless(
    nominal: Fit, fit: Fit, choices: Sequence[Choice], observations: Observations, most_repeats: int
) -> set[Place]:
    """Effects of several orders that would leave most of what there is to explain with all orders that they may have.

    None of those to come explains more than the last one did: the best comes first.
    """
    gains: dict[Place, list[float]] = {}
    for choice in choices:
        gains.setdefault(place_of(choice.options[0].candidate), []).append(choice.options[0].gain)
    found = set()
    for (effect, joint), own in gains.items():
        if len(own) < TELLING or joint is None:
            continue
        noise = observations.noise[joint].share * len(fit.projection.residual[joint])
        before, after = (max(each.joint_energies[joint] - noise, 0.0) for each in (nominal, fit))
        if after - (most_repeats - len(own)) * own[-1] > (1.0 - EXPLAINED) * before:
            found.add((effect, joint))
    return found


def endless(choices: Sequence[Choice]) -> set[Place]:
    """Effects that several orders of make a series, at joints where it is one of many things that were found."""
    orders = Counter(place_of(choice.options[0].candidate) for choice in choices)
    crowded = _joints_of(orders, CROWDED)
    return {(effect, joint) for (effect, joint), count in orders.items() if count >= TELLING and joint in crowded}


def full(choices: Sequence[Choice]) -> set[int]:
    """Joints at which so many different effects were found that what is left there is of no catalogue."""
    return _joints_of({place_of(choice.options[0].candidate) for choice in choices}, FULL)


def _joints_of(places: Iterable[Place], least: int) -> set[int]:
    """Joints that have at least so many different effects."""
    counts = Counter(joint for effect, joint in places if joint is not None and not effect_class(effect).is_expected)
    return {joint for joint, count in counts.items() if count >= least}


def _left(fit: Fit, joints: set[int]) -> float:
    """All that a model leaves at some joints, noise included: what explains more is there, whatever else is."""
    return sum(float(fit.projection.residual[joint] @ fit.projection.residual[joint]) for joint in joints)
