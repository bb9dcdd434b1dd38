"""Whether what the links weigh more than a given model says is one body at the tool.

With d the surplus of the base parameters and C its covariance, a point mass m at r of the last link accounts for

    d = m B (1, r, r rᵀ …),

B the base parameters of each of the last link's ten standard ones. It is a payload where it takes most of dᵀ C⁻¹ d.
"""

from dataclasses import replace

import numpy as np
from scipy import optimize, stats

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding, sizes
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.selection.admission import LEVEL
from tauscope.effects.carried_body import FARTHEST_M, unit_body
from tauscope.effects.payload import Payload
from tauscope.recording.recording import Array
from tauscope.robot.robot import STANDARD_PARAMETERS

MOST_OF_IT = 0.7
"""Part of what makes the surplus significant that the body takes at least: else the links' own values are wrong."""

CERTAIN = 5.0
"""Standard errors of its mass."""

USUAL_M = 0.3
"""Distance from the last link's origin at which things are carried, as a weak prior where torque does not show it."""

PARAMETERS = 4


def payload_finding(diagnosis: Diagnosis, surplus: Array, covariance: Array) -> tuple[Finding | None, Array]:
    """The payload that explains the links' surplus, and the base parameters that it makes.

    Parameters
    ----------
    surplus : (m,) float64
        real less given base parameters
    covariance : (m, m) float64
        of that

    Returns
    -------
    tuple of Finding or None and (m,) float64
        None and zeros where it is no payload
    """
    whitener, rank = _whitener(covariance)
    target = whitener @ surplus
    body = _base_of_last_link(diagnosis)

    def left(mass: float, place: Array) -> Array:
        return target - whitener @ body @ (mass * unit_body(place))

    none = (None, np.zeros(len(surplus)))
    energy = float(target @ target)
    if stats.chi2.sf(energy, rank) > LEVEL:
        return none
    first = whitener @ body @ unit_body(np.zeros(3))
    mass = max(float(first @ target) / max(float(first @ first), np.finfo(float).tiny), 0.01)
    found = optimize.least_squares(
        lambda x: np.concatenate([left(x[0], x[1:]), x[1:] / USUAL_M]),
        np.array([mass, 0.0, 0.0, 0.0]),
        bounds=([0.0, *[-FARTHEST_M] * 3], [np.inf, *[FARTHEST_M] * 3]),
        x_scale=np.array([max(mass, 0.01), 0.1, 0.1, 0.1]),
    )
    mass, place = float(found.x[0]), found.x[1:]
    slope = np.asarray(found.jac)
    spread = np.linalg.pinv(slope.T @ slope, hermitian=True)
    rest = left(mass, place)
    gain = energy - float(rest @ rest)
    known = stats.chi2.sf(gain, PARAMETERS) < LEVEL and mass > CERTAIN * np.sqrt(spread[0, 0])
    if not known or gain < MOST_OF_IT * (energy - rank):
        return none
    share = body @ (mass * unit_body(place))
    return _finding(diagnosis, mass, place, spread, gain, share), share


def _finding(diagnosis: Diagnosis, mass: float, place: Array, spread: Array, gain: float, share: Array) -> Finding:
    """The payload as a finding; the model without it keeps everything else."""
    model = diagnosis.selection.fit.model
    parameters = model.parameters.copy()
    parameters[: len(share)] -= share
    effect = Payload(None, np.zeros((1, 3)), np.full(3, -FARTHEST_M), np.full(3, FARTHEST_M))
    return Finding(
        terms=(Term(effect, place, np.array([mass])),),
        covariances=(spread,),
        gain=gain * diagnosis.inflation,
        probability=0.999,
        before=sizes(replace(model, parameters=parameters), diagnosis.fitter, diagnosis.held_out),
        after=diagnosis.after,
        in_model=False,
    )


def _base_of_last_link(diagnosis: Diagnosis) -> Array:
    """Base parameters of each of the last link's standard parameters, (m, 10)."""
    base, count = diagnosis.selection.fit.model.structure.base, len(STANDARD_PARAMETERS)
    whole = np.zeros((count, count * diagnosis.robot.joint_count))
    whole[:, -count:] = np.eye(count)
    return np.stack([base.project(row) for row in whole], axis=1)


def _whitener(covariance: Array) -> tuple[Array, int]:
    """W with Wᵀ W = C⁻¹ where C says anything, and how many directions that are."""
    scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    known = values > 1e-12 * values[-1]
    return (vectors[:, known] / np.sqrt(values[known])).T / scale, int(known.sum())
