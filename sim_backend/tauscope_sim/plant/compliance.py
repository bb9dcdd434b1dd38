"""Transmissions that give way: their torque between motor and link, and how a resting link hangs in them."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tauscope.errors import ScenarioError
from tauscope_sim.plant.coordinates import Coordinates
from tauscope_sim.plant.term import Forces, Moment, PhysicalEffect, Slopes, Transmission

Array = NDArray[np.float64]


def compliant_transmissions(effects: Sequence[PhysicalEffect], rotor_inertia: Array) -> dict[int, Transmission]:
    """Compliant transmissions by joint, counted from 0.

    Raises ScenarioError where two effects make the same joint compliant, or both give it a rotor.

    `rotor_inertia`: (n,), that effects give to the motors of rigid joints [kg m² or kg].
    """
    found: dict[int, Transmission] = {}
    for transmission in (effect.transmission() for effect in effects):
        if transmission is None:
            continue
        joint = transmission.joint - 1
        if joint in found:
            raise ScenarioError(
                f"joint {joint + 1}: joint_elasticity or backlash stands twice; a joint has one transmission "
                "(the contact_stiffness of backlash is its elasticity)"
            )
        if rotor_inertia[joint] > 0.0:
            raise ScenarioError(
                f"joint {joint + 1}: its compliant transmission states rotor_inertia itself; "
                "remove the effect rotor_inertia"
            )
        found[joint] = transmission
    return found


class Compliance:
    """All compliant transmissions of an arm.

    `transmissions`: by joint, counted from 0.
    """

    def __init__(self, transmissions: Mapping[int, Transmission], coordinates: Coordinates) -> None:
        self._parts = [(joint, coordinates.motor(joint), transmissions[joint]) for joint in coordinates.compliant]
        self.rotor_inertia: Array = np.array([part.rotor_inertia for _, _, part in self._parts])
        """of the motors, in the order of the coordinates [kg m² or kg]"""

    def torque(self, moment: Moment) -> list[float]:
        """Torque that each compliant joint's link receives [Nm or N]."""
        return [part.torque(*_twist(moment, joint, motor)) for joint, motor, part in self._parts]

    def linearise(self, moment: Moment, forces: Forces, slopes: Slopes) -> None:
        """Add stiffness and damping between motors and links."""
        for joint, motor, part in self._parts:
            felt = 1.0 + forces.load_gain[joint] + np.sign(moment.load[joint]) * forces.load_friction[joint]
            matrices = (slopes.by_position, slopes.by_velocity)
            for slope, matrix in zip(part.torque_slopes(*_twist(moment, joint, motor)), matrices, strict=True):
                matrix[joint, joint] += slope
                matrix[joint, motor] -= slope
                matrix[motor, motor] += felt * slope
                matrix[motor, joint] -= felt * slope

    def twist_at_rest(self, load: list[float]) -> list[float]:
        """Twist of each compliant joint at rest [rad or m].

        `load`: torque that the links need, one a joint [Nm or N].
        """
        return [part.twist_at_rest(load[joint]) for joint, _, part in self._parts]


def _twist(moment: Moment, joint: int, motor: int) -> tuple[float, float]:
    """Lead of a motor over its link, and its rate."""
    return (
        moment.position[motor] - moment.position[joint],
        moment.velocity[motor] - moment.velocity[joint],
    )
