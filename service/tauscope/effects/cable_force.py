"""Elastic torque that sets in past an angle: hoses, cables and end stops."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, mesh, per_joint_columns
from tauscope.number_text import significant
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Angles at which a cable begins to pull, relative to the range of motion: one that always pulls is a spring.
ONSETS = np.linspace(0.2, 0.9, 8)
EXPONENTS = np.array([1.0, 1.5, 2.0])


@dataclass(frozen=True, eq=False)
class CableForce(Effect):
    """τ = ±k max(±(q - q_t), 0)^p."""

    of_motion_alone = True
    id = "cable_force"
    rank = 190
    arguments = frozenset({"position"})
    equation = "tau = +-k max(+-(q - q_t), 0)^p"
    meaning = "a one-sided elastic torque sets in past an angle"
    remedy = "re-route the hose or cable, or model its pull past the angle"
    code = "{effect.side}.0 * {c[0]} * pow(fmax({effect.side}.0 * (q - {s[0]}), 0.0), {s[1]})"
    revealing_motion = "motion well past the angle on both sides"
    coefficients = (Coefficient("k", "{tau}/{q}^p", positive=True),)
    shapes = (Shape("q_t", "{q}"), Shape("p", "1", fixed=True))

    side: int = 1

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """Both sides of every joint that moves."""
        made = []
        for joint in context.joints:
            if context.moves(joint):
                low, high = float(context.lowest[joint]), float(context.highest[joint])
                for side in (1, -1):
                    onsets = np.sort((low if side > 0 else high) + side * ONSETS * (high - low))
                    bounds = np.array([onsets[0], 1.0]), np.array([onsets[-1], 2.0])
                    made.append(cls(joint, mesh(onsets, EXPONENTS), *bounds, side=side))
        return made

    def columns(self, signals: Signals, shapes: Array) -> Array:
        beyond = np.maximum(self.side * (signals.position[self.joint] - shapes[:, :1]), 0.0)
        return per_joint_columns((self.side * beyond ** shapes[:, 1:])[:, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        side = "above" if self.side > 0 else "below"
        angle = found["q_t"]
        return f"an elastic force {side} {significant(angle.value, 2)} {angle.unit} is missing"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        side = "above" if self.side > 0 else "below"
        return [{"stiffness": coefficients[0], "angle": shape[0], "exponent": shape[1], "side_of_angle": side}]
