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
from service.diagnosis.selection.choice import Choice

EXPLAINED = 0.6
"""Share of a joint's excess residual that findings have to explain between them where they leave more than noise."""


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


def _left(fit: Fit, joints: set[int]) -> float:
    """All that a model leaves at some joints, noise included: what explains more is there, whatever else is."""
    return sum(float(fit.projection.residual[joint] @ fit.projection.residual[joint]) for joint in joints)
