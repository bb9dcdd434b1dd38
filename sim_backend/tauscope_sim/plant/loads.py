"""Accelerations of joints whose friction depends on the torque that they transmit."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgesv

from tauscope.errors import ScenarioError

Array = NDArray[np.float64]

MOST_SIGN_CHANGES = 60
"""Sign patterns that are tried; a handful is needed, and the solution exists and is unique."""

LARGEST_GAIN = 0.95
"""Largest torque a unit of load that a transmission may lose: at 1 it is self-locking."""


def loaded_accelerations(
    mass_matrix: Array, drive: Array, link_side: Array, gain: Array, friction: Array, load: Array
) -> tuple[Array, Array, Array]:
    """Solve u = J q̈ + L (1 + g) + |L| f with L = (H - J) q̈ + h for q̈: the load's algebraic loop, in closed form.

    For given signs of L it is linear: with D = diag(g + f sgn L),

        (H + D (H - J)) q̈ = u - (1 + D) h.

    The signs are corrected until they agree with the L that they lead to. H - J is positive definite and 1 + D is
    positive, so the matrix is regular with a positive determinant for every pattern of signs: there is exactly one
    solution, without a lag of one step. Raises ScenarioError where a transmission would lose more than `LARGEST_GAIN`
    of its load.

    Parameters
    ----------
    mass_matrix : (2, n, n) float64
        H with the rotors J on its diagonal, and H - J without [kg m² or kg]
    drive : (n,) float64
        u less what does not depend on the load [Nm or N]
    link_side : (n,) float64
        h, torque on the link's side [Nm or N]
    gain : (n,) float64
        g of each joint
    friction : (n,) float64
        f of each joint, zero or of any sign; |g| + |f| below 1
    load : (n,) float64
        L, a first guess of which only the signs count [Nm or N]

    Returns
    -------
    acceleration : (n,) float64
        q̈ [rad/s² or m/s²]
    load : (n,) float64
        L [Nm or N]
    matrix : (n, n) float64
        H + D (H - J) at the solution [kg m² or kg]
    """
    worst = int(np.argmax(np.abs(gain) + np.abs(friction)))
    if not abs(gain[worst]) + abs(friction[worst]) <= LARGEST_GAIN:
        raise ScenarioError(
            f"joint {worst + 1}: friction and ripple of its load add up to {abs(gain[worst]) + abs(friction[worst]):g} "
            f"of the load; make them at most {LARGEST_GAIN:g} together, or the transmission locks itself"
        )
    with_rotors, links_only = mass_matrix
    for _ in range(MOST_SIGN_CHANGES):
        loss = gain + friction * np.sign(load)
        matrix = with_rotors + loss[:, None] * links_only
        acceleration = dgesv(matrix, drive - (1.0 + loss) * link_side)[2]
        found = links_only @ acceleration + link_side
        wrong = friction * (np.sign(found) - np.sign(load)) * found
        if not np.any(wrong):
            break
        # one sign at a time, the last joint first: this order (Murty's) never cycles
        last = int(np.flatnonzero(wrong)[-1])
        load = load.copy()
        load[last] = found[last]
    return acceleration, found, matrix
