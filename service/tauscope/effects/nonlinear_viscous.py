"""Viscous friction that grows with another power of speed than the first: grease, churning oil."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, per_joint_columns
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Powers looked at, below one and above.
POWERS = (np.array([0.35, 0.5, 0.65, 0.8]), np.array([1.25, 1.6, 2.0, 2.4, 3.0]))
# Powers that are estimated. Nearer to one the column is the nominal model's own, and a coefficient of any size only
# cancels that.
BOUNDS = ((0.3, 0.85), (1.15, 3.5))


class NonlinearViscous(Effect):
    """τ = c sgn(q̇) |q̇|ᵖ."""

    of_motion_alone = True
    id = "nonlinear_viscous"
    rank = 30
    arguments = frozenset({"velocity"})
    equation = "tau = c sgn(qd) |qd|^p"
    meaning = "friction grows with a power of speed other than one"
    remedy = "replace the viscous line by a power of speed"
    code = "{c[0]} * copysign(pow(fabs(v), {s[0]}), v)"
    revealing_motion = "motion at top speed beside slow motion: half as fast again as so far"
    coefficients = (Coefficient("c", "{tau} (s/{q})^p"),)
    shapes = (Shape("p", "1"),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """Two a joint that moves: less than in proportion to speed, and more."""
        sides = [
            (powers[:, None], np.array([low]), np.array([high]))
            for powers, (low, high) in zip(POWERS, BOUNDS, strict=True)
        ]
        return [cls(joint, *side) for joint in context.joints if context.moves(joint) for side in sides]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        velocity = signals.velocity[self.joint]
        return per_joint_columns((np.sign(velocity) * np.abs(velocity) ** shapes)[:, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """Whether friction bends up or down: a coefficient and its power less one say it together."""
        faster = found["c"].value * (found["p"].value - 1.0) >= 0.0
        return f"friction grows {'faster' if faster else 'more slowly'} than in proportion to speed"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"amplitude": coefficients[0], "exponent": shape[0]}]
