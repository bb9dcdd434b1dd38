"""The recordings' rows as a diagnosis sees them: in one band, repetitions kept apart, every joint's noise white.

The positions of a repeated motion are averaged as for the identification, the torques are not: what differs from
repetition to repetition is noise, or something that changes over time, and must be seen.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from service.diagnosis.whitening import JointNoise
from service.dynamics.base_parameters import BaseParameters
from service.identification.dataset import Dataset, PreparedMotion
from service.recording.conditioning import Conditioner
from service.recording.recording import Array
from service.robot import Robot

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Piece:
    """One piece of motion with the torque of every repetition in the common band.

    prepared : PreparedMotion
        motion and rigid-body columns
    torque : (n, P, M) float64
        measured torque in the common band
    used : (n, P, M) bool
        rows that rest on measured torque
    time : (P, N) float64
        instants at the recorded rate, from the beginning of the recording [s]
    """

    prepared: PreparedMotion
    torque: Array
    used: BoolArray
    time: Array

    @property
    def repetitions(self) -> int:
        """P."""
        return self.torque.shape[1]

    @property
    def rows(self) -> int:
        """Rows of one repetition, M."""
        return self.torque.shape[2]

    def reduced(self, values: Array) -> Array:
        """Signals (k, N) or (k, P, N) in the common band, all repetitions one after another, (k, P M).

        Parameters
        ----------
        values : (k, N) or (k, P, N) float64
            at the recorded rate
        """
        rows = self.prepared.motion.band.reduce(values)
        return self.repeated(rows) if rows.ndim == 2 else rows.reshape(len(rows), -1)

    def repeated(self, rows: Array) -> Array:
        """Rows (k, M) that are the same in every repetition, (k, P M).

        Parameters
        ----------
        rows : (k, M) float64
            in the common band
        """
        return rows if self.repetitions == 1 else np.tile(rows, (1, self.repetitions))

    def row_times(self) -> Array:
        """Instant of every row, (P M,) [s]."""
        motion = self.prepared.motion
        offset = (len(motion.time) - 1 - (self.rows - 1) * motion.rate_hz / motion.band.rate_hz) / 2.0
        first = self.time[:, :1] + max(offset, 0.0) / motion.rate_hz
        return (first + np.arange(self.rows) / motion.band.rate_hz).ravel()


@dataclass(frozen=True, eq=False)
class Observations:
    """All pieces of some recordings.

    robot : Robot
        the arm
    pieces : tuple of Piece
        in the order of the recordings
    names : tuple of str
        the recordings
    noise : tuple of JointNoise
        one a joint; empty until it is known
    """

    robot: Robot
    pieces: tuple[Piece, ...]
    names: tuple[str, ...]
    noise: tuple[JointNoise, ...] = ()
    _kept: dict[int, BoolArray] = field(default_factory=dict, repr=False)

    @staticmethod
    def prepare(
        conditioners: Sequence[Conditioner], robot: Robot, base: BaseParameters, cutoff_hz: float | None
    ) -> "Observations":
        """Condition recordings in a band.

        Parameters
        ----------
        conditioners : sequence of Conditioner
            the surveyed recordings
        robot : Robot
            the arm
        base : BaseParameters
            its identifiable combinations
        cutoff_hz : float or None
            the common band [Hz]; None for no filter
        """
        starts = [float(c.recording.samples(0, 1).time[0]) for c in conditioners]
        prepared = Dataset(conditioners, robot, base, cutoff_hz)
        pieces = tuple(_piece(each, starts[each.recording]) for each in prepared)
        return Observations(robot, pieces, tuple(c.recording.name for c in conditioners))

    def with_noise(self, noise: Sequence[JointNoise]) -> "Observations":
        """The same rows with their noise known.

        Parameters
        ----------
        noise : sequence of JointNoise, length n
            one a joint
        """
        return replace(self, noise=tuple(noise), _kept={})

    @property
    def repeated(self) -> bool:
        """Whether any motion is there more than once."""
        return any(piece.repetitions > 1 for piece in self.pieces)

    def torque(self, joint: int) -> list[Array]:
        """Measured torque of one joint in the common band, piece by piece, (1, P M) each.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        return [piece.torque[joint].reshape(1, -1) for piece in self.pieces]

    def white(self, joint: int, rows: Sequence[Array]) -> Array:
        """Rows of all pieces, whitened, those that were not measured left out, (k, R).

        Parameters
        ----------
        joint : int
            joint index, from 0
        rows : sequence of (k, P M) float64
            a piece each
        """
        whitened = np.concatenate([self.noise[joint].whitened(each) for each in rows], axis=-1)
        kept = self.kept(joint)
        return whitened if kept.all() else whitened[..., kept]

    def kept(self, joint: int) -> BoolArray:
        """Whitened rows that count.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        if joint not in self._kept:
            self._kept[joint] = np.concatenate(
                [self.noise[joint].kept(piece.used[joint].ravel()) for piece in self.pieces]
            )
        return self._kept[joint]

    def row_labels(self, joint: int) -> tuple[NDArray[np.intp], Array]:
        """Recording and instant of every whitened row that counts, (R,) each.

        Parameters
        ----------
        joint : int
            joint index, from 0
        """
        order = self.noise[joint].order
        recording = [np.full(piece.repetitions * piece.rows - order, piece.prepared.recording) for piece in self.pieces]
        instants = [piece.row_times()[order:] for piece in self.pieces]
        kept = self.kept(joint)
        return np.concatenate(recording)[kept], np.concatenate(instants)[kept]

    def __iter__(self) -> Iterator[Piece]:
        """The pieces."""
        return iter(self.pieces)


def _piece(prepared: PreparedMotion, start_s: float) -> Piece:
    """The torque of every repetition in the common band."""
    motion = prepared.motion
    length = len(motion.time) / motion.rate_hz
    time = motion.time - start_s + length * np.arange(motion.repetitions)[:, None]
    reduce, reduce_mask = motion.band.reduce, motion.band.reduce_mask
    used = np.stack([reduce_mask(np.ascontiguousarray(measured.T)) for measured in motion.measured], axis=1)
    torque = np.stack([reduce(np.ascontiguousarray(each.T)) for each in motion.torque], axis=1)
    return Piece(prepared, torque, used, time)
