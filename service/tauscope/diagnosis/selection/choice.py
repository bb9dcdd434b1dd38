"""Effects in the model, fitted, and the choice among them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Candidate
from tauscope.diagnosis.selection.confirmation import Confirmation

CERTAIN = 3.0
"""Standard errors by which a friction coefficient must be negative to be impossible."""

Place = tuple[str, int | None]
"""Effect id and joint index, from 0; None for the whole arm."""


@dataclass(frozen=True, eq=False)
class Option:
    """A form in the model, fitted with everything else free.

    gain : float
        decrease of the residual's energy [noise variances]
    """

    candidate: Candidate
    fit: Fit
    gain: float

    @property
    def score(self) -> float:
        """Gain less what as many coefficients and shapes would explain of noise."""
        return self.gain - self.candidate.count - 2.0 * float(np.log(self.candidate.shapes_tried))


@dataclass(frozen=True, eq=False)
class Kind:
    """The same effect of another kind, fitted with everything else in the place of the chosen one.

    behind : float
        by how much less it explains, parameters and what the usual kind is preferred by counted [noise variances]
    """

    behind: float
    term: Term


@dataclass(frozen=True, eq=False)
class Choice:
    """One step of the selection.

    confirmation : Confirmation or None
        what held-out recordings say of the chosen one; None where there are none
    """

    options: tuple[Option, ...]
    confirmation: Confirmation | None
    p_value: float
    was_given: bool = False
    kinds: tuple[Kind, ...] = ()


@dataclass(frozen=True, eq=False)
class Selection:
    """What was selected."""

    nominal: Fit
    fit: Fit
    choices: tuple[Choice, ...]
    rejected: tuple[Choice, ...]


def place_of(candidate: Candidate) -> Place:
    """Which effect where."""
    return candidate.effect.id, candidate.effect.joint


def is_physical(option: Option, before: Fit, *, instead: bool = False) -> bool:
    """Whether the term explains anything with coefficients that can be, and leaves friction that can be."""
    term = option.fit.model.terms[-1]
    joint = term.effect.joint
    possible = has_possible_values(term, None if joint is None else option.fit.model.structure.terms[joint].k_v)
    alone = instead or all(each.effect.is_expected for each in before.model.terms)
    possible = possible and term.effect.is_consistent(term.coefficients, term.shape, alone=alone)
    return option.gain > 0.0 and possible and not driving(option.fit) - driving(before)


def has_possible_values(term: Term, k_v: float | None) -> bool:
    """Whether an effect can have these coefficients and this shape.

    Parameters
    ----------
    k_v : float or None
        of the effect's joint; None where there is none [s/rad or s/m]
    """
    signs = zip(term.effect.coefficients, term.coefficients, strict=True)
    possible = all(
        each.smallest <= abs(value) <= each.largest and (value >= 0.0 or not each.positive) for each, value in signs
    )
    return possible and term.effect.is_possible(term.shape, k_v)


def driving(fit: Fit, *, certain: float = CERTAIN) -> set[tuple[int, str]]:
    """Joints and coefficients at which the nominal friction would drive the motion."""
    model, std = fit.model, np.sqrt(np.maximum(np.diag(fit.covariance), 0.0) * fit.inflation())
    found = set()
    for joint in range(model.structure.robot.joint_count):
        for name in ("stiction", "viscous"):
            column = model.structure.coefficient(joint, name)
            if column is not None and model.parameters[column] < -certain * std[column]:
                found.add((joint, name))
    return found


def distinct(options: Sequence[Option]) -> tuple[Option, ...]:
    """Each effect at each place once, the first of several forms."""
    kept: list[Option] = []
    for option in options:
        if place_of(option.candidate) not in [place_of(other.candidate) for other in kept]:
            kept.append(option)
    return tuple(kept)


def outsized(option: Option, observations: Observations) -> bool:
    """Whether the last term's torque exceeds all that was measured at a joint: it then only cancels other columns."""
    term = option.fit.model.terms[-1]
    if term.effect.may_exceed_measured:
        return False
    touched = list(term.effect.touched(observations.robot.joint_count))
    own, measured = np.zeros(len(touched)), np.zeros(len(touched))
    for piece in observations:
        rows = option.fit.model.term_torque(term, option.fit.model.signals(piece))
        own += np.mean(rows**2, axis=tuple(range(1, rows.ndim))) * rows.shape[-1]
        measured += np.mean(piece.prepared.motion.torque[..., touched] ** 2, axis=(0, 1)) * rows.shape[-1]
    return bool((own > measured).any())
