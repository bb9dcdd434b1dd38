"""Which terms the model has: as many as the data ask for, tested against the residual that the larger model leaves."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.identification.band import preliminary_terms
from tauscope.identification.consistency.inequalities import LEAST_COULOMB
from tauscope.identification.covariance import parameter_covariance
from tauscope.identification.dataset import Dataset, rms_speed
from tauscope.identification.friction_shape import EstimatedShape, estimate_shapes, shape_parameters
from tauscope.identification.least_squares import FINEST_TORQUE, JointFactor, factorise, restrict, single_joint_std
from tauscope.identification.posterior import infer
from tauscope.identification.residuals import evaluate
from tauscope.identification.rotor import kept_columns, needed_rotors, separable_rotors
from tauscope.identification.shape_sensitivity import refine_structure
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Standard error of a constant's logarithm that leaves no doubt about it. K_v has its profile as well; δ is known where
# five standard errors are within a factor of e.
TIGHT = {"k_v": 0.1, "delta": 0.2}
# Noise variances that a Stribeck term must take off the criterion to stay in the model: what chance does as rarely as
# five standard errors, with the term's two unknowns τ_sc and δ.
SIGNIFICANT = float(stats.chi2.isf(2.0 * stats.norm.sf(5.0), df=2))


def choose_model(
    motions: Dataset, robot: Robot, base: BaseParameters, *, rotor_inertia: bool
) -> tuple[ModelStructure, tuple[EstimatedShape, ...], tuple[JointFactor, ...]]:
    """The terms that the data ask for: friction shapes, Stribeck terms, rotors."""
    given = [joint.friction_shape for joint in robot.joints]
    separable = separable_rotors(robot, base) if rotor_inertia else (False,) * robot.joint_count
    structure = _with_rotors(ModelStructure(robot, base, preliminary_terms(motions, robot)), separable)
    _doubt_friction_at_rest(motions, structure)
    if any(shape.k_v is None or shape.delta is None for shape in given):
        speed = rms_speed(motions)
        shapes = _refine(motions, structure, _estimate_shapes(motions, structure, speed), speed)
    else:
        shapes = tuple(EstimatedShape(s.k_v or 0.0, s.delta, True, True, True, True) for s in given)
    shapes = tuple(shape.open_at_limit() for shape in shapes)
    complete = _with_shapes(structure, shapes)
    factors = factorise(motions, complete)
    needed = _needed_rotors(motions, complete, factors) if any(separable) else separable
    keep = kept_columns(complete, {joint for joint, is_needed in enumerate(needed) if is_needed})
    return _with_rotors(complete, needed), shapes, restrict(factors, keep)


def _doubt_friction_at_rest(motions: Dataset, structure: ModelStructure) -> None:
    """Give rows at rest the variance that friction has there: any torque up to breakaway, by such a model."""
    if not any(prepared.at_rest.any() for prepared in motions):
        return
    posterior = infer(structure, factorise(motions, structure))
    columns = [*structure.coefficients("stiction").values()]  # every joint has one
    stiction = np.maximum(posterior.mean[columns], 0.0)
    motions.rest_variance = stiction**2 / 3.0 / posterior.noise_std**2
    posterior = infer(structure, factorise(motions, structure))
    held, rows = np.zeros(len(columns)), np.full(len(columns), np.finfo(float).tiny)
    for prepared in motions:
        left = prepared.reduced_torque - prepared.predicted_rows(structure, posterior.mean)
        for joint, row in enumerate(left):
            for stop in prepared.stops(joint):
                own = row[stop][prepared.used[joint, stop]]
                held[joint] += len(own) * own.mean() ** 2 - posterior.noise_std[joint] ** 2
                rows[joint] += len(own)
    motions.rest_variance = np.clip(held / rows, 0.0, stiction**2) / posterior.noise_std**2


def _estimate_shapes(motions: Dataset, structure: ModelStructure, speed: Array) -> tuple[EstimatedShape, ...]:
    """Shape constants; a Stribeck term stays where it is far from zero against the residual that it leaves itself."""
    count = structure.robot.joint_count
    factors = factorise(motions, structure)
    noise_std, _ = _preliminary_residual(motions, structure, factors)
    proposed = estimate_shapes(motions, structure, factors, noise_std, np.zeros(count), (True,) * count, speed)
    # Judged by what the refined candidates leave: beside constants off their optimum every other one looks open.
    refined = _refine(motions, structure, proposed, speed)
    gains, unit, tight = _judge(motions, _with_shapes(structure, refined), refined, noise_std)
    supported = [
        shape.delta is not None and not shape.delta_given and bool(gains[joint] >= SIGNIFICANT)
        for joint, shape in enumerate(proposed)
    ]
    known = ["k_v" in names for names in tight]
    found = estimate_shapes(motions, structure, factors, noise_std, unit, supported, speed, known)
    return tuple(
        _with_tight(shape, best, tight[joint]) for joint, (shape, best) in enumerate(zip(found, refined, strict=True))
    )


def _with_tight(shape: EstimatedShape, refined: EstimatedShape, tight: set[str]) -> EstimatedShape:
    """The shape with what refining all constants together found, where profiles along single ones left a doubt.

    Beside a Stribeck term the two slopes are one pair: neither may be left where only the grid had put it, and δ's
    profile beside the K_v of a grid tells how far that K_v is off, not what is known of δ.
    """
    paired = shape.delta is not None and not shape.delta_given
    if paired:
        shape = replace(shape, delta=refined.delta, delta_identifiable="delta" in tight)
    if not shape.k_v_given and (paired or (shape.k_v_identifiable and "k_v" in tight)):
        shape = replace(shape, k_v=refined.k_v)
    return shape


def _refine(
    motions: Dataset, structure: ModelStructure, shapes: tuple[EstimatedShape, ...], speed: Array
) -> tuple[EstimatedShape, ...]:
    """Identifiable constants of all joints moved to their common optimum."""
    estimated = shape_parameters(shapes)
    if not estimated:
        return shapes
    structure = _with_shapes(structure, shapes)
    posterior = infer(structure, factorise(motions, structure))
    refined = refine_structure(motions, structure, posterior.mean, posterior.weights, estimated, speed)
    return tuple(
        replace(shape, k_v=terms.k_v, delta=terms.delta) for shape, terms in zip(shapes, refined.terms, strict=True)
    )


def _judge(
    motions: Dataset, structure: ModelStructure, shapes: tuple[EstimatedShape, ...], noise_std: Array
) -> tuple[Array, Array, list[set[str]]]:
    """What a model with all proposed terms says of them, per joint.

    What its Stribeck term takes off the criterion; one noise variance, inflated by autocorrelation and divided by
    `noise_std`²; and which of its shape constants have a small standard error.
    """
    factors = factorise(motions, structure)
    posterior = infer(structure, factors)
    (statistics,) = evaluate(motions, structure, [posterior.mean])
    given = (motions, structure, posterior.mean, factors, posterior.weights, statistics.autoregressions)
    # With δ held: how uncertain δ itself is says nothing about whether the term is there.
    held = parameter_covariance(*given, posterior=posterior)
    gains = np.array([_stribeck_gain(structure, posterior.mean, held, joint) for joint in range(len(shapes))])
    estimated = shape_parameters(shapes)
    errors = np.sqrt(np.diag(parameter_covariance(*given, estimated, posterior))[structure.size :])
    tight: list[set[str]] = [set() for _ in shapes]
    for (joint, name), error in zip(estimated, errors, strict=True):
        if 0.0 < error < TIGHT[name]:
            tight[joint].add(name)
    inflation = np.array([model.long_run_ratio for model in statistics.autoregressions])
    relative = np.maximum(statistics.fit.band_rms, FINEST_TORQUE * noise_std) / noise_std
    return gains, inflation * relative**2, tight


def _stribeck_gain(structure: ModelStructure, parameters: Array, covariance: Array, joint: int) -> float:
    """What a Stribeck term takes off the criterion [noise variances] less the cost of `LEAST_COULOMB`; 0 if rising."""
    stiction, stribeck = (structure.coefficient(joint, name) for name in ("stiction", "stribeck"))
    if stiction is None or stribeck is None or parameters[stribeck] >= 0.0:
        return 0.0
    pair, factors = [stiction, stribeck], np.array([1.0 - LEAST_COULOMB, 1.0])
    impossible = min(float(factors @ parameters[pair]), 0.0)
    smallest = np.finfo(float).tiny
    gain = parameters[stribeck] ** 2 / max(covariance[stribeck, stribeck], smallest)
    return float(gain - impossible**2 / max(factors @ covariance[np.ix_(pair, pair)] @ factors, smallest))


def _with_shapes(structure: ModelStructure, shapes: Sequence[EstimatedShape]) -> ModelStructure:
    terms = zip(structure.terms, shapes, strict=True)
    return structure.with_terms(tuple(replace(joint, k_v=s.k_v, delta=s.delta) for joint, s in terms))


def _needed_rotors(motions: Dataset, complete: ModelStructure, factors: tuple[JointFactor, ...]) -> tuple[bool, ...]:
    """Rotors that the data ask for; autocorrelation costs a pass and is looked at only where it could matter."""
    noise_std = single_joint_std(factors)
    needed = needed_rotors(factors, complete, noise_std, np.ones(complete.robot.joint_count))
    if any(needed):
        _, inflation = _preliminary_residual(motions, complete, factors)
        needed = needed_rotors(factors, complete, noise_std, inflation)
    return needed


def _with_rotors(structure: ModelStructure, rotors: Sequence[bool]) -> ModelStructure:
    terms = zip(structure.terms, rotors, strict=True)
    return structure.with_terms(tuple(replace(joint, rotor=rotor) for joint, rotor in terms))


def _preliminary_residual(
    motions: Dataset, structure: ModelStructure, factors: tuple[JointFactor, ...]
) -> tuple[Array, Array]:
    (statistics,) = evaluate(motions, structure, [infer(structure, factors).mean])
    inflation = np.array([model.long_run_ratio for model in statistics.autoregressions])
    return np.maximum(statistics.fit.band_rms, np.finfo(float).tiny), inflation
