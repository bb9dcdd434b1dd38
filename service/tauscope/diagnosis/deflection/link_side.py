"""A recording as the encoders on the links see it, and by how much each link lags its motor."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import mean_inertia
from tauscope.dynamics import smooth_sign
from tauscope.errors import RecordingError
from tauscope.identification.dataset import prepared_motion
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.conditioning.position_noise import encoder_step
from tauscope.recording.link_encoders import LinkEncoders, find_link_encoders
from tauscope.recording.samples import Array, Table

LIGHT = 0.2  # load, over its rms, below which teeth may be apart: errors of the load are of this size


@dataclass(frozen=True, eq=False)
class LinkRows:
    """One joint's deflection and the states that may explain it, in the common band, (M,) each."""

    recording: int
    deflection: Array  # (M,), q - q_link [rad or m]
    load: Array  # (M,), torque of the rigid body [Nm or N]
    side: Array  # (M,), side of the teeth on which that load presses, -1 … 1
    position: Array  # (M,), of the link; as are velocity and acceleration
    velocity: Array
    acceleration: Array
    direction: Array  # (M,), A(q̇), the smooth sign of the velocity
    rigid: Array  # (m, M), columns of the base parameters that make the load
    inertia: float  # mean inertia of the link and all that it carries [kg m² or kg]
    resolution: float  # step or noise of the encoders [rad or m]
    rate_hz: float  # of the rows [Hz]

    def stretches(self, length_s: float) -> NDArray[np.intp]:
        """Number of the stretch of so many seconds that each row belongs to, (M,). `length_s`: of a stretch [s]."""
        return (np.arange(len(self.load)) / (self.rate_hz * length_s)).astype(np.intp)


@dataclass(frozen=True, eq=False)
class _LinkTable:
    """A recording's table with the links' positions in the place of the motors', without what derives from q."""

    source: Table
    lag: Array  # (N, n), by how much each link lags its motor; zero at joints without an encoder on the link [rad or m]
    kept: NDArray[np.intp]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that are kept."""
        return tuple(self.source.names[place] for place in self.kept)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.source)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop."""
        block = self.source.rows(start, stop)[:, self.kept]
        block[:, 1 : 1 + self.lag.shape[1]] -= self.lag[start:stop]
        return block


def link_recording(recording: Recording, encoders: LinkEncoders) -> Recording:
    """The recording with positions as the links' encoders see them, each link's zero where its motor's is."""
    names = recording.table.names
    kept = [place for place, name in enumerate(names) if not name.startswith(("qd", "qlink", "qref"))]
    lag = np.zeros_like(encoders.lag)
    lag[:, encoders.joints] = encoders.lag[:, encoders.joints]
    table = _LinkTable(recording.table, lag, np.array(kept))
    return Recording(recording.name, recording.joint_count, recording.effort_kind, table)


def link_rows(
    recording: Recording, number: int, model: ExtendedModel, cutoff_hz: float | None
) -> Iterator[tuple[int, LinkRows]]:
    """Joints that have an encoder on the link, with the rows of one recording in the band, piece by piece."""
    robot, structure = model.structure.robot, model.structure
    if not recording.has("qlink"):
        return
    samples = recording.samples()
    encoders = find_link_encoders(samples, [joint.type for joint in robot.joints])
    if encoders is None or samples.link_position is None or not encoders.joints:
        return
    step = np.maximum(encoder_step([samples.position]), encoder_step([samples.link_position]))
    try:
        conditioner = Conditioner.survey(link_recording(recording, encoders), robot).as_one_motion(None)
        motions = list(conditioner.motions(cutoff_hz))
    except RecordingError:  # an encoder that misses too much says nothing
        return
    resolution = np.maximum(step, conditioner.position_noise_std)
    for motion in motions:
        prepared = prepared_motion(motion, robot, structure.base, number)
        inertia = mean_inertia(robot, model.standard_parameters(), motion.position)
        for joint in encoders.joints:
            known = np.isfinite(encoders.lag[:, joint])
            load = (
                model.parameters[structure.joint_columns(joint)][: len(prepared.rigid[joint])] @ prepared.rigid[joint]
            )
            velocity = motion.velocity[:, joint]
            rms = max(float(np.sqrt(np.mean(load**2))), np.finfo(float).tiny)
            rows = [
                np.interp(motion.time, samples.time[known], encoders.lag[known, joint]),
                load,
                np.clip(load / (LIGHT * rms), -1.0, 1.0),
                motion.position[:, joint],
                velocity,
                motion.acceleration[:, joint],
                smooth_sign(velocity, structure.terms[joint].k_v),
            ]
            yield (
                joint,
                LinkRows(
                    number,
                    *motion.band.reduce(np.stack(rows)),
                    rigid=prepared.reduced_rigid[joint],
                    inertia=float(inertia[joint]),
                    resolution=float(resolution[joint]),
                    rate_hz=motion.band.rate_hz,
                ),
            )
