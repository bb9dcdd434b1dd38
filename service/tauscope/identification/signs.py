"""Joints whose torque is recorded with the wrong sign, or not in the scale of the stated masses.

A free fit cannot tell: with the torque of all joints its parameters change their sign too. Bodies and friction can:
masses are positive and friction takes power. So the most probable bodies are estimated for each joint's sign, and for
all, and the signs under which they explain the torque best are found one after the other.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from tauscope.dynamics.regressor import torque_regressor
from tauscope.identification.consistency import ConsistentParameters
from tauscope.identification.dataset import Dataset, PreparedMotion
from tauscope.identification.excitation import thin
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.least_squares import JointFactor, torque_rms
from tauscope.identification.physical_estimate import consistent_estimate, is_rejected
from tauscope.identification.posterior import Posterior, infer
from tauscope.identification.residuals import evaluate
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

POSTURES = 200  # of the training motion, by which both are compared
FELT = 1e-3  # gravity below this share of the masses' weight at one metre, per kilogram, does not show [Nm/Nm]


def gravity_scale(motions: Dataset, structure: ModelStructure, parameters: Array) -> float | None:
    """Factor from stated gravity to that of `parameters`, (p,), by least squares; None where none shows."""
    links = structure.robot.model.links
    if links is None:
        return None
    position = thin(np.concatenate([thin(prepared.motion.position, POSTURES) for prepared in motions]), POSTURES)
    still = np.zeros_like(position)
    columns = torque_regressor(
        structure.robot, position, still, still, columns=np.asarray(structure.base.independent_columns)
    )
    stated = columns @ structure.base.project(np.concatenate([link.to_vector() for link in links]))
    weight = sum(link.mass for link in links) * float(np.linalg.norm(structure.robot.gravity))
    power = float(np.mean(stated**2))
    if power <= (FELT * weight) ** 2:
        return None
    return float(np.mean(stated * (columns @ parameters[: structure.base_count])) / power)


# Log likelihood by which another sign has to explain the torque better: odds of 150 for one joint in a hundred.
CLEARLY = 5.0
UNEXPLAINED = 0.2  # share of a joint's torque that a wrong sign leaves unexplained at least…
# …and by how much the long-run variance of that exceeds white noise's; without both no other sign is tried.
COLOURED = 1.2


def reversed_joints(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    factors: tuple[JointFactor, ...],
    ratios: Array,
    posterior: Posterior,
    consistent: ConsistentParameters,
) -> tuple[int, ...]:
    """Joints whose torque explains itself much better with the other sign; `ratios`: (n,), ρ_j of residuals."""
    unexplained = (posterior.noise_std > UNEXPLAINED * torque_rms(factors)) & (ratios > COLOURED)
    if not (is_rejected(consistent) or unexplained.any()):
        return ()
    signs = np.ones(structure.robot.joint_count)
    parameters = FullParameters.of(structure).map @ consistent.parameters
    while True:
        others = [*(signs * (1.0 - 2.0 * np.eye(len(signs)))), -signs]  # one joint turned, or all
        tried = [(other, _estimate(structure, factors, ratios, other)) for other in others]
        other, best = max(tried, key=lambda each: _log_likelihood(factors, ratios, *each))
        # Beside a wrong sign the residual is as coloured as the motion: the whiter hypothesis tells the noise.
        left = evaluate(motions, structure, [best, -best])
        white = [left[int(sign < 0.0)].autoregressions[joint].long_run_ratio for joint, sign in enumerate(other)]
        colour = np.minimum(ratios, white)
        gain = _log_likelihood(factors, colour, other, best) - _log_likelihood(factors, colour, signs, parameters)
        if gain <= CLEARLY:
            return tuple(int(joint) for joint in np.flatnonzero(signs < 0.0))
        signs, ratios = other, colour
        parameters = _estimate(structure, factors, ratios, signs)


def _estimate(structure: ModelStructure, factors: tuple[JointFactor, ...], ratios: Array, signs: Array) -> Array:
    """The most probable bodies if these are the torques' signs, (p,)."""
    turned = tuple(_turn(factor, sign) for factor, sign in zip(factors, signs, strict=True))
    posterior = infer(structure, turned, ratios)
    found = consistent_estimate(structure, posterior.factor, posterior.target, posterior.prior)
    return FullParameters.of(structure).map @ found.parameters


def _turn(factor: JointFactor, sign: float) -> JointFactor:
    return replace(factor, triangle=np.column_stack([factor.triangle[:, :-1], sign * factor.triangle[:, -1]]))


def _log_likelihood(factors: tuple[JointFactor, ...], ratios: Array, signs: Array, parameters: Array) -> float:
    """-Σ N_j / ρ_j log σ_j, with σ_j what these parameters leave."""
    turned = [_turn(factor, sign) for factor, sign in zip(factors, signs, strict=True)]
    left = [np.sqrt(factor.squared_residual(parameters) / factor.rows) for factor in turned]
    rows = [factor.rows / ratio for factor, ratio in zip(factors, ratios, strict=True)]
    return -float(np.dot(rows, np.log(np.maximum(left, np.finfo(float).tiny))))
