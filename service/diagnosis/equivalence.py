"""Which effects data like these cannot tell apart, whichever of them they happen to prefer.

Of two effects A and B beside the same model, B imitates the share cos² of what A's torque has outside that model, shape
of B included. What is left of A, λ_A (1 - cos²), is all that could tell them apart: below `EQUIVALENT` noise variances
a small error of the columns decides between them, and no name is better than the other.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from service.diagnosis.choice import Option
from service.diagnosis.fit import Fit
from service.diagnosis.projection import SINGULAR
from service.diagnosis.screening import Screen
from service.diagnosis.term import Term
from service.recording.recording import Array

EQUIVALENT = 10.0
"""Score below the best within which data do not tell two effects apart, and what would have to tell them apart
[noise variances]."""


def equivalents(option: Option, others: Sequence[Option], fit: Fit, screen: Screen, inflation: float) -> list[Option]:
    """The others that explain nearly as much as an option, or that these data could not tell from it.

    Parameters
    ----------
    option : Option
        the chosen one
    others : sequence of Option
        fitted beside the same model
    fit : Fit
        that model
    screen : Screen
        of the recordings
    inflation : float
        factor by which the residual exceeds the modelled noise
    """
    margin = EQUIVALENT * inflation
    found = []
    own: Mapping[int, Array] | None = None
    for each in others:
        if each is option or each.gain <= 0.0:
            continue
        if each.score > option.score - margin:
            found.append(each)
            continue
        own = _projected(option.fit.model.terms[-1], fit, screen) if own is None else own
        rival = _projected(each.fit.model.terms[-1], fit, screen)
        parts = (
            _unimitated(own, option, rival) * option.gain,
            _unimitated(rival, each, own) * each.gain,
        )
        if max(parts) < margin:
            found.append(each)
    return found


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
