"""The robot file's static friction as a term of the equations of motion."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from service.robot.robot import FrictionCoefficients, FrictionShape
from sim_backend.friction import shape_constants
from sim_backend.plant.coordinates import Coordinates
from sim_backend.plant.term import Forces, Moment, Slopes, Term

Array = NDArray[np.float64]


class StaticFriction(Term):
    """Friction τ_f = τ_s (2/π) arctan(K_v v) + τ_sc (2/π) arctan(δ v) + τ_v v of every joint, v the motor's velocity.

    Parameters
    ----------
    friction : sequence of FrictionCoefficients
        τ_s, τ_sc, τ_v, one entry a joint
    friction_shape : sequence of FrictionShape
        K_v and δ, one entry a joint
    coordinates : Coordinates
        places of links and motors

    Raises
    ------
    RobotFileError
        where a shape constant that is needed is missing
    """

    def __init__(
        self,
        friction: Sequence[FrictionCoefficients],
        friction_shape: Sequence[FrictionShape],
        coordinates: Coordinates,
    ) -> None:
        constants = shape_constants(friction, friction_shape)
        self._viscous = np.array([coefficients.viscous for coefficients in friction])
        levels = [(coefficients.stiction, coefficients.stribeck) for coefficients in friction]
        self._level = np.array(levels).T / (0.5 * np.pi)
        self._steepness = np.array(constants).T
        # a slice is a view: quicker than picking columns
        self._motors = coordinates.motors if coordinates.compliant else slice(None)

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add τ_f.

        Parameters
        ----------
        moment : Moment
            where
        forces : Forces
            what is added to
        """
        velocity = moment.velocities[self._motors]
        curve = np.arctan(self._steepness * velocity)
        curve *= self._level
        forces.friction += curve[0]
        forces.friction += curve[1]
        forces.friction += self._viscous * velocity

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add dτ_f/dv.

        Parameters
        ----------
        moment : Moment
            where
        slopes : Slopes
            what is added to
        """
        scaled = self._steepness * moment.velocities[self._motors]
        slope = self._level * self._steepness / (1.0 + scaled * scaled)
        slopes.velocity_diagonal[self._motors] += slope[0] + slope[1] + self._viscous
