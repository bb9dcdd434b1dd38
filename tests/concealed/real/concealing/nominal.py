"""What a nominal model absorbs: rigid body, rotor, and friction of a curve with constants of its own.

The plain residual of a set, and what is left of a concealed torque after the same fit, are in the set's own band and
weighted by the plain residual of every joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.passage import Grid, Passage
from tauscope.dynamics.base_parameters import base_parameters
from tauscope.dynamics.regressor import torque_regressor
from tauscope.robot import Robot

Array = NDArray[np.float64]

STEPS = (0.02, 0.2)
"""Speeds at which the friction's two smooth signs turn, relative to the joint's rms speed."""

PER_JOINT = 5
"""Two smooth signs, speed, constant and the rotor's acceleration."""

RANK = 1e-5
"""Directions of the scaled columns below this share of the largest are left alone."""


@dataclass(frozen=True, eq=False)
class Nominal:
    """A fitted nominal model.

    grids : list of Grid
        of every passage
    states : sequence of State
        of every passage, at the instants of its grid
    columns : list of (R, n, P) float64
        of every passage, in band
    rigid : list of (M, n, m) float64
        the rigid body's columns before the filter
    basis : (P, r) float64
        coefficients of whitened orthonormal columns
    observed : (Σ R n, r) float64
        those columns, training rows
    weights : (n,) float64
        residual that whitens the rows of every joint
    scale : (n,) float64
        plain residual of the training rows, rms
    coefficients : (P,) float64
        estimate
    """

    robot: Robot
    passages: Sequence[Passage]
    grids: list[Grid]
    states: "Sequence[State]"
    columns: list[Array]
    rigid: list[Array]
    basis: Array
    observed: Array
    weights: Array
    scale: Array
    coefficients: Array

    @property
    def training(self) -> list[int]:
        return [number for number, each in enumerate(self.passages) if not each.held_out]

    def rows(self, values: Sequence[Array]) -> list[Array]:
        """Recorded values (N, n) of every passage in band, at the rows that are compared."""
        return [
            grid.compared(grid.smoothed(passage, each))
            for grid, passage, each in zip(self.grids, self.passages, values, strict=True)
        ]

    def absorbed(self, rows: Sequence[Array]) -> Array:
        """Coefficients (P,) that absorb the most of in-band rows of the training passages."""
        stacked = np.concatenate([(rows[number] / self.weights).ravel() for number in self.training])
        return np.asarray(self.basis @ (self.observed.T @ stacked))

    def left(self, rows: Sequence[Array]) -> list[Array]:
        """What is left of in-band rows, in every passage."""
        absorbed = self.absorbed(rows)
        return [each - columns @ absorbed for each, columns in zip(rows, self.columns, strict=True)]

    def residual(self) -> list[Array]:
        """The plain residual of every passage."""
        return self.left(self.rows([each.torque for each in self.passages]))

    def load(self) -> list[Array]:
        """Rigid-body torque (N, n) of the fitted model at the recorded instants of every passage."""
        return [
            np.column_stack(
                [np.interp(passage.time, grid.time, each) for each in (rigid @ self.coefficients[: rigid.shape[2]]).T]
            )
            for passage, grid, rigid in zip(self.passages, self.grids, self.rigid, strict=True)
        ]


State = tuple[Array, Array, Array]
"""Position, velocity and acceleration (M, n) at the instants of a grid."""


def fit_nominal(
    robot: Robot, passages: Sequence[Passage], band_hz: float, states: Sequence[State] | None = None
) -> Nominal:
    """Fit it: least squares, twice more with every joint weighted by what the fit before left.

    Parameters
    ----------
    states : sequence of State or None
        of every passage, where they are known from another robot file
    """
    grids = [Grid.of(each, band_hz) for each in passages]
    wanted = np.asarray(base_parameters(robot).independent_columns)
    states = states or [_state(grid, each) for grid, each in zip(grids, passages, strict=True)]
    rigid = [torque_regressor(robot, *state, columns=wanted) for state in states]
    training = [number for number, each in enumerate(passages) if not each.held_out]
    speed = np.sqrt(np.mean(np.concatenate([states[number][1] for number in training]) ** 2, axis=0))
    columns = [
        grid.compared(np.concatenate([each, _own_columns(state, speed)], axis=2))
        for grid, each, state in zip(grids, rigid, states, strict=True)
    ]
    scale, coefficients = np.ones(robot.joint_count), np.zeros(columns[0].shape[2])
    made = Nominal(robot, passages, grids, states, columns, rigid, np.empty(0), np.empty(0), scale, scale, coefficients)
    rows = made.rows([each.torque for each in passages])
    for _ in range(3):
        basis, observed = _orthonormal([columns[number] for number in training], scale)
        made = replace(made, basis=basis, observed=observed, weights=scale)
        made = replace(made, coefficients=made.absorbed(rows))
        left = np.concatenate([rows[number] - columns[number] @ made.coefficients for number in training])
        scale = np.sqrt(np.mean(left**2, axis=0))
    return replace(made, scale=scale)


def reweigh(nominal: Nominal, weights: Array) -> Nominal:
    """The same columns, absorbing with other weights (n,)."""
    basis, observed = _orthonormal([nominal.columns[number] for number in nominal.training], weights)
    return replace(nominal, basis=basis, observed=observed, weights=weights)


def _state(grid: Grid, passage: Passage) -> State:
    position, velocity, acceleration = (
        grid.smoothed(passage, each) for each in (passage.position, passage.velocity, passage.acceleration)
    )
    return position, velocity, acceleration


def soft_sign(velocity: Array, turn: Array | float) -> Array:
    """Direction of motion, ±1 beyond a speed."""
    return np.asarray(velocity / np.sqrt(velocity**2 + turn**2))


def _own_columns(state: State, speed: Array) -> Array:
    """Columns (M, n, 5 n) of what every joint has for itself."""
    _, velocity, acceleration = state
    count = velocity.shape[1]
    signs = [soft_sign(velocity, share * np.maximum(speed, 1e-9)) for share in STEPS]
    each = np.stack([*signs, velocity, np.ones_like(velocity), acceleration], axis=2)
    own = np.zeros((*velocity.shape, count, PER_JOINT))
    for joint in range(count):
        own[:, joint, joint] = each[:, joint]
    return own.reshape(*velocity.shape, count * PER_JOINT)


def _orthonormal(columns: Sequence[Array], scale: Array) -> tuple[Array, Array]:
    """Coefficients of orthonormal whitened columns, and those columns."""
    stacked = np.concatenate([(each / scale[:, None]).reshape(-1, each.shape[2]) for each in columns])
    sizes = np.maximum(np.linalg.norm(stacked, axis=0), 1e-300)
    left, singular, right = np.linalg.svd(stacked / sizes, full_matrices=False)
    kept = singular > RANK * singular[0]
    return (right[kept].T / singular[kept]) / sizes[:, None], left[:, kept]
