"""A body fixed to the last link, as torque: a point mass m at the place r of the last link's frame.

Its ten standard parameters are m, the first moment m r, and the inertia m (rᵀr 1 - r rᵀ) about the frame's origin.
"""

from collections.abc import Sequence

import numpy as np

from tauscope.dynamics import torque_regressor
from tauscope.effects.context import Signals
from tauscope.effects.effect import Coefficient, Quantity, Shape
from tauscope.recording.recording import Array
from tauscope.robot import LinkInertia
from tauscope.robot.robot import STANDARD_PARAMETERS

FARTHEST_M = 0.5  # distance from the last link's origin at which nobody carries anything [m]
MASS = Coefficient("m", "kg")
PLACE = (Shape("r_x", "m", reported=False), Shape("r_y", "m", reported=False), Shape("r_z", "m", reported=False))


def unit_body(place: Array) -> Array:
    """Standard parameters (10,) of one kilogramme at a place. `place`: (3,), r, in the last link's frame [m]."""
    return LinkInertia(1.0, place, place @ place * np.eye(3) - np.outer(place, place)).to_vector()


def body_columns(signals: Signals) -> Array:
    """Torque per unit of each standard parameter of the last link, (10, n, N)."""

    def made() -> Array:
        state = [np.ascontiguousarray(each.T) for each in (signals.position, signals.velocity, signals.acceleration)]
        count = len(STANDARD_PARAMETERS)
        last = np.arange(count * (signals.robot.link_count - 1), count * signals.robot.link_count)
        return np.ascontiguousarray(torque_regressor(signals.robot, *state, columns=last).transpose(2, 1, 0))

    return signals.remembered_of_motion("body at the last link", made)


def body_quantities(mass: float, place: Array, covariance: Array) -> Sequence[Quantity]:
    """Mass and first moment at `place`, (3,), by `covariance`, (4, 4), without components that no torque shows."""
    found = [Quantity("m", mass, float(np.sqrt(max(covariance[0, 0], 0.0))), "kg")]
    for axis, name in enumerate(("ms_x", "ms_y", "ms_z")):
        if covariance[1 + axis, 1 + axis] > 0.0:
            slope = np.zeros(4)
            slope[0], slope[1 + axis] = place[axis], mass
            error = float(np.sqrt(max(slope @ covariance @ slope, 0.0)))
            found.append(Quantity(name, mass * float(place[axis]), error, "kg m"))
    return found
