"""Friction that grows with the torque that the transmission carries: teeth and rollers pressed together."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from tauscope.effects.effect import Effect, per_joint_columns
from tauscope.effects.parameters import Coefficient
from tauscope.effects.setting import Setting
from tauscope.effects.signals import Signals
from tauscope.recording.recording import Array


class LoadDependentFriction(Effect):
    """τ = μ |τ_rb| A(q̇), τ_rb the rigid-body torque."""

    has_step: ClassVar[bool] = True
    id: ClassVar[str] = "load_dependent_friction"
    arguments: ClassVar[frozenset[str] | None] = frozenset({"load", "velocity"})
    equation: ClassVar[str] = "tau = mu |tau_rb| sgn(qd)"
    meaning: ClassVar[str] = "friction grows with the transmitted torque"
    remedy: ClassVar[str] = "add mu times the magnitude of the rigid-body torque to the Coulomb level"
    revealing_motion: ClassVar[str] = "the same speeds under other loads: other poses, an added payload, fast motion"
    # 4: a worm gear of 20 % efficiency, 1 / (1 + mu)
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("mu", "1", positive=True, largest=4.0),)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves."""
        return [cls(joint) for joint in setting.joints if setting.moves(joint) and setting.is_loaded(joint)]

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """|τ_rb| A(q̇).

        Parameters
        ----------
        shapes : (1, 0) float64
            none
        """
        return per_joint_columns((np.abs(signals.load[self.joint]) * signals.step[self.joint])[None, None])
