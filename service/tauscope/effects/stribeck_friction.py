"""Extra friction near zero velocity that decays with speed, beyond what the nominal curve has."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, mesh, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot

SPEEDS = np.array([0.04, 0.08, 0.15, 0.25, 0.4, 0.65, 1.0])  # decay speeds looked at, relative to the joint's top speed
EXPONENTS = np.array([1.0, 2.0])
# Least K_v v_s: where friction has not risen to half its size before it decays, step and decay together are any small
# bump, and s is of any size.
SHORTEST_DECAY = 1.0


class StribeckFriction(Effect):
    """τ = s A(q̇) exp(-(|q̇|/v_s)^α)."""

    has_step = True
    of_motion_and_step = True
    id = "stribeck_friction"
    rank = 60
    arguments = frozenset({"velocity"})
    equation = "tau = s sgn(qd) exp(-(|qd|/v_s)^alpha)"
    meaning = "friction rises towards zero velocity more than the model's curve"
    remedy = "add a Stribeck term"
    code = "{c[0]} * {step} * exp(-pow(fabs(v) / {s[0]}, {s[1]}))"
    revealing_motion = "slow sweeps between rest and a few v_s, beside motion at top speed"
    coefficients = (Coefficient("s", "{tau}", positive=True),)
    shapes = (Shape("v_s", "{q}/s", logarithmic=True), Shape("alpha", "1", fixed=True))

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """Two a joint that moves, an exponent each: which of the two it is, only the fitted curves can say."""
        made = []
        for joint in context.joints:
            if context.moves(joint):
                speeds = SPEEDS * context.top_speed[joint]
                for exponent in EXPONENTS:
                    bounds = np.array([0.5 * speeds[0], exponent]), np.array([1.5 * speeds[-1], exponent])
                    made.append(cls(joint, mesh(speeds, np.array([exponent])), *bounds))
        return made

    def is_possible(self, shape: Array, k_v: float | None) -> bool:
        return k_v is None or k_v * float(shape[0]) >= SHORTEST_DECAY

    def columns(self, signals: Signals, shapes: Array) -> Array:
        speed = np.abs(signals.velocity[self.joint])
        decay = np.exp(-((speed / shapes[:, :1]) ** shapes[:, 1:]))
        return per_joint_columns((signals.step[self.joint] * decay)[:, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        verb = "rises" if found["s"].value >= 0.0 else "falls"
        return f"friction {verb} by {size_text(found['s'])} towards zero velocity"

    def advice(self, found: Sizes) -> str:
        return self.remedy if found["s"].value >= 0.0 else "lower friction near zero velocity by a Stribeck term"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"amplitude": coefficients[0], "velocity": shape[0], "exponent": shape[1]}]
