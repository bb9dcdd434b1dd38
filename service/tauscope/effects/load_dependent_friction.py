"""Friction that grows with the torque that the transmission carries: teeth and rollers pressed together."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, per_joint_columns, percent_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class LoadDependentFriction(Effect):
    """τ = μ |τ_rb| A(q̇), τ_rb the rigid-body torque."""

    has_step = True
    id = "load_dependent_friction"
    rank = 40
    arguments = frozenset({"load", "velocity"})
    equation = "tau = mu |tau_rb| sgn(qd)"
    meaning = "friction grows with the transmitted torque"
    remedy = "add mu times the magnitude of the rigid-body torque to the Coulomb level"
    code = "{c[0]} * fabs(load) * {step}"
    revealing_motion = "the same speeds under other loads: other poses, an added payload, fast motion"
    # 4: a worm gear of 20 % efficiency, 1 / (1 + mu)
    coefficients = (Coefficient("mu", "1", positive=True, largest=4.0),)

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        return context.moves(joint) and context.is_loaded(joint)

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns((np.abs(signals.load[self.joint]) * signals.step[self.joint])[None, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        verb = "rises" if found["mu"].value >= 0.0 else "falls"
        return f"friction {verb} by {percent_text(found['mu'].value)} of the transmitted torque"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"mu": coefficients[0]}]
