"""How far a finding beside a larger one may be no more than an error of that one's curve.

A law of the catalogue has one formula, what an arm does has its own. What the formula leaves of it is as significant as
the recordings are long, and another law takes it up that is not there. Nothing in these recordings tells that from a
second effect but its size, and what it depends on: such errors are small parts of what the larger law explains, and
functions of the same quantities; only for a very small part is it chance that makes them look like functions of others.
Where effects meet at a joint, the one that alone explains most there leads; each other one has a share s of all that is
explained there, and is certain by s²/(s² + e²) with e = `SHAPE_ERROR`, or `LIKENESS` where it depends on something that
the leading one does not depend on. Below `HARDLY` it is no finding at all.

A gear of efficiency η takes τ/η where the motor drives and τ η where it is driven: (1/η + η)/2 of the load like a wrong
gain, (1/η - η)/2 of it like load friction. Load friction of another formula shows as both as well. Beside it a wrong
gain is doubted however large it is, with e = `EFFICIENCY`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.selection.choice import Place
from tauscope.effects import Effect
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.effects.torque_gain_error import TorqueGainError
from tauscope.recording.recording import Array

SHAPE_ERROR = 0.1
"""Share of what is explained at a joint that an error of the leading law's curve may well have; on arms that conceal
other formulas than the catalogue's it is 0.03 to 0.16 where another law is taken for it at all."""

LIKENESS = 0.02
"""The same for an effect that depends on what the leading one does not: along a motion all quantities are related."""

EFFICIENCY = 0.4
"""The same for a wrong gain beside load friction: on two arms whose load friction grows with the square of the load,
and nothing else is missing, it is 0.34 and 0.40; on a third it led."""

PLAIN = 0.9
"""Certainty from which a finding is not doubted."""

HARDLY = 0.1
"""Certainty below which a finding is none."""

WORTH_SHARING = 20.0
"""Energy that findings take off a joint's residual from which it counts as explained at all [noise variances]."""


@dataclass(frozen=True, eq=False)
class Standing:
    """A finding beside the others at its joints.

    behind : Effect or None
        the one that leads where its own share is largest; None where it leads itself, meets no other, or is plain
    """

    certainty: float = 1.0
    behind: Effect | None = None


LEADING = Standing()


Groups = Mapping[Place, Sequence[int]]
"""Effects and joints, and where in a model their terms stand."""


def groups_of(model: ExtendedModel) -> Groups:
    """The terms of each effect at each place: several orders of a periodic torque are one finding."""
    groups: dict[Place, list[int]] = {}
    for place, term in enumerate(model.terms):
        groups.setdefault((term.effect.id, term.effect.joint), []).append(place)
    return groups


def standings(nominal: Fit, fit: Fit, without: Sequence[Fit], fitter: Fitter, inflation: float) -> list[Standing]:
    """What each group of terms is beside the others."""
    joints, groups = len(fit.projection.residual), groups_of(fit.model)
    effects = [fit.model.terms[places[0]].effect for places in groups.values()]
    touched = [effect.touched(joints) for effect in effects]
    meeting = [sum(joint in own for own in touched) > 1 for joint in range(joints)]
    if not any(meeting):
        return [LEADING] * len(touched)
    after = fit.joint_energies
    explained = nominal.joint_energies - after
    counts = np.array(meeting) & (explained > WORTH_SHARING * inflation)
    leads = np.argmax([_alone(places, nominal, fit, fitter) for places in groups.values()], axis=0)
    found = []
    for number, effect in enumerate(effects):
        own = list(touched[number])
        gear = _gear_of(effect, effects)
        leader = (leads[own] == number).any() and gear is None
        if effect.is_expected or not counts[own].all() or leader:
            found.append(LEADING)
            continue
        shares = (without[number].joint_energies[own] - after[own]) / explained[own]
        share, joint = max(float(shares.max()), 0.0), own[int(shares.argmax())]
        leading = gear or effects[int(leads[joint])]
        error = EFFICIENCY if gear else SHAPE_ERROR if _is_of_the_same(effect, leading) else LIKENESS
        certainty = share**2 / (share**2 + error**2)
        found.append(Standing(certainty, leading if certainty < PLAIN else None))
    return found


def _gear_of(effect: Effect, others: Sequence[Effect]) -> Effect | None:
    """The load friction beside which a wrong gain may be a gear's efficiency; None for anything else."""
    if not isinstance(effect, TorqueGainError):
        return None
    friction = (each for each in others if isinstance(each, LoadDependentFriction))
    return next((each for each in friction if each.joint == effect.joint), None)


def _is_of_the_same(effect: Effect, leading: Effect) -> bool:
    """Whether an effect depends on nothing that a leading one does not depend on."""
    if effect.arguments is None or leading.arguments is None:
        return True
    return effect.arguments <= leading.arguments


def _alone(places: Sequence[int], nominal: Fit, fit: Fit, fitter: Fitter) -> Array:
    """Energy that one finding alone takes off each joint's residual, (n,)."""
    only = fitter.fit(with_terms(fit.model, [fit.model.terms[place] for place in places]))
    return nominal.joint_energies - only.joint_energies
