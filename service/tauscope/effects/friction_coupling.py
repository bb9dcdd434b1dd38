"""Friction on the sum or difference of two joints' motion: a motor that turns with both, as in coupled wrists."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.dynamics import smooth_sign
from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Steepness of the coupled motor's Coulomb step, times the rms of the joint's own speed.
STEEPNESSES = np.array([30.0, 120.0, 500.0, 2000.0])


@dataclass(frozen=True, eq=False)
class FrictionCoupling(Effect):
    """Friction of v = q̇_j + s q̇_k, s = ±1: τ_j = F(v), τ_k = s F(v), F(v) = f A(K v) + w v."""

    of_motion_alone = True
    id = "friction_coupling"
    rank = 90
    arguments = frozenset({"velocity", "others"})
    equation = "tau_j = f sgn(v) + w v, tau_k = +-tau_j, v = qd_j +- qd_k"
    meaning = "two joints share friction on the sum or difference of their motion"
    remedy = "add Coulomb and viscous friction of the coupled motor's own speed"
    no_code = "it needs the velocities of two joints"
    revealing_motion = "both joints at once, in the same and in opposite directions, slowly and fast"
    coefficients = (Coefficient("f", "{tau}", positive=True), Coefficient("w", "{tau} s/{q}"))
    shapes = (Shape("K", "s/{q}", logarithmic=True),)

    partner: int = 0
    sign: int = 1

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """Neighbours, on the sum and on the difference."""
        made = []
        for joint in filter(context.moves, context.joints):
            steepness = STEEPNESSES / context.speed[joint]
            grid = steepness[:, None], 0.3 * steepness[:1], 5.0 * steepness[-1:]
            if joint > 0 and context.moves(joint - 1):
                made += [cls(joint, *grid, partner=joint - 1, sign=sign) for sign in (1, -1)]
        return made

    def touched(self, joint_count: int) -> tuple[int, ...]:
        return (self.partner, self.joint or 0)

    def place(self, joint_names: Sequence[str]) -> str:
        return f"at {joint_names[self.partner]} and {joint_names[self.joint or 0]}"

    def claim(self, found: Sizes, context: ArmContext) -> str:
        relation = "sum" if self.sign > 0 else "difference"
        return f"{size_text(found['f'])} of Coulomb friction on the {relation} of two speeds is missing"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        velocity = signals.velocity[self.joint] + self.sign * signals.velocity[self.partner]
        step = smooth_sign(velocity, shapes)
        own = np.stack([step, np.broadcast_to(velocity, step.shape)], axis=1)
        return np.stack([self.sign * own, own], axis=2)

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        f, w = coefficients
        of = "sum" if self.sign > 0 else "difference"
        return [{"other_joint": self.partner + 1, "of": of, "coulomb": f, "viscous": w, "k_v": shape[0]}]
