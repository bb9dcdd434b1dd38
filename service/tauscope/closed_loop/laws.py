"""Torque that an MJCF cannot hold, at one instant: Stribeck and load-dependent friction, constants, and the like.

Driving: μ_d τ². Braking, where the load drives the motor: μ_b |τ|. τ is the torque of the rigid body.
A gear loses more of a higher load where the motor drives it, and a share of any load that drives the motor; compare
form M6 of Duclusaud et al. (ICRA 2025).
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tauscope.dynamics.friction import smooth_sign
from tauscope.effects import Signals
from tauscope.export.compensation.model import JointFriction
from tauscope.export.model import ExportModel, FoundEffect
from tauscope.recording.recording import Array

# Weight of the last step's load in the load that friction follows: friction acts back on it through the acceleration,
# and a friction that takes more than half of any further load would make the two alternate from step to step.
RELAXED = 0.5


@dataclass(frozen=True, eq=False)
class LoadFriction:
    """Coefficients of all joints."""

    driving: Array  # (n,) or (n, 1, V), μ_d [1/Nm or 1/N]
    braking: Array  # (n,) or (n, 1, V), μ_b [1]

    def level(self, load: Array, direction: Array) -> Array:
        """Level of dry friction at `load` [Nm or N] for the sign `direction`; all (n,) or (n, S, V)."""
        size = np.abs(load)
        return np.where(direction * load > 0.0, self.driving * size, self.braking) * size


RESTING = 1e-4  # speed below which a joint's direction is that of the torque on it [rad/s or m/s]


class JointLaws:
    """Dry friction and further torque of all joints at one instant.

    Dry friction is set-valued: a level that holds a joint at rest. An effect is linear in the sign of the velocity; the
    part with the sign is a level, the rest is torque.
    """

    def __init__(
        self,
        model: ExportModel,
        effects: tuple[FoundEffect, ...],
        held: Array,
        has_offset: tuple[bool, ...],
        friction_by_load: LoadFriction | None = None,
    ) -> None:
        """Take a model, `effects` and offsets beside the MJCF; `held`: (n,), dry friction that its bristles hold."""
        friction: tuple[JointFriction, ...] = model.friction
        self._stiction = np.array([each.stiction for each in friction])
        self._stribeck = np.array([each.stribeck for each in friction])
        self._delta = np.array([each.delta or 0.0 for each in friction])
        self._offset = np.array([0.0 if has else each.offset for each, has in zip(friction, has_offset, strict=True)])
        self._held, self._effects, self._by_load = held, effects, friction_by_load
        names, shape = ("position", "velocity", "acceleration", "load", "torque", "step"), (model.robot.joint_count, 1)
        at_rest: dict[str, Any] = {name: np.zeros(shape) for name in names}
        bodies = np.concatenate([link.to_vector() for link in model.links])
        self._signals = Signals(
            robot=model.robot,
            rate_hz=1.0,
            time=np.zeros((1, 1)),
            recording=0,
            **at_rest,
            steepness=np.array([each.k_v for each in friction]),
            bodies=bodies,
            links=bodies,
            periodic=False,
        )

    def __call__(self, position: Array, velocity: Array, load: Array, drive: Array) -> tuple[Array, Array]:
        """Levels of dry friction, and torque against the motion beside them, (n,) each [Nm or N].

        `position`, `velocity`: (n,), q, q̇; `load`: (n,), torque of the rigid body; `drive`: (n,), torque of the drive,
        which gives a resting joint its direction [Nm or N].
        """
        level = self._stiction + self._stribeck * smooth_sign(np.abs(velocity), self._delta)
        torque = self._offset.copy()
        direction = np.where(np.abs(velocity) > RESTING, np.sign(velocity), np.sign(drive - load))
        if self._by_load is not None:
            level = level + self._by_load.level(load, direction)
        if self._effects:
            smooth = self._evaluate(position, velocity, load, np.zeros_like(direction))
            level = level + direction * (self._evaluate(position, velocity, load, direction) - smooth)
            torque += smooth
        return np.maximum(level - self._held, 0.0), torque

    def _evaluate(self, position: Array, velocity: Array, load: Array, step: Array) -> Array:
        state = {"position": position, "velocity": velocity, "load": load, "step": step}
        columns = {name: values[:, None] for name, values in state.items()}
        now = replace(self._signals, **columns, of_motion={}, _memory={})
        total = np.zeros(len(position))
        for found in self._effects:
            (columns,) = found.effect.columns(now, found.shape[None])
            total[found.effect.joint] += float(found.coefficients @ columns[:, 0, 0])
        return total
