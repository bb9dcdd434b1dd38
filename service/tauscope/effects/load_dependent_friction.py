"""Friction that grows with the torque that the transmission carries: teeth and rollers pressed together."""

from collections.abc import Sequence

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, per_joint_columns
from tauscope.recording.recording import Array


class LoadDependentFriction(Effect):
    """τ = μ |τ_rb| A(q̇), τ_rb the rigid-body torque."""

    has_step = True
    id = "load_dependent_friction"
    arguments = frozenset({"load", "velocity"})
    equation = "tau = mu |tau_rb| sgn(qd)"
    meaning = "friction grows with the transmitted torque"
    remedy = "add mu times the magnitude of the rigid-body torque to the Coulomb level"
    revealing_motion = "the same speeds under other loads: other poses, an added payload, fast motion"
    # 4: a worm gear of 20 % efficiency, 1 / (1 + mu)
    coefficients = (Coefficient("mu", "1", positive=True, largest=4.0),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint that moves."""
        return [cls(joint) for joint in context.joints if context.moves(joint) and context.is_loaded(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|τ_rb| A(q̇)."""
        return per_joint_columns((np.abs(signals.load[self.joint]) * signals.step[self.joint])[None, None])
