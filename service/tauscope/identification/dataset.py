"""The recordings' equations, ready to be summed: kept in memory while they are few, made again when they are many."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import ndimage

from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.dynamics.regressor import TorqueRegressor
from tauscope.identification.structure import ModelStructure
from tauscope.recording.conditioning import Conditioner, Mask, Motion
from tauscope.recording.conditioning.common_band import HarmonicBand
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Bytes of columns that are kept between passes; beyond, every pass conditions the recording again.
MEMORY_LIMIT = 256 * 1024 * 1024


REST_S = 0.1  # a joint that moves by no more than its encoder resolves for so long stands still [s]
STOP_S = 0.5  # a joint that stands so long is held by its friction; a shorter rest is a turning point [s]
MOSTLY = 0.1  # share of a row's samples at rest from which on it says little of the noise in motion
FEWEST_AT_REST = 3  # samples that tell rest from a turning point


@dataclass(frozen=True, eq=False)
class PreparedMotion:
    """One piece of motion; `rigid`: (m_j, N) a joint, columns of the links that it moves, at the recorded rate."""

    motion: Motion
    rigid: tuple[Array, ...]
    reduced_rigid: tuple[Array, ...]  # tuple of (m_j, M), length n, the same in the common band, decimated
    reduced_torque: Array  # (n, M), measured torque in the common band, mean of the repetitions
    used: Mask  # (n, M), rows that rest on measured torque
    at_rest: Array  # (n, M), share of each row's samples at which the joint stands still
    rest_variance: Array  # (n,), variance of friction at rest over that of a row's noise
    recording: int

    @property
    def row_weight(self) -> float:
        """√P: a mean of P repetitions has 1/P of the noise variance."""
        return float(np.sqrt(self.motion.repetitions))

    def whiten(self, joint: int, rows: Array) -> Array:
        """Rows of a joint's equations (k, M) in units of their noise; zero where none was measured.

        At rest friction holds with any torque up to breakaway, the same one throughout a stop: the covariance of its L
        rows is σ² (1 + v 1 1ᵀ), so their mean counts for 1 / √(1 + v L) of itself and their differences for all.
        """
        white = rows * (self.used[joint] * self.row_weight)
        if self.rest_variance[joint] > 0.0:
            for stop in self.stops(joint):
                held = np.flatnonzero(self.used[joint, stop]) + stop.start
                kept = 1.0 / np.sqrt(1.0 + self.rest_variance[joint] * len(held))
                white[:, held] -= (1.0 - kept) * white[:, held].mean(axis=1, keepdims=True)
        return white

    def stops(self, joint: int) -> list[slice]:
        """Consecutive rows of every stop of a joint: longer than a turning point, or cut short by the motion's edge."""
        resting = self.at_rest[joint] >= MOSTLY
        edges = np.flatnonzero(np.diff(resting, prepend=False, append=False)).reshape(-1, 2)
        least = STOP_S * self.motion.band.rate_hz
        is_stop = (edges[:, 1] - edges[:, 0] >= least) | (edges[:, 0] == 0) | (edges[:, 1] == len(resting))
        stops = (slice(*each) for each in edges[is_stop].tolist())
        return [stop for stop in stops if self.used[joint, stop].any()]

    @property
    def moving(self) -> Mask:
        """Rows that tell of noise: of a joint that never moves all, else those in which it mostly moves, (n, M)."""
        moving = self.used & (self.at_rest < MOSTLY)
        return np.where(moving.any(axis=1, keepdims=True), moving, self.used)

    @property
    def nbytes(self) -> int:
        """Memory of the columns [bytes]."""
        return sum(columns.nbytes for columns in (*self.rigid, *self.reduced_rigid))

    def joint_columns(self, structure: ModelStructure, joint: int) -> Array:
        """All columns of a joint's equation in the common band, (p_j, M)."""
        return np.concatenate(self.joint_column_groups(structure, joint))

    def joint_column_groups(self, structure: ModelStructure, joint: int) -> tuple[Array, Array]:
        """The same columns without a copy: those of the links that the joint moves, and its own terms."""
        motion = self.motion
        own = structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
        return self.reduced_rigid[joint], motion.band.reduce(own)

    def predicted_rows(self, structure: ModelStructure, parameters: Array) -> Array:
        """Model torque in the common band, (n, M). `parameters`: (p,), one parameter set."""
        motion = self.motion
        outward, others = [], []
        for joint, rigid in enumerate(self.reduced_rigid):
            links, own = np.split(parameters[structure.joint_columns(joint)], [len(rigid)])
            terms = structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
            outward.append(links @ rigid)
            others.append(own @ terms)
        return np.stack(outward) + motion.band.reduce(np.stack(others))

    def predict_torque(self, structure: ModelStructure, candidates: Array) -> Array:
        """Torque, (c, n, N), at the recorded rate, before any filter, of parameter sets `candidates`, (c, p)."""
        motion = self.motion
        samples, count = motion.position.shape
        torque = np.empty((len(candidates), count, samples))
        for joint in range(count):
            own = structure.joint_term_columns(joint, motion.velocity[:, joint], motion.acceleration[:, joint])
            outward, others = np.split(structure.joint_columns(joint), [len(self.rigid[joint])])
            torque[:, joint] = candidates[:, outward] @ self.rigid[joint]
            torque[:, joint] += candidates[:, others] @ own
        return torque


@dataclass(eq=False)
class Dataset:
    """All pieces of motion of some recordings, in one band, that can be gone through again and again."""

    conditioners: Sequence[Conditioner]
    robot: Robot
    base: BaseParameters
    cutoff_hz: float | None  # the common band; None for no filter
    rest_variance: Array | None = None
    _kept: list[PreparedMotion] | None = field(default=None, repr=False)
    _too_large: bool = field(default=False, repr=False)

    def __iter__(self) -> Iterator[PreparedMotion]:
        """The pieces in the order of the recordings; computed once where they fit into `MEMORY_LIMIT`."""
        if self._kept is not None:
            yield from map(self._doubt_rest, self._kept)
            return
        kept: list[PreparedMotion] = []
        size = 0
        for prepared in self._prepare():
            size += prepared.nbytes
            self._too_large = self._too_large or size > MEMORY_LIMIT
            if self._too_large:
                kept.clear()
            else:
                kept.append(prepared)
            yield self._doubt_rest(prepared)
        if not self._too_large:
            self._kept = kept

    def _doubt_rest(self, prepared: PreparedMotion) -> PreparedMotion:
        """The piece with what is known of friction at rest."""
        return prepared if self.rest_variance is None else replace(prepared, rest_variance=self.rest_variance)

    def _prepare(self) -> Iterator[PreparedMotion]:
        for index, conditioner in enumerate(self.conditioners):
            for measured in conditioner.motions(self.cutoff_hz):
                motion = _without_jitter(measured, conditioner.moving)
                yield prepared_motion(motion, self.robot, self.base, index, conditioner.resolution)


def prepared_motion(
    motion: Motion, robot: Robot, base: BaseParameters, recording: int, resolution: Array | None = None
) -> PreparedMotion:
    """One piece with its rigid-body columns; `resolution`: (n,), least motion that is none of the noise, for rest."""
    regressor = TorqueRegressor(robot, columns=base.independent_columns)
    whole = np.empty((robot.joint_count, regressor.column_count, len(motion.position)))
    regressor.write_shares(motion.position, motion.velocity, motion.acceleration, whole)
    rigid = tuple(row[base.outward(joint)] for joint, row in enumerate(whole))
    reduce = motion.band.reduce
    return PreparedMotion(
        motion,
        rigid,
        tuple(reduce(columns) for columns in rigid),
        reduce(np.ascontiguousarray(motion.mean_torque.T)),
        motion.band.reduce_mask(np.asarray(motion.measured.any(axis=0)).T),
        _at_rest(motion, resolution),
        np.zeros(robot.joint_count),
        recording,
    )


def _at_rest(motion: Motion, resolution: Array | None) -> Array:
    """Share of each row's samples within a stretch of `REST_S` in which a joint moves by no more than it resolves."""
    window = min(round(REST_S * motion.rate_hz) + 1, len(motion.position))
    shape = (motion.position.shape[1], len(motion.position))
    if resolution is None or window < FEWEST_AT_REST or isinstance(motion.band, HarmonicBand):
        return np.zeros_like(motion.band.reduce(np.zeros(shape)))
    position = motion.position.T
    span = ndimage.maximum_filter1d(position, window, axis=1) - ndimage.minimum_filter1d(position, window, axis=1)
    still = ndimage.maximum_filter1d((span <= resolution[:, None]).astype(float), window, axis=1)
    return np.clip(motion.band.reduce(still), 0.0, 1.0)


def _without_jitter(motion: Motion, moving: Mask) -> Motion:
    """The motion with joints that stand still standing still: their encoder's noise is no friction's velocity."""
    if moving.all():
        return motion
    return replace(motion, velocity=motion.velocity * moving, acceleration=motion.acceleration * moving)


def rms_speed(motions: Iterable[PreparedMotion]) -> Array:
    """Root mean square of every joint's velocity, at least 1e-9, (n,) [rad/s or m/s]."""
    squares, count = 0.0, 0
    for prepared in motions:
        squares = squares + np.sum(prepared.motion.velocity**2, axis=0)
        count += len(prepared.motion.velocity)
    return np.maximum(np.sqrt(squares / count), 1e-9)
