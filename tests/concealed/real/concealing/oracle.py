"""An oracle that knows the law of what is concealed, with its nonlinear parameters, and has only its size to find.

It sees the files that the diagnosis sees. Torque laws are columns beside the nominal model's; what happened to the
torque channel is undone, and a robot file put right, by the size that leaves least, found by Gauss and Newton. Rows are
whitened by an autoregression of every joint's residual.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.real.concealing.channels import FLIPPED, delay_torque, scale_torque
from concealed.real.concealing.concealment import Concealment
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.nominal import PER_JOINT, RANK, Nominal, reweigh
from concealed.real.concealing.sizing import nominal_of_file

Array = NDArray[np.float64]
Rows = list[Array]

ORDER = 6
"""Of the autoregression: rows come 2.5 times a period of the band's corner."""

STEPS = 12
SIGN_STD = 0.5
"""A sign is right or wrong by four of these."""

WEIGHINGS = 3
"""Fits, each with the joints weighted by what the one before left."""

CLOSE = 0.02
"""Steps end below this share of the standard error."""

LARGEST_STEP = 0.1
"""Of Gauss and Newton, relative to the largest size."""

LOAD_STEPS = 20
SCAN = 13
"""Sizes that are looked at before the best of them is refined."""


@dataclass(frozen=True)
class Estimate:
    """A size and its standard error."""

    size: float
    std: float


def estimate_sizes(ground: Ground, laws: Sequence[Concealment], *, start: float | None = None) -> list[Estimate] | None:
    """Sizes of all that is concealed; None for several of which one is no law of torque.

    Parameters
    ----------
    start : float or None
        size near which it is looked for, where that is known: none in an untouched set
    """
    if all(law.torque is not None for law in laws):
        return _torque_sizes(ground, laws)
    return [_other_size(ground, laws[0], start=start)] if len(laws) == 1 else None


def _torque_sizes(ground: Ground, laws: Sequence[Concealment]) -> list[Estimate]:
    """Least squares with a column a law; again with the load and the residual that the fit before has."""
    nominal, load, sizes = ground.nominal, ground.load, np.zeros(len(laws))
    observed = nominal.rows([each.torque for each in ground.passages])
    found: list[Estimate] = []
    for _ in range(LOAD_STEPS):
        columns = [
            nominal.rows([law.torque(each, own) for each, own in zip(ground.passages, load, strict=True)])
            for law in laws
            if law.torque is not None
        ]
        before = sizes
        sizes, std = _least_squares(nominal, observed, columns)
        found = [Estimate(float(size), float(error)) for size, error in zip(sizes, std, strict=True)]
        if np.all(np.abs(sizes - before) < CLOSE * std):
            break
        cleared = [
            rows - sum(size * each[number] for size, each in zip(sizes, columns, strict=True))
            for number, rows in enumerate(observed)
        ]
        left = np.concatenate([nominal.left(cleared)[number] for number in nominal.training])
        nominal = reweigh(nominal, np.sqrt(np.mean(left**2, axis=0)))
        nominal = replace(nominal, coefficients=nominal.absorbed(cleared))
        load = nominal.load()
    return found


def _least_squares(nominal: Nominal, observed: Rows, columns: Sequence[Rows]) -> tuple[Array, Array]:
    """Sizes of columns beside the nominal model's, and their standard errors, on whitened training rows."""
    training = nominal.training
    flat = [nominal.left(each) for each in (observed, *columns)]
    first = np.stack([_stack(each, training, nominal.weights) for each in flat[1:]], axis=1)
    rough, *_ = np.linalg.lstsq(first, _stack(flat[0], training, nominal.weights), rcond=None)
    left = [
        flat[0][number] - sum(size * each[number] for size, each in zip(rough, flat[1:], strict=True))
        for number in range(len(observed))
    ]
    whiten = _whitener([left[number] for number in training])
    wide = whiten([nominal.columns[number] for number in training])
    wide /= np.maximum(np.linalg.norm(wide, axis=0), 1e-300)
    basis, singular, _ = np.linalg.svd(wide, full_matrices=False)
    basis = basis[:, singular > RANK * singular[0]]
    target, *laws = (whiten([each[number] for number in training]) for each in (observed, *columns))
    matrix = np.stack(laws, axis=1)
    matrix -= basis @ (basis.T @ matrix)
    normal = matrix.T @ matrix
    # The whitened rows have unit variance but for what the nominal model and the columns take up.
    sizes = np.linalg.solve(normal, matrix.T @ target)
    rest = target - matrix @ sizes
    rest -= basis @ (basis.T @ rest)
    free = max(len(target) - basis.shape[1] - len(sizes), 1)
    return np.asarray(sizes, np.float64), np.asarray(
        np.sqrt(np.diag(np.linalg.inv(normal)) * float(rest @ rest) / free)
    )


def _stack(rows: Rows, training: Sequence[int], scale: Array) -> Array:
    return np.concatenate([(rows[number] / scale).ravel() for number in training])


def _whitener(residual: Rows, order: int = ORDER) -> Callable[[Rows], Array]:
    """From rows (R, n) or (R, n, P) of the training passages to whitened ones, stacked; of order 0 scaled alone."""
    filters = []
    for joint in range(residual[0].shape[1]):
        own = [each[:, joint] for each in residual]
        lagged = [
            np.array([each[order - lag : len(each) - lag] for lag in range(1, order + 1)])
            .reshape(order, len(each) - order)
            .T
            for each in own
        ]
        matrix, target = np.concatenate(lagged), np.concatenate([each[order:] for each in own])
        weights = np.linalg.lstsq(matrix, target, rcond=None)[0] if order else np.zeros(0)
        std = float(np.sqrt(np.mean((target - matrix @ weights) ** 2)))
        filters.append((np.concatenate([[1.0], -weights]), max(std, 1e-12)))

    def whiten(rows: Rows) -> Array:
        return np.concatenate(
            [
                signal.lfilter(weights, [1.0], each[:, joint], axis=0)[order:] / std
                for each in rows
                for joint, (weights, std) in enumerate(filters)
            ]
        )

    return whiten


def _other_size(ground: Ground, law: Concealment, *, start: float | None) -> Estimate:
    if law.kind == "saturation":  # nothing is recorded beyond the level, and much at it
        level = max(float(np.abs(each.torque[:, law.joint]).max()) for each in ground.training)
        return Estimate(level, float(ground.nominal.scale[law.joint]))
    if law.fixed is not None:
        return _sign(ground, law)
    undo = _undone_residual if law.rewrite is None else _file_residual
    size, weights, estimate = start, ground.nominal.weights, Estimate(0.0, np.inf)
    for number in range(WEIGHINGS):
        last = number == WEIGHINGS - 1  # far from the truth an autoregression would take the misfit for noise
        estimate = _newton(lambda at, weights=weights: undo(ground, law, at, weights), size, law.bounds, whiten=last)
        size, left = estimate.size, np.concatenate(undo(ground, law, estimate.size, weights))
        weights = np.sqrt(np.mean(left**2, axis=0))
    return estimate


def _undone_residual(ground: Ground, law: Concealment, size: float, weights: Array) -> Rows:
    """Plain residual of training torque from which a gain or a delay is taken, in the units of the recorded torque."""
    nominal, factor = ground.nominal, np.ones(ground.robot.joint_count)
    side = float(law.constants["side"])
    if law.kind.startswith("delay"):
        joints = list(range(len(factor))) if law.kind == "delay_all" else [law.joint]
        torque = [delay_torque(each.time, each.torque, joints, -side * size) for each in ground.passages]
    else:
        factor[law.joint] = 1.0 + side * size
        torque = [each.torque / factor for each in ground.passages]
    left = reweigh(nominal, weights / np.abs(factor)).left(nominal.rows(torque))
    return [factor * left[number] for number in nominal.training]


def _file_residual(ground: Ground, law: Concealment, size: float, weights: Array) -> Rows:
    """Plain residual of training torque with the robot file put right by a size."""
    nominal = reweigh(nominal_of_file(ground, law, -size), weights)
    left = nominal.left(nominal.rows([each.torque for each in ground.passages]))
    return [left[number] for number in nominal.training]


def _newton(
    residual: Callable[[float], Rows], start: float | None, bounds: tuple[float, float], *, whiten: bool
) -> Estimate:
    """The size that leaves least: the best of a few where no start is given, then Gauss and Newton."""
    size = _best_of_few(residual, bounds) if start is None else start
    step, std = 1e-3 * (bounds[0] * bounds[1]) ** 0.5, float("nan")
    for _ in range(STEPS):
        left = residual(size)
        scaled = _whitener(left, ORDER if whiten else 0)
        slope = scaled(
            [(a - b) / (2.0 * step) for a, b in zip(residual(size + step), residual(size - step), strict=True)]
        )
        change = -float(slope @ scaled(left)) / float(slope @ slope)
        std = 1.0 / float(np.sqrt(slope @ slope))
        size += float(np.clip(change, -LARGEST_STEP * bounds[1], LARGEST_STEP * bounds[1]))
        if abs(change) < CLOSE * std:
            break
    return Estimate(size, std)


def _best_of_few(residual: Callable[[float], Rows], bounds: tuple[float, float]) -> float:
    sizes = [0.0, *np.geomspace(*bounds, SCAN - 1)]
    scale = np.sqrt(np.mean(np.concatenate(residual(0.0)) ** 2, axis=0))
    energies = [_energy(residual(size), scale) for size in sizes]
    return float(sizes[int(np.argmin(energies))])


def _energy(rows: Rows, scale: Array) -> float:
    return sum(float(np.sum((each / scale) ** 2)) for each in rows)


def _sign(ground: Ground, law: Concealment) -> Estimate:
    """g is -2 where a sign is wrong, and 0 where it is right.

    Joints of one arm share its links: with one wrong sign among them, more is left. Where all are wrong, friction feeds
    the motion.
    """
    nominal, joint = ground.nominal, law.joint
    if law.kind == "sign_joint":
        turned = nominal.rows([scale_torque(each.torque, [joint], FLIPPED) for each in ground.passages])
        energies = [
            _energy([rows[number] for number in nominal.training], nominal.weights)
            for rows in (nominal.residual(), nominal.left(turned))
        ]
        return Estimate(FLIPPED if energies[1] < energies[0] else 0.0, SIGN_STD)
    power, own = 0.0, slice(nominal.columns[0].shape[2] - PER_JOINT * (ground.robot.joint_count - joint), None)
    for number in nominal.training:
        grid, passage = nominal.grids[number], ground.passages[number]
        velocity = grid.compared(grid.smoothed(passage, passage.velocity))[:, joint]
        friction = nominal.columns[number][:, joint, own][:, :3] @ nominal.coefficients[own][:3]
        power += float(np.sum(friction * velocity))
    return Estimate(FLIPPED if power < 0.0 else 0.0, SIGN_STD)
