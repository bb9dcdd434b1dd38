"""From a robot and recordings to parameters: the whole way, in the order of the steps."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np
from scipy import stats
from threadpoolctl import ThreadpoolController

from service.dynamics.base_parameters import BaseParameters, base_parameters
from service.errors import IdentificationError, RecordingMismatchError
from service.identification.band import choose_cutoff, preliminary_terms
from service.identification.consistency import (
    ConsistentParameters,
    FrictionColumns,
    friction_inequalities,
    nearest_consistent_parameters,
    plausible_prior,
)
from service.identification.covariance import parameter_covariance
from service.identification.dataset import Dataset
from service.identification.friction_shape import EstimatedShape, estimate_shapes, shape_parameters
from service.identification.least_squares import (
    JointFactor,
    Solution,
    condition_number,
    factorise,
    restricted,
    solve,
)
from service.identification.residuals import Fit, ResidualStatistics, evaluate
from service.identification.rotor import kept_columns, needed_rotors, separable_rotors
from service.identification.shape_sensitivity import refined_structure
from service.identification.structure import ModelStructure
from service.recording.conditioning import Conditioner, ConditioningSummary
from service.recording.recording import Array, Recording
from service.robot import Robot

REWEIGHTINGS = 2
"""Rounds of estimating σ_j from the residual and solving again; it settles in two."""

NOISE_DECADES = 6
"""Powers of ten by which the noise may be enlarged where the consistent model is hard to reach."""

CONSISTENCY_LEVEL = 0.999
"""The free estimate counts as impossible, not merely unlucky, where physics rejects it at this level."""

SIGNIFICANT = 5.0
"""Standard errors by which a Stribeck term must differ from zero to stay in the model."""

FINEST_TORQUE = 1e-6
"""Share of a joint's torque that counts as its noise at least: no sensor resolves more, and weights stay finite."""

SCAN_ROWS = 1 << 16

STANDING_STILL = 10.0
SMALLEST_MOTION = 1e-9
"""A joint moves where its range exceeds so many standard deviations of its noise, and this [rad or m]."""

FASTEST = 1e4
"""A median speed above this is a mistake of units [rad/s or m/s]."""

KNOWN_SHARE = 0.1
"""A coefficient whose standard error moves the joint's torque by more than this share of its rms is not
identifiable."""

Progress = Callable[[str], None]


class Estimator(StrEnum):
    """How the joints' equations are weighted."""

    LS = "ls"
    WLS = "wls"


@dataclass(frozen=True)
class Options:
    """What a user may ask of an identification.

    estimator : Estimator
        LS (17) or WLS (19)
    cutoff_hz : float, None or "auto"
        band that torque and regressor share [Hz]; None for no filter; chosen from the data by default
    rotor_inertia : bool
        whether rotors are added where the data ask for them
    """

    estimator: Estimator = Estimator.WLS
    cutoff_hz: float | Literal["auto"] | None = "auto"
    rotor_inertia: bool = True


@dataclass(frozen=True, eq=False)
class Identification:
    """A model of the arm with what is known about its uncertainty.

    robot : Robot
        the arm
    structure : ModelStructure
        the model's columns
    parameters : (p,) float64
        the model that is delivered: the free estimate, or the consistent one where physics rejects the free one
    free_parameters : (p,) float64
        the LS or WLS estimate
    consistent_parameters : (p,) float64
        the nearest physically consistent parameters in the same columns
    constrained : bool
        whether `parameters` are the consistent ones
    covariance : (p + s, p + s) float64
        of the free estimate, and of the logarithms of the estimated shape constants
    undetermined : (p,) bool
        parameters about which the recordings say nothing
    shapes : tuple of EstimatedShape, length n
        the friction curves' shape constants
    consistent : ConsistentParameters
        full standard parameters of the links
    condition_number : float
        of the unweighted regressor
    residuals : ResidualStatistics
        of `parameters` on the recordings: fit, noise, autocorrelation
    consistent_fit, held_out, held_out_consistent : Fit or None
        fits of the consistent parameters; of `parameters` and of the consistent ones on the held-out recordings
    cutoff_hz : float or None
        the band that was used
    estimator : Estimator
        how it was weighted
    conditioning, held_out_conditioning : tuple of ConditioningSummary
        one a recording
    identifiable : tuple of dict, length n
        per joint and coefficient, whether the data can tell it
    """

    robot: Robot
    structure: ModelStructure
    parameters: Array
    free_parameters: Array
    consistent_parameters: Array
    constrained: bool
    covariance: Array
    undetermined: np.ndarray
    shapes: tuple[EstimatedShape, ...]
    consistent: ConsistentParameters
    condition_number: float
    residuals: ResidualStatistics
    consistent_fit: Fit
    held_out: Fit | None
    held_out_consistent: Fit | None
    cutoff_hz: float | None
    estimator: Estimator
    conditioning: tuple[ConditioningSummary, ...]
    held_out_conditioning: tuple[ConditioningSummary, ...]
    identifiable: tuple[dict[str, bool], ...]


@ThreadpoolController().wrap(limits=1, user_api="blas")  # factors of 50 columns: threads cost more than they bring
def identify(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    options: Options = Options(),
    progress: Progress = lambda step: None,
) -> Identification:
    """Identify a robot arm from recordings.

    Parameters
    ----------
    robot : Robot
        the arm
    recordings : sequence of Recording
        what the model is made from; each one continuous motion
    held_out : sequence of Recording
        what it is judged by, never used for the estimate
    options : Options
        estimator, band, optional terms
    progress : callable
        told the name of each step as it begins

    Returns
    -------
    Identification
        the model and its uncertainty

    Raises
    ------
    RecordingMismatchError
        where a recording has another number of joints than the robot
    RecordingError
        where a recording is too short or too broken to be used
    IdentificationError
        where the recordings hold too little for the parameters
    """
    for recording in (*recordings, *held_out):
        if recording.joint_count != robot.joint_count:
            raise RecordingMismatchError(
                f"{recording.name}: has {recording.joint_count} joints, robot {robot.name} has {robot.joint_count}:"
                " give the robot file that belongs to it"
            )
    progress("condition recordings")
    base = base_parameters(robot)
    conditioners = [Conditioner.survey(recording, robot) for recording in recordings]
    _require_motion(conditioners)
    with _naming(recordings):
        automatic = options.cutoff_hz == "auto"
        cutoff = choose_cutoff(conditioners, robot, base) if automatic else options.cutoff_hz
    motions = Dataset(conditioners, robot, base, cutoff)
    with _naming(recordings):
        progress("choose model terms")
        structure, shapes, factors = _model(motions, robot, base, options)
        progress("estimate parameters")
        weights, solution, unweighted = _estimate(factors, structure.size, options.estimator)
        consistent = _consistent(structure, solution)
    estimates = (solution.parameters, _in_model_columns(structure, consistent.parameters))
    progress("evaluate residuals")
    free, bound = evaluate(motions, structure, estimates)
    progress("estimate uncertainty")
    covariance = parameter_covariance(
        motions, structure, solution.parameters, factors, weights, free.autoregressions, shape_parameters(shapes)
    )
    constrained = _is_rejected(consistent, free)
    progress("evaluate held-out recordings")
    held_conditioners = [Conditioner.survey(recording, robot) for recording in held_out]
    held_free, held_bound = _held_out_fits(held_conditioners, structure, cutoff, estimates)
    return Identification(
        robot=robot,
        structure=structure,
        parameters=estimates[constrained],
        free_parameters=estimates[0],
        consistent_parameters=estimates[1],
        constrained=constrained,
        covariance=covariance,
        undetermined=solution.undetermined,
        shapes=shapes,
        consistent=consistent,
        condition_number=condition_number(unweighted.factor),
        residuals=bound if constrained else free,
        consistent_fit=bound.fit,
        held_out=held_bound if constrained else held_free,
        held_out_consistent=held_bound,
        cutoff_hz=cutoff,
        estimator=options.estimator,
        conditioning=tuple(conditioner.summary(cutoff) for conditioner in conditioners),
        held_out_conditioning=tuple(conditioner.summary(cutoff) for conditioner in held_conditioners),
        identifiable=_identifiable(structure, factors, covariance, solution, shapes),
    )


@contextmanager
def _naming(recordings: Sequence[Recording]) -> Iterator[None]:
    """Put the recordings' names before the message of what they could not answer."""
    try:
        yield
    except IdentificationError as error:
        raise IdentificationError(f"{', '.join(recording.name for recording in recordings)}: {error}") from error


def _require_motion(conditioners: Sequence[Conditioner]) -> None:
    """Refuse recordings in which no joint leaves the noise of its own encoder, or one moves as nothing can."""
    moving = False
    for conditioner in conditioners:
        noise = np.sqrt(conditioner.noise.density * conditioner.timing.rate_hz / 2.0)
        for start, stop in conditioner.timing.rows:
            for first in range(start, stop, SCAN_ROWS):
                samples = conditioner.recording.samples(first, min(first + SCAN_ROWS, stop))
                _require_plausible_speed(conditioner, samples.time, samples.position)
                reach = np.nanmax(samples.position, axis=0) - np.nanmin(samples.position, axis=0)
                moving = moving or bool(np.any(reach > np.maximum(STANDING_STILL * noise, SMALLEST_MOTION)))
    if not moving:
        names = ", ".join(conditioner.recording.name for conditioner in conditioners)
        raise IdentificationError(
            f"{names}: no joint moves by more than the noise of its position: record a motion that excites every joint"
        )


def _require_plausible_speed(conditioner: Conditioner, time: Array, position: Array) -> None:
    """Refuse speeds that no joint reaches: time stamps or positions are in another unit."""
    complete = np.isfinite(position).all(axis=1)
    if complete.sum() < 2:
        return
    speed = np.abs(np.diff(position[complete], axis=0) / np.diff(time[complete])[:, None])
    typical = np.median(speed, axis=0)
    joint = int(np.argmax(typical))
    if typical[joint] > FASTEST:
        name = conditioner.robot.joints[joint].name
        raise IdentificationError(
            f"{conditioner.recording.name}: {name} (column q{joint + 1}) moves at {typical[joint]:.3g} per second most of"
            " the time: is column t in seconds, and q in rad or m?"
        )


def _model(
    motions: Dataset, robot: Robot, base: BaseParameters, options: Options
) -> tuple[ModelStructure, tuple[EstimatedShape, ...], tuple[JointFactor, ...]]:
    """The terms that the data ask for, and the factors of the model that has them."""
    given = [joint.friction_shape for joint in robot.joints]
    separable = separable_rotors(robot, base) if options.rotor_inertia else (False,) * robot.joint_count
    structure = _with_rotors(ModelStructure(robot, base, preliminary_terms(motions, robot)), separable)
    if any(shape.k_v is None or shape.delta is None for shape in given):
        shapes = _refined(motions, structure, _estimated_shapes(motions, structure))
    else:
        shapes = tuple(EstimatedShape(s.k_v or 0.0, s.delta, True, True, True, True) for s in given)
    complete = _with_shapes(structure, shapes)
    factors = factorise(motions, complete)
    needed = _needed_rotors(motions, complete, factors) if any(separable) else separable
    keep = kept_columns(complete, {joint for joint, is_needed in enumerate(needed) if is_needed})
    return _with_rotors(complete, needed), shapes, restricted(factors, keep)


def _estimated_shapes(motions: Dataset, structure: ModelStructure) -> tuple[EstimatedShape, ...]:
    """Shape constants; a Stribeck term stays where it is far from zero against the residual that it leaves.

    Its significance cannot be judged by the residual without it: what it would explain is the colour in that residual.
    """
    count = structure.robot.joint_count
    factors = factorise(motions, structure)
    noise_std, inflation = _preliminary_residual(motions, structure, factors)
    proposed = estimate_shapes(motions, structure, factors, noise_std, np.ones(count), (True,) * count)
    added = [shape.delta is not None and not shape.delta_given for shape in proposed]
    supported = [False] * count
    if any(added):
        extended = _with_shapes(structure, proposed)
        deviations, inflation = _stribeck_deviations(motions, extended, proposed)
        supported = [bool(new and deviations[joint] >= SIGNIFICANT) for joint, new in enumerate(added)]
    return estimate_shapes(motions, structure, factors, noise_std, inflation, supported)


def _refined(
    motions: Dataset, structure: ModelStructure, shapes: tuple[EstimatedShape, ...]
) -> tuple[EstimatedShape, ...]:
    """Identifiable constants of all joints moved to their common optimum."""
    estimated = shape_parameters(shapes)
    if not estimated:
        return shapes
    structure = _with_shapes(structure, shapes)
    weights, solution, _ = _estimate(factorise(motions, structure), structure.size, Estimator.WLS)
    refined = refined_structure(motions, structure, solution.parameters, weights, estimated)
    return tuple(
        replace(shape, k_v=terms.k_v, delta=terms.delta) for shape, terms in zip(shapes, refined.terms, strict=True)
    )


def _stribeck_deviations(
    motions: Dataset, structure: ModelStructure, shapes: tuple[EstimatedShape, ...]
) -> tuple[Array, Array]:
    """Per joint, how many standard errors its Stribeck term is from zero, and the inflation by autocorrelation."""
    factors = factorise(motions, structure)
    weights, solution, _ = _estimate(factors, structure.size, Estimator.WLS)
    (statistics,) = evaluate(motions, structure, [solution.parameters])
    covariance = parameter_covariance(
        motions,
        structure,
        solution.parameters,
        factors,
        weights,
        statistics.autoregressions,
        shape_parameters(shapes),
    )
    deviations = np.zeros(len(shapes))
    for joint in range(len(shapes)):
        column = structure.coefficient(joint, "stribeck")
        if column is not None:
            std = np.sqrt(max(covariance[column, column], np.finfo(float).tiny))
            deviations[joint] = abs(solution.parameters[column]) / std
    return deviations, np.array([model.long_run_ratio for model in statistics.autoregressions])


def _with_shapes(structure: ModelStructure, shapes: Sequence[EstimatedShape]) -> ModelStructure:
    """The structure with these shape constants."""
    terms = zip(structure.terms, shapes, strict=True)
    return structure.with_terms(tuple(replace(joint, k_v=s.k_v, delta=s.delta) for joint, s in terms))


def _needed_rotors(motions: Dataset, complete: ModelStructure, factors: tuple[JointFactor, ...]) -> tuple[bool, ...]:
    """Rotors that the data ask for; autocorrelation costs a pass and is looked at only where it could matter."""
    weights, _, _ = _estimate(factors, complete.size, Estimator.WLS)
    needed = needed_rotors(factors, complete, 1.0 / weights, np.ones(complete.robot.joint_count))
    if any(needed):
        _, inflation = _preliminary_residual(motions, complete, factors)
        needed = needed_rotors(factors, complete, 1.0 / weights, inflation)
    return needed


def _with_rotors(structure: ModelStructure, rotors: Sequence[bool]) -> ModelStructure:
    """The structure with rotor inertia at some joints."""
    terms = zip(structure.terms, rotors, strict=True)
    return structure.with_terms(tuple(replace(joint, rotor=rotor) for joint, rotor in terms))


def _preliminary_residual(
    motions: Dataset, structure: ModelStructure, factors: tuple[JointFactor, ...]
) -> tuple[Array, Array]:
    """Residual standard deviation in the band and its inflation by autocorrelation, (n,) each."""
    _, solution, _ = _estimate(factors, structure.size, Estimator.WLS)
    (statistics,) = evaluate(motions, structure, [solution.parameters])
    inflation = np.array([model.long_run_ratio for model in statistics.autoregressions])
    return np.maximum(statistics.fit.band_rms, np.finfo(float).tiny), inflation


def _estimate(factors: tuple[JointFactor, ...], size: int, estimator: Estimator) -> tuple[Array, Solution, Solution]:
    """Weights, the solution, and that of LS; a weight is 1/σ_j, the residual's standard deviation in the band."""
    std = np.ones(len(factors))
    solution = unweighted = solve(factors, size, std)
    if estimator is Estimator.WLS:
        for _ in range(REWEIGHTINGS):
            std = _residual_std(factors, size, solution.parameters)
            solution = solve(factors, size, std)
    return 1.0 / std, solution, unweighted


def _residual_std(factors: tuple[JointFactor, ...], size: int, parameters: Array) -> Array:
    """σ_j with the degrees of freedom that the parameters took, shared by rows; never below `FINEST_TORQUE`."""
    total = sum(factor.rows for factor in factors)
    squares = np.array([factor.squared_residual(parameters) for factor in factors])
    freedom = np.array([factor.rows * max(1.0 - size / total, 1e-3) for factor in factors])
    torque = np.sqrt([np.sum(factor.triangle[:, -1] ** 2) / factor.rows for factor in factors])
    finest = FINEST_TORQUE * np.maximum(torque, FINEST_TORQUE * torque.max()) + np.finfo(float).tiny
    return np.maximum(np.sqrt(squares / freedom), finest)


def _consistent(structure: ModelStructure, solution: Solution) -> ConsistentParameters:
    """The nearest parameters that bodies and friction can have, in the metric of the estimate.

    Data that no arm could have made may put the estimate millions of standard errors away from any body. The program is
    then solved for a noise ten times as large, and so on: the same nearest point, with a prior that weighs more.
    """
    robot, base = structure.robot, structure.base
    standard = 10 * robot.joint_count
    size = standard + structure.size - structure.base_count
    factor = np.zeros((structure.size, size))
    factor[:, base.independent_columns] = solution.factor[:, : structure.base_count]
    factor[:, base.dependent_columns] = solution.factor[:, : structure.base_count] @ base.combination
    factor[:, standard:] = solution.factor[:, structure.base_count :]
    columns = _friction_columns(structure, standard - structure.base_count)
    limits = friction_inequalities(columns, size, [joint.name for joint in robot.joints])
    for attempt in range(NOISE_DECADES + 1):
        scale = 10.0**-attempt
        prior = plausible_prior(robot, scale * factor, scale * solution.target, columns)
        try:
            found = nearest_consistent_parameters(scale * factor, scale * solution.target, prior, limits)
        except IdentificationError:
            if attempt == NOISE_DECADES:
                raise
            continue
        return replace(
            found,
            squared_residual=found.squared_residual / scale**2,
            free_squared_residual=found.free_squared_residual / scale**2,
        )
    raise AssertionError("the last attempt returns or raises")


def _friction_columns(structure: ModelStructure, shift: int) -> FrictionColumns:
    """Where the joints' coefficients stand when `shift` further columns stand before them."""

    def places(name: str) -> tuple[int | None, ...]:
        columns = (structure.coefficient(joint, name) for joint in range(structure.robot.joint_count))
        return tuple(None if column is None else column + shift for column in columns)

    return FrictionColumns(places("stiction"), places("stribeck"), places("viscous"), places("rotor_inertia"))


def _in_model_columns(structure: ModelStructure, full: Array) -> Array:
    """Full standard parameters and friction, projected onto the model's columns: Θ* = Θ_L + B Θ_K."""
    standard = 10 * structure.robot.joint_count
    return np.concatenate([structure.base.project(full[:standard]), full[standard:]])


def _is_rejected(consistent: ConsistentParameters, free: ResidualStatistics) -> bool:
    """Whether no body can have the free estimate, beyond what noise explains.

    The cost of consistency is χ²-like in the noise's own units; a residual that is coloured counts for fewer samples.
    """
    inflation = float(np.mean([model.long_run_ratio for model in free.autoregressions]))
    allowed = stats.chi2.ppf(CONSISTENCY_LEVEL, df=len(consistent.parameters)) * inflation
    return bool(consistent.residual_increase > allowed)


def _held_out_fits(
    conditioners: Sequence[Conditioner],
    structure: ModelStructure,
    cutoff_hz: float | None,
    estimates: tuple[Array, Array],
) -> tuple[Fit | None, Fit | None]:
    """Fits of both estimates on recordings that were not used."""
    if not conditioners:
        return None, None
    motions = Dataset(conditioners, structure.robot, structure.base, cutoff_hz)
    free, bound = evaluate(motions, structure, estimates)
    return free.fit, bound.fit


def _identifiable(
    structure: ModelStructure,
    factors: tuple[JointFactor, ...],
    covariance: Array,
    solution: Solution,
    shapes: Sequence[EstimatedShape],
) -> tuple[dict[str, bool], ...]:
    """Per joint, which coefficients and shape constants the data can tell."""
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    described = []
    for joint, (factor, shape) in enumerate(zip(factors, shapes, strict=True)):
        torque = np.linalg.norm(factor.triangle[:, -1])
        known: dict[str, bool] = {"stribeck": False}
        for name in structure.terms[joint].names:
            column = structure.coefficient(joint, name)
            if column is None:
                continue
            place = int(np.searchsorted(factor.columns, column))
            reach = std[column] * np.linalg.norm(factor.triangle[:, place])
            known[name] = bool(reach < KNOWN_SHARE * torque) and not bool(solution.undetermined[column])
        known["k_v"], known["delta"] = shape.k_v_identifiable, shape.delta_identifiable
        described.append(known)
    return tuple(described)
