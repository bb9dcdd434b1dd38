"""The accelerations that a motion most likely had, given the torque that went with it.

Positions have noise; differentiated twice, it grows with the square of the frequency. It stands in every column that
is made of accelerations, and its torque M n is missing in what is left to explain: with accelerations a + n, M the
mass matrix, e the torque's noise

    r = τ - τ̂(a + n) = e - M n,        S_n(f) = (2πf)⁴ S_q,

so that columns and residual have n in common (errors in variables). The wider the band, the more of it: a rotor or a
compliant gear then explains noise. What the residual says of it is

    n̂ = E[n | r] = -S_n Mᵀ (M S_n Mᵀ + S_e)⁻¹ r,        E[(n - n̂) rᵀ] = 0:

accelerations a + n - n̂ have no noise in common with what is left. S_n is diagonal over frequencies and M over time;
the equations are solved by conjugate gradients, every product with S_n by Fourier transforms.

The prediction of torque by torque is none: these accelerations serve to tell effects apart, never to say how well a
model does (`Observations.as_measured`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import fft
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import LinearOperator, cg

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.residual import full_torque
from tauscope.diagnosis.observations.observations import BoolArray, Observations, Piece
from tauscope.diagnosis.observations.spikes import without_spikes
from tauscope.dynamics import mass_matrix
from tauscope.identification.dataset import prepared_motion
from tauscope.recording.conditioning.common_band import Decimator
from tauscope.recording.recording import Array

INERTIA_HZ = 25.0
"""Rate at which the mass matrix is made along a motion; it changes with the pose, far slower than any noise."""

TRANSITION = (1.5, 2.0)
"""Frequencies relative to the cut-off between which noise fades out of consideration: the band's own slope ends before,
and beyond it nothing enters any row."""

SOLVED = 1e-3
"""Residual of the conjugate gradients, relative to the right-hand side."""

MOST_STEPS = 100


def with_likely_accelerations(observations: Observations, model: ExtendedModel, cutoff_hz: float) -> Observations:
    """The observations with the positions' noise taken out of the accelerations as far as the torque shows it.

    Joints whose acceleration was not made of their positions, and torque that was not measured, say nothing of it.

    Parameters
    ----------
    cutoff_hz : float
        of the band that torque and columns share [Hz]
    """
    residuals = [_residual(model, piece) for piece in observations]
    torque_noise = _torque_noise(observations, residuals)
    pieces = tuple(
        _corrected(piece, residual, torque_noise, model, cutoff_hz)
        for piece, residual in zip(observations, residuals, strict=True)
    )
    return replace(observations, pieces=pieces)


def acceleration_noise(
    residual: Array,
    known: BoolArray,
    inertia: Array,
    density: Array,
    torque_noise: Array,
    rate_hz: float,
    cutoff_hz: float,
) -> Array:
    """n̂: the accelerations' most likely noise within and around a band, (n, N) [rad/s² or m/s²].

    Parameters
    ----------
    residual : (n, N) float64
        measured less modelled torque at the recorded rate, no filter [Nm or N]
    known : (n, N) bool
        where it is known
    inertia : (N, n, n) float64
        mass matrix M along the motion
    density : (n,) float64
        one-sided spectral density of the positions' noise S_q; zero of what has none [rad²/Hz or m²/Hz]
    torque_noise : (n,) float64
        variance S_e of a sample of the residual, as if it were white [(Nm)² or N²]
    rate_hz : float
        recorded rate [Hz]
    cutoff_hz : float
        of the band [Hz]
    """
    count, samples = residual.shape
    length = fft.next_fast_len(samples + int(rate_hz / cutoff_hz), real=True)
    frequency = np.fft.rfftfreq(length, 1.0 / rate_hz)
    near, far = (ratio * cutoff_hz for ratio in TRANSITION)
    considered = np.clip((far - frequency) / (far - near), 0.0, 1.0)
    spectrum = 0.5 * rate_hz * density[:, None] * (2.0 * np.pi * frequency) ** 4 * considered

    def noise_of(torque: Array) -> Array:
        """S_n Mᵀ u."""
        carried = np.einsum("tij,jt->it", inertia, torque)
        return fft.irfft(spectrum * fft.rfft(carried, length), length)[:, :samples]

    def covariance(flat: Array) -> Array:
        """(M S_n Mᵀ + S_e) u where the residual is known."""
        torque = np.where(known, flat.reshape(count, samples), 0.0)
        caused = np.einsum("tij,jt->it", inertia, noise_of(torque))
        return np.where(known, caused + torque_noise[:, None] * torque, flat.reshape(count, samples)).ravel()

    scale = np.where(known, torque_noise[:, None], 1.0).ravel()
    size = residual.size
    operator = LinearOperator((size, size), matvec=covariance, dtype=np.float64)
    preconditioner = LinearOperator((size, size), matvec=lambda flat: flat / scale, dtype=np.float64)
    target = np.where(known, residual, 0.0).ravel()
    weighted, _ = cg(operator, target, rtol=SOLVED, maxiter=MOST_STEPS, M=preconditioner)
    return -noise_of(np.where(known, weighted.reshape(count, samples), 0.0))


def _corrected(piece: Piece, residual: Array, torque_noise: Array, model: ExtendedModel, cutoff_hz: float) -> Piece:
    """A piece with most likely accelerations; one that no filter has limited, or of averages, as it is."""
    prepared, motion = piece.prepared, piece.prepared.motion
    if not _is_noisy(piece):
        return piece
    moves = motion.acceleration.any(axis=0) & piece.by_position
    noise = acceleration_noise(
        residual,
        np.ascontiguousarray(motion.measured[0].T),
        _inertia(piece, model),
        np.where(moves, piece.position_noise.density, 0.0),
        torque_noise,
        motion.rate_hz,
        cutoff_hz,
    )
    likely = replace(motion, acceleration=motion.acceleration - noise.T)
    structure = model.structure
    made = prepared_motion(likely, structure.robot, structure.base, prepared.recording)
    return replace(piece, prepared=made, memory={})


def _is_noisy(piece: Piece) -> bool:
    """Whether there is noise to be told from the torque."""
    return piece.repetitions == 1 and isinstance(piece.prepared.motion.band, Decimator)


def _residual(model: ExtendedModel, piece: Piece) -> Array:
    """Measured less modelled torque at the recorded rate, (n, N)."""
    return without_spikes(np.ascontiguousarray(piece.prepared.motion.torque[0].T)) - full_torque(model, piece)


def _torque_noise(observations: Observations, residuals: Sequence[Array]) -> Array:
    """Variance of white noise that leaves as much in the band as the residual does, (n,)."""
    squares, rows = 0.0, 0.0
    for piece, residual in zip(observations, residuals, strict=True):
        band = piece.prepared.motion.band
        gain = float(np.sum(band.kernel**2)) if isinstance(band, Decimator) else 1.0
        used = piece.used[:, 0]
        squares = squares + np.sum(band.reduce(residual) ** 2, axis=1, where=used) / gain
        rows = rows + used.sum(axis=1)
    return squares / np.maximum(rows, 1.0) + np.finfo(float).tiny


def _inertia(piece: Piece, model: ExtendedModel) -> Array:
    """Mass matrix along a piece of motion, (N, n, n)."""
    motion = piece.prepared.motion
    samples = len(motion.position)
    knots = np.unique(np.append(np.arange(0, samples, max(int(motion.rate_hz / INERTIA_HZ), 1)), samples - 1))
    at_knots = mass_matrix(model.structure.robot, model.standard_parameters(), motion.position[knots])
    return CubicSpline(knots, at_knots, axis=0)(np.arange(samples))
