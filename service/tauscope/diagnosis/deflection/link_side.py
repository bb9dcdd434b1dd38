"""A recording as the encoders on the links see it, and by how much each link lags its motor."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import mean_inertia
from tauscope.dynamics import smooth_sign
from tauscope.identification.dataset import prepared_motion
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.conditioning.position_noise import encoder_step
from tauscope.recording.samples import Array, Samples, Table

LIGHT = 0.2
"""Load, over its rms, below which teeth may be apart: errors of the load are of this size."""

FOLLOWS = 0.1
"""Deflection over the motion, rms, from which a column is in another unit or of another joint: no transmission that
carries an arm gives way so far."""


@dataclass(frozen=True, eq=False)
class LinkRows:
    """One joint's deflection and the states that may explain it, in the common band, (M,) each.

    deflection : (M,) float64
        q - q_link [rad or m]
    load : (M,) float64
        torque of the rigid body [Nm or N]
    side : (M,) float64
        side of the teeth on which that load presses, -1 … 1
    position, velocity, acceleration : (M,) float64
        of the link
    direction : (M,) float64
        A(q̇), the smooth sign of the velocity
    rigid : (m, M) float64
        columns of the base parameters that make the load
    inertia : float
        mean inertia of the link and all that it carries [kg m² or kg]
    step : float
        smallest change that both encoders resolve [rad or m]
    rate_hz : float
        of the rows [Hz]
    """

    recording: int
    deflection: Array
    load: Array
    side: Array
    position: Array
    velocity: Array
    acceleration: Array
    direction: Array
    rigid: Array
    inertia: float
    step: float
    rate_hz: float

    def stretches(self, length_s: float) -> NDArray[np.intp]:
        """Number of the stretch of so many seconds that each row belongs to, (M,).

        Parameters
        ----------
        length_s : float
            of a stretch [s]
        """
        return (np.arange(len(self.load)) / (self.rate_hz * length_s)).astype(np.intp)


@dataclass(frozen=True)
class _LinkTable:
    """Rows of a recording's table with the links' positions in the place of the motors', without what derives from q.

    swapped : tuple of (int, int, float)
        column of q, column of qlink and zero of qlink, of every joint that has both
    """

    source: Table
    kept: NDArray[np.intp]
    swapped: tuple[tuple[int, int, float], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns that are kept."""
        return tuple(self.source.names[place] for place in self.kept)

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.source)

    def rows(self, start: int, stop: int) -> Array:
        """Rows start:stop."""
        block = self.source.rows(start, stop).copy()
        for motor, link, zero in self.swapped:
            block[:, motor] = block[:, link] - zero
        return block[:, self.kept]


def link_joints(samples: Samples) -> list[int]:
    """Joints, from 0, with an encoder on the link: its column neither repeats q nor moves without it."""
    if samples.link_position is None:
        return []
    found = []
    for joint, (motor, link) in enumerate(zip(samples.position.T, samples.link_position.T, strict=True)):
        both = np.isfinite(motor) & np.isfinite(link)
        apart = (motor - link)[both]
        if np.any(apart != 0.0) and apart.std() < FOLLOWS * motor[both].std():
            found.append(joint)
    return found


def link_recording(recording: Recording, joints: Sequence[int], zeros: Array) -> Recording:
    """The recording with the positions of these joints as their links' encoders see them.

    Parameters
    ----------
    zeros : (n,) float64
        what every qlink shows where q is zero [rad or m]
    """
    names = recording.table.names
    kept = [place for place, name in enumerate(names) if not name.startswith(("qd", "qlink", "qref"))]
    swapped = tuple((names.index(f"q{j + 1}"), names.index(f"qlink{j + 1}"), float(zeros[j])) for j in joints)
    table = _LinkTable(recording.table, np.array(kept), swapped)
    return Recording(recording.name, recording.joint_count, recording.effort_kind, table)


def link_rows(
    recording: Recording, number: int, model: ExtendedModel, cutoff_hz: float | None
) -> Iterator[tuple[int, LinkRows]]:
    """Joints that have an encoder on the link, with the rows of one recording, piece by piece.

    Parameters
    ----------
    number : int
        index of the recording, from 0
    cutoff_hz : float or None
        of the common band [Hz]; None for no filter
    """
    samples = recording.samples()
    joints = link_joints(samples)
    if not joints or samples.link_position is None:
        return
    robot, structure = model.structure.robot, model.structure
    step = np.maximum(encoder_step([samples.position]), encoder_step([samples.link_position]))
    apart = samples.position - samples.link_position
    zeros = np.array([-np.nanmedian(own) if joint in joints else 0.0 for joint, own in enumerate(apart.T)])
    conditioner = Conditioner.survey(link_recording(recording, joints, zeros), robot).as_one_motion(None)
    for motion in conditioner.motions(cutoff_hz):
        prepared = prepared_motion(motion, robot, structure.base, number)
        inertia = mean_inertia(robot, model.standard_parameters(), motion.position)
        for joint in joints:
            known = np.isfinite(apart[:, joint])
            load = (
                model.parameters[structure.joint_columns(joint)][: len(prepared.rigid[joint])] @ prepared.rigid[joint]
            )
            velocity = motion.velocity[:, joint]
            rms = max(float(np.sqrt(np.mean(load**2))), np.finfo(float).tiny)
            rows = [
                np.interp(motion.time, samples.time[known], apart[known, joint]),
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
                    step=float(step[joint]),
                    rate_hz=motion.band.rate_hz,
                ),
            )
