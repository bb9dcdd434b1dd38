"""Where the links of compliant joints hang when the motors stand still."""

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import ScenarioError
from tauscope_sim.plant.equations import EquationsOfMotion

Array = NDArray[np.float64]

MOST_ITERATIONS = 200
"""The twist shrinks by the ratio of gravity's gradient to stiffness each time; a few rounds are usual."""

TOLERANCE = 1e-13
"""Change of a link's position that ends the iteration [rad or m]."""


def settled(equations: EquationsOfMotion, motor_position: Array) -> Array:
    """State of an arm at rest with q_j = θ_j - twist_j(load_j(q)), found by iteration.

    Raises ScenarioError where a transmission is too soft to carry its link.

    Parameters
    ----------
    motor_position : (n,) float64
        θ [rad or m]

    Returns
    -------
    (2N + m,) float64
        y: positions, zero velocities, the effects' initial states
    """
    compliant = list(equations.coordinates.compliant)
    position = np.concatenate([motor_position, motor_position[compliant]])
    vector = np.concatenate([position, np.zeros_like(position), equations.initial_states()])
    low, high = np.full(len(compliant), -np.inf), np.full(len(compliant), np.inf)
    change = np.zeros(len(compliant))
    for _ in range(MOST_ITERATIONS if compliant else 0):
        load, place = equations.load_at(0.0, vector.tolist()), vector[compliant]
        hanging = motor_position[compliant] - equations.compliance.twist_at_rest(load)
        low, high = _narrowed(low, high, place, hanging)
        # a link that balances inside its backlash wishes itself from tooth to tooth: it is between the two
        between = (hanging <= low) | (hanging >= high)
        following = hanging.copy()
        following[between] = 0.5 * (low[between] + high[between])
        change = following - place
        vector[compliant] = following
        if np.all(np.abs(change) < TOLERANCE):
            return vector
    if not compliant:
        return vector
    joint = compliant[int(np.argmax(np.abs(change)))] + 1
    raise ScenarioError(f"joint {joint}: its transmission is too soft to carry the arm; give it more stiffness")


def _narrowed(low: Array, high: Array, place: Array, hanging: Array) -> tuple[Array, Array]:
    """Bounds of every link's place at rest; one that other links' moves have made wrong is given up."""
    up, down = hanging > place, hanging < place
    low, high = np.where(up, place, low), np.where(down, place, high)
    crossed = low >= high
    return np.where(crossed & down, -np.inf, low), np.where(crossed & up, np.inf, high)
