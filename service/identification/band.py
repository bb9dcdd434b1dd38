"""Which band torque and regressor share: as wide as the positions allow, no wider than the model explains the torque.

Two bounds, the lower one holds. (1) Noise of the positions, differentiated twice, must stay a small share of q̈, or
it biases the inertial parameters (`service.recording.conditioning.position_noise`). (2) Beyond the frequency where
the unexplained part of the torque first outgrows the explained one, more band adds more disturbance than motion; an
octave beyond it is kept, because the edges of friction's steps lie there. Positions so clean that (1) never binds are
not filtered at all: nothing would be gained.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from scipy import signal

from service.dynamics.base_parameters import BaseParameters
from service.identification.dataset import Dataset
from service.identification.friction_shape import ORDINARY
from service.identification.least_squares import factorise, solve
from service.identification.structure import JointTerms, ModelStructure
from service.recording.conditioning import Conditioner
from service.recording.recording import Array
from service.robot import Robot

KEPT_BEYOND = 2.0
"""Width of the band over the frequency where the unexplained torque outgrows the explained one."""

ROUNDS = 2
"""Fits at a narrower band each: a fit disturbed by noise misplaces the crossing."""

SMALLEST_CYCLES = 20.0
"""A band holds at least this many cycles of its cut-off within the longest stretch of the recording."""

ENOUGH_ROWS = 1 << 17
"""Rows of a recording that its spectra are taken from: more changes nothing."""

ENOUGH_PIECES = 8
"""Pieces of motion that tell the joints' typical speeds."""

SPECTRUM_POINTS = 200
SMOOTHING = np.sqrt(2.0)
"""Spectra are averaged from f/√2 to f·√2 before they are compared: an octave, no single harmonic decides."""


def choose_cutoff(conditioners: Sequence[Conditioner], robot: Robot, base: BaseParameters) -> float | None:
    """Cut-off of the common band, chosen from the data.

    Parameters
    ----------
    conditioners : sequence of Conditioner
        the recordings
    robot : Robot
        the arm
    base : BaseParameters
        its identifiable combinations

    Returns
    -------
    float or None
        cut-off [Hz]; None where the positions are clean enough for no filter
    """
    conditioners = [_beginning(conditioner) for conditioner in conditioners]
    limits = [conditioner.noise.limit_hz for conditioner in conditioners]
    bounds = [limit for limit in limits if limit is not None]
    if not bounds:
        return None
    longest = min(
        max(stop - start for start, stop in conditioner.timing.rows) / conditioner.timing.rate_hz
        for conditioner in conditioners
    )
    floor = SMALLEST_CYCLES / longest
    limit = cutoff = max(min(bounds), floor)
    for _ in range(ROUNDS):
        crossing = _crossing(conditioners, robot, base, cutoff)
        if crossing is None:
            break
        cutoff = min(max(KEPT_BEYOND * crossing, floor), limit)
    return cutoff


def _beginning(conditioner: Conditioner) -> Conditioner:
    """The recording's first `ENOUGH_ROWS` rows."""
    rows, left = [], ENOUGH_ROWS
    for start, stop in conditioner.timing.rows:
        if left > 0:
            rows.append((start, min(stop, start + left)))
            left -= stop - start
    return replace(conditioner, timing=replace(conditioner.timing, rows=tuple(rows)))


def _crossing(
    conditioners: Sequence[Conditioner], robot: Robot, base: BaseParameters, cutoff_hz: float
) -> float | None:
    """Lowest frequency above the motion's own at which the model leaves more than half of the torque unexplained.

    Measured, not modelled torque is compared: noise of the positions makes modelled torque, which explains nothing.
    """
    motions = Dataset(conditioners, robot, base, cutoff_hz)
    structure = ModelStructure(robot, base, preliminary_terms(motions, robot))
    factors = factorise(motions, structure)
    noise_std = np.ones(robot.joint_count)
    for _ in range(2):
        solution = solve(factors, structure.size, noise_std)
        noise_std = np.sqrt([max(f.squared_residual(solution.parameters) / f.rows, 1e-300) for f in factors])
    frequency = np.linspace(0.0, cutoff_hz, SPECTRUM_POINTS + 1)[1:]
    measured, unexplained = np.zeros(SPECTRUM_POINTS), np.zeros(SPECTRUM_POINTS)
    for prepared in motions:
        (predicted,) = prepared.predicted_torque(structure, solution.parameters[None])
        modelled = prepared.motion.band.reduce(predicted) / noise_std[:, None]
        torque = prepared.reduced_torque / noise_std[:, None]
        rate = prepared.motion.band.rate_hz
        measured += _power(torque, rate, frequency)
        unexplained += _power(torque - modelled, rate, frequency)
    peak = int(np.argmax(measured))
    below = np.flatnonzero(_smoothed(measured, frequency)[peak:] < 2.0 * _smoothed(unexplained, frequency)[peak:])
    return float(frequency[peak + below[0]]) if len(below) else None


def _power(signals: Array, rate_hz: float, frequency: Array) -> Array:
    """Energy spectrum of all signals (n, M) together, at the frequencies asked for."""
    own, power = signal.welch(signals, rate_hz, nperseg=min(256, signals.shape[1]))
    return np.interp(frequency, own, power.sum(axis=0)) * signals.shape[1]


def _smoothed(power: Array, frequency: Array) -> Array:
    """Mean of a spectrum over an octave around every frequency."""
    total = np.concatenate([[0.0], np.cumsum(power)])
    low = np.searchsorted(frequency, frequency / SMOOTHING)
    high = np.searchsorted(frequency, frequency * SMOOTHING, side="right")
    return (total[high] - total[low]) / np.maximum(high - low, 1)


def preliminary_terms(motions: Dataset, robot: Robot) -> tuple[JointTerms, ...]:
    """Friction steps of an ordinary steepness, for fits made before the shape constants are known.

    Parameters
    ----------
    motions : Dataset
        the data, for the joints' typical speeds
    robot : Robot
        constants that its file states are used
    """
    squares, count = np.zeros(robot.joint_count), 0
    for prepared in islice(motions, ENOUGH_PIECES):
        squares += np.sum(prepared.motion.velocity**2, axis=0)
        count += len(prepared.motion.velocity)
    speed = np.maximum(np.sqrt(squares / max(count, 1)), 1e-9)
    steepness = ORDINARY / speed
    return tuple(
        JointTerms(joint.friction_shape.k_v or float(default), joint.friction_shape.delta)
        for joint, default in zip(robot.joints, steepness, strict=True)
    )
