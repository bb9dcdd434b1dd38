"""Which band torque and regressor share: as wide as the positions allow, no wider than the model explains the torque.

Three bounds, the lowest holds. (1) Noise of the positions, differentiated twice, must stay a small share of q̈, or it
biases the inertial parameters (`tauscope.recording.conditioning.position_noise`); they are estimated from all
recordings together, so a slow one sets no band by itself. (2) The torque that this noise makes
in the regressor must stay small beside what the fit leaves, or the bias exceeds the standard errors. (3) Beyond the
frequency where the unexplained part of the torque first outgrows the explained one, more band adds more disturbance
than motion; an octave beyond it is kept, because the edges of friction's steps lie there. Neither (2) nor (3) cuts into
the motion itself: a model of half a motion is no model. Positions so clean that (1) never binds are not filtered at
all: nothing would be gained.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from scipy import signal

from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.dynamics.rigid_body import mass_matrix
from tauscope.identification.dataset import Dataset, PreparedMotion, rms_speed
from tauscope.identification.friction_shape import ORDINARY
from tauscope.identification.least_squares import factorise
from tauscope.identification.posterior import infer
from tauscope.identification.structure import JointTerms, ModelStructure
from tauscope.recording.conditioning import Conditioner, Motion, Source
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array
from tauscope.robot import Robot

KEPT_BEYOND = 2.0  # width of the band over the frequency where the unexplained torque outgrows the explained one
# Largest torque that noise of the positions may make in the regressor, relative to what the fit leaves.
NOISE_TORQUE_SHARE = 0.15
MOTION_SHARE = 0.95  # share of the power of every joint's velocity that makes its motion's own band…
MOTION_MARGIN = 2.0  # …and the width of the band over it that is kept at least
ROWS_A_PARAMETER = 3.0  # rows of every joint's equations for each of its parameters that a band leaves at least
# Share of the positions' noise that differs from period to period, below which what torque does not repeat says nothing
# of what that noise makes in the regressor: it is the same in every period.
INDEPENDENT = 0.5
# Part of the residual that is the torque's own at least, however much the noise of the positions made of it.
SMALLEST_OWN_SHARE = 0.01
PROBED_POSTURES = 50

ROUNDS = 2  # fits at a narrower band each: a fit disturbed by noise misplaces the crossing
# A band holds at least this many cycles of its cut-off within the longest stretch of the recording.
SMALLEST_CYCLES = 20.0
ENOUGH_ROWS = 1 << 17  # rows of a recording that its spectra are taken from: more changes nothing
ENOUGH_PIECES = 8  # pieces of motion that tell the joints' typical speeds
SPECTRUM_SEGMENT = 4096  # samples in one segment of the motion's spectrum
FILTER_POINTS = 1 << 14  # points of a filter's frequency response, both halves
SPECTRUM_POINTS = 200
# Spectra are averaged from f/√2 to f·√2 before they are compared: an octave, no single harmonic decides.
SMOOTHING = np.sqrt(2.0)


def choose_cutoff(conditioners: Sequence[Conditioner], robot: Robot, base: BaseParameters) -> float | None:
    """Cut-off of the common band, chosen from the data [Hz]; None where the positions need no filter."""
    conditioners = [_beginning(conditioner) for conditioner in conditioners]
    quiet = quiet_limit(conditioners)
    if quiet is None:
        return None
    longest = min(
        max(stop - start for start, stop in conditioner.timing.rows) / conditioner.timing.rate_hz
        for conditioner in conditioners
    )
    floor = SMALLEST_CYCLES / longest
    limit = cutoff = max(quiet, floor)
    widest = Dataset(conditioners, robot, base, limit)
    floor = max(floor, MOTION_MARGIN * _motion_band(widest), _least_band(widest, robot, base, limit))
    for _ in range(ROUNDS):
        bounds = _bounds(conditioners, robot, base, cutoff)
        if not bounds:
            break
        cutoff = min(max(min(bounds), floor), limit)
    return cutoff


def quiet_limit(conditioners: Sequence[Conditioner]) -> float | None:
    """Widest band in which noise keeps to its share of q̈ in all recordings together [Hz]; None where it always does.

    Where one recording stands the band f_r, its motion has the energy of its noise up to there, which grows as f⁵: all
    of them stand f⁵ = Σ w_r f_r⁵ / Σ w_r, each by the noise w_r that it brings, density times duration.
    """
    limits = np.array([c.noise.joint_limits_hz for c in conditioners])
    moving = np.array([c.moving for c in conditioners])
    if np.isinf(limits).all():
        return None
    widest = np.array([[c.timing.rate_hz / 2.0] for c in conditioners])
    stood = np.where(moving, np.minimum(limits, widest), 0.0)
    duration = np.array([[sum(stop - start for start, stop in c.timing.rows) / c.timing.rate_hz] for c in conditioners])
    weights = duration * np.array([c.noise.density for c in conditioners]) + np.finfo(float).tiny
    pooled = (np.sum(weights * stood**5, axis=0) / np.sum(weights, axis=0)) ** 0.2
    return float(np.where(moving.any(axis=0), pooled, np.inf).min())


def _motion_band(motions: Dataset) -> float:
    """Frequency below which `MOTION_SHARE` of the power of every joint's velocity lies [Hz]."""
    frequency, power = np.zeros(1), np.zeros(1)
    for prepared in motions:
        motion = prepared.motion
        segment = min(SPECTRUM_SEGMENT, len(motion.velocity))
        frequency, own = signal.welch(motion.velocity, motion.rate_hz, nperseg=segment, axis=0)
        power = own if power.shape != own.shape else power + own
    below = np.cumsum(power, axis=0) / np.maximum(power.sum(axis=0), np.finfo(float).tiny)
    return float(frequency[np.argmax(below >= MOTION_SHARE, axis=0)].max())


def _least_band(motions: Dataset, robot: Robot, base: BaseParameters, cutoff_hz: float) -> float:
    """Band that leaves `ROWS_A_PARAMETER`: rows become fewer in proportion to it [Hz]."""
    structure = ModelStructure(robot, base, preliminary_terms(motions, robot))
    rows = sum(prepared.used.sum(axis=1) for prepared in motions)
    columns = np.array([len(structure.joint_columns(joint)) for joint in range(robot.joint_count)])
    return float(cutoff_hz * (ROWS_A_PARAMETER * columns / np.maximum(rows, 1)).max())


def _beginning(conditioner: Conditioner) -> Conditioner:
    rows, left = [], ENOUGH_ROWS
    for start, stop in conditioner.timing.rows:
        if left > 0:
            rows.append((start, min(stop, start + left)))
            left -= stop - start
    return replace(conditioner, timing=replace(conditioner.timing, rows=tuple(rows)))


def _bounds(conditioners: Sequence[Conditioner], robot: Robot, base: BaseParameters, cutoff_hz: float) -> list[float]:
    """What a fit in the present band says about the next one: bounds (2) and (3), where they bind."""
    motions = Dataset(conditioners, robot, base, cutoff_hz)
    structure = ModelStructure(robot, base, preliminary_terms(motions, robot))
    factors = factorise(motions, structure)
    parameters = infer(structure, factors).mean
    residual_std = np.sqrt([f.squared_residual(parameters) / f.rows for f in factors]) + np.finfo(float).tiny
    bounds = [_quiet_band(conditioners, motions, structure, parameters, residual_std)]
    crossing = _crossing(motions, structure, parameters, residual_std)
    if crossing is not None:
        bounds.append(KEPT_BEYOND * crossing)
    return [bound for bound in bounds if np.isfinite(bound)]


def _quiet_band(
    conditioners: Sequence[Conditioner],
    motions: Dataset,
    structure: ModelStructure,
    parameters: Array,
    residual_std: Array,
) -> float:
    """Widest band in which noise of q̈ makes little torque, by joint j: Σ_k H_jk² S_k (2π)⁴ g f⁵/5 ≤ share² · residual.

    Of that noise the band's filter passes the share g.

    The residual, less what that noise put into it, counts as white in the present band. Where torque was measured in
    several periods, what it does not repeat bounds it: a model that is wrong as yet is no reason for a wider band.
    """
    prepared = next(iter(motions))
    chosen = np.linspace(0, len(prepared.motion.position) - 1, PROBED_POSTURES).astype(int)
    standard = np.zeros(10 * structure.robot.link_count)  # base parameters as those that lead them
    standard[structure.base.independent_columns] = parameters[: structure.base_count]
    inertia = mass_matrix(structure.robot, standard, prepared.motion.position[chosen])
    sources = [conditioner.source.in_band(motions.cutoff_hz) for conditioner in conditioners]
    from_position = np.array([[name == Source.POSITION for name in source.names] for source in sources])
    density = np.mean([c.noise.density for c in conditioners] * from_position, axis=0)
    independent = _independent_share(prepared.motion, conditioners[0].position_noise_std)
    density *= independent + (1.0 - independent) * prepared.motion.repetitions
    growth = (inertia**2).mean(axis=0) @ density * (2.0 * np.pi) ** 4 * _passed_share(prepared.motion, motions) / 5.0
    cutoff = motions.cutoff_hz or np.inf
    own = np.maximum(residual_std**2 - growth * cutoff**5, SMALLEST_OWN_SHARE * residual_std**2)
    own = np.minimum(own, np.where(independent >= INDEPENDENT, _unrepeated_power(prepared), np.inf))
    with np.errstate(divide="ignore"):
        return float(((NOISE_TORQUE_SHARE**2 * own / cutoff / growth) ** 0.25).min())


def _passed_share(motion: Motion, motions: Dataset) -> float:
    """Share of the noise of q̈ below the cut-off that passes a filter without an edge there: ∫ f⁴ |H|² df / (f_c⁵/5)."""
    if motions.cutoff_hz is None or not isinstance(motion.band, Decimator):
        return 1.0
    frequency = np.fft.rfftfreq(FILTER_POINTS, 1.0 / motion.rate_hz)
    passed = frequency**4 * np.abs(np.fft.rfft(motion.band.kernel, FILTER_POINTS)) ** 2
    return float(np.sum(passed) * frequency[1] / (motions.cutoff_hz**5 / 5.0))


def _unrepeated_power(prepared: PreparedMotion) -> Array:
    """Variance of measured torque that differs between periods, in the band, (n,); infinite if nothing repeats."""
    motion = prepared.motion
    if motion.repetitions == 1:
        return np.full(motion.torque.shape[2], np.inf)
    deviation = np.where(motion.measured, motion.torque - motion.mean_torque, 0.0)
    in_band = np.stack([motion.band.reduce(each.T) for each in deviation])
    return np.sum(np.mean(in_band**2, axis=2), axis=0) / (motion.repetitions - 1)


def _independent_share(motion: Motion, noise_std: Array) -> Array:
    """Share of the positions' noise that is another in every period, (n,); 1 where nothing was averaged.

    Rows that stand for P periods are weighted by √P: independent noise counts as in one period, rounding that is the
    same in every period P times.
    """
    if motion.scatter is None:
        return np.ones(len(noise_std))
    return np.minimum(motion.scatter**2 / np.maximum(noise_std**2, np.finfo(float).tiny), 1.0)


def _crossing(motions: Dataset, structure: ModelStructure, parameters: Array, residual_std: Array) -> float | None:
    """Lowest frequency above the motion's at which more than half of the measured torque is unexplained."""
    frequency = np.linspace(0.0, motions.cutoff_hz or 0.0, SPECTRUM_POINTS + 1)[1:]
    measured, unexplained = np.zeros(SPECTRUM_POINTS), np.zeros(SPECTRUM_POINTS)
    for prepared in motions:
        (predicted,) = prepared.predict_torque(structure, parameters[None])
        modelled = prepared.motion.band.reduce(predicted) / residual_std[:, None]
        torque = prepared.reduced_torque / residual_std[:, None]
        rate = prepared.motion.band.rate_hz
        measured += _power(torque, rate, frequency)
        unexplained += _power(torque - modelled, rate, frequency)
    peak = int(np.argmax(measured))
    below = np.flatnonzero(_smooth(measured, frequency)[peak:] < 2.0 * _smooth(unexplained, frequency)[peak:])
    return float(frequency[peak + below[0]]) if len(below) else None


def _power(signals: Array, rate_hz: float, frequency: Array) -> Array:
    """Energy spectrum of all signals (n, M) together, at the frequencies asked for."""
    own, power = signal.welch(signals, rate_hz, nperseg=min(256, signals.shape[1]))
    return np.interp(frequency, own, power.sum(axis=0)) * signals.shape[1]


def _smooth(power: Array, frequency: Array) -> Array:
    total = np.concatenate([[0.0], np.cumsum(power)])
    low = np.searchsorted(frequency, frequency / SMOOTHING)
    high = np.searchsorted(frequency, frequency * SMOOTHING, side="right")
    return (total[high] - total[low]) / np.maximum(high - low, 1)


def preliminary_terms(motions: Dataset, robot: Robot) -> tuple[JointTerms, ...]:
    """Friction steps of an ordinary steepness, for fits made before the shape constants are known."""
    steepness = ORDINARY / rms_speed(islice(motions, ENOUGH_PIECES))
    return tuple(
        JointTerms(joint.friction_shape.k_v or float(default), joint.friction_shape.delta)
        for joint, default in zip(robot.joints, steepness, strict=True)
    )
