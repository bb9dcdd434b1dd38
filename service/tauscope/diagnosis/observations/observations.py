"""The recordings' rows as a diagnosis sees them: in one band, repetitions kept apart, every joint's noise white.

An identification averages a motion's repetitions. Here each counts as the motion that it was: under stiff friction a
joint that comes to rest creeps a little differently every time, and the average's torque is nobody's. What differs
between repetitions beyond their motion is noise, or a change over time (`tauscope.diagnosis.noise.floor`).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.observations.band import STATE_BANDS, quiet_cutoffs, state_cutoffs
from tauscope.diagnosis.observations.channels import read_temperature, without_spikes
from tauscope.diagnosis.observations.whitening import JointNoise, RowWeighting
from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.identification.dataset import Dataset, PreparedMotion
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.conditioning.filters import smooth
from tauscope.recording.conditioning.position_noise import PositionNoise
from tauscope.recording.recording import Array
from tauscope.robot import Robot

BoolArray = NDArray[np.bool_]
FINEST = 1e-6  # least noise of a joint, relative to its rms torque: no sensor has 20 bits, no simulation needs them
LEFT_OUT = 100.0  # factor to the noise of a joint that is left out


@dataclass(frozen=True)
class Repetition:
    """Where the motion of a recording repeats."""

    start_s: float  # since the beginning of the recording [s]
    length_s: float  # of one period [s]
    count: int


@dataclass(frozen=True, eq=False)
class Piece:
    """One piece of motion with the torque of every repetition in the common band."""

    prepared: PreparedMotion
    torque: Array  # (n, P, M), measured torque in the common band
    used: BoolArray  # (n, P, M), rows that rest on measured torque
    time: Array  # (P, N), instants at the recorded rate, from the beginning of the recording [s]
    state_hz: Array  # (n,), band of each joint's own motion [Hz]
    position_noise: PositionNoise
    # (n,), bands in which the velocities say most of single samples [Hz]; None for no filter
    quiet_hz: Array | None = None
    rigid_hz: float | None = None  # band in which the accelerations do [Hz]; None for no filter
    # (n, P, N), at these instants [°C]; NaN at joints without a sensor, None where there is none
    temperature: Array | None = None
    memory: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def velocity_std(self) -> Array:
        """Noise of the velocity in the motion's own band, (n,) [rad/s or m/s]: σ² = D (2π)² f³/3."""
        return 2.0 * np.pi * np.sqrt(self.position_noise.density * self.state_hz**3 / 3.0)

    @property
    def repetitions(self) -> int:
        """P."""
        return self.torque.shape[1]

    @property
    def rows(self) -> int:
        """Rows of one repetition, M."""
        return self.torque.shape[2]

    def reduced(self, values: Array) -> Array:
        """`values`, (k, N) or (k, P, N), in the common band, all repetitions one after another, (k, P M)."""
        rows = self.prepared.motion.band.reduce(values)
        return self.repeated(rows) if rows.ndim == 2 else rows.reshape(len(rows), -1)

    def repeated(self, rows: Array) -> Array:
        """Rows (k, M) that are the same in every repetition, (k, P M). `rows`: (k, M), in the common band."""
        return rows if self.repetitions == 1 else np.tile(rows, (1, self.repetitions))

    def without_noise_of_inertia(self, values: Array) -> Array:
        """Accelerations or torque of links, `values`, (n, N), without what lies far above the common band.

        Friction's step needs the motion's whole band; inertia does not, and multiplies that band's noise by the square
        of its frequency, which a column that is not linear in it would fold back.
        """
        if self.rigid_hz is None:
            return np.ascontiguousarray(values)
        return np.ascontiguousarray(smooth(values.T, self.prepared.motion.rate_hz, self.rigid_hz).T)

    def quiet_acceleration(self) -> Array:
        """The motion's acceleration `without_noise_of_inertia`, (n, N): made once."""
        if "quiet_acceleration" not in self.memory:
            self.memory["quiet_acceleration"] = self.without_noise_of_inertia(self.prepared.motion.acceleration.T)
        return self.memory["quiet_acceleration"]

    def quiet_rigid(self) -> list[Array]:
        """Columns (m_j, N) of the links that each joint moves `without_noise_of_inertia`: made once."""
        if "quiet_rigid" not in self.memory:
            self.memory["quiet_rigid"] = [self.without_noise_of_inertia(own) for own in self.prepared.rigid]
        return self.memory["quiet_rigid"]

    def row_times(self) -> Array:
        """Instant of every row, (P M,) [s]."""
        motion = self.prepared.motion
        offset = (len(motion.time) - 1 - (self.rows - 1) * motion.rate_hz / motion.band.rate_hz) / 2.0
        first = self.time[:, :1] + max(offset, 0.0) / motion.rate_hz
        return (first + np.arange(self.rows) / motion.band.rate_hz).ravel()


@dataclass(frozen=True, eq=False)
class Observations:
    """All pieces of some recordings."""

    robot: Robot
    pieces: tuple[Piece, ...]
    names: tuple[str, ...]
    noise: tuple[JointNoise, ...] = ()
    repetitions: tuple[tuple[Repetition, ...], ...] = ()
    weightings: tuple[RowWeighting, ...] = ()
    _kept: dict[int, BoolArray] = field(default_factory=dict, repr=False)

    @staticmethod
    def prepare(
        conditioners: Sequence[Conditioner],
        robot: Robot,
        base: BaseParameters,
        cutoff_hz: float | None,
        steepness: Array,
    ) -> "Observations":
        """Condition recordings in a band [Hz], None for no filter, that of the motion itself by K_v, (n,)."""
        starts = [float(c.recording.samples(0, 1).time[0]) for c in conditioners]
        bands = [state_cutoffs(c, cutoff_hz, steepness) for c in conditioners]
        quiet = [quiet_cutoffs(c, cutoff_hz, steepness) for c in conditioners]
        apart = [c.as_one_motion(band) for c, band in zip(conditioners, bands, strict=True)]
        prepared = Dataset(apart, robot, base, cutoff_hz)
        return Observations(
            robot,
            pieces=tuple(
                replace(
                    _piece(each, starts[each.recording], conditioners[each.recording], bands[each.recording]),
                    quiet_hz=quiet[each.recording],
                    rigid_hz=None if cutoff_hz is None else STATE_BANDS[0] * cutoff_hz,
                )
                for each in prepared
            ),
            names=tuple(c.recording.name for c in conditioners),
            repetitions=tuple(
                tuple(Repetition(run.start_s - start, run.length_s, run.count) for run in c.timing.runs)
                for c, start in zip(conditioners, starts, strict=True)
            ),
        )

    def with_noise(self, noise: Sequence[JointNoise]) -> "Observations":
        """The same rows with their noise known, which is never finer than sensors and simulations are."""
        rms = [np.sqrt(np.mean(np.concatenate(self.torque(joint), axis=1) ** 2)) for joint in range(len(noise))]
        known = tuple(own.at_least(FINEST * float(each)) for own, each in zip(noise, rms, strict=True))
        return replace(self, noise=known, weightings=(), _kept={})

    def with_weightings(self, weightings: Sequence[RowWeighting]) -> "Observations":
        """The same rows, counting as much as they say."""
        return replace(self, weightings=tuple(weightings))

    def without_joints(self, joints: Collection[int]) -> "Observations":
        """The same rows, those of some joints as good as left out: what no other joint tells stays what it is."""
        noise = [own.times(LEFT_OUT) if joint in joints else own for joint, own in enumerate(self.noise)]
        return replace(self, noise=tuple(noise))

    def apart(self) -> "Observations":
        """The same pieces with negative indices of recordings: none of them is one of training."""
        pieces = [
            replace(piece, prepared=replace(piece.prepared, recording=-1 - piece.prepared.recording)) for piece in self
        ]
        return replace(self, pieces=tuple(pieces))

    def torque(self, joint: int) -> list[Array]:
        """Measured torque of one joint in the common band, piece by piece, (1, P M) each."""
        return [piece.torque[joint].reshape(1, -1) for piece in self.pieces]

    def white(self, joint: int, rows: Sequence[Array]) -> Array:
        """Rows of all pieces, (k, P M) each, whitened, those that were not measured left out, (k, R)."""
        whitened = np.concatenate([self.noise[joint].whitened(each) for each in rows], axis=-1)
        kept = self.kept(joint)
        counted = whitened if kept.all() else whitened[..., kept]
        return self.weightings[joint].applied(counted) if self.weightings else counted

    def independent_rows(self, joint: int, rows: Array) -> float:
        """Number of independent white rows, (R,), of a joint; one that tells less than a whole one is a part."""
        told = float(np.sum(self.weightings[joint].weights ** 2)) if self.weightings else float(len(rows))
        return self.noise[joint].share * told

    def kept(self, joint: int) -> BoolArray:
        """Mask of the whitened rows that count, (rows,)."""
        if joint not in self._kept:
            self._kept[joint] = np.concatenate(
                [self.noise[joint].kept(piece.used[joint].ravel()) for piece in self.pieces]
            )
        return self._kept[joint]

    def row_labels(self, joint: int) -> tuple[NDArray[np.intp], Array]:
        """Recording and instant of every whitened row that counts, (R,) each."""
        order = self.noise[joint].order
        recording = [np.full(piece.repetitions * piece.rows - order, piece.prepared.recording) for piece in self.pieces]
        instants = [piece.row_times()[order:] for piece in self.pieces]
        kept = self.kept(joint)
        return np.concatenate(recording)[kept], np.concatenate(instants)[kept]

    def __iter__(self) -> Iterator[Piece]:
        """The pieces."""
        return iter(self.pieces)


def _piece(prepared: PreparedMotion, start_s: float, conditioner: Conditioner, state_hz: Array | None) -> Piece:
    """The torque of every repetition in the common band."""
    motion = prepared.motion
    length = len(motion.time) / motion.rate_hz
    time = motion.time - start_s + length * np.arange(motion.repetitions)[:, None]
    reduce, reduce_mask = motion.band.reduce, motion.band.reduce_mask
    used = np.stack([reduce_mask(np.ascontiguousarray(measured.T)) for measured in motion.measured], axis=1)
    torque = np.stack([reduce(without_spikes(np.ascontiguousarray(each.T))) for each in motion.torque], axis=1)
    widest = np.full(motion.position.shape[1], motion.rate_hz / 2.0)
    width = widest if state_hz is None else np.minimum(state_hz, widest)
    temperature = read_temperature(conditioner, time + start_s)
    return Piece(prepared, torque, used, time, width, conditioner.noise, temperature=temperature)
