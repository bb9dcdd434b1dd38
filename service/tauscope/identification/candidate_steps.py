"""Candidate columns of friction's steps after all other columns were projected off: small matrices to search in.

All columns Z that do not depend on a shape constant (rigid body, viscous, offset) are projected off: with S Sᵀ =
(ZᵀZ)⁻¹ from the factors at hand, Q = Z S is never formed, only Qᵀ G = Sᵀ (ZᵀG) of the candidate columns G, summed in
one pass. What is left are Gram matrices of the candidates.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from tauscope.dynamics.friction import smooth_sign
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.least_squares import Solution
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array

COLLINEAR = 1e-9  # a second column with less than this share of its energy left beside the first adds nothing


@dataclass(frozen=True, eq=False)
class JointGrid:
    """One joint's candidate columns after projection: a step of every slope, and v|v| as the last.

    `slopes`: (g,), candidate constants.
    `gram`: (g + 1, g + 1), GᵀG of its columns, before projection.
    `inner`: (z, g + 1), Q_jᵀ G: what the projection takes away.
    `target`: (g + 1,), Gᵀ y after projection.
    """

    slopes: Array
    gram: Array
    inner: Array
    target: Array

    @property
    def bend(self) -> int:
        """The candidate v|v|: viscous friction that bends with speed, which the model itself does not have."""
        return len(self.slopes)

    def block(self, other: "JointGrid", mine: list[int], theirs: list[int]) -> Array:
        """Projected Gram matrix between columns of two joints, (mine, theirs)."""
        product = -self.inner[:, mine].T @ other.inner[:, theirs]
        return product + self.gram[np.ix_(mine, theirs)] if self is other else product


def projected_grids(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    shared: NDArray[np.intp],
    solution: Solution,
    noise_std: Array,
    slopes: list[Array],
) -> list[JointGrid]:
    """Candidate columns of every joint, projected off the shared ones; one pass over the data.

    `shared`: (z,) int, its global columns that do not depend on any shape constant, ascending.
    `noise_std`: (n,), residual standard deviation of every joint, for the weights [Nm or N].
    `slopes`: list of (g,), length n, every joint's candidates [s/rad or s/m].
    """
    joints = range(structure.robot.joint_count)
    gram = [np.zeros((len(values) + 1, len(values) + 1)) for values in slopes]
    cross = [np.zeros((len(shared), len(values) + 1)) for values in slopes]
    target = [np.zeros(len(values) + 1) for values in slopes]
    for prepared in motions:
        for joint in joints:
            columns = prepared.joint_columns(structure, joint)
            index = structure.joint_columns(joint)
            kept = np.isin(index, shared)
            place = np.searchsorted(shared, index[kept])
            velocity = prepared.motion.velocity[:, joint]
            candidates = np.vstack([smooth_sign(velocity, slopes[joint][:, None]), velocity * np.abs(velocity)])
            whiten = partial(prepared.whiten, joint)
            steps = whiten(prepared.motion.band.reduce(candidates)) / noise_std[joint]
            common = whiten(columns[kept]) / noise_std[joint]
            torque = whiten(prepared.reduced_torque[None, joint])[0] / noise_std[joint]
            residual = torque - solution.parameters[place] @ common
            gram[joint] += steps @ steps.T
            cross[joint][place] += common @ steps.T
            target[joint] += steps @ residual
    return [JointGrid(slopes[j], gram[j], solution.spread.T @ cross[j], target[j]) for j in joints]


def total_gain(grids: list[JointGrid], chosen: list[list[int]]) -> float:
    """What the chosen columns of all joints together take off the criterion."""
    pairs = list(zip(grids, chosen, strict=True))
    matrix = np.block([[a.block(b, i, j) for b, j in pairs] for a, i in pairs])
    target = np.concatenate([grid.target[indices] for grid, indices in pairs])
    return float(target @ linalg.lstsq(matrix, target, cond=1e-12)[0])


@dataclass(frozen=True, eq=False)
class Conditional:
    """One joint's candidates after the chosen columns of all other joints are projected off as well.

    `gram`: (g + 1, g + 1), Gram matrix of the candidates; `target`: (g + 1,), their products with the torque.
    """

    gram: Array
    target: Array

    @staticmethod
    def of(grids: list[JointGrid], chosen: list[list[int]], joint: int) -> "Conditional":
        """The candidates of one joint with the other joints as chosen."""
        grid, every = grids[joint], list(range(len(grids[joint].target)))
        gram, target = grid.block(grid, every, every), grid.target
        others = [(grids[k], chosen[k]) for k in range(len(grids)) if k != joint]
        if not others:
            return Conditional(gram, target)
        matrix = np.block([[a.block(b, i, j) for b, j in others] for a, i in others])
        cross = np.vstack([other.block(grid, indices, every) for other, indices in others])
        known = np.concatenate([other.target[indices] for other, indices in others])
        solved = linalg.lstsq(matrix, np.column_stack([cross, known]), cond=1e-12)[0]
        return Conditional(gram - cross.T @ solved[:, :-1], target - cross.T @ solved[:, -1])

    def gains(self, options: list[list[int]], *, physical: bool = False) -> Array:
        """What each option, one or two columns, takes off the criterion, (options,)."""
        first = np.array([option[0] for option in options])
        energy = np.maximum(np.diag(self.gram), np.finfo(float).tiny)
        single = self.target[first] ** 2 / energy[first]
        if len(options[0]) == 1:
            return single
        second = np.array([option[1] for option in options])
        overlap = self.gram[first, second] / energy[first]
        left = energy[second] - overlap * self.gram[first, second]
        apart = left > COLLINEAR * energy[second]
        stribeck = np.where(apart, self.target[second] - overlap * self.target[first], 0.0) / np.where(apart, left, 1.0)
        added = stribeck**2 * left
        if physical:
            stiction = self.target[first] / energy[first] - overlap * stribeck
            falls = (stribeck < 0.0) & (stiction + stribeck >= 0.0)
            added = np.where(falls, added, 0.0)
        return single + added
