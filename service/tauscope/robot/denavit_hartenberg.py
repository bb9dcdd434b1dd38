"""Denavit-Hartenberg rows to the segments of a chain, in the standard and in the modified convention.

Rotation about z, sliding along z and the joint's own motion commute, so a row's constant θ and d may stand before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.robot.placement import compose, rotation_about_x, rotation_about_z
from tauscope.robot.robot import JointType, Placement, Segment


@dataclass(frozen=True)
class DenavitHartenbergRow:
    """One row of Denavit-Hartenberg parameters.

    theta : float
        θ; a revolute joint's position adds to it [rad]
    d : float
        along z; a prismatic joint's position adds to it [m]
    a : float
        along x [m]
    alpha : float
        α, about x [rad]
    """

    theta: float
    d: float
    a: float
    alpha: float
    type: JointType = JointType.REVOLUTE


def standard_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of standard rows (Spong): A = Rz(θ) Tz(d) Tx(a) Rx(α).

    Parameters
    ----------
    rows : sequence of DenavitHartenbergRow
        one a joint, base first
    """
    return tuple(Segment(row.type, _along_z(row), _along_x(row)) for row in rows)


def modified_segments(rows: Sequence[DenavitHartenbergRow]) -> tuple[Segment, ...]:
    """Segments of modified rows (Craig): A = Rx(α) Tx(a) Rz(θ) Tz(d).

    Parameters
    ----------
    rows : sequence of DenavitHartenbergRow
        one a joint, base first
    """
    return tuple(Segment(row.type, compose(_along_x(row), _along_z(row)), Placement()) for row in rows)


def _along_z(row: DenavitHartenbergRow) -> Placement:
    """Rz(θ) Tz(d)."""
    return Placement(rotation_about_z(row.theta), np.array([0.0, 0.0, row.d]))


def _along_x(row: DenavitHartenbergRow) -> Placement:
    """Tx(a) Rx(α), which commute."""
    return Placement(rotation_about_x(row.alpha), np.array([row.a, 0.0, 0.0]))
