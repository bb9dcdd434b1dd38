"""One pass over the data for everything that residuals tell: fit, noise, autocorrelation."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tauscope.identification.autocorrelation import (
    FILTERED_LAGS,
    LARGEST_ORDER,
    AutocovarianceSum,
    Autoregression,
    LaggedProducts,
)
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.structure import ModelStructure
from tauscope.recording.conditioning import AllPass, Stretch, split_periods
from tauscope.recording.recording import Array

FEWEST_PERIOD_SAMPLES = 50  # differences between periods that are needed before their variance is trusted
LEAST_TORQUE = 1e-12  # share of the residual below which a recording has no torque to be compared with
CLEARLY_MORE = 1.3  # ratio of two estimated powers that is no chance


@dataclass(frozen=True, eq=False)
class Fit:
    """How well a parameter set explains the torque."""

    rms: Array  # (n,), root mean square of the torque residual at the recorded rate, no filter [Nm or N]
    band_rms: Array  # (n,), the same in the common band
    moving_rms: Array  # (n,), the same in the common band, of rows in which the joint moves
    torque_rms: Array  # (n,), root mean square of the measured torque in the common band [Nm or N]
    relative_error: float


@dataclass(frozen=True, eq=False)
class ResidualStatistics:
    """What the residuals of one parameter set tell."""

    fit: Fit
    period_noise_std: Array | None  # (n,), of the torque noise by what differs between periods; None without enough
    raw_lags: tuple[AutocovarianceSum, ...]
    band_lags: tuple[AutocovarianceSum, ...]
    unfiltered: bool

    @property
    def noise_method(self) -> str:
        """``periods`` (model-free) or ``residual``."""
        return "residual" if self.period_noise_std is None else "periods"

    @cached_property
    def noise_std(self) -> Array:
        """Standard deviation of the torque noise, a sample at the recorded rate, (n,) [Nm or N]."""
        if self.period_noise_std is not None:
            return self.period_noise_std
        return np.sqrt([lags.model().innovation_variance for lags in self.raw_lags])

    @cached_property
    def autoregressions(self) -> tuple[Autoregression, ...]:
        """Autoregressive model of each joint's residual in the common band.

        Where periods were averaged and nothing was filtered, the single periods show the same noise many times over and
        tell it best; unless the mean has clearly more power at low frequency, which is then what the model lacks.
        """
        means = tuple(lags.model() for lags in self.band_lags)
        if not self.unfiltered or self.raw_lags is self.band_lags:
            return means
        singles = (lags.model() for lags in self.raw_lags)
        return tuple(
            mean if _low_power(mean) > CLEARLY_MORE * _low_power(single) else single
            for mean, single in zip(means, singles, strict=True)
        )


def _low_power(model: Autoregression) -> float:
    return model.variance * model.long_run_ratio


def evaluate(
    motions: Iterable[PreparedMotion], structure: ModelStructure, candidates: Sequence[Array]
) -> tuple[ResidualStatistics, ...]:
    """Residual statistics of several parameter sets in one pass. `candidates`: sequence of (p,), parameter sets."""
    sums = [_Sums(structure.robot.joint_count) for _ in candidates]
    for prepared in motions:
        predicted = prepared.predict_torque(structure, np.stack(candidates))
        for torque, total in zip(predicted, sums, strict=True):
            total.add(prepared, torque)
    return tuple(total.statistics() for total in sums)


class _MeanSquare:
    """Running mean square of every joint's samples, of those that count."""

    def __init__(self, joint_count: int) -> None:
        self.squares, self._count = np.zeros(joint_count), np.zeros(joint_count)

    def add(self, values: Array, used: NDArray[np.bool_], repetitions: int = 1) -> None:
        """Add samples (n, M) that stand for so many each."""
        kept = values if used.all() else np.where(used, values, 0.0)
        self.squares += repetitions * np.einsum("jt,jt->j", kept, kept)
        self._count += repetitions * used.sum(axis=1)

    @property
    def rms(self) -> Array:
        """Root mean square, (n,)."""
        return np.sqrt(self.squares / np.maximum(self._count, 1))


class _Sums:
    """Running sums for one parameter set."""

    def __init__(self, joint_count: int) -> None:
        self._raw, self._band, self._moving, self._torque = (_MeanSquare(joint_count) for _ in range(4))
        self._period_squares, self._period_count = np.zeros(joint_count), np.zeros(joint_count)
        self._raw_lags = tuple(AutocovarianceSum() for _ in range(joint_count))
        self._band_lags = tuple(AutocovarianceSum(FILTERED_LAGS) for _ in range(joint_count))
        self._unfiltered, self._unaveraged = True, True

    def add(self, prepared: PreparedMotion, predicted: Array) -> None:
        """Add one piece of motion with its predicted torque (n, N)."""
        motion = prepared.motion
        self._unfiltered = self._unfiltered and isinstance(motion.band, AllPass)
        self._unaveraged = self._unaveraged and motion.repetitions == 1
        band = prepared.reduced_torque - motion.band.reduce(predicted)
        filtered_white = motion.band.filtered_white(FILTERED_LAGS)
        lags = LARGEST_ORDER if filtered_white is None else FILTERED_LAGS
        lagged = [
            LaggedProducts.of(row * prepared.row_weight, moving, lags)
            for row, moving in zip(band, prepared.moving, strict=True)
        ]
        for total, products in zip(self._band_lags, lagged, strict=True):
            total.add(products, filtered_white)
        self._band.add(band, prepared.used, motion.repetitions)
        self._moving.add(band, prepared.moving, motion.repetitions)
        self._torque.add(prepared.reduced_torque, prepared.used, motion.repetitions)
        self._add_raw(prepared, predicted, lagged)

    def _add_raw(self, prepared: PreparedMotion, predicted: Array, lagged: Sequence[LaggedProducts]) -> None:
        """Add the residual at the recorded rate; `lagged` is that of the common band."""
        motion = prepared.motion
        torque, measured = (np.ascontiguousarray(values.swapaxes(1, 2)) for values in (motion.torque, motion.measured))
        residual = torque - predicted
        self._add_periods(prepared, residual.swapaxes(1, 2))
        residual, measured = residual[..., motion.own], measured[..., motion.own]  # windows overlap: count samples once
        for repetition, known in zip(residual, measured, strict=True):
            self._raw.add(repetition, known)
        if isinstance(motion.band, AllPass) and motion.repetitions == 1:  # nothing was filtered: the same series
            for total, products in zip(self._raw_lags, lagged, strict=True):
                total.add(products)
            return
        for repetition, known in zip(residual, measured, strict=True):
            for total, row, used in zip(self._raw_lags, repetition, known, strict=True):
                total.add(LaggedProducts.of(row, used))

    def statistics(self) -> ResidualStatistics:
        """The sums, turned into what they stand for."""
        left, torque = self._band.squares.sum(), self._torque.squares.sum()
        relative = np.sqrt(left / max(torque, LEAST_TORQUE**2 * left, np.finfo(float).tiny))
        fit = Fit(self._raw.rms, self._band.rms, self._moving.rms, self._torque.rms, float(relative))
        by_periods = bool((self._period_count >= FEWEST_PERIOD_SAMPLES).all())
        noise = np.sqrt(self._period_squares / self._period_count) if by_periods else None
        raw_lags = self._band_lags if self._unfiltered and self._unaveraged else self._raw_lags
        return ResidualStatistics(fit, noise, raw_lags, self._band_lags, self._unfiltered)

    def _add_periods(self, prepared: PreparedMotion, residual: Array) -> None:
        """What differs between repetitions of the same motion is noise, whatever the model."""
        motion = prepared.motion
        measured = motion.measured
        if motion.repetitions == 1:
            periods = split_periods(
                Stretch(0.0, motion.rate_hz, residual[0], residual[0], measured[0], motion.period, False)
            )
            if periods is None:
                return
            residual, measured = periods.torque, periods.measured
        count = measured.sum(axis=0)
        mean = np.where(measured, residual, 0.0).sum(axis=0) / np.maximum(count, 1)
        deviation = np.where(measured, residual - mean, 0.0)
        self._period_squares += np.einsum("pij,pij->j", deviation, deviation)
        self._period_count += np.maximum(count - 1, 0).sum(axis=0)
