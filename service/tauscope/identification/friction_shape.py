"""Shape constants K_v and δ of the friction curve, by separable least squares.

All columns Z that do not depend on a shape constant (rigid body, viscous, offset) are projected off: with S Sᵀ =
(ZᵀZ)⁻¹ from the factors at hand, Q = Z S is never formed, only Qᵀ G = Sᵀ (ZᵀG) of the candidate columns G, summed in
one pass. What is left are Gram matrices of the candidates.

The coefficients of (7) are linear and are eliminated exactly (variable projection); only the shape constants remain.
Every joint's constants are searched over a logarithmic grid of candidates, joint after joint until nothing moves, and
refined between grid points. A constant that the data cannot tell says so and takes an ordinary value that fits as well:
never a slope that ran away.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from tauscope.dynamics.friction import smooth_sign
from tauscope.identification.dataset import PreparedMotion
from tauscope.identification.least_squares import JointFactor, Solution, restrict, solve
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array
from tauscope.robot import FrictionShape

COLLINEAR = 1e-9  # a second column with less than this share of its energy left beside the first adds nothing


@dataclass(frozen=True, eq=False)
class JointGrid:
    """One joint's candidate columns after projection: a step of every slope, and v|v| as the last."""

    slopes: Array  # (g,), candidate constants
    gram: Array  # (g + 1, g + 1), GᵀG of its columns, before projection
    inner: Array  # (z, g + 1), Q_jᵀ G: what the projection takes away
    target: Array  # (g + 1,), Gᵀ y after projection

    @property
    def bend(self) -> int:
        """The candidate v|v|: viscous friction that bends with speed, which the model itself does not have."""
        return len(self.slopes)

    def block(self, other: "JointGrid", mine: list[int], theirs: list[int]) -> Array:
        """Projected Gram matrix between columns of two joints, (mine, theirs)."""
        product = -self.inner[:, mine].T @ other.inner[:, theirs]
        return product + self.gram[np.ix_(mine, theirs)] if self is other else product


def project_grids(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    shared: NDArray[np.intp],
    solution: Solution,
    noise_std: Array,
    slopes: list[Array],
) -> list[JointGrid]:
    """Candidate columns of every joint, projected off the `shared` ones, (z,) int; one pass over the data.

    `noise_std`: (n,), of residuals, for the weights [Nm or N]; `slopes`: (g,) a joint, candidates [s/rad or s/m].
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
    """One joint's candidates after the chosen columns of all other joints are projected off as well."""

    gram: Array  # (g + 1, g + 1), Gram matrix of the candidates; `target`: (g + 1,), their products with the torque
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


GRID_POINTS = 42
# Candidates times the joint's rms velocity run over these powers of ten: from a gentle Stribeck slope to a step.
GRID_DECADES = (0.2, 4.3)
LEAST_STEP = 10**0.8  # k_v times the rms velocity is at least this: what is gentler is viscous friction by another name
# K times the rms velocity of a constant that the data leave open, as near as they allow: the step of a textbook.
ORDINARY = 1000.0
STRAIGHT = 0.17  # δ times the rms velocity v below which A(δ v) is a straight line but for a hundredth: (δ v)²/3
AT_LIMIT = 0.95  # share of the steepest δ from which on it is at its limit
SEPARATION = 4.0  # k_v is at least this many times δ: closer, their columns are one
# What a Stribeck term must take off the criterion to be proposed, in residual variances: five standard errors.
IMPROVEMENT = 25.0
# …and the share of the joint's residual energy that it must explain, so that it is not a proxy of something else.
IMPROVEMENT_SHARE = 0.005
KNOWN_BAND = 25.0  # constants whose criterion is within this much of the best are not told apart: five standard errors
AS_GOOD = 0.02  # share of the residual's energy that is no practical difference between two constants
SWEEPS = 4


@dataclass(frozen=True)
class EstimatedShape:
    """Shape constants of one joint."""

    k_v: float  # slope of the step at zero velocity [s/rad or s/m]
    delta: float | None  # slope of the Stribeck term [s/rad or s/m]; None where the data show no such term
    k_v_identifiable: bool  # False where the data cannot tell it
    delta_identifiable: bool
    k_v_given: bool  # True where the robot file states it
    delta_given: bool

    def open_at_limit(self) -> "EstimatedShape":
        """The shape, open where δ is at its limit: two such near steps are one of another form than an arctangent."""
        if self.delta is None or self.delta_given or self.delta * SEPARATION < AT_LIMIT * self.k_v:
            return self
        return replace(self, k_v_identifiable=self.k_v_given, delta_identifiable=False)


def estimate_shapes(
    motions: Iterable[PreparedMotion],
    structure: ModelStructure,
    factors: tuple[JointFactor, ...],
    noise_std: Array,
    unit: Array,
    stribeck: Sequence[bool],
    speed: Array,
    tight: Sequence[bool] | None = None,
) -> tuple[EstimatedShape, ...]:
    """Shape constants of all joints; those stated are kept. `noise_std`: (n,), by which rows are weighted.

    `unit`: (n,), one noise variance, inflated by autocorrelation, over `noise_std`²; zeros for the best candidates
    whatever they are worth. `speed`: (n,), rms velocity, which candidates are relative to [rad/s or m/s].
    """
    given = [joint.friction_shape for joint in structure.robot.joints]
    steps = [*structure.coefficients("stiction").values(), *structure.coefficients("stribeck").values()]
    shared = np.setdiff1d(np.arange(structure.size), steps)
    without_steps = restrict(factors, shared)
    solution = solve(without_steps, len(shared), noise_std)
    slopes = _candidate_slopes(speed, given)
    grids = project_grids(motions, structure, shared, solution, noise_std, slopes)
    chosen = _search(grids, given)
    squares = (f.squared_residual(solution.parameters) for f in without_steps)
    energy = sum(square / std**2 for square, std in zip(squares, noise_std, strict=True))
    rows = sum(factor.rows for factor in factors)
    variance = max(float(energy - total_gain(grids, chosen)) / rows, np.finfo(float).eps)
    described = []
    for joint, (grid, shape) in enumerate(zip(grids, given, strict=True)):
        conditional, indices = Conditional.of(grids, chosen, joint), chosen[joint]
        residual_energy = factors[joint].rows * variance
        if stribeck[joint] and shape.delta is None:
            indices = _with_stribeck(conditional, grid, indices, shape, variance, residual_energy)
        is_tight = tight is not None and tight[joint]
        described.append(_described(conditional, grid, indices, shape, float(unit[joint]), residual_energy, is_tight))
    return tuple(described)


def _candidate_slopes(speed: Array, given: Sequence[FrictionShape]) -> list[Array]:
    """Per joint a logarithmic grid relative to its rms velocity, then the stated constants."""
    grid = np.logspace(*GRID_DECADES, GRID_POINTS)
    stated = [[value for value in (shape.k_v, shape.delta) if value is not None] for shape in given]
    return [np.append(grid / typical, own) for typical, own in zip(speed, stated, strict=True)]


def _search(grids: list[JointGrid], given: Sequence[FrictionShape]) -> list[list[int]]:
    """Grid indices [K_v] or [K_v, δ] a joint, each joint's best with the others held, until nothing moves."""
    options = [_plain_options(grid, shape) for grid, shape in zip(grids, given, strict=True)]
    chosen = [candidates[len(candidates) // 2] for candidates in options]
    for _ in range(SWEEPS):
        before = list(chosen)
        for joint, candidates in enumerate(options):
            if len(candidates) > 1:
                gains = Conditional.of(grids, chosen, joint).gains(candidates)
                chosen[joint] = candidates[int(np.argmax(gains))]
        if chosen == before:
            break
    return chosen


def _steps(grid: JointGrid, shape: FrictionShape) -> list[int]:
    if shape.k_v is not None:
        return [GRID_POINTS]
    least = (1.0 - 1e-9) * LEAST_STEP / 10 ** GRID_DECADES[0] * grid.slopes[0]  # a grid point: not left to rounding
    return [k for k in range(GRID_POINTS) if grid.slopes[k] >= least]


def _plain_options(grid: JointGrid, shape: FrictionShape) -> list[list[int]]:
    """What a joint's constants may be without a Stribeck term of unknown δ; stated constants are kept."""
    if shape.delta is None:
        return [[k] for k in _steps(grid, shape)]
    stated = len(grid.slopes) - 1
    if shape.k_v is not None:
        return [[GRID_POINTS, stated]]
    return [[k, stated] for k in _steps(grid, shape) if grid.slopes[k] >= SEPARATION * shape.delta]


def _described(
    conditional: Conditional,
    grid: JointGrid,
    indices: list[int],
    shape: FrictionShape,
    unit: float,
    residual_energy: float,
    is_tight: bool,
) -> EstimatedShape:
    """The joint's constants refined, with what the data can tell about them; `unit` is one noise variance.

    A gentle step's long tail, A(K_v v) = 1 - 2/(π K_v v), stands in for viscous friction that bends with speed: K_v
    is known only where steeper steps fit clearly worse even beside a column v|v|, which the model never has.
    """
    slopes = grid.slopes
    k_v, k_v_known = float(slopes[indices[0]]), True
    delta, delta_known = shape.delta, shape.delta is not None
    if shape.k_v is None:
        steps = [k for k in _steps(grid, shape) if len(indices) == 1 or slopes[k] >= SEPARATION * slopes[indices[1]]]
        profile = conditional.gains([[k, *indices[1:]] for k in steps])
        k_v, k_v_known = _peak(profile, slopes[steps], KNOWN_BAND * unit)
        k_v_known = k_v_known or is_tight
        if len(indices) == 1:
            if k_v_known:
                profile = conditional.gains([[k, grid.bend] for k in steps])
                k_v_known = bool(profile[-1] <= profile.max() - KNOWN_BAND * unit)
            if not k_v_known:
                k_v = _ordinary(profile, slopes[steps], grid, unit, residual_energy)
    if shape.delta is None and len(indices) > 1:
        gentle = [d for d in range(GRID_POINTS) if slopes[indices[0]] >= SEPARATION * slopes[d]]
        profile = conditional.gains([[indices[0], d] for d in gentle])
        # Where δ begins: beside a K_v of the grid, its profile tells how far that K_v is off, not what is known of δ.
        delta, _ = _peak(profile, slopes[gentle], KNOWN_BAND * unit)
    return EstimatedShape(k_v, delta, k_v_known, delta_known, shape.k_v is not None, shape.delta is not None)


def _peak(profile: Array, slopes: Array, band: float) -> tuple[float, bool]:
    """Where a profile peaks, between grid points, and whether it falls by `band` on both sides."""
    best = int(np.argmax(profile))
    if not 0 < best < len(slopes) - 1:
        return float(slopes[best]), False
    left, middle, right = profile[best - 1 : best + 2]
    curvature = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / curvature if curvature < 0.0 else 0.0
    return float(slopes[best] * np.exp(shift * np.log(slopes[1] / slopes[0]))), bool(
        max(profile[0], profile[-1]) < profile[best] - band
    )


def _ordinary(profile: Array, slopes: Array, grid: JointGrid, unit: float, residual_energy: float) -> float:
    """The most ordinary slope of those that fit practically as well as the best: never one that ran away."""
    ordinary = ORDINARY / 10 ** GRID_DECADES[0] * grid.slopes[0]
    fitting = profile >= profile.max() - AS_GOOD * residual_energy
    if profile[0] >= profile.max() - KNOWN_BAND * unit:
        fitting[:] = True  # it could be viscous friction as well: a stand-in, any step will do
    candidates = slopes[fitting]
    return float(candidates[np.argmin(np.abs(np.log(candidates / ordinary)))])


def _with_stribeck(
    conditional: Conditional,
    grid: JointGrid,
    plain: list[int],
    shape: FrictionShape,
    variance: float,
    residual_energy: float,
) -> list[int]:
    """The best pair [K_v, δ] where it explains enough more than K_v, with the next grid point's column, alone."""
    slopes = grid.slopes
    pairs = [[k, d] for k in _steps(grid, shape) for d in range(GRID_POINTS) if slopes[k] >= SEPARATION * slopes[d]]
    if not pairs:
        return plain
    gains = conditional.gains(pairs, physical=True)
    best = int(np.argmax(gains))
    alone = float(conditional.gains([plain])[0])
    if shape.k_v is None:
        beside = [[plain[0], plain[0] + step] for step in (-1, 1) if 0 <= plain[0] + step < GRID_POINTS]
        alone = max(alone, float(conditional.gains(beside).max()))
    enough = max(IMPROVEMENT * variance, IMPROVEMENT_SHARE * residual_energy)
    return pairs[best] if gains[best] - alone > enough else plain


def gentle_range(k_v: float, speed: float) -> tuple[float, float]:
    """Gentlest and steepest δ that is a term of its own: others are viscous friction, or K_v's [s/rad or s/m]."""
    return STRAIGHT / speed, k_v / SEPARATION


def shape_parameters(shapes: Sequence[EstimatedShape]) -> list[tuple[int, str]]:
    """The constants that were estimated and not merely chosen: they are refined, and share in the covariance."""
    estimated: list[tuple[int, str]] = []
    for joint, shape in enumerate(shapes):
        paired = shape.delta is not None and not shape.delta_given
        if not shape.k_v_given and (shape.k_v_identifiable or paired):
            estimated.append((joint, "k_v"))
        if paired:
            estimated.append((joint, "delta"))
    return estimated
