"""Findings that only stand in for something that the catalogue does not have.

Several weak likenesses of an unknown effect each take a part of it and pass every test but one: together they leave
most of it, where a finding that is what it says leaves nothing but noise; how much is left can only be told where the
noise is known from repetitions. A window in time can stand in for anything that is strong for a while: what happens
once explains its joints wholly, or more than all that it leaves, noise included; else it is something else.
"""

from collections.abc import Sequence

from service.diagnosis.catalogue import TimeLocalEffect
from service.diagnosis.fitting.fit import Fit
from service.diagnosis.fitting.lack_of_fit import lack_of_fit
from service.diagnosis.observations.observations import Observations
from service.diagnosis.selection.choice import Choice, Place, place_of

EXPLAINED = 0.6
"""Share of a joint's excess residual that findings have to explain between them where they leave more than noise."""

TELLING = 3
"""Orders of one periodic effect from which it shows whether more of them can ever explain as much."""


def proxies(
    nominal: Fit, fit: Fit, choices: Sequence[Choice], observations: Observations, *, pure_error: bool
) -> list[int]:
    """Places of the choices that are at joints where the model leaves most of what there is to explain.

    Parameters
    ----------
    nominal, fit : Fit
        models without and with all choices
    choices : sequence of Choice
        one a term of `fit`
    observations : Observations
        the rows that both were fitted to
    pure_error : bool
        whether their noise is known from repetitions
    """
    if not choices:
        return []
    after = lack_of_fit(fit, observations, pure_error=pure_error)
    if not any(after.significant):
        return []
    before = lack_of_fit(nominal, observations, pure_error=pure_error)
    weak = {
        joint
        for joint, left in enumerate(after.significant)
        if pure_error and left and after.excess[joint] > (1.0 - EXPLAINED) * before.excess[joint]
    }
    unexplained = {joint for joint, left in enumerate(after.significant) if left}
    found = []
    for place, choice in enumerate(choices):
        effect = choice.options[0].candidate.effect
        joints = set(effect.touched(len(after.excess)))
        if len(joints) > 1:  # where anything was wrong: a likeness may spare the others
            joints = {joint for joint in joints if before.significant[joint]} or joints
        doubtful = isinstance(effect, TimeLocalEffect) and joints & unexplained
        if joints <= weak or (doubtful and choice.options[0].gain < _left(fit, joints)):
            found.append(place)
    return found


def hopeless(
    nominal: Fit, fit: Fit, choices: Sequence[Choice], observations: Observations, most_repeats: int
) -> set[Place]:
    """Effects of several orders that would leave most of what there is to explain with all orders that they may have.

    None of those to come explains more than the last one did: the best comes first.

    Parameters
    ----------
    nominal, fit : Fit
        models without and with all choices so far
    choices : sequence of Choice
        one a term of `fit`
    observations : Observations
        the rows that both were fitted to, their noise known from repetitions
    most_repeats : int
        orders that an effect may have
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


def _left(fit: Fit, joints: set[int]) -> float:
    """All that a model leaves at some joints, noise included: what explains more is there, whatever else is."""
    return sum(float(fit.projection.residual[joint] @ fit.projection.residual[joint]) for joint in joints)
