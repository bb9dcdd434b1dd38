"""Which effects data like these cannot tell apart, whichever of them they happen to prefer.

Of two effects A and B beside the same model, B imitates the share cos² of what A's torque has outside that model, shape
of B included. What is left of A, λ_A (1 - cos²), is all that could tell them apart: below `EQUIVALENT` noise variances
a small error of the columns decides between them, and no name is better than the other.

Nor is a law's formula ever exact. Two laws of the same quantities at one joint, drag and Stribeck friction say, differ
by less than what their formulas may be wrong by: there a share `FORMULA_ERROR` of what is explained counts as noise,
and of probabilities a share `FORMULA_DOUBT`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.fitting.projection import SINGULAR
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.screen import Screen
from tauscope.diagnosis.selection.choice import Choice, Option, distinct
from tauscope.recording.recording import Array

EQUIVALENT = 10.0
"""Score below the best within which data do not tell two effects apart, and what would have to tell them apart
[noise variances]."""

FORMULA_ERROR = 0.005
"""Share of what an effect explains that counts as noise between it and another law of the same quantities; on arms that
conceal other formulas than the catalogue's, the wrong one of two explained up to a sixteenth more."""

FORMULA_DOUBT = 0.025
"""The same where the two are weighed against each other: of two that explain much, one that leads by a ninth has a
probability of 0.9. On an arm with drag of another formula the wrong one led by an eighth, 27 of 219 noise variances."""


def equivalents(option: Option, others: Sequence[Option], fit: Fit, screen: Screen, inflation: float) -> list[Option]:
    """The others that explain nearly as much as an option, or that these data could not tell from it."""
    found = []
    own: Mapping[int, Array] | None = None
    for each in others:
        if each is option or each.gain <= 0.0:
            continue
        margin = EQUIVALENT * doubt(option, each, inflation, FORMULA_ERROR)
        if each.score > option.score - margin:
            found.append(each)
            continue
        own = _projected(option.fit.model.terms[-1], fit, screen) if own is None else own
        rival = _projected(each.fit.model.terms[-1], fit, screen)
        parts = (
            _unimitated(own, option, rival) * option.gain,
            _unimitated(rival, each, own) * each.gain,
        )
        if max(parts) < EQUIVALENT * inflation:
            found.append(each)
    return found


def doubt(option: Option, rival: Option, inflation: float, formula_error: float = FORMULA_DOUBT) -> float:
    """What counts as one noise variance between the scores of two options."""
    return inflation + (formula_error * option.gain if of_one_kind(option, rival) else 0.0)


def of_one_kind(option: Option, rival: Option) -> bool:
    """Whether two options are laws of the same quantities at one joint."""
    one, other = option.candidate.effect, rival.candidate.effect
    return one.joint == other.joint and one.arguments is not None and one.arguments == other.arguments


def probability_among(score: float, rivals: Sequence[float], doubts: Sequence[float]) -> float:
    """Share of one explanation among all by their likelihoods.

    Parameters
    ----------
    score : float
        of the one [noise variances]
    """
    ahead = np.array([score - rival for rival in rivals]) / np.array(doubts)
    return float(min(1.0 / (1.0 + np.exp(np.clip(-0.5 * ahead, -700.0, 700.0)).sum()), 0.999))


def with_rivals(choice: Choice, others: Sequence[Choice]) -> Choice:
    """A choice with what it was preferred to, as far as those are laws of the same quantities.

    Where no formula of the catalogue is that of the arm, it is chance which of two holds on other motion, and which
    of two makes the other superfluous.
    """
    chosen = choice.options[0]
    alike = [each.options[0] for each in others if of_one_kind(chosen, each.options[0])]
    return replace(choice, options=distinct([*choice.options, *alike]))


def _projected(term: Term, fit: Fit, screen: Screen) -> Mapping[int, Array]:
    """Columns of a term's coefficients, then of its shapes, beside a model, (c + f, R_j) at every joint."""
    observations = screen.observations
    touched = term.effect.touched(observations.robot.joint_count)
    rows: dict[int, list[Array]] = {joint: [] for joint in touched}
    for piece in observations:
        derivatives = fit.model.term_derivatives(term, fit.model.signals(piece))
        for slot, joint in enumerate(touched):
            rows[joint].append(piece.reduced(np.ascontiguousarray(derivatives[:, slot])))
    white = {joint: observations.white(joint, parts) for joint, parts in rows.items()}
    inner = np.sum([columns @ fit.projection.basis[joint].T for joint, columns in white.items()], axis=0)
    return {joint: white.get(joint, 0.0) - inner @ basis for joint, basis in enumerate(fit.projection.basis)}


def _unimitated(one: Mapping[int, Array], option: Option, other: Mapping[int, Array]) -> float:
    """Share 1 - cos² of an effect's torque, as fitted, that the other's columns do not span."""
    coefficients = option.fit.model.terms[-1].coefficients
    torque = np.concatenate([coefficients @ rows[: len(coefficients)] for rows in one.values()])
    columns = np.concatenate(list(other.values()), axis=1)
    gram, target = columns @ columns.T, columns @ torque
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    solved = np.linalg.pinv(gram / np.outer(scale, scale), rcond=SINGULAR, hermitian=True) @ (target / scale)
    whole = float(torque @ torque)
    return max(1.0 - float(solved @ (target / scale)) / max(whole, np.finfo(float).tiny), 0.0)
