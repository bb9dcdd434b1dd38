"""Dry friction that grows with the load of the transmission, by one law where it drives and another where it brakes.

Driving: μ_d τ². Braking, where the load drives the motor: μ_b |τ|. τ is the torque of the rigid body.
A gear loses more of a higher load where the motor drives it, and a share of any load that drives the motor; compare
form M6 of Duclusaud et al. (ICRA 2025).
"""

from dataclasses import dataclass

import numpy as np

from tauscope.recording.recording import Array

# Weight of the last step's load in the load that friction follows: friction acts back on it through the acceleration,
# and a friction that takes more than half of any further load would make the two alternate from step to step.
RELAXED = 0.5


@dataclass(frozen=True, eq=False)
class LoadFriction:
    """Coefficients of all joints.

    `driving`: (n,) or (n, 1, V), μ_d [1/Nm or 1/N].
    `braking`: (n,) or (n, 1, V), μ_b [1].
    """

    driving: Array
    braking: Array

    def level(self, load: Array, direction: Array) -> Array:
        """Level of dry friction.

        `load`: (n,) or (n, S, V), torque of the rigid body [Nm or N]; `direction`: (n,) or (n, S, V), sign of the
        motion. Returns (n,) or (n, S, V) [Nm or N].
        """
        size = np.abs(load)
        return np.where(direction * load > 0.0, self.driving * size, self.braking) * size
