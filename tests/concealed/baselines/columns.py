"""What all baselines look at: the identification's residual, and the columns of the catalogue in the same band.

Rows of every joint are scaled by the residual's own rms there and are otherwise left as they are: no noise model.
Effects that happen once are left out, which favours the baselines: no trial conceals one.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from concealed.sealing.truth import label
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.white_columns import SHAPES_AT_ONCE, white_columns
from tauscope.diagnosis.model.nominal import nominal_model, setting_of
from tauscope.diagnosis.model.residual import residual_rows
from tauscope.diagnosis.observations.band import diagnosis_cutoff
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.effects import Effect, TimeLocalEffect, possible_effects
from tauscope.identification import identify
from tauscope.identification.autocorrelation import Autoregression
from tauscope.recording import Recording
from tauscope.recording.conditioning import Conditioner
from tauscope.robot import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Columns:
    """Some shapes of one effect at one place.

    place : str
        ``effect@joint``
    shapes : int
        free shape parameters of the effect
    rows : dict of int to (g, c, R_j) float64
        columns at every joint that the effect touches
    """

    place: str
    shapes: int
    rows: dict[int, Array]


@dataclass(frozen=True, eq=False)
class Ground:
    """A fitted nominal model, and the effects beside it.

    fit : Fit
        the model; its residual is what is left of the scaled torque
    effects : list of Effect
        the catalogue on this arm
    """

    fit: Fit
    effects: list[Effect]
    observations: Observations
    names: tuple[str, ...]

    @property
    def residual(self) -> tuple[Array, ...]:
        """Scaled residual of every joint, (R_j,)."""
        return self.fit.projection.residual

    def columns(self) -> Iterator[Columns]:
        """All columns, a few shapes at once."""
        signals = [self.fit.model.signals(piece) for piece in self.observations]
        for effect in self.effects:
            place = label(effect.id, None if effect.joint is None else self.names[effect.joint])
            free = sum(effect.is_free(number) for number in range(effect.grid.shape[1]))
            for first in range(0, len(effect.grid), SHAPES_AT_ONCE):
                shapes = effect.grid[first : first + SHAPES_AT_ONCE]
                yield Columns(place, free, white_columns(self.observations, effect, shapes, signals))


def ground(robot: Robot, recordings: Sequence[Recording]) -> Ground:
    """Identify an arm, and fit its model in the band of the diagnosis."""
    identification = identify(robot, recordings)
    conditioners = [Conditioner.survey(recording, robot) for recording in recordings]
    model = nominal_model(identification)
    cutoff = diagnosis_cutoff(conditioners, identification, model.steepness)
    base = identification.structure.base
    bare = Observations.prepare(conditioners, robot, base, cutoff, model.steepness)
    setting = setting_of(model, bare, conditioners, cutoff)
    effects = [each for each in possible_effects(setting) if not isinstance(each, TimeLocalEffect)]
    scaled = bare.with_noise([_scale(rows) for rows in residual_rows(model, bare)])
    fit = Fitter(scaled).projected(model)
    return Ground(fit, effects, scaled, tuple(joint.name for joint in robot.joints))


def _scale(rows: Sequence[Array]) -> JointNoise:
    power = float(np.mean(np.concatenate([each[0] for each in rows]) ** 2))
    return JointNoise(Autoregression(np.empty(0), power, power))
