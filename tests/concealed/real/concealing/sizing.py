"""The size at which an effect leaves a wanted multiple of the plain residual, after the nominal model's share."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from concealed.real.concealing.concealment import Concealment, rms_left
from concealed.real.concealing.ground import Ground
from concealed.real.concealing.nominal import Nominal, fit_nominal
from concealed.real.concealing.robot_file import copy_robot
from tauscope.robot import read_robot

Array = NDArray[np.float64]

EXACT = 0.03
"""Relative error of the multiple that is reached."""

MOST_STEPS = 14

LEAST_SHARE = 0.1
"""Of a torque, in rms, that a nominal model has to leave: less hangs on the last digits of the law's curve."""


def multiple_left(ground: Ground, concealment: Concealment, size: float) -> float:
    """Rms that the nominal model leaves of an effect at its joint, in units of the plain residual there."""
    return rms_left(ground, torque_left(ground, concealment, size), concealment)


def torque_left(ground: Ground, concealment: Concealment, size: float) -> list[Array]:
    """What a nominal model leaves of an effect, at the compared rows of every passage (R, n).

    With a wrong robot file, of the torque that the fitted right model predicts.
    """
    nominal = ground.nominal
    if concealment.rewrite is None:
        return nominal.left(nominal.rows(concealment.added(ground, size)))
    wrong = nominal_of_file(ground, concealment, size)
    return wrong.left([columns @ nominal.coefficients for columns in nominal.columns])


def nominal_of_file(ground: Ground, concealment: Concealment, size: float) -> Nominal:
    """The nominal model that the same recordings give with a wrong robot file."""
    if concealment.rewrite is None:
        raise ValueError(f"{concealment.kind} is not in the robot file")
    with tempfile.TemporaryDirectory() as where:
        if size:
            concealment.rewrite(size, ground.folder, Path(where))
        else:
            copy_robot(ground.folder, Path(where))
        robot = read_robot(Path(where) / "robot.yaml")
    return fit_nominal(robot, ground.passages, ground.band_hz, ground.nominal.states)


def size_for(ground: Ground, concealment: Concealment, wanted: float) -> float | None:
    """The size that leaves a wanted multiple; None where no physical one does.

    Physical sizes lie within the bounds of the effect, and no torque that is added is larger, in rms, than the torque
    that moved the joint. Nor does any do of an effect of which the nominal model absorbs all but `LEAST_SHARE`.
    """
    if concealment.fixed is not None:
        return concealment.fixed
    if concealment.rewrite is not None and multiple_left(ground, concealment, concealment.bounds[1]) < wanted:
        return None
    if concealment.torque is None:
        return solve_size(lambda size: multiple_left(ground, concealment, size), wanted, concealment.bounds)
    unit = multiple_left(ground, concealment, 1.0)
    if unit <= 0.0:
        return None
    if unit < LEAST_SHARE * _rms_of_all(ground, concealment):
        return None
    size = wanted / unit
    return size if size <= concealment.bounds[1] and _is_carried(ground, concealment, size) else None


def _rms_of_all(ground: Ground, concealment: Concealment) -> float:
    """What there would be in the place of `multiple_left` at size 1 if the nominal model absorbed nothing."""
    return rms_left(ground, ground.nominal.rows(concealment.added(ground, 1.0)), concealment)


def _is_carried(ground: Ground, concealment: Concealment, size: float) -> bool:
    """Whether the torque added at every joint is no larger than the joint's own."""
    there = []
    for passage, torque in zip(ground.passages, concealment.added(ground, size), strict=True):
        inside = slice(None) if concealment.window is None else concealment.window(passage.time) > 0.0
        if not passage.held_out:
            there.append(torque[inside])
    rms = np.sqrt(np.mean(np.concatenate(there) ** 2, axis=0))
    return bool(np.all(rms <= ground.effort))


def solve_size(multiple: Callable[[float], float], wanted: float, bounds: tuple[float, float]) -> float | None:
    """Where a multiple that rises or falls with size is as wanted, between bounds; None where it is at neither end.

    Regula falsi in logarithms, as multiples go with powers of the size (Illinois: Dowell and Jarratt 1971).
    """
    ends = np.log(np.asarray(bounds))
    low, high = ends
    right = _height(multiple(float(np.exp(high))), wanted)
    left = _height(multiple(float(np.exp(low))), wanted)
    if left * right > 0.0:
        return None
    for _ in range(MOST_STEPS):
        place = (low * right - high * left) / (right - left)
        height = _height(multiple(float(np.exp(place))), wanted)
        if abs(height) <= np.log1p(EXACT):
            return float(np.exp(place))
        if height * right < 0.0:
            low, left = high, right
        else:
            left *= 0.5
        high, right = place, height
    return None


def _height(multiple: float, wanted: float) -> float:
    return float(np.clip(np.log(max(multiple, 1e-12) / wanted), -3.0, 3.0))
