"""Where the links of compliant joints hang when the motors stand still."""

import numpy as np
from numpy.typing import NDArray

from service.errors import ScenarioError
from sim_backend.plant.equations import EquationsOfMotion

Array = NDArray[np.float64]

MOST_ITERATIONS = 200
"""The twist shrinks by the ratio of gravity's gradient to stiffness each time; a few rounds are usual."""

TOLERANCE = 1e-13
"""Change of a link's position that ends the iteration [rad or m]."""


def settled(equations: EquationsOfMotion, motor_position: Array) -> Array:
    """State of an arm at rest with q_j = θ_j - twist_j(load_j(q)), found by iteration.

    Parameters
    ----------
    equations : EquationsOfMotion
        of the arm
    motor_position : (n,) float64
        θ [rad or m]

    Returns
    -------
    (2N + m,) float64
        y: positions, zero velocities, the effects' initial states

    Raises
    ------
    ScenarioError
        where a transmission is too soft to carry its link
    """
    compliant = list(equations.coordinates.compliant)
    position = np.concatenate([motor_position, motor_position[compliant]])
    vector = np.concatenate([position, np.zeros_like(position), equations.initial_states()])
    share, change = np.ones(len(compliant)), np.zeros(len(compliant))
    for _ in range(MOST_ITERATIONS if compliant else 0):
        load = equations.load_at(0.0, vector.tolist())
        hanging = motor_position[compliant] - equations.compliance.twist_at_rest(load)
        wish = hanging - vector[compliant]
        # a link that balances inside its backlash makes the wish jump from tooth to tooth: approach by halves
        share[wish * change < 0.0] *= 0.5
        change = share * wish
        vector[compliant] += change
        if np.all(np.abs(change) < TOLERANCE):
            return vector
    if not compliant:
        return vector
    joint = compliant[int(np.argmax(np.abs(change)))] + 1
    raise ScenarioError(f"joint {joint}: its transmission is too soft to carry the arm; give it more stiffness")
