"""Mass at the tool all the time: seen only against a model that says what the arm weighs without it.

In recordings alone it is one with the last link. Against a given model the last link's surplus is what it is.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.carried_body import FARTHEST_M, MASS, PLACE, body_columns, body_quantities, unit_body
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Effect, Quantities, Sizes, size_text
from tauscope.recording.recording import Array


class Payload(Effect):
    """τ = m Φ_body(r), the torque of a point mass at r of the last link."""

    of_motion_alone = True
    id = "payload"
    rank = 240
    arguments = frozenset({"position", "velocity", "acceleration", "others"})
    equation = "tau = m Phi_body(q, qd, qdd; r)"
    meaning = "a mass is fixed to the tool that the model does not have"
    remedy = "add the body to the last link (or correct the last link's own mass: torque cannot tell)"
    no_code = "it needs the positions of all joints"
    no_scenario = "the improved robot file has it in the last link"
    revealing_motion = "the same motion with the tool taken off"
    coefficients = (MASS,)
    shapes = PLACE
    screened = False

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        return [cls(None, np.zeros((1, 3)), np.full(3, -FARTHEST_M), np.full(3, FARTHEST_M))]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque of one kilogramme at r."""
        body = body_columns(signals)
        return np.stack([np.tensordot(unit_body(place), body, axes=1)[None] for place in shapes])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        if found["m"].value < 0.0:
            return f"the model's tool is {size_text(found['m'])} too heavy"
        return f"a {size_text(found['m'])} payload is missing"

    def advice(self, found: Sizes) -> str:
        return self.remedy if found["m"].value >= 0.0 else "lower the mass of the last link"

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        return tuple(body_quantities(float(coefficients[0]), shape, covariance))
